//! `tracing` events of the adapter, as lines of the host: this library has its own copy of `tracing`, to which nobody listens.
#![allow(unsafe_code)]

use std::fmt::{self, Write};
use std::sync::OnceLock;

use tracing::field::{Field, Visit};
use tracing::level_filters::LevelFilter;
use tracing::span::{Attributes, Id, Record};
use tracing::{Event, Level, Metadata, Subscriber};

use crate::contract::{Host, LOG_ERROR, LOG_INFO, LOG_WARN, Text};

#[derive(Clone, Copy)]
struct HostLog(Host);

// SAFETY: the host says that `log` may be called from any thread with its context.
unsafe impl Send for HostLog {}
// SAFETY: as above.
unsafe impl Sync for HostLog {}

static HOST: OnceLock<HostLog> = OnceLock::new();

/// Remembers the host, once, and sends it what the adapter logs.
///
/// # Safety
/// `host` is null or points at a host that lives as long as the process.
pub(super) unsafe fn install(host: *const Host) {
    if host.is_null() || HOST.get().is_some() {
        return;
    }
    // SAFETY: not null; the rest is the caller's promise.
    let host = unsafe { *host };
    if HOST.set(HostLog(host)).is_ok() {
        // An adapter that listens to itself keeps doing so.
        let _ = tracing::subscriber::set_global_default(ToHost);
    }
}

/// A line to the user.
pub(super) fn line(level: i32, text: &str) {
    if let Some(HostLog(Host { context, log: Some(log), .. })) = HOST.get().copied() {
        // SAFETY: context and call belong together, and the text outlives the call.
        unsafe { log(context, level, Text::from_bytes(text.as_bytes())) };
    }
}

struct ToHost;

impl Subscriber for ToHost {
    fn enabled(&self, metadata: &Metadata<'_>) -> bool {
        *metadata.level() <= Level::INFO
    }

    fn max_level_hint(&self) -> Option<LevelFilter> {
        Some(LevelFilter::INFO)
    }

    fn new_span(&self, _: &Attributes<'_>) -> Id {
        Id::from_u64(1)
    }

    fn record(&self, _: &Id, _: &Record<'_>) {}

    fn record_follows_from(&self, _: &Id, _: &Id) {}

    fn event(&self, event: &Event<'_>) {
        let mut fields = Fields(String::new());
        event.record(&mut fields);
        let level = match *event.metadata().level() {
            Level::ERROR => LOG_ERROR,
            Level::WARN => LOG_WARN,
            _ => LOG_INFO,
        };
        line(level, &fields.0);
    }

    fn enter(&self, _: &Id) {}

    fn exit(&self, _: &Id) {}
}

/// The message as it is, other fields as `name=value`.
struct Fields(String);

impl Visit for Fields {
    fn record_debug(&mut self, field: &Field, value: &dyn fmt::Debug) {
        let space = if self.0.is_empty() { "" } else { " " };
        // Writing to a string cannot fail.
        let _ = match field.name() {
            "message" => write!(self.0, "{space}{value:?}"),
            name => write!(self.0, "{space}{name}={value:?}"),
        };
    }
}
