//! FFmpeg as a program: found when pixels are asked for, started without a shell, its words passed on.

use std::ffi::{OsStr, OsString};
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, ChildStdout, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use std::thread::JoinHandle;

use vice_core::error::{DataError, DataResult};

/// libavcodec of FFmpeg 4.0, which decodes what the data sets hold and knows every option that is used here.
const OLDEST_LIBAVCODEC: (u32, u32) = (58, 18);
/// libavcodec of FFmpeg 5.1, where `-vsync` became `-fps_mode`.
const FPS_MODE_LIBAVCODEC: (u32, u32) = (59, 37);
/// How to get it, for every error about a missing one.
pub(crate) const INSTALL: &str = "install FFmpeg 4.0 or later (`apt install ffmpeg`, `brew install ffmpeg`, `winget install \
                       ffmpeg`, https://ffmpeg.org/download.html) so that `ffmpeg` is on the PATH";
/// Lines of FFmpeg that an error quotes.
const QUOTED_LINES: usize = 4;

/// The FFmpeg program. Making one of these looks for nothing yet: only decoding needs it.
#[derive(Clone, Debug)]
pub struct Ffmpeg {
    program: OsString,
    libavcodec: Arc<OnceLock<(u32, u32)>>,
}

impl Default for Ffmpeg {
    /// `ffmpeg` on the PATH.
    fn default() -> Self {
        Self::new("ffmpeg")
    }
}

impl Ffmpeg {
    /// A program by its path, or by a name that is looked for on the PATH.
    pub fn new(program: impl Into<OsString>) -> Self {
        Self { program: program.into(), libavcodec: Arc::default() }
    }

    /// Whether the program is there and new enough.
    ///
    /// # Errors
    /// [`DataError`] that says what is missing and how to install it.
    pub fn check(&self) -> DataResult<()> {
        self.version().map(|_| ())
    }

    /// Version of libavcodec, asked once.
    fn version(&self) -> DataResult<(u32, u32)> {
        if let Some(version) = self.libavcodec.get() {
            return Ok(*version);
        }
        let name = self.program.to_string_lossy();
        let output = self.command().arg("-version").output().map_err(|e| {
            let what = match e.kind() {
                std::io::ErrorKind::NotFound => format!("FFmpeg (`{name}`) is not installed"),
                _ => format!("FFmpeg (`{name}`) cannot be started"),
            };
            DataError::new(format!("{what}, which films need")).hint(INSTALL).because(e)
        })?;
        let text = String::from_utf8_lossy(&output.stdout);
        let version = libavcodec_version(&text).ok_or_else(|| {
            DataError::new(format!("`{name}` does not say which FFmpeg it is")).hint(INSTALL)
        })?;
        if version < OLDEST_LIBAVCODEC {
            let first = text.lines().next().unwrap_or_default();
            return Err(DataError::new(format!("FFmpeg is too old: {first}")).hint(INSTALL));
        }
        Ok(*self.libavcodec.get_or_init(|| version))
    }

    pub(crate) fn command(&self) -> Command {
        let mut command = Command::new(&self.program);
        // Settings of the user's shell that would colour its words or write a report file.
        command.env("AV_LOG_FORCE_NOCOLOR", "1").env_remove("AV_LOG_FORCE_COLOR").env_remove("FFREPORT");
        command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
        command
    }

    /// Options that keep a decoder from changing the number of frames.
    fn every_frame_once(&self) -> DataResult<[&'static str; 2]> {
        let modern = self.version()? >= FPS_MODE_LIBAVCODEC;
        Ok(if modern { ["-fps_mode", "passthrough"] } else { ["-vsync", "0"] })
    }

