//! The process of a plugin, seen from the program: what it is asked, how long it may take, and how it ended.

use std::ffi::OsString;
use std::io::{BufRead, BufReader, Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, ExitStatus, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::sync::{Mutex, OnceLock, PoisonError};
use std::time::{Duration, Instant};

use vice_core::budget::Budget;
use vice_core::error::{DataError, DataResult};

use super::codec::{Carried, Reader, Writer};
use crate::LoadOptions;

/// Seconds that a call may take.
const CALL_SECONDS: u64 = 30;
/// How long it may take to close a data set when nothing more is asked.
const CLOSING: Duration = Duration::from_secs(1);
/// Bytes of one answer; the largest are images and clouds.
const ANSWER_BYTES: u64 = 2 << 30;
/// Lines, and bytes of each, that a plugin may say to the user.
const LOG_LINES: usize = 200;
const LOG_LINE_BYTES: u64 = 4096;

/// How the program is started as the process of a plugin: its words before the file.
static PROGRAM: OnceLock<Vec<OsString>> = OnceLock::new();

/// Names the command that serves a plugin: a program and its words, to which the file of the plugin is added. It calls
/// [`serve`](super::serve). Said once; without it plugins run in the process of the program.
pub fn program_is(words: Vec<OsString>) {
    // The first to say it is the program itself.
    let _ = PROGRAM.set(words);
}

/// Whether there is a program that serves plugins.
pub fn can_isolate() -> bool {
    PROGRAM.get().is_some()
}

/// A process that holds one plugin.
pub(super) struct Process {
    file: PathBuf,
    inner: Mutex<Inner>,
}

struct Inner {
    child: Child,
    /// `None` once it was told to end.
    requests: Option<ChildStdin>,
    answers: Receiver<Vec<u8>>,
    /// Ends when all that it said was passed on.
    log: Receiver<()>,
    /// How it ended.
    ended: Option<String>,
}

impl Process {
    pub(super) fn start(file: &Path, options: &LoadOptions) -> DataResult<Self> {
        let failed = |e: std::io::Error| {
            DataError::new("the process of the plugin cannot be started").at(file).because(e)
        };
        let words = PROGRAM.get().filter(|words| !words.is_empty());
        let words = words.ok_or_else(|| {
            DataError::new("this program cannot run a plugin in a process of its own").at(file)
        })?;
        let mut command = Command::new(&words[0]);
        command.args(&words[1..]).arg(file);
        if options.allow_writable {
            command.arg("--allow-writable-plugin");
        }
        let mut child = command
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .map_err(failed)?;
        let nothing = || DataError::new("the process of the plugin has no pipes").at(file);
        let requests = child.stdin.take().ok_or_else(nothing)?;
        let answers = answers_of(child.stdout.take().ok_or_else(nothing)?);
        let log = tell_log(child.stderr.take().ok_or_else(nothing)?, file.to_path_buf());
        let inner = Mutex::new(Inner { child, requests: Some(requests), answers, log, ended: None });
        Ok(Self { file: file.to_path_buf(), inner })
    }

    /// One call. Calls come one after another, whatever the plugin says of threads.
    pub(super) fn ask<T: Carried>(&self, what: &str, request: &Writer) -> DataResult<T> {
        let mut inner = self.inner.lock().unwrap_or_else(PoisonError::into_inner);
        let ended = |how: &str| DataError::new(format!("{what}: {how}")).at(&self.file);
        if let Some(how) = &inner.ended {
            return Err(ended(how));
        }
        let answer = match inner.call(&request.0) {
            Ok(answer) => answer,
            Err(how) => {
                let error = ended(&how);
                inner.ended = Some(format!("{how} before that"));
                return Err(error);
            }
        };
        drop(inner);
        let mut reader = Reader(&answer);
        let read = |reader: &mut Reader<'_>| match reader.get()? {
            true => reader.get().map(Ok),
            false => reader.get().map(Err),
        };
        let answer = read(&mut reader).and_then(|answer| reader.end().map(|()| answer));
        match answer {
            Ok(answer) => answer,
            Err(fault) => Err(ended(&fault)),
        }
    }
}

