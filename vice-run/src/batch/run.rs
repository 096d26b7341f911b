//! Running a batch: what is there is left alone, what goes wrong is a row.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::str::FromStr;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use vice_core::error::{ErrorKind, one_line};
use vice_core::evaluate::SampleSink;

use super::content::Hashes;
use super::key::Key;
use super::manifest::{Manifest, Row};
use super::paths;
use super::samples;
use super::store::{Keep, RowRecord, Store};
use crate::error::{RunError, RunResult};
use crate::evaluation::Samples;
use crate::progress::silent;
use crate::report::assessment::Assessment;
use crate::report::frames::Shots;
use crate::report::html;
use crate::request::Request;
use crate::result::ResultDocument;
use crate::scans::Scans;
use crate::text::with_options;

/// Most memory that scans take which are kept for the next run, bytes.
const SCAN_BYTES: usize = 128 << 20;

/// How long hashes are held before they are kept.
const BETWEEN_SAVES: Duration = Duration::from_secs(20);

/// How a batch is run.
#[derive(Clone, Copy, Debug)]
pub struct Options {
    /// Runs at a time. They share the threads inside of a run.
    pub jobs: usize,
    /// Which part of the manifest.
    pub shard: Shard,
    /// How often a run that failed is tried again, where what is asked makes sense.
    pub retry: usize,
    /// What is kept beside the results.
    pub keep: Keep,
}

/// Part `index` of `count`, from 1: of the rows in turn, so that each part has some of each group.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    index: usize,
    count: usize,
}

impl Default for Shard {
    fn default() -> Self {
        Self { index: 1, count: 1 }
    }
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parts = text.split_once('/').and_then(|(i, n)| Some((i.parse().ok()?, n.parse().ok()?)));
        match parts {
            Some((index, count)) if (1..=count).contains(&index) => Ok(Self { index, count }),
            _ => Err("expected I/N with I from 1 to N, such as 2/4".to_string()),
        }
    }
}

impl Shard {
    fn has(self, place: usize) -> bool {
        place % self.count == self.index - 1
    }
}

/// How it stands with a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum State {
    /// Its result was there.
    Skipped,
    /// It was evaluated.
    Done,
    /// It went wrong.
    Failed,
}

/// A run that ended.
#[derive(Clone, Copy, Debug)]
pub struct Event<'a> {
    /// Which.
    pub record: &'a RowRecord,
    /// How.
    pub state: State,
    /// How it stands with all.
    pub summary: Summary,
}

/// How it stands with all runs of a part.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Summary {
    /// Runs of this part.
    pub total: usize,
    /// Evaluated now.
    pub done: usize,
    /// Were there.
    pub skipped: usize,
    /// Went wrong.
    pub failed: usize,
}

impl Summary {
    /// Runs that ended.
    pub const fn ended(&self) -> usize {
        self.done + self.skipped + self.failed
    }

    /// Runs that are still to be looked at.
    pub const fn left(&self) -> usize {
        self.total - self.ended()
    }

    /// Runs that were tried a second.
    pub fn rate(&self, seconds: f64) -> f64 {
        (self.done + self.failed) as f64 / seconds.max(1e-9)
    }
}

/// What would be run.
#[derive(Clone, Debug)]
pub struct Planned<'a> {
    /// The run.
    pub row: &'a Row,
    /// Its key, or why it has none.
    pub key: Result<Key, String>,
    /// Whether its result is there.
    pub is_there: bool,
}

/// Looks at what a batch would do; nothing is written.
pub fn plan<'a>(manifest: &'a Manifest, store: &Store, shard: Shard, keep: Keep) -> Vec<Planned<'a>> {
    let hashes = Hashes::read(&store.hashes());
    let rows = manifest.rows.iter().enumerate().filter(|(place, _)| shard.has(*place));
    let planned = rows.map(|(_, row)| {
        let key = Key::of(&row.request, &manifest.base, &hashes).map_err(|e| told(&e, &manifest.base));
        let is_there = key.as_ref().is_ok_and(|key| store.has(key, keep));
        Planned { row, key, is_there }
    });
    planned.collect()
}

