//! How the cost of each command grows with what it is given: every command that has a size, at 10^3, 10^4 and 10^5; those
//! that make or read pictures at fewer.
//!
//! usage: `cargo run --release -p vice-benches --bin scaling [-- --vice PROGRAM] [--only WORD] [--write FILE]`
//!
//! The program is built here unless `--vice` names one. It runs on data that are made for it in a folder that is removed
//! afterwards. Of several runs the fastest counts, less what the program takes to start. The exponent is that of the last
//! two sizes: 1 is linear, and above 1.2 a command is at fault unless the table gives a reason. `--only` takes the commands
//! in whose line the word occurs. `--write` puts the table between the markers of docs/performance.md.
#![allow(clippy::print_stdout, clippy::print_stderr)]

mod bags;
mod cases;
mod flight;
mod measure;
mod pictures;
mod surfaces;
mod table;

use std::error::Error;
use std::path::PathBuf;
use std::process::Command;

use measure::Program;
use table::Row;

pub(crate) type Result<T> = std::result::Result<T, Box<dyn Error + Send + Sync>>;

/// What is not begun any more: longer than this for one run, seconds.
const LONGEST: f64 = 40.0;

/// What the command line asks for.
#[derive(Default)]
struct Options {
    vice: Option<PathBuf>,
    only: Option<String>,
    write: Option<PathBuf>,
}

impl Options {
    fn parse(mut arguments: impl Iterator<Item = String>) -> Result<Self> {
        let mut options = Self::default();
        while let Some(name) = arguments.next() {
            let value = arguments.next().ok_or_else(|| format!("{name} needs a value"))?;
            match name.as_str() {
                "--vice" => {
                    options.vice = Some(std::fs::canonicalize(&value).map_err(|e| format!("{value}: {e}"))?)
                }
                "--only" => options.only = Some(value),
                "--write" => options.write = Some(value.into()),
                _ => return Err(format!("unknown option {name}; known: --vice, --only, --write").into()),
            }
        }
        if options.only.is_some() && options.write.is_some() {
            return Err("--write needs the whole table, without --only".into());
        }
        Ok(options)
    }
}

fn main() -> Result<()> {
    let options = Options::parse(std::env::args().skip(1))?;
    let vice = options.vice.map_or_else(build, Ok)?;
    let program = Program::new(vice)?;
    let (mut rows, mut failed) = (Vec::new(), 0);
    for case in cases::all() {
        let line = format!("{} {}", case.command, case.grows);
        if options.only.as_ref().is_some_and(|word| !line.contains(word.as_str())) {
            continue;
        }
        eprintln!("{line}");
        let mut row =
            Row { command: case.command, grows: case.grows, reason: case.reason, measured: Vec::new() };
        for size in case.sizes {
            // So many times more cost as many times as much at least.
            let times = |n: usize| size as f64 / n as f64;
            if row.measured.last().is_some_and(|(n, m)| times(*n) * m.seconds > LONGEST) {
                break;
            }
            let folder = tempfile::tempdir()?;
            let cost = (case.prepare)(folder.path(), size, &program)
                .and_then(|arguments| program.least(folder.path(), &arguments, case.made));
            match cost {
                Ok(cost) => {
                    eprintln!("  {size}: {:.3} s, {:.0} MiB", cost.seconds, cost.peak_mib);
                    row.measured.push((size, cost));
                }
                Err(e) => {
                    eprintln!("  {size}: {e}");
                    failed += 1;
                    break;
                }
            }
        }
        rows.push(row);
    }
    let text = table::render(&rows, program.start_seconds);
    println!("{text}");
    if failed > 0 {
        return Err(format!("{failed} commands failed").into());
    }
    if let Some(path) = options.write {
        table::replace(&path, &text)?;
        eprintln!("wrote {}", path.display());
    }
    Ok(())
}

/// Builds the program.
fn build() -> Result<PathBuf> {
    let root = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("..");
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let arguments = ["build", "--release", "-p", "vice-cli", "--message-format=json-render-diagnostics"];
    let output = Command::new(cargo)
        .current_dir(root)
        .args(arguments)
        .stderr(std::process::Stdio::inherit())
        .output()?;
    if !output.status.success() {
        return Err("vice cannot be built".into());
    }
    let lines = String::from_utf8(output.stdout)?;
    let mut programs = lines.lines().filter_map(|line| {
        let message: serde_json::Value = serde_json::from_str(line).ok()?;
        Some(PathBuf::from(message["executable"].as_str()?))
    });
    programs.next_back().ok_or_else(|| "cargo names no program".into())
}
