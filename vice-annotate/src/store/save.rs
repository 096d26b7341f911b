//! Writing the labels file: beside and renamed, in the background and at the end.

use std::path::PathBuf;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use vice_core::error::{DataError, DataResult};
use vice_files::atomic::{self, Overwrite};
use vice_files::image_file::read_bytes;
use vice_files::labels::write_json;

use super::Store;
use super::claim::{self, Claim};
use super::journal::{FileMark, Line, sync_folder_of};

/// A labels file that is about to be written.
#[derive(Debug)]
pub struct SaveWork {
    path: PathBuf,
    bytes: Vec<u8>,
    mark: FileMark,
    revision: u64,
    /// What the file must be now: otherwise another program has changed it.
    expected: Option<FileMark>,
}

impl SaveWork {
    /// Writes the file beside and renames it. The labels are not locked meanwhile.
    ///
    /// # Errors
    /// [`DataError`] if another program has changed the file, or it cannot be written; it is as before then.
    pub fn run(&self) -> DataResult<()> {
        let now = if self.path.exists() { Some(FileMark::of(&read_bytes(&self.path)?)) } else { None };
        if now.is_some() && now != self.expected {
            return Err(DataError::new("was changed by another program meanwhile, and is not written over")
                .at(&self.path)
                .hint("all changes are in the journal beside it: move the file away and start again to have them"));
        }
        atomic::write(&self.path, Overwrite::Replace, |w| w.write_all(&self.bytes))?;
        sync_folder_of(&self.path)
    }
}

impl Store {
    /// What has to be written for the labels file to hold all changes; `None` where it does.
    ///
    /// # Errors
    /// [`DataError`] if the journal cannot be written.
    pub fn begin_save(&mut self) -> DataResult<Option<SaveWork>> {
        if self.saved == Some(self.revision) {
            return Ok(None);
        }
        let Some(journal) = &mut self.journal else { return Ok(None) };
        let mut bytes = Vec::new();
        let labels = self.document.labels()?;
        write_json(&mut bytes, &labels)
            .map_err(|e| DataError::new("the labels cannot be written").at(&self.path).because(e))?;
        let mark = FileMark::of(&bytes);
        journal.append(&Line::Saving { file: mark })?;
        Ok(Some(SaveWork {
            path: self.path.clone(),
            bytes,
            mark,
            revision: self.revision,
            expected: self.file,
        }))
    }

    /// Notes how a save ended.
    pub fn end_save(&mut self, work: &SaveWork, result: DataResult<()>) {
        let noted = result.and_then(|()| {
            self.file = Some(work.mark);
            // The file is another one now. Only names that were ours lead to it, and their journal is locked.
            self.claim = match claim::take(&self.path)? {
                Claim::Ours(file) => file,
                Claim::Taken => None,
            };
            self.saved = Some(work.revision);
            self.journal.as_mut().map_or(Ok(()), |journal| journal.append(&Line::Saved))
        });
        self.note_save(noted);
    }

    fn note_save(&mut self, result: DataResult<()>) {
        let problem = result.err().map(|e| e.to_string());
        if let Some(problem) = problem.as_deref().filter(|p| self.save_problem.as_deref() != Some(p)) {
            tracing::warn!("the labels file is behind the journal: {problem}");
        }
        self.save_problem = problem;
    }
}

/// How long after a save that failed it is tried again.
const RETRY: Duration = Duration::from_secs(5);

/// Who is told why the labels file is behind the journal (`None`: it no longer is), whenever that changes.
type OnProblem = Box<dyn Fn(Option<&str>) + Send>;

/// Saves in the background some time after a change.
#[derive(Debug)]
pub struct Saver {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

#[derive(Debug)]
struct Shared {
    store: Arc<Mutex<Store>>,
    wanted: Mutex<Wanted>,
    wake: Condvar,
}

#[derive(Debug, Default)]
struct Wanted {
    since: Option<Instant>,
    stop: bool,
}

impl Saver {
    /// Starts saving a store `delay` after each first change, and tells `on_problem` when the labels file falls behind the
    /// journal, and when it has caught up.
    ///
    /// # Errors
    /// [`DataError`] if no thread can be started.
    pub fn start(store: Arc<Mutex<Store>>, delay: Duration, on_problem: OnProblem) -> DataResult<Self> {
        let shared = Arc::new(Shared { store, wanted: Mutex::default(), wake: Condvar::new() });
        let of_thread = Arc::clone(&shared);
        // What was restored from the journal is worth saving, too.
        shared.want();
        let thread = std::thread::Builder::new()
            .name("save labels".to_string())
            .spawn(move || of_thread.run(delay, &on_problem))
            .map_err(|e| DataError::new("cannot start a thread").because(e))?;
        Ok(Self { shared, thread: Some(thread) })
    }

    /// Says that there was a change.
    pub fn changed(&self) {
        self.shared.want();
    }

    /// Saves what is left and closes the journal.
    ///
    /// # Errors
    /// [`DataError`] if the labels file cannot be written. The changes are in the journal.
    pub fn finish(mut self) -> DataResult<()> {
        lock(&self.shared.wanted).stop = true;
        self.shared.wake.notify_all();
        if let Some(thread) = self.thread.take() {
            // A thread that panicked saves nothing; the save below does.
            let _ = thread.join();
        }
        save_now(&self.shared.store)
    }
}

/// Saves what is left, and lets go of the journal.
pub(crate) fn save_now(store: &Mutex<Store>) -> DataResult<()> {
    save(store);
    let mut store = lock(store);
    store.journal = None;
    store.claim = None;
    match store.save_problem() {
        Some(problem) => Err(DataError::new(format!("the labels file is behind the journal: {problem}"))),
        None => Ok(()),
    }
}

fn save(store: &Mutex<Store>) {
    let begun = lock(store).begin_save();
    match begun {
        Ok(None) => {}
        Ok(Some(work)) => {
            let result = work.run();
            lock(store).end_save(&work, result);
        }
        Err(error) => lock(store).note_save(Err(error)),
    }
}

impl Shared {
    fn want(&self) {
        lock(&self.wanted).since.get_or_insert_with(Instant::now);
        self.wake.notify_all();
    }

    fn run(&self, delay: Duration, on_problem: &OnProblem) {
        let mut told: Option<String> = None;
        loop {
            let delay = if told.is_some() { RETRY } else { delay };
            let mut wanted = lock(&self.wanted);
            loop {
                if wanted.stop {
                    return;
                }
                wanted = match wanted.since.map(|since| delay.saturating_sub(since.elapsed())) {
                    Some(Duration::ZERO) => break,
                    Some(left) => {
                        self.wake.wait_timeout(wanted, left).unwrap_or_else(PoisonError::into_inner).0
                    }
                    None => self.wake.wait(wanted).unwrap_or_else(PoisonError::into_inner),
                };
            }
            wanted.since = None;
            drop(wanted);
            save(&self.store);
            let problem = lock(&self.store).save_problem().map(str::to_string);
            if problem.is_some() {
                // Room may be made on the disk without any further change here.
                self.want();
            }
            if problem != told {
                on_problem(problem.as_deref());
                told = problem;
            }
        }
    }
}

/// A lock whose holder panicked still guards whole data here: every change is all or nothing.
pub(crate) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