impl Inner {
    fn call(&mut self, request: &[u8]) -> Result<Vec<u8>, String> {
        let length = (request.len() as u64).to_le_bytes();
        // A process that is gone cannot be written to; how it went is asked below.
        let sent = self.requests.as_mut().is_some_and(|pipe| {
            pipe.write_all(&length).and_then(|()| pipe.write_all(request)).and_then(|()| pipe.flush()).is_ok()
        });
        let seconds = Budget::in_use().most(CALL_SECONDS).max(1);
        let patience = Duration::from_secs(if sent { seconds } else { 1 });
        match self.answers.recv_timeout(patience) {
            Ok(answer) => Ok(answer),
            Err(RecvTimeoutError::Timeout) => {
                // It may have ended just now.
                let _ = self.child.kill();
                let _ = self.child.wait();
                Err(format!("the plugin does not answer: it was ended after {seconds} s"))
            }
            Err(RecvTimeoutError::Disconnected) => {
                // Whatever it does without an answer to give, it is of no more use.
                std::thread::sleep(Duration::from_millis(20));
                let ended_itself = matches!(self.child.try_wait(), Ok(Some(_)));
                let _ = self.child.kill();
                Err(match self.child.wait() {
                    Ok(status) if ended_itself => format!("the plugin {}", death(status)),
                    _ => "the plugin's process answers no more: it was ended".to_string(),
                })
            }
        }
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        let inner = self.inner.get_mut().unwrap_or_else(PoisonError::into_inner);
        // It closes what it holds, and may have something to say of that; not for long.
        drop(inner.requests.take());
        let until = Instant::now() + CLOSING;
        while inner.ended.is_none() && matches!(inner.child.try_wait(), Ok(None)) && Instant::now() < until {
            std::thread::sleep(Duration::from_millis(1));
        }
        let _ = inner.child.kill();
        let _ = inner.child.wait();
        // What it said last; not for long, since what it started may hold the pipe open.
        let _ = inner.log.recv_timeout(Duration::from_millis(500));
    }
}

/// The answers as they come, read by a thread so that silence can be noticed. What is none ends them.
fn answers_of(mut pipe: impl Read + Send + 'static) -> Receiver<Vec<u8>> {
    let (send, receive) = channel();
    std::thread::spawn(move || {
        loop {
            let mut length = [0; 8];
            if pipe.read_exact(&mut length).is_err() {
                return;
            }
            let length = u64::from_le_bytes(length);
            if length > Budget::in_use().most(ANSWER_BYTES) {
                return;
            }
            let mut answer = Vec::new();
            // Memory is taken for what comes, not for what is announced.
            let read = pipe.by_ref().take(length).read_to_end(&mut answer);
            let whole = read.is_ok_and(|n| n as u64 == length);
            if !whole || send.send(answer).is_err() {
                return;
            }
        }
    });
    receive
}

/// Passes on what the process says, up to a limit; the rest is read and dropped, so that it does not wait for a reader.
fn tell_log(pipe: impl Read + Send + 'static, file: PathBuf) -> Receiver<()> {
    let (done, all_told) = channel();
    std::thread::spawn(move || {
        // Dropped at the end of the thread, which is how the end is told.
        let _done: std::sync::mpsc::Sender<()> = done;
        let mut pipe = BufReader::new(pipe);
        let mut lines = 0;
        loop {
            let mut line = Vec::new();
            match pipe.by_ref().take(LOG_LINE_BYTES).read_until(b'\n', &mut line) {
                Ok(n) if n > 0 => {}
                _ => return,
            }
            lines += 1;
            let text = String::from_utf8_lossy(&line);
            let text = text.trim_end();
            let most = usize::try_from(Budget::in_use().most(LOG_LINES as u64)).unwrap_or(usize::MAX);
            if text.is_empty() || lines > most {
                continue;
            }
            if lines == most {
                let shown = file.display();
                tracing::warn!("plugin {shown} says more than {most} lines: the rest is left out");
                continue;
            }
            match text.split_once(": ") {
                Some(("warning", said)) => tracing::warn!("{said}"),
                Some(("error", said)) => tracing::error!("{said}"),
                Some(("info", said)) => tracing::info!("{said}"),
                _ => tracing::warn!("plugin {}: {text}", file.display()),
            }
        }
    });
    all_told
}

/// How a process died, in words that follow a name: `crashes (abort, signal 6)`.
pub fn death(status: ExitStatus) -> String {
    #[cfg(unix)]
    if let Some(signal) = std::os::unix::process::ExitStatusExt::signal(&status) {
        let meaning = match signal {
            4 => "illegal instruction",
            6 => "abort: an uncaught exception, a failed assertion or a panic",
            7 => "bus error",
            8 => "arithmetic error",
            9 => "killed",
            11 => "segmentation fault: memory that is not there",
            _ => "a signal",
        };
        return format!("crashes ({meaning}, signal {signal})");
    }
    match status.code() {
        Some(code) => format!("ends the program with exit code {code}"),
        None => "ends the program".to_string(),
    }
}
