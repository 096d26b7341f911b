//! What happens after errors, with several data sets at once, from threads, and a thousand times.

use std::collections::hash_map::DefaultHasher;
use std::hash::{Hash, Hasher};
use std::time::{Duration, Instant};

use vice_core::dataset::Dataset;
use vice_core::error::DataResult;
use vice_core::time::Stamp;

use super::{Check, Lists, spread};

/// Growth of memory that may be the allocator's, bytes.
const NOISE_BYTES: u64 = 8 << 20;

/// With fewer cycles nothing can be said about growth.
const CYCLES_THAT_TELL: u64 = 100;

impl Check<'_> {
    /// Names that are not there are errors, and change nothing.
    pub(super) fn unknown_names(&mut self, dataset: &dyn Dataset, lists: &Lists) {
        self.step("names that are not there");
        let (no_such, stamp) = ("no such name", Stamp::default());
        let answers = [
            ("calibration", dataset.camera(no_such).is_ok()),
            ("frames", dataset.frames(no_such).is_ok()),
            ("image", dataset.image(no_such, 0).is_ok()),
            ("body_from_camera", dataset.body_from_camera(no_such, stamp).is_ok()),
            ("trajectory", dataset.trajectory(no_such).is_ok()),
            ("a stored image", matches!(dataset.image_file(no_such, 0), Ok(Some(_)))),
            ("a depth image", matches!(dataset.depth_image(no_such, 0), Ok(Some(_)))),
            ("has_depth", dataset.has_depth(no_such)),
            ("is_relative", dataset.is_relative(no_such)),
        ];
        let answered: Vec<&str> = answers.iter().filter(|(_, is_ok)| *is_ok).map(|(what, _)| *what).collect();
        if !answered.is_empty() {
            self.fault(format!("it gives {} for a name that it does not have", answered.join(", ")));
        }
        self.step("reading again after errors");
        for camera in &lists.cameras {
            match dataset.frames(&camera.name) {
                Ok(frames) if frames == camera.frames => {}
                _ => self.fault(format!("camera {}: its frames are others after an error", camera.name)),
            }
        }
        self.good("names that are not there are errors, and it works on after them");
    }

    /// The ends of time must not upset it, whatever the answer.
    pub(super) fn odd_stamps(&mut self, dataset: &dyn Dataset, lists: &Lists) {
        for stamp in [Stamp::MIN, Stamp::default(), Stamp::MAX] {
            self.step(format!("floor, inertial state and camera at {stamp} ns"));
            // An error is a good answer here.
            let _ = dataset.floor(stamp);
            let _ = dataset.inertial_state(stamp);
            for camera in &lists.cameras {
                let _ = dataset.body_from_camera(&camera.name, stamp);
            }
        }
        self.good("stamps far outside the recording are no problem");
    }

    /// A second data set is opened while one is open, and works on when it is closed.
    pub(super) fn several_at_once(&mut self, first: &dyn Dataset, lists: &Lists) {
        self.step("two data sets at once");
        let want = fingerprint(first, lists, 0);
        let Some(second) = self.open_again() else { return };
        if fingerprint(second.as_ref(), lists, 0) != want {
            self.fault("a second data set opened beside the first gives other data");
        }
        drop(second);
        self.step("the first data set after a second one was closed");
        match fingerprint(first, lists, 0) == want {
            true => self.good("two data sets can be open at once"),
            false => self.fault("a data set gives other data after another one was closed"),
        }
    }

    pub(super) fn read_from_threads(&mut self, dataset: &dyn Dataset, lists: &Lists) {
        let threads = self.thorough.threads.max(2);
        self.step(format!("reading from {threads} threads"));
        let want = fingerprint(dataset, lists, 0);
        let got: Vec<Option<u64>> = std::thread::scope(|scope| {
            let read = |turn: usize| scope.spawn(move || fingerprint(dataset, lists, turn));
            let running: Vec<_> = (0..threads).map(read).collect();
            running.into_iter().map(|thread| thread.join().ok()).collect()
        });
        if got.iter().any(Option::is_none) {
            self.fault("it panics when several threads read at once");
        } else if got.iter().any(|g| *g != Some(want)) {
            self.fault("several threads that read at once get other data than one alone");
        } else {
            self.good(format!("{threads} threads get the same data as one"));
        }
    }

    /// Opens and closes, and looks whether memory or files are left over.
    pub(super) fn again_and_again(&mut self, lists: &Lists) {
        let cycles = self.thorough.cycles;
        self.step(format!("opening and closing {cycles} times"));
        let camera = lists.cameras.first().map(|c| c.name.clone());
        let start = Instant::now();
        let (mut done, mut told) = (0, start);
        let mut levels: Vec<Level> = Vec::new();
        while done < cycles && start.elapsed() < self.thorough.cycles_within {
            let Some(dataset) = self.open_again() else { return };
            if let Some(camera) = &camera {
                // Something is read each time, so that what is made on demand is also given back.
                let _ = dataset.camera(camera);
            }
            drop(dataset);
            done += 1;
            levels.push(Level::now());
            if told.elapsed() > Duration::from_secs(1) {
                told = Instant::now();
                self.step(format!("opening and closing, {done} of {cycles} times"));
            }
        }
        let slow = if done < cycles { " (it takes long, so fewer times)" } else { "" };
        match left_over(&levels) {
            Some(what) => self.fault(what),
            None => self.good(format!("opened and closed {done} times, nothing is left over{slow}")),
        }
    }
}

