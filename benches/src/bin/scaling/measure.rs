//! Running the program: time and peak memory.

use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use crate::Result;

/// Runs of a command at most, and the time after which there are no more but these.
const RUNS: [usize; 2] = [2, 6];
const ENOUGH_SECONDS: f64 = 2.0;
/// A run that takes longer is not repeated.
const LONG_SECONDS: f64 = 10.0;

/// What a command costs.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cost {
    /// Without the start of the program.
    pub(crate) seconds: f64,
    pub(crate) peak_mib: f64,
}

/// The program.
pub(crate) struct Program {
    path: PathBuf,
    pub(crate) start_seconds: f64,
}

impl Program {
    pub(crate) fn new(path: PathBuf) -> Result<Self> {
        let mut program = Self { path, start_seconds: 0.0 };
        let folder = tempfile::tempdir()?;
        program.start_seconds = program.least(folder.path(), &["--version".to_string()], &[])?.seconds;
        Ok(program)
    }

    /// The least of several runs. What a run leaves, `made` in the folder, is taken away before the next.
    pub(crate) fn least(&self, folder: &Path, arguments: &[String], made: &[&str]) -> Result<Cost> {
        let (mut least, mut peak_mib, mut spent) = (f64::INFINITY, 0.0_f64, 0.0);
        for run in 0..RUNS[1] {
            if run >= RUNS[0] && spent > ENOUGH_SECONDS || spent > LONG_SECONDS {
                break;
            }
            for path in made.iter().map(|name| folder.join(name)).filter(|path| path.exists()) {
                if path.is_dir() { std::fs::remove_dir_all(path)? } else { std::fs::remove_file(path)? }
            }
            let cost = self.run(folder, arguments)?;
            (least, peak_mib, spent) =
                (least.min(cost.seconds), peak_mib.max(cost.peak_mib), spent + cost.seconds);
        }
        Ok(Cost { seconds: (least - self.start_seconds).max(0.0), peak_mib })
    }

    /// One run.
    pub(crate) fn run(&self, folder: &Path, arguments: &[String]) -> Result<Cost> {
        let errors = folder.join("errors.txt");
        let start = Instant::now();
        let mut child = Command::new(&self.path)
            .current_dir(folder)
            .args(arguments)
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(File::create(&errors)?)
            .spawn()?;
        let mut peak_kib = 0_u32;
        let (status, seconds) = loop {
            let text = std::fs::read_to_string(format!("/proc/{}/status", child.id())).unwrap_or_default();
            let line = text.lines().find_map(|l| l.strip_prefix("VmHWM:")).unwrap_or_default();
            peak_kib = peak_kib.max(line.trim().trim_end_matches(" kB").parse().unwrap_or(0));
            if let Some(status) = child.try_wait()? {
                break (status, start.elapsed().as_secs_f64());
            }
            std::thread::sleep(Duration::from_micros(300));
        };
        // 3: too many labels could not be scored, which is no matter here.
        if !matches!(status.code(), Some(0 | 3)) {
            let said = std::fs::read_to_string(&errors).unwrap_or_default();
            return Err(format!("vice {}: {status}: {}", arguments.join(" "), said.trim()).into());
        }
        Ok(Cost { seconds, peak_mib: f64::from(peak_kib) / 1024.0 })
    }
}
