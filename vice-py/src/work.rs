//! Long calls: other threads of Python go on meanwhile, progress is shown, Ctrl-C ends them, and a panic is an error.
//!
//! The work runs on a thread of its own, and the caller's thread waits for it without the interpreter's lock, looking for
//! signals in between. So a signal is heard however long a step of the work takes.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use pyo3::prelude::*;
use vice_run::Progress;
use vice_run::error::RunResult;

use crate::errors::{Answer, Failure, OfPython};
use crate::warnings;

/// How often signals are looked for and progress is shown.
const LOOK: Duration = Duration::from_millis(50);
/// How long the work may take to notice that it is no longer wanted, before the caller goes on without it.
const GRACE: Duration = Duration::from_millis(250);
/// The main thread of a program has as much.
const STACK_BYTES: usize = 16 << 20;

/// What the work and who waits for it know of each other.
#[derive(Default)]
pub(crate) struct Told {
    stop: AtomicBool,
    latest: Mutex<Option<(String, usize, usize)>>,
}

/// Ends work that is no longer wanted, from within its report of progress.
struct NotWanted;

impl Told {
    /// Set where the work is no longer wanted.
    pub(crate) const fn stop(&self) -> &AtomicBool {
        &self.stop
    }

    /// Says how far the work is.
    pub(crate) fn tell(&self, what: &str, done: usize, total: usize) {
        *self.latest.lock().unwrap_or_else(PoisonError::into_inner) = Some((what.to_string(), done, total));
    }
}

/// Does long work that reports progress. `progress` is called with what is being done and (done, total) of it.
pub(crate) fn long<T: Send + 'static>(
    py: Python<'_>,
    progress: Option<&Py<PyAny>>,
    work: impl FnOnce(&Progress<'_>) -> RunResult<T> + Send + 'static,
) -> Answer<T> {
    stoppable(py, progress, move |told| {
        work(&|what, done, total| {
            told.tell(what, done, total);
            if told.stop.load(Ordering::Relaxed) {
                // Not a panic: no hook runs, and nobody hears of it but `wait`.
                resume_unwind(Box::new(NotWanted));
            }
        })
    })
}

/// Does long work that looks for itself whether it is still wanted.
pub(crate) fn stoppable<T: Send + 'static>(
    py: Python<'_>,
    progress: Option<&Py<PyAny>>,
    work: impl FnOnce(&Told) -> RunResult<T> + Send + 'static,
) -> Answer<T> {
    warnings::listen();
    let told = Arc::new(Told::default());
    let (send, receive) = channel();
    let its = Arc::clone(&told);
    let spawned =
        std::thread::Builder::new().name("vicepose".to_string()).stack_size(STACK_BYTES).spawn(move || {
            let outcome = catch_unwind(AssertUnwindSafe(|| work(&its)));
            // Who waited may be gone.
            let _ = send.send(outcome);
        });
    spawned?;
    wait(py, receive, &told, progress)
}

type Outcome<T> = Result<RunResult<T>, Box<dyn Any + Send>>;

fn wait<T: Send>(
    py: Python<'_>,
    receive: Receiver<Outcome<T>>,
    told: &Told,
    progress: Option<&Py<PyAny>>,
) -> Answer<T> {
    let mut shown = None;
    // A receiver is for one thread at a time, which a lock promises.
    let receive = Mutex::new(receive);
    let next = |limit: Duration| {
        py.detach(|| receive.lock().unwrap_or_else(PoisonError::into_inner).recv_timeout(limit))
    };
    loop {
        let outcome = next(LOOK);
        let latest = told.latest.lock().unwrap_or_else(PoisonError::into_inner).clone();
        let show = || match (progress, &latest) {
            (Some(progress), Some((what, done, total))) if shown != latest => {
                progress.call1(py, (what, done, total)).map(drop)
            }
            _ => Ok(()),
        };
        match outcome {
            Ok(outcome) => {
                show().python()?;
                return outcome_of(outcome);
            }
            Err(RecvTimeoutError::Disconnected) => {
                return Err(Failure::Panicked("the work ended without an answer".to_string()));
            }
            Err(RecvTimeoutError::Timeout) => {
                if let Err(error) = py.check_signals().and_then(|()| show()) {
                    told.stop.store(true, Ordering::SeqCst);
                    let until = Instant::now() + GRACE;
                    while Instant::now() < until && matches!(next(LOOK), Err(RecvTimeoutError::Timeout)) {}
                    return Err(Failure::Python(error));
                }
            }
        }
        shown = latest;
    }
}

fn outcome_of<T>(outcome: Outcome<T>) -> Answer<T> {
    match outcome {
        Ok(answer) => Ok(answer?),
        Err(payload) => Err(Failure::Panicked(text_of(payload.as_ref()))),
    }
}

/// Short work on the caller's thread, where a panic would be one as well.
pub(crate) fn guarded<T>(work: impl FnOnce() -> Answer<T>) -> Answer<T> {
    catch_unwind(AssertUnwindSafe(work))
        .unwrap_or_else(|payload| Err(Failure::Panicked(text_of(payload.as_ref()))))
}

/// Short work that reads data, without the interpreter's lock: other threads may need it to go on.
pub(crate) fn short<T: Send>(py: Python<'_>, work: impl FnOnce() -> RunResult<T> + Send) -> Answer<T> {
    warnings::listen();
    py.detach(|| guarded(|| Ok(work()?)))
}

/// The last panic's text and place, kept in place of being printed.
static LAST: Mutex<Option<String>> = Mutex::new(None);

/// Keeps panics from standard error: they become exceptions.
pub(crate) fn keep_panics() {
    std::panic::set_hook(Box::new(|info| {
        *LAST.lock().unwrap_or_else(PoisonError::into_inner) = Some(info.to_string().replace('\n', " "));
    }));
}

fn text_of(payload: &(dyn Any + Send)) -> String {
    if payload.is::<NotWanted>() {
        return "the work was stopped".to_string();
    }
    let kept = LAST.lock().unwrap_or_else(PoisonError::into_inner).take();
    kept.unwrap_or_else(|| {
        let text = payload.downcast_ref::<&str>().map(|s| (*s).to_string());
        text.or_else(|| payload.downcast_ref::<String>().cloned())
            .unwrap_or_else(|| "it panicked".to_string())
    })
}