/// What this process holds after a cycle, where the system tells.
#[derive(Clone, Copy)]
struct Level {
    bytes: u64,
    files: u64,
}

impl Level {
    fn now() -> Self {
        let statm = std::fs::read_to_string("/proc/self/statm").unwrap_or_default();
        let pages: u64 = statm.split_whitespace().nth(1).and_then(|p| p.parse().ok()).unwrap_or(0);
        let files = std::fs::read_dir("/proc/self/fd").map_or(0, |entries| entries.count() as u64);
        Self { bytes: pages * 4096, files }
    }
}

/// What grows as long as it is opened and closed. Caches fill in the first cycles, and an allocator keeps some memory: what
/// counts is that the second half grows as the first did.
fn left_over(levels: &[Level]) -> Option<String> {
    let cycles = levels.len() as u64;
    if cycles < CYCLES_THAT_TELL {
        return None;
    }
    let at = |tenth: usize| levels[(levels.len() - 1) * tenth / 10];
    let (early, middle, late) = (at(2), at(6), at(10));
    let grows =
        |a: u64, b: u64, c: u64, least: u64| b.saturating_sub(a) >= least && c.saturating_sub(b) >= least;
    let between = (cycles * 8 / 10).max(1);
    if grows(early.files, middle.files, late.files, cycles / 10) {
        return Some(format!("{} files are left open after {between} times", late.files - early.files));
    }
    if grows(early.bytes, middle.bytes, late.bytes, NOISE_BYTES) {
        let each = (late.bytes - early.bytes) / between;
        return Some(format!("memory grows by {each} bytes each time it is opened and closed"));
    }
    None
}

/// One number for what is read: lists, a few images, trajectories. `turn` changes the order in which it is read.
fn fingerprint(dataset: &dyn Dataset, lists: &Lists, turn: usize) -> u64 {
    let cameras = lists.cameras.len();
    let jobs = 2 * cameras + lists.streams.len();
    let mut parts = vec![0; jobs];
    for job in (0..jobs).map(|j| (j + turn) % jobs) {
        let mut hasher = DefaultHasher::new();
        if job < cameras {
            let name = &lists.cameras[job].name;
            add(&mut hasher, dataset.frames(name), |h, frames| frames.hash(h));
        } else if job < 2 * cameras {
            let camera = &lists.cameras[job - cameras];
            for place in spread(camera.frames.len(), 3) {
                add(&mut hasher, dataset.image(&camera.name, place), |h, image| image.data().hash(h));
                add(&mut hasher, dataset.image_file(&camera.name, place), |h, file| file.hash(h));
                add(&mut hasher, dataset.body_from_camera(&camera.name, camera.frames[place]), |h, pose| {
                    pose.to_row_major().map(f64::to_bits).hash(h);
                });
            }
        } else {
            add(&mut hasher, dataset.trajectory(&lists.streams[job - 2 * cameras]), |h, trajectory| {
                for (stamp, pose) in trajectory.iter() {
                    (stamp, pose.to_row_major().map(f64::to_bits)).hash(h);
                }
            });
        }
        parts[job] = hasher.finish();
    }
    let mut hasher = DefaultHasher::new();
    parts.hash(&mut hasher);
    hasher.finish()
}

fn add<T>(hasher: &mut DefaultHasher, read: DataResult<T>, hash: impl FnOnce(&mut DefaultHasher, T)) {
    match read {
        Ok(value) => hash(hasher, value),
        Err(error) => error.to_string().hash(hasher),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn levels(bytes: impl Fn(u64) -> u64, files: impl Fn(u64) -> u64) -> Vec<Level> {
        (0..1000).map(|i| Level { bytes: bytes(i), files: files(i) }).collect()
    }

    #[test]
    fn what_grows_steadily_is_left_over() {
        assert_eq!(left_over(&levels(|_| 50 << 20, |_| 9)), None);
        // A cache that fills once, and an allocator that keeps a peak.
        assert_eq!(left_over(&levels(|i| (i.min(300)) << 20, |_| 9)), None);
        assert!(left_over(&levels(|i| i * 100_000, |_| 9)).unwrap().contains("memory grows by"));
        assert!(left_over(&levels(|_| 0, |i| 9 + i)).unwrap().contains("files are left open"));
        assert_eq!(left_over(&levels(|i| i << 20, |i| i)[..50]), None);
    }
}
