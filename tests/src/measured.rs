//! What a run of a program costs: time, processor and memory, of that process alone.

use std::io::Read;
use std::process::{Child, Command, Stdio};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use crate::Run;

/// Longest that a run may take before it is ended, seconds.
const PATIENCE_S: f64 = 120.0;

/// A run, and what it cost.
#[derive(Debug)]
pub struct Measured {
    /// What it said.
    pub run: Run,
    /// Seconds from its start to its end.
    pub wall_s: f64,
    /// Seconds of processor.
    pub cpu_s: f64,
    /// Most memory that it had at once, in 10^6 bytes; NaN where the system does not tell.
    pub peak_mb: f64,
}

impl Measured {
    /// Seconds that count: those of the processor where other work of the machine kept the process waiting.
    pub fn seconds(&self) -> f64 {
        if self.cpu_s.is_nan() { self.wall_s } else { self.wall_s.min(self.cpu_s) }
    }
}

/// Runs a program to its end.
///
/// Its memory is asked for every half millisecond, so that a peak within the last of these can be missed.
pub fn measured(command: &mut Command) -> Measured {
    let begun = Instant::now();
    let mut child = command
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program can be started");
    let (stdout, stderr) = (reader(child.stdout.take()), reader(child.stderr.take()));
    let (mut peak_mb, mut cpu_s) = (f64::NAN, f64::NAN);
    while !has_ended(&mut child) {
        peak_mb = peak_mb.max(peak_of(child.id()));
        cpu_s = cpu_of(child.id()).max(cpu_s);
        if begun.elapsed().as_secs_f64() > PATIENCE_S {
            child.kill().expect("it can be ended");
        }
        std::thread::sleep(Duration::from_micros(500));
    }
    let wall_s = begun.elapsed().as_secs_f64();
    // An ended process that nobody asked about yet still tells its processor time.
    cpu_s = cpu_of(child.id()).max(cpu_s);
    let status = child.wait().expect("it ended");
    let text = |reader: JoinHandle<Vec<u8>>| {
        String::from_utf8_lossy(&reader.join().expect("it was read")).into_owned()
    };
    let run = Run { code: status.code().unwrap_or(-1), stdout: text(stdout), stderr: text(stderr) };
    Measured { run, wall_s, cpu_s, peak_mb }
}

fn reader(pipe: Option<impl Read + Send + 'static>) -> JoinHandle<Vec<u8>> {
    std::thread::spawn(move || {
        let mut bytes = Vec::new();
        if let Some(mut pipe) = pipe {
            pipe.read_to_end(&mut bytes).expect("a pipe can be read");
        }
        bytes
    })
}

/// Whether a child ended; on Linux without taking note of it, so that what it used can still be asked for.
fn has_ended(child: &mut Child) -> bool {
    match status_words(child.id()) {
        Some(words) => words.first().is_none_or(|state| state == "Z" || state == "X"),
        None => child.try_wait().expect("it is our child").is_some(),
    }
}

/// The words of `/proc/PID/stat` behind the name.
fn status_words(pid: u32) -> Option<Vec<String>> {
    let text = std::fs::read_to_string(format!("/proc/{pid}/stat")).ok()?;
    Some(text.rsplit_once(") ")?.1.split(' ').map(str::to_string).collect())
}

fn cpu_of(pid: u32) -> f64 {
    /// Ticks in a second; all systems of Linux that this is tested on have as many.
    const TICKS: f64 = 100.0;
    // In the user's code and in the kernel's: the 14th and 15th word.
    let ticks =
        |words: &[String]| Some(words.get(11)?.parse::<f64>().ok()? + words.get(12)?.parse::<f64>().ok()?);
    status_words(pid).and_then(|words| ticks(&words)).map_or(f64::NAN, |ticks| ticks / TICKS)
}

fn peak_of(pid: u32) -> f64 {
    let text = std::fs::read_to_string(format!("/proc/{pid}/status")).unwrap_or_default();
    let line = text.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    let kib = line.and_then(|line| line.trim().trim_end_matches(" kB").parse::<f64>().ok());
    kib.map_or(f64::NAN, |kib| kib * 1024.0 / 1e6)
}