    /// Starts FFmpeg on a QuickTime or MP4 film.
    ///
    /// The film is named as `file:` and its absolute path, which no option and no other protocol begins with, the
    /// demuxer is forced, and what the film itself may refer to is limited to files and pipes.
    pub(crate) fn start(&self, film: &Path, input: &[OsString], output: &[OsString]) -> DataResult<Running> {
        let passthrough = self.every_frame_once()?;
        let absolute =
            std::path::absolute(film).map_err(|e| DataError::new("cannot be read").at(film).because(e))?;
        let mut name = OsString::from("file:");
        name.push(&absolute);
        let mut command = self.command();
        command
            .args(["-hide_banner", "-nostdin", "-nostats", "-loglevel", "level+info"])
            .args(["-protocol_whitelist", "file,pipe", "-f", "mov", "-ignore_editlist", "1"])
            .args(input)
            .args([OsStr::new("-i"), &name])
            .args(["-map", "0:v:0", "-an", "-sn", "-dn"])
            .args(passthrough)
            .args(output)
            .arg("pipe:1");
        let mut child = command
            .spawn()
            .map_err(|e| DataError::new("FFmpeg cannot be started").hint(INSTALL).because(e))?;
        let (Some(stdout), Some(stderr)) = (child.stdout.take(), child.stderr.take()) else {
            return Err(DataError::new("FFmpeg was started without pipes"));
        };
        let (times, shown) = channel();
        let words = Arc::new(Mutex::new(Words::default()));
        let heard = Arc::clone(&words);
        let listen = move || {
            let mut stderr = BufReader::new(stderr);
            let mut line = Vec::new();
            while stderr.read_until(b'\n', &mut line).is_ok_and(|n| n > 0) {
                let text = String::from_utf8_lossy(&line);
                if let Some(ticks) = shown_time(&text) {
                    // Nobody listens any more once the decoder is given up.
                    let _ = times.send(ticks);
                } else {
                    heard.lock().unwrap_or_else(PoisonError::into_inner).hear(&text);
                }
                line.clear();
            }
        };
        let stdout = Some(BufReader::new(stdout));
        let mut running = Running { child, stdout, shown, words, listener: None };
        let listener = std::thread::Builder::new().spawn(listen);
        running.listener =
            Some(listener.map_err(|e| DataError::new("no thread to listen to FFmpeg").because(e))?);
        Ok(running)
    }
}

/// A running FFmpeg; killed and waited for when dropped.
#[derive(Debug)]
pub(crate) struct Running {
    child: Child,
    stdout: Option<BufReader<ChildStdout>>,
    /// When each frame that comes out of the pipe is shown, in ticks; FFmpeg says so before it writes the frame.
    pub(crate) shown: Receiver<i64>,
    words: Arc<Mutex<Words>>,
    listener: Option<JoinHandle<()>>,
}

impl Running {
    /// The frames.
    pub(crate) fn stdout(&mut self) -> Option<&mut BufReader<ChildStdout>> {
        self.stdout.as_mut()
    }

    /// Its process id.
    #[cfg(test)]
    pub(crate) fn id(&self) -> u32 {
        self.child.id()
    }

    /// What FFmpeg said that was not passed on yet: warnings and errors, in order.
    pub(crate) fn take_words(&self) -> Vec<String> {
        std::mem::take(&mut self.words.lock().unwrap_or_else(PoisonError::into_inner).fresh)
    }

    /// After the frames have ended: waits for FFmpeg and quotes its last errors.
    pub(crate) fn last_words(&mut self) -> String {
        // Closing the pipe first: an FFmpeg that still writes would wait for us while we wait for it.
        drop(self.stdout.take());
        let _ = self.child.wait();
        if let Some(listener) = self.listener.take() {
            let _ = listener.join();
        }
        let words = self.words.lock().unwrap_or_else(PoisonError::into_inner);
        let from = words.errors.len().saturating_sub(QUOTED_LINES);
        words.errors[from..].join("; ")
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        drop(self.stdout.take());
        let _ = self.child.kill();
        let _ = self.child.wait();
        if let Some(listener) = self.listener.take() {
            let _ = listener.join();
        }
    }
}

/// Warnings and errors of one run, bounded: a broken film can complain about every block.
#[derive(Debug, Default)]
struct Words {
    fresh: Vec<String>,
    errors: Vec<String>,
}

impl Words {
    const KEPT: usize = 64;

