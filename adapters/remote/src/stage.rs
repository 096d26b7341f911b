//! Fetching whole objects into files, each written beside and renamed.

use std::io::Write;
use std::path::Path;

use futures_util::StreamExt;
use object_store::GetOptions;
use tempfile::NamedTempFile;
use vice_core::error::{DataError, DataResult, ErrorKind};

use crate::failure::Failure;
use crate::limits::{Limits, STAGE_LIMIT};
use crate::object::{MAX_REQUEST_BYTES, Object, REQUESTS_AT_A_TIME, tried};
use crate::segments::pieces;

/// Files that are fetched at a time.
const FILES_AT_A_TIME: usize = 8;

/// Whether a file has all bytes of an object. Which version of it is in the name of a folder above.
pub(crate) fn is_there(object: &Object, path: &Path) -> bool {
    path.metadata().is_ok_and(|m| m.is_file() && m.len() == object.version.size)
}

/// Refuses more bytes than may be staged.
pub(crate) fn check_limit(bytes: u64, limits: Limits, shown: &str) -> DataResult<()> {
    if bytes <= limits.stage_bytes {
        return Ok(());
    }
    let gib = |bytes: u64| bytes as f64 / f64::from(1 << 30);
    let problem =
        format!("{:.2} GiB would have to be fetched, more than {:.2}", gib(bytes), gib(limits.stage_bytes));
    Err(DataError::of_kind(ErrorKind::Unsupported, problem)
        .at(shown)
        .hint(format!("the environment variable {STAGE_LIMIT} says how many GiB may be")))
}

/// Fetches objects to paths where they are not there yet.
pub(crate) async fn fetch(files: Vec<(Object, std::path::PathBuf)>) -> DataResult<()> {
    let missing = files.into_iter().filter(|(object, path)| !is_there(object, path));
    let jobs = missing.map(|(object, path)| async move { fetch_one(&object, &path).await });
    let mut jobs = futures_util::stream::iter(jobs).buffer_unordered(FILES_AT_A_TIME);
    while let Some(done) = jobs.next().await {
        done?;
    }
    Ok(())
}

async fn fetch_one(object: &Object, path: &Path) -> DataResult<()> {
    let file = if object.ranges { by_parts(object, path).await? } else { at_once(object, path).await? };
    let failed = |e: std::io::Error| cannot_write(path, e);
    let len = file.as_file().metadata().map_err(failed)?.len();
    if len != object.version.size {
        let problem = format!("{len} of {} bytes came", object.version.size);
        return Err(DataError::new(problem).at(&object.shown));
    }
    file.persist(path).map_err(|e| failed(e.error))?;
    Ok(())
}

async fn by_parts(object: &Object, path: &Path) -> DataResult<NamedTempFile> {
    let mut file = beside(path)?;
    let all: Vec<_> = pieces(0..object.version.size, MAX_REQUEST_BYTES).collect();
    for some in all.chunks(REQUESTS_AT_A_TIME) {
        for part in object.parts(some.to_vec()).await? {
            file.write_all(&part).map_err(|e| cannot_write(path, e))?;
        }
    }
    Ok(file)
}

/// From a server that gives no parts: what breaks off is fetched anew.
async fn at_once(object: &Object, path: &Path) -> DataResult<NamedTempFile> {
    tried(&object.client, &object.shown, || async {
        let got = object.client.store.get_opts(&object.path, GetOptions::default()).await?;
        object.check(&got.meta)?;
        let failed = |e: DataError| Failure::Passing(e.to_string());
        let mut file = beside(path).map_err(failed)?;
        let mut stream = got.into_stream();
        while let Some(bytes) = stream.next().await {
            file.write_all(&bytes?).map_err(|e| failed(cannot_write(path, e)))?;
        }
        let len = file.as_file().metadata().map_or(0, |m| m.len());
        match len == object.version.size {
            true => Ok(file),
            false => Err(Failure::Passing(format!("{len} of {} bytes came", object.version.size))),
        }
    })
    .await
}

fn beside(path: &Path) -> DataResult<NamedTempFile> {
    let folder = path.parent().unwrap_or(Path::new("."));
    std::fs::create_dir_all(folder)
        .and_then(|()| NamedTempFile::new_in(folder))
        .map_err(|e| cannot_write(path, e))
}

/// Puts an empty file where one that lies elsewhere is looked for.
pub(crate) fn stand_in(path: &Path) -> DataResult<()> {
    if path.exists() {
        return Ok(());
    }
    let failed = |e: std::io::Error| cannot_write(path, e);
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder).map_err(failed)?;
    }
    std::fs::OpenOptions::new().append(true).create(true).open(path).map_err(failed)?;
    Ok(())
}

fn cannot_write(path: &Path, error: std::io::Error) -> DataError {
    DataError::new("cannot be written to the cache")
        .at(path)
        .hint(format!("the environment variable {} names another folder", crate::limits::CACHE))
        .because(error)
}
