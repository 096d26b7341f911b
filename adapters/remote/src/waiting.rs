//! Waiting for what is asynchronous, from whatever thread.

use std::future::Future;
use std::sync::OnceLock;
use std::sync::mpsc::sync_channel;

use tokio::runtime::{Builder, Runtime};
use vice_core::error::{DataError, DataResult};

static RUNTIME: OnceLock<Option<Runtime>> = OnceLock::new();

/// Runs a future on threads of our own and waits for it: the caller may be a thread of another runtime.
pub(crate) fn wait<T: Send + 'static>(
    work: impl Future<Output = DataResult<T>> + Send + 'static,
) -> DataResult<T> {
    let runtime = RUNTIME.get_or_init(|| {
        Builder::new_multi_thread().worker_threads(2).thread_name("vice-remote").enable_all().build().ok()
    });
    let lost = || DataError::new("the threads that fetch data cannot be started");
    let runtime = runtime.as_ref().ok_or_else(lost)?;
    let (done, result) = sync_channel(1);
    runtime.spawn(async move {
        // Who waited may be gone.
        let _ = done.send(work.await);
    });
    result.recv().map_err(|_| DataError::new("what fetches data broke off"))?
}
