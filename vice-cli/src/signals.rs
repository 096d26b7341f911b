//! Being asked to stop: once to end cleanly, twice to end at once.

use std::sync::atomic::{AtomicBool, Ordering};

use crate::terminal::Verbosity;

/// The exit code after it, as of a program that Ctrl-C ended.
pub(crate) const INTERRUPTED: u8 = 130;

/// Sets a flag at the first Ctrl-C or SIGTERM; the second ends the program.
pub(crate) fn stop_at_first(stop: &'static AtomicBool, verbosity: Verbosity) -> anyhow::Result<()> {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_io().build()?;
    std::thread::spawn(move || {
        let heard = runtime.block_on(async {
            let mut asked = Asked::new()?;
            asked.wait().await;
            stop.store(true, Ordering::SeqCst);
            verbosity.note("stopping when the runs in flight have ended; once more stops at once");
            asked.wait().await;
            std::io::Result::Ok(())
        });
        if heard.is_ok() {
            std::process::exit(i32::from(INTERRUPTED));
        }
    });
    Ok(())
}

#[cfg(unix)]
struct Asked([tokio::signal::unix::Signal; 2]);

#[cfg(unix)]
impl Asked {
    fn new() -> std::io::Result<Self> {
        use tokio::signal::unix::{SignalKind, signal};
        Ok(Self([signal(SignalKind::interrupt())?, signal(SignalKind::terminate())?]))
    }

    async fn wait(&mut self) {
        let [a, b] = &mut self.0;
        tokio::select! {
            _ = a.recv() => {}
            _ = b.recv() => {}
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

    async fn wait(&mut self) {
        if tokio::signal::ctrl_c().await.is_err() {
            std::future::pending::<()>().await;
        }
    }
}
