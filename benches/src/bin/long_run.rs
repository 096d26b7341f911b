//! Writes a long flight without images and evaluates it with the program `vice`: time and peak memory of each command.
//!
//! usage: `long_run PROGRAM FOLDER [MINUTES] [POINTS]` (30 minutes, 400 points; 20 frames and 200 poses a second)
//!
//! The camera looks down at the floor and wanders over it; each point is carried until it leaves the image and is then
//! placed anew, as an annotator does. The flight is written once: a folder that is there is used again. Beside it lie
//! two trajectories of a million poses.
#![allow(clippy::print_stdout)]

use std::error::Error;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use vice_benches::flight::Flight;

fn main() -> Result<(), Box<dyn Error + Send + Sync>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [program, folder, rest @ ..] = &arguments[..] else {
        return Err("usage: long_run PROGRAM FOLDER [MINUTES] [POINTS]".into());
    };
    let number = |i: usize, default| rest.get(i).map_or(Ok(default), |n: &String| n.parse::<usize>());
    let (minutes, points) = (number(0, 30)?, number(1, 400)?);
    let folder = Path::new(folder);
    if !folder.exists() {
        std::fs::create_dir_all(folder)?;
        Flight { frames: minutes * 60 * 20, poses_a_frame: 10, points }.write(folder)?;
        vice_benches::write_tum(&folder.join("reference.tum"), 1_000_000, 0.0)?;
        vice_benches::write_tum(&folder.join("estimate.tum"), 1_000_000, 0.02)?;
    }
    let evaluate = ["evaluate", "flight", "--labels", "labels.csv", "--estimate", "estimate.txt"];
    let commands: [&[&str]; 6] = [
        &[],
        &["--json", "none.json", "--samples", "none"],
        &["--json", "jsonl.json", "--samples", "jsonl"],
        &["--json", "all.json"],
        &["--fps", "10", "--duration", "30"],
        &["--subsets", "1,2,3,4"],
    ];
    for options in commands {
        run(program, folder, &[&evaluate[..], options].concat())?;
    }
    run(program, folder, &["trajectory", "reference.tum", "estimate.tum", "--align", "se3"])
}

/// Time and peak memory of a command.
fn run(program: &str, folder: &Path, arguments: &[&str]) -> Result<(), Box<dyn Error + Send + Sync>> {
    let start = Instant::now();
    let program = std::fs::canonicalize(program)?;
    let mut child =
        Command::new(program).current_dir(folder).args(arguments).stdout(Stdio::null()).spawn()?;
    let mut peak_kib = 0;
    let status = loop {
        let text = std::fs::read_to_string(format!("/proc/{}/status", child.id())).unwrap_or_default();
        let line = text.lines().find_map(|l| l.strip_prefix("VmHWM:")).unwrap_or_default();
        let kib: u64 = line.trim().trim_end_matches(" kB").parse().unwrap_or(0);
        peak_kib = peak_kib.max(kib);
        if let Some(status) = child.try_wait()? {
            break status;
        }
        std::thread::sleep(Duration::from_millis(2));
    };
    let seconds = start.elapsed().as_secs_f64();
    println!("{seconds:7.2} s {:6} MiB  vice {}  ({status})", peak_kib / 1024, arguments.join(" "));
    Ok(())
}
