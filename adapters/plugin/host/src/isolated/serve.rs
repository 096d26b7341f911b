//! The process of a plugin: loads it and answers the program's calls over a pipe, until the program is gone.

use std::fs::File;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::sync::mpsc::channel;
use std::time::Duration;

use vice_core::budget::Budget;
use vice_core::dataset::{Dataset, DatasetFactory, OpenOptions};
use vice_core::error::{DataError, DataResult};

use super::calls;
use super::codec::{Carried, Reader, Writer};
use super::values::{Frames, Samples};
use crate::{LoadOptions, Plugin};

/// Bytes of memory that a plugin may ask for, that of the program in it included.
const MEMORY_BYTES: u64 = 4 << 30;
/// How long a plugin may take to close a data set when nothing more is asked.
const CLOSING: Duration = Duration::from_secs(2);
/// Bytes of a request, which holds names and numbers.
const REQUEST_BYTES: u64 = 16 << 20;

/// Serves a plugin to the program that started this process, and ends with it.
///
/// Standard output becomes standard error, since the answers go through it: what the plugin prints is told as its log.
///
/// # Errors
/// [`DataError`] if the pipes of the process cannot be used. A plugin that does not load is an answer.
pub fn serve(file: &Path, options: &LoadOptions) -> DataResult<()> {
    let failed = |e: std::io::Error| DataError::new("the pipes of the process cannot be used").because(e);
    let (mut requests, mut answers) = pipes().map_err(failed)?;
    limit_memory();
    let (send, receive) = channel();
    // On a thread of its own: a plugin that hangs must not outlive the program.
    std::thread::spawn(move || {
        loop {
            let mut length = [0; 8];
            if requests.read_exact(&mut length).is_err() {
                // The program asks no more, or is gone: what is open is closed, unless the plugin hangs.
                drop(send);
                std::thread::sleep(CLOSING);
                std::process::exit(0);
            }
            let length = u64::from_le_bytes(length);
            let mut request = Vec::new();
            let read = (&mut requests).take(length.min(REQUEST_BYTES)).read_to_end(&mut request);
            if !read.is_ok_and(|n| n as u64 == length) || send.send(request).is_err() {
                std::process::exit(0);
            }
        }
    });
    let plugin = Plugin::load(file, options);
    let mut server = Server { plugin, open: None };
    while let Ok(request) = receive.recv() {
        let mut out = Writer::default();
        match server.answer(&request, &mut out) {
            Ok(()) => {}
            Err(error) => {
                out = Writer::default();
                out.put(&false).put(&error);
            }
        }
        let length = (out.0.len() as u64).to_le_bytes();
        answers.write_all(&length).and_then(|()| answers.write_all(&out.0)).map_err(failed)?;
    }
    Ok(())
}

/// The pipes to the program, behind the back of the plugin: it finds no input, and its output goes with its errors.
#[cfg(unix)]
fn pipes() -> std::io::Result<(File, File)> {
    use rustix::stdio::{dup2_stdin, dup2_stdout, stderr, stdin, stdout};
    let input = File::from(rustix::io::dup(stdin())?);
    let output = File::from(rustix::io::dup(stdout())?);
    dup2_stdout(stderr())?;
    dup2_stdin(File::open("/dev/null")?)?;
    Ok((input, output))
}

/// Elsewhere the pipes are standard input and output: a plugin that prints breaks its own answers.
#[cfg(not(unix))]
fn pipes() -> std::io::Result<(impl Read + Send, impl Write)> {
    Ok((std::io::stdin(), std::io::stdout()))
}

/// More memory than this is refused by the system, which ends most plugins that ask for it.
#[cfg(unix)]
fn limit_memory() {
    use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};
    let most = Budget::in_use().most(MEMORY_BYTES);
    let most = getrlimit(Resource::As).maximum.map_or(most, |hard| hard.min(most));
    // Where the system refuses there is no limit, as on systems that have none.
    let _ = setrlimit(Resource::As, Rlimit { current: Some(most), maximum: Some(most) });
}

#[cfg(not(unix))]
fn limit_memory() {}

struct Server {
    plugin: DataResult<Plugin>,
    open: Option<Box<dyn Dataset>>,
}

