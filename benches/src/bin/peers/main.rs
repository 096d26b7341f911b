//! Our benchmarks beside what a user would pick instead, in turn, and the ratios of their times.
//!
//! usage: `cargo run --release -p vice-benches --bin peers [-- --rounds N] [--points N] [--write FILE]`
//!
//! - C++: `peers/opencv.cpp`, compiled here with `c++` (or `CXX`) against Debian's `libopencv-dev`.
//! - Plain loops: `peers/strong.cpp`, the fastest way known for the same formulas, compiled with all that this machine has.
//! - Python: `peers/peers.py` with `VICE_PEERS_PYTHON` (by default `python3`), which needs `opencv-python-headless`,
//!   `numpy`, `scipy`, `plyfile` and `evo`.
//! - Ours: the program `vice`, built here, so that a user without a Rust tool chain can repeat it with `vice bench`.
//!
//! A peer that is missing is named, and its rows are left out. One round runs everything once; a ratio is taken within
//! its round, and the table shows the median and the range over the rounds. `--write` puts the table between the
//! markers of docs/performance.md.
#![allow(clippy::print_stdout, clippy::print_stderr)]

mod files;
mod programs;
mod sizes;
mod table;

use std::error::Error;
use std::path::PathBuf;

use programs::{Ours, Peers};
use table::Rounds;

/// What the command line asks for.
struct Options {
    rounds: usize,
    points: usize,
    write: Option<PathBuf>,
}

impl Options {
    fn parse(mut arguments: impl Iterator<Item = String>) -> Result<Self, Box<dyn Error + Send + Sync>> {
        let mut options = Self { rounds: 5, points: 1_000_000, write: None };
        while let Some(name) = arguments.next() {
            let value = arguments.next().ok_or_else(|| format!("{name} needs a value"))?;
            match name.as_str() {
                "--rounds" => options.rounds = value.parse()?,
                "--points" => options.points = value.parse()?,
                "--write" => options.write = Some(value.into()),
                _ => return Err(format!("unknown option {name}; known: --rounds, --points, --write").into()),
            }
        }
        if options.rounds == 0 || options.points == 0 {
            return Err("--rounds and --points must be above zero".into());
        }
        Ok(options)
    }
}

fn main() -> Result<(), Box<dyn Error + Send + Sync>> {
    let options = Options::parse(std::env::args().skip(1))?;
    let folder = tempfile::tempdir()?;
    let files = files::Files::write(folder.path())?;
    let ours = Ours::build()?;
    let peers = Peers::find(folder.path());
    for missing in &peers.missing {
        eprintln!("missing: {missing}");
    }
    let mut rounds = Rounds::default();
    for round in 0..options.rounds {
        eprintln!("round {} of {}", round + 1, options.rounds);
        rounds.start();
        peers.cpp(options.points, &files, &mut rounds)?;
        peers.strong(options.points, &mut rounds)?;
        ours.kernels(options.points, &mut rounds)?;
        ours.depth(&files, &mut rounds)?;
        ours.tracker(&files, &mut rounds)?;
        peers.python(options.points, &files, &mut rounds)?;
        ours.trajectory(&files, &mut rounds)?;
        peers.evo(&files, &mut rounds)?;
    }
    let text = rounds.render(options.points, &peers.missing);
    println!("{text}");
    if let Some(path) = options.write {
        table::replace(&path, &text)?;
        eprintln!("wrote {}", path.display());
    }
    Ok(())
}
