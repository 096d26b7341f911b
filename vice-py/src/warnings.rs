//! What the libraries warn of, to Python's `logging` under the name `vicepose`.

use std::io;
use std::sync::Once;

use pyo3::prelude::*;
use tracing::{Level, Metadata};
use tracing_subscriber::fmt::MakeWriter;

/// Listens from the first call on. The program listens for itself, and whoever comes first is heard.
pub(crate) fn listen() {
    static FIRST: Once = Once::new();
    FIRST.call_once(|| {
        let subscriber = tracing_subscriber::fmt()
            .with_max_level(Level::WARN)
            .without_time()
            .with_level(false)
            .with_target(false)
            .with_ansi(false)
            .with_writer(ToLogging("warning"))
            .finish();
        // Fails only where another one listens already.
        let _ = tracing::subscriber::set_global_default(subscriber);
    });
}

/// One method of a logger.
#[derive(Clone, Copy)]
struct ToLogging(&'static str);

impl<'a> MakeWriter<'a> for ToLogging {
    type Writer = Self;

    fn make_writer(&'a self) -> Self {
        *self
    }

    fn make_writer_for(&'a self, meta: &Metadata<'_>) -> Self {
        Self(if *meta.level() == Level::ERROR { "error" } else { "warning" })
    }
}

impl io::Write for ToLogging {
    /// An event comes as one text.
    fn write(&mut self, text: &[u8]) -> io::Result<usize> {
        let line = String::from_utf8_lossy(text).trim_end().to_string();
        Python::attach(|py| {
            let logger = py.import("logging").and_then(|l| l.call_method1("getLogger", ("vicepose",)));
            // A logger that fails must not fail the work.
            let _ = logger.and_then(|logger| logger.call_method1(self.0, ("%s", line)));
        });
        Ok(text.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}