    fn hear(&mut self, line: &str) {
        let Some((error, text)) = complaint(line) else { return };
        if error {
            if self.errors.len() == Self::KEPT {
                self.errors.remove(0);
            }
            self.errors.push(text.clone());
        }
        if self.fresh.len() < Self::KEPT {
            self.fresh.push(text);
        }
    }
}

/// Whether a line of FFmpeg is an error (else a warning), and its text without address and level.
fn complaint(line: &str) -> Option<(bool, String)> {
    let levels = [("[warning] ", false), ("[error] ", true), ("[fatal] ", true), ("[panic] ", true)];
    levels.into_iter().find_map(|(level, error)| {
        let at = line.find(level)?;
        let who = line[..at].trim_start_matches('[').split(" @ ").next().unwrap_or_default();
        let what = line[at + level.len()..].trim();
        let text = if who.is_empty() { what.to_string() } else { format!("{who}: {what}") };
        Some((error, text))
    })
}

/// The time in a line of the `metadata` filter: `[Parsed_metadata_3 @ 0x5] [info] frame:3    pts:3072    pts_time:0.3`.
///
/// Only lines that begin with the filter's name: a film's title may say anything, but not at the beginning of a line.
fn shown_time(line: &str) -> Option<i64> {
    let (head, time) = line.strip_prefix("[Parsed_metadata_")?.split_once(" pts:")?;
    if !head.contains("] frame:") {
        return None;
    }
    time.split_whitespace().next()?.parse().ok()
}

/// `libavcodec     59. 37.100 / 59. 37.100` in the text of `ffmpeg -version`.
fn libavcodec_version(text: &str) -> Option<(u32, u32)> {
    let line = text.lines().find_map(|l| l.trim().strip_prefix("libavcodec"))?;
    // Built with / running: what runs counts.
    let running = line.rsplit('/').next()?;
    let mut parts = running.split('.').map(|p| p.trim().parse::<u32>().ok());
    Some((parts.next()??, parts.next()??))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_words_of_ffmpeg_are_understood() {
        let version = "ffmpeg version 5.1.9-0+deb12u1 Copyright (c)\nlibavutil      57. 28.100 / 57. 28.100\n\
                       libavcodec     59. 37.100 / 59. 37.100\n";
        assert_eq!(libavcodec_version(version), Some((59, 37)));
        assert_eq!(libavcodec_version("nothing"), None);
        let line = "[Parsed_metadata_2 @ 0x55d] [info] frame:12   pts:20480   pts_time:2.000001\n";
        assert_eq!(shown_time(line), Some(20480));
        assert_eq!(shown_time("[info]   Duration: 00:00:02.00"), None);
        assert_eq!(
            shown_time("[info]     title           : [Parsed_metadata_2 @ 0x5] [info] frame:0 pts:9"),
            None
        );
        assert_eq!(
            complaint("[mov,mp4 @ 0x5] [error] moov atom not found\n"),
            Some((true, "mov,mp4: moov atom not found".to_string()))
        );
        assert_eq!(complaint("[warning] odd\n"), Some((false, "odd".to_string())));
        assert_eq!(complaint("[info] fine\n"), None);
    }

    #[test]
    fn a_missing_ffmpeg_says_how_to_get_it() {
        let error = Ffmpeg::new("/no/such/ffmpeg").check().unwrap_err().to_string();
        assert!(error.contains("is not installed") && error.contains("apt install ffmpeg"), "{error}");
    }

    #[cfg(unix)]
    #[test]
    fn an_old_or_foreign_program_is_refused() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        let program = |name: &str, says: &str| {
            let path = folder.path().join(name);
            std::fs::write(&path, format!("#!/bin/sh\necho '{says}'\n")).unwrap();
            std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o755)).unwrap();
            path
        };
        let old = program("old", "ffmpeg version 2.8.15\nlibavcodec     56. 60.100 / 56. 60.100");
        let error = Ffmpeg::new(old).check().unwrap_err().to_string();
        assert!(error.contains("too old: ffmpeg version 2.8.15") && error.contains("install"), "{error}");
        let foreign = program("foreign", "hello");
        assert!(Ffmpeg::new(foreign).check().unwrap_err().to_string().contains("does not say"));
    }
}