/// Adds an answer.
fn put<T: Carried>(out: &mut Writer, answer: &T) {
    out.put(&true).put(answer);
}

impl Server {
    fn answer(&mut self, request: &[u8], out: &mut Writer) -> DataResult<()> {
        let wrong = |fault: String| DataError::new(format!("the request is not understood: {fault}"));
        let mut from = Reader(request);
        let call: u8 = from.get().map_err(wrong)?;
        let plugin = match &self.plugin {
            Ok(plugin) => plugin,
            Err(error) => {
                out.put(&false).put(error);
                return Ok(());
            }
        };
        match call {
            calls::HELLO => {
                let more = [plugin.complete_table(), plugin.thread_safe()];
                out.put(&true).put(plugin.info()).put(&plugin.path().to_path_buf());
                out.put(&more).put(&plugin.abi_version());
                return Ok(());
            }
            calls::PROBE => {
                let path: PathBuf = from.get().map_err(wrong)?;
                put(out, &plugin.probe(&path));
                return Ok(());
            }
            calls::OPEN => {
                let path: PathBuf = from.get().map_err(wrong)?;
                let settings: Vec<[String; 2]> = from.list().map_err(wrong)?;
                let options =
                    OpenOptions { settings: settings.into_iter().map(|[key, value]| (key, value)).collect() };
                let opened = plugin.open(&path, &options)?;
                let cameras = opened.cameras();
                let has_depth: Vec<bool> = cameras.iter().map(|c| opened.has_depth(c)).collect();
                let streams = opened.streams();
                let relative: Vec<bool> = streams.iter().map(|s| opened.is_relative(s)).collect();
                out.put(&true).put(&opened.name().to_string()).list(&cameras).list(&has_depth);
                out.list(&streams).list(&relative);
                self.open = Some(opened);
                return Ok(());
            }
            _ => {}
        }
        let dataset = self.open.as_deref().ok_or_else(|| wrong("no data set is open".to_string()))?;
        of_dataset(dataset, call, &mut from, out, &wrong)
    }
}

fn of_dataset(
    dataset: &dyn Dataset,
    call: u8,
    from: &mut Reader<'_>,
    out: &mut Writer,
    wrong: &dyn Fn(String) -> DataError,
) -> DataResult<()> {
    // Which arguments a call has is known by its number alone.
    let name = |from: &mut Reader<'_>| from.get::<String>().map_err(wrong);
    let index = |from: &mut Reader<'_>| from.get::<u64>().map(|i| i as usize).map_err(wrong);
    let stamp = |from: &mut Reader<'_>| from.get().map_err(wrong);
    match call {
        calls::CAMERA => put(out, &dataset.camera(&name(from)?)?),
        calls::FRAMES => put(out, &Frames(dataset.frames(&name(from)?)?.to_vec())),
        calls::IMAGE => put(out, &dataset.image(&name(from)?, index(from)?)?),
        calls::IMAGE_FILE => {
            let file = dataset.image_file(&name(from)?, index(from)?)?;
            out.put(&true).put(&file.is_some()).bytes(&file.unwrap_or_default());
        }
        calls::BODY_FROM_CAMERA => put(out, &dataset.body_from_camera(&name(from)?, stamp(from)?)?),
        calls::TRAJECTORY => put(out, &dataset.trajectory(&name(from)?)?),
        calls::IMU => put(out, &Samples(dataset.imu()?.to_vec())),
        calls::INERTIAL_STATE => put(out, &dataset.inertial_state(stamp(from)?)?),
        calls::DEPTH_IMAGE => put(out, &dataset.depth_image(&name(from)?, index(from)?)?),
        calls::CLOUD => put(out, &dataset.cloud()?),
        calls::FLOOR => put(out, &dataset.floor(stamp(from)?)?),
        calls::SUSPICIONS => drop(out.put(&true).list(&dataset.suspicions())),
        calls::CHECKS => drop(out.put(&true).list(&dataset.checks())),
        calls::FACTS => drop(out.put(&true).list(&dataset.facts())),
        other => return Err(wrong(format!("there is no call {other}"))),
    }
    Ok(())
}