/// Runs what is not there yet. `stop` ends it when the runs in flight have ended; `tell` hears of each run.
///
/// # Errors
/// [`RunError`] if the folder cannot be written: never for a run that goes wrong.
pub fn run(
    manifest: &Manifest,
    store: &Store,
    options: &Options,
    stop: &AtomicBool,
    tell: &(dyn Fn(&Event<'_>) + Sync),
) -> RunResult<Summary> {
    refuse_in_data(manifest, store.folder())?;
    store.prepare(manifest)?;
    let hashes = Arc::new(Hashes::read(&store.hashes()));
    let of_scans = Arc::clone(&hashes);
    let shared = Shared {
        base: &manifest.base,
        store,
        scans: Arc::new(Scans::new(SCAN_BYTES, move |path| of_scans.identity(path))),
        hashes,
        retry: options.retry,
        keep: options.keep,
    };
    let saved = Mutex::new(Instant::now());
    let rows: Vec<&Row> =
        manifest.rows.iter().enumerate().filter(|(p, _)| options.shard.has(*p)).map(|(_, r)| r).collect();
    let summary = Mutex::new(Summary { total: rows.len(), ..Summary::default() });
    let (next, failure) = (AtomicUsize::new(0), Mutex::new(None));
    let work = || {
        while !stop.load(Ordering::SeqCst) {
            let Some(row) = rows.get(next.fetch_add(1, Ordering::SeqCst)) else { break };
            match one(row, &shared) {
                Ok((record, state)) => {
                    let mut summary = summary.lock().unwrap_or_else(PoisonError::into_inner);
                    match state {
                        State::Done => summary.done += 1,
                        State::Skipped => summary.skipped += 1,
                        State::Failed => summary.failed += 1,
                    }
                    tell(&Event { record: &record, state, summary: *summary });
                    drop(summary);
                    // So that who is killed need not read everything again.
                    let mut saved = saved.lock().unwrap_or_else(PoisonError::into_inner);
                    if saved.elapsed() > BETWEEN_SAVES {
                        *saved = Instant::now();
                        let _ = shared.hashes.write(&store.hashes());
                    }
                }
                Err(error) => {
                    failure.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
                    break;
                }
            }
            if failure.lock().unwrap_or_else(PoisonError::into_inner).is_some() {
                break;
            }
        }
    };
    std::thread::scope(|scope| {
        for _ in 1..options.jobs.clamp(1, rows.len().max(1)) {
            scope.spawn(work);
        }
        work();
    });
    shared.hashes.write(&store.hashes())?;
    match failure.into_inner().unwrap_or_else(PoisonError::into_inner) {
        Some(error) => Err(error),
        None => Ok(summary.into_inner().unwrap_or_else(PoisonError::into_inner)),
    }
}

/// What is written into a data set would change its content, and so the keys.
fn refuse_in_data(manifest: &Manifest, folder: &Path) -> RunResult<()> {
    let absolute = std::path::absolute(folder)?;
    let place = absolute.ancestors().find_map(|f| Some((f, f.canonicalize().ok()?)));
    let place = place.map_or_else(
        || absolute.clone(),
        |(there, real)| real.join(absolute.strip_prefix(there).unwrap_or(Path::new(""))),
    );
    for row in &manifest.rows {
        let data = manifest.base.join(&row.request.dataset.path);
        if data.canonicalize().is_ok_and(|data| place.starts_with(data)) {
            let problem = format!("{} lies in the data set {}", folder.display(), data.display());
            return Err(RunError::usage("out", problem).advise("name a folder outside of it"));
        }
    }
    Ok(())
}

/// What all runs of a batch share.
struct Shared<'a> {
    base: &'a Path,
    store: &'a Store,
    hashes: Arc<Hashes>,
    scans: Arc<Scans>,
    retry: usize,
    keep: Keep,
}

fn one(row: &Row, shared: &Shared<'_>) -> RunResult<(RowRecord, State)> {
    let Shared { base, store, hashes, retry, keep, .. } = shared;
    let begun = Instant::now();
    let record = |key, error| RowRecord::new(row, key, error, begun.elapsed().as_secs_f64());
    let failed = |key: Option<Key>, error: &RunError| {
        let exit_code = if error.kind() == ErrorKind::Usage { 2 } else { 1 };
        record(key, Some((told(error, base), exit_code)))
    };
    let key = match Key::of(&row.request, base, hashes) {
        Ok(key) => key,
        Err(error) => return written(store, failed(None, &error), State::Failed),
    };
    if store.has(&key, *keep) {
        return match store.row(&row.run_id) {
            Ok(Some(there)) if there.answers(row, &key) => Ok((there, State::Skipped)),
            _ => written(store, record(Some(key), None), State::Skipped),
        };
    }
    let mut tries = 0;
    loop {
        let found = catch_unwind(AssertUnwindSafe(|| evaluated(&row.request, &key, shared)));
        match found {
            Ok(Ok(document)) => {
                // The last of its files: where it is, the others are.
                store.write_result(&key, &document)?;
                return written(store, record(Some(key), None), State::Done);
            }
            Ok(Err(error)) if error.kind() == ErrorKind::Usage || tries >= *retry => {
                return written(store, failed(Some(key), &error), State::Failed);
            }
            Ok(Err(_)) => tries += 1,
            Err(_) => {
                let error = Some(("the program itself failed here: please report it".to_string(), 101));
                return written(store, record(Some(key), error), State::Failed);
            }
        }
    }
}

fn written(store: &Store, record: RowRecord, state: State) -> RunResult<(RowRecord, State)> {
    store.write_row(&record)?;
    Ok((record, state))
}

/// The document of a request, which says the paths as the manifest does: its bytes do not tell where it was made.
fn evaluated(request: &Request, key: &Key, shared: &Shared<'_>) -> RunResult<ResultDocument> {
    let resolved = paths::resolved(request, shared.base);
    let mut opened = resolved.open()?;
    opened.scans = Some(Arc::clone(&shared.scans));
    let samples_path = shared.store.samples_path(key);
    let mut document = match shared.keep {
        Keep { reports: true, .. } => resolved.evaluate(&opened, Samples::Keep, &silent)?,
        Keep { samples: true, .. } => samples::write(&samples_path, |sink| {
            resolved.evaluate(&opened, Samples::Stream(sink as &mut SampleSink<'_>), &silent)
        })?,
        _ => resolved.evaluate(&opened, Samples::Drop, &silent)?,
    };
    document.request = request.clone();
    if shared.keep.reports {
        if shared.keep.samples {
            samples::write_kept(&samples_path, &document)?;
        }
        let page = html::render(&[html::Run::new(document.clone(), Shots::default(), not_diagnosed())])?;
        shared.store.write_report(key, &page)?;
    }
    document.drop_samples();
    Ok(document)
}

/// A batch is about many flights: what is wrong with one of them is asked of it alone.
fn not_diagnosed() -> Assessment {
    Assessment::not_run("no diagnosis is made in a batch: `vice diagnose` makes it of one run")
}

/// An error on one line, with paths as the manifest has them.
fn told(error: &RunError, base: &Path) -> String {
    let text = with_options(&one_line(error));
    match base.to_str() {
        Some(base) if !base.is_empty() => text.replace(&format!("{base}/"), ""),
        _ => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shards_part_the_rows() {
        let shards: Vec<Shard> = (1..=4).map(|i| format!("{i}/4").parse().unwrap()).collect();
        for place in 0..20 {
            assert_eq!(shards.iter().filter(|s| s.has(place)).count(), 1);
        }
        for wrong in ["0/4", "5/4", "1", "1/0", "a/b", ""] {
            assert!(wrong.parse::<Shard>().is_err(), "{wrong}");
        }
    }
}
