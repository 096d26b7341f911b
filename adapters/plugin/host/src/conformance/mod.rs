//! What an adapter is expected to do, as a suite: the tests run it on every built-in format, `vice plugin check` on a plugin.
//!
//! A step is announced before it begins, so that whoever runs the suite in a process of its own can say where it died. Findings
//! are words for the adapter's author: what is wrong, and what a user would see of it.

mod cameras;
mod files;
mod format;
mod motion;
mod raw;
mod robust;
mod scene;
mod words;

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use vice_core::dataset::{Dataset, DatasetFactory, OpenOptions};
use vice_core::error::{DataError, one_line};
use vice_core::time::Stamp;

use crate::ask::MISTAKE;
use crate::library::Plugin;

/// How a finding counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// As it should be.
    Good,
    /// Not there, which is allowed; the text says what will not work without it.
    Missing,
    /// Allowed, but suspicious.
    Suspicious,
    /// Wrong: the contract is broken.
    Fault,
}

/// What the suite says while it runs.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Event {
    /// This is tried next.
    Step(String),
    /// This was found.
    Finding(Verdict, String),
}

/// How thorough the suite is.
#[derive(Clone, Debug)]
pub struct Thoroughness {
    /// Times the data set is opened and closed.
    pub cycles: u32,
    /// When opening and closing is stopped all the same.
    pub cycles_within: Duration,
    /// Images that are decoded of each camera, spread over all of them.
    pub images: usize,
    /// Threads that read at the same time.
    pub threads: usize,
}

impl Default for Thoroughness {
    fn default() -> Self {
        Self { cycles: 1000, cycles_within: Duration::from_secs(60), images: 200, threads: 4 }
    }
}

/// What is checked.
pub struct Subject<'a> {
    /// The format.
    pub factory: &'a dyn DatasetFactory,
    /// The library it came in, whose calls are then also made directly.
    pub plugin: Option<&'a Plugin>,
    /// A data set of the format, or a folder of several.
    pub path: &'a Path,
    /// Settings to open it with.
    pub options: &'a OpenOptions,
}

/// Runs the suite; true if nothing was a fault.
pub fn check(subject: &Subject<'_>, thorough: &Thoroughness, tell: &mut dyn FnMut(Event)) -> bool {
    let mut check = Check { subject, thorough, tell, faults: 0, path: subject.path.to_path_buf() };
    check.format();
    check.wrong_folders();
    if check.claims_the_path()
        && let Some(dataset) = check.opens()
    {
        let lists = check.lists(dataset.as_ref());
        for camera in &lists.cameras {
            check.camera(dataset.as_ref(), camera);
            check.stored_images(dataset.as_ref(), camera);
        }
        check.streams(dataset.as_ref(), &lists);
        check.inertial(dataset.as_ref(), &lists);
        check.depth(dataset.as_ref(), &lists);
        check.scene(dataset.as_ref(), &lists);
        check.words(dataset.as_ref());
        check.unknown_names(dataset.as_ref(), &lists);
        check.odd_stamps(dataset.as_ref(), &lists);
        check.several_at_once(dataset.as_ref(), &lists);
        check.read_from_threads(dataset.as_ref(), &lists);
        drop(dataset);
        if let Some(plugin) = subject.plugin {
            check.raw_calls(plugin, &lists);
        }
        check.again_and_again(&lists);
    }
    check.faults == 0
}

/// What the data set says it has.
struct Lists {
    cameras: Vec<CameraLists>,
    streams: Vec<String>,
}

struct CameraLists {
    name: String,
    frames: Arc<[Stamp]>,
}

impl Lists {
    /// First and last frame of the first camera that has any.
    fn extent(&self) -> Option<(Stamp, Stamp)> {
        let frames = self.cameras.iter().map(|c| &c.frames).find(|f| !f.is_empty())?;
        Some((*frames.first()?, *frames.last()?))
    }
}

struct Check<'a> {
    subject: &'a Subject<'a>,
    thorough: &'a Thoroughness,
    tell: &'a mut dyn FnMut(Event),
    faults: usize,
    /// The data set: of a collection its first.
    path: PathBuf,
}

impl Check<'_> {
    fn step(&mut self, what: impl Into<String>) {
        (self.tell)(Event::Step(what.into()));
    }

    fn find(&mut self, verdict: Verdict, text: impl Into<String>) {
        self.faults += usize::from(verdict == Verdict::Fault);
        (self.tell)(Event::Finding(verdict, text.into()));
    }

    fn good(&mut self, text: impl Into<String>) {
        self.find(Verdict::Good, text);
    }

    fn missing(&mut self, text: impl Into<String>) {
        self.find(Verdict::Missing, text);
    }

    fn suspicious(&mut self, text: impl Into<String>) {
        self.find(Verdict::Suspicious, text);
    }

    /// An error where data may be missing, unless the adapter itself is at fault.
    fn error(&mut self, place: &str, error: &DataError) {
        let line = one_line(error);
        let verdict = if line.contains(MISTAKE) { Verdict::Fault } else { Verdict::Suspicious };
        self.find(verdict, format!("{place}: {line}"));
    }

    fn fault(&mut self, text: impl Into<String>) {
        self.find(Verdict::Fault, text);
    }

    /// Opens the data set once more.
    fn open_again(&mut self) -> Option<Box<dyn Dataset>> {
        match self.subject.factory.open(&self.path, self.subject.options) {
            Ok(dataset) => Some(dataset),
            Err(error) => {
                self.fault(format!("it opened before, but not again: {}", one_line(&error)));
                None
            }
        }
    }
}

/// At most `limit` places of `count`, evenly spread, the first and the last among them.
fn spread(count: usize, limit: usize) -> Vec<usize> {
    if count <= limit {
        return (0..count).collect();
    }
    match limit {
        0 => Vec::new(),
        1 => vec![0],
        _ => (0..limit).map(|i| i * (count - 1) / (limit - 1)).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_spread_evenly() {
        assert_eq!(spread(3, 5), [0, 1, 2]);
        assert_eq!(spread(10, 4), [0, 3, 6, 9]);
        assert_eq!(spread(10, 1), [0]);
        assert!(spread(10, 0).is_empty());
    }
}
