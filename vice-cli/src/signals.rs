//! Being asked to stop: at once without leaving anything half written, or, for a batch, once to end cleanly and twice to
//! end at once.

use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};

use vice_run::files::leftovers;

use crate::terminal::Verbosity;

/// The exit code after it, as of a program that Ctrl-C ended.
pub(crate) const INTERRUPTED: u8 = 130;

/// The flag that the first signal sets, for commands that end by themselves then.
static GENTLE: OnceLock<(&'static AtomicBool, Verbosity)> = OnceLock::new();

/// Listens to Ctrl-C, SIGTERM and SIGHUP from here on: temporary files go, then the program ends.
///
/// Where the system gives no thread for it a signal ends the program as ever, and what is half written is left.
pub(crate) fn listen() {
    let Ok(runtime) = tokio::runtime::Builder::new_current_thread().enable_io().build() else { return };
    let listening = std::thread::Builder::new().name("signals".to_string()).spawn(move || {
        runtime.block_on(async {
            let Ok(mut asked) = Asked::new() else { return };
            let mut code = asked.wait().await;
            if let Some((stop, verbosity)) = GENTLE.get() {
                stop.store(true, Ordering::SeqCst);
                verbosity.note("stopping when the runs in flight have ended; once more stops at once");
                code = asked.wait().await;
            }
            leftovers::remove_all();
            std::process::exit(code);
        });
    });
    drop(listening);
}

/// Has the first signal set a flag; only the second ends the program.
pub(crate) fn stop_at_first(stop: &'static AtomicBool, verbosity: Verbosity) {
    // A command asks for it once.
    let _ = GENTLE.set((stop, verbosity));
}

#[cfg(unix)]
struct Asked([tokio::signal::unix::Signal; 3]);

#[cfg(unix)]
impl Asked {
    fn new() -> std::io::Result<Self> {
        use tokio::signal::unix::{SignalKind, signal};
        Ok(Self([
            signal(SignalKind::interrupt())?,
            signal(SignalKind::terminate())?,
            signal(SignalKind::hangup())?,
        ]))
    }

    /// The exit code that a shell gives a program which the signal ended.
    async fn wait(&mut self) -> i32 {
        let [interrupt, terminate, hangup] = &mut self.0;
        tokio::select! {
            _ = interrupt.recv() => 130,
            _ = terminate.recv() => 143,
            _ = hangup.recv() => 129,
        }
    }
}

#[cfg(not(unix))]
struct Asked;

#[cfg(not(unix))]
impl Asked {
    fn new() -> std::io::Result<Self> {
        Ok(Self)
    }

    async fn wait(&mut self) -> i32 {
        if tokio::signal::ctrl_c().await.is_err() {
            std::future::pending::<()>().await;
        }
        i32::from(INTERRUPTED)
    }
}
