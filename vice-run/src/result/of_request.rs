//! Requests from files: as they are, or out of a result document.

use std::path::Path;

use vice_core::error::{DataError, DataResult, ErrorKind};

use super::{SCHEMA_OF_RIGS, parse as parse_document, read_bytes};
use crate::error::RunResult;
use crate::request::Request;

impl Request {
    /// Reads a request, or that of a result document.
    ///
    /// # Errors
    /// [`vice_core::error::DataError`] with the path and line if the file cannot be read or is neither.
    pub fn read(path: impl AsRef<Path>) -> RunResult<Self> {
        Ok(read(path.as_ref())?)
    }
}

fn read(path: &Path) -> DataResult<Request> {
    let text = read_bytes(path)?;
    parse(&text).map_err(|e| e.at(path))
}

fn parse(text: &[u8]) -> DataResult<Request> {
    #[derive(serde::Deserialize)]
    struct Head {
        schema: Option<String>,
    }
    let at = |e: serde_json::Error, what: &str| {
        DataError::of_kind(ErrorKind::Usage, format!("{what}: {e}")).line(e.line() as u64)
    };
    let head: Head = serde_json::from_slice(text).map_err(|e| at(e, "is no request: it is not JSON"))?;
    match head.schema {
        None => serde_json::from_slice(text).map_err(|e| at(e, "is a request with a mistake in it")),
        Some(schema) if schema == SCHEMA_OF_RIGS => {
            #[derive(serde::Deserialize)]
            struct Asked {
                request: Request,
            }
            let asked: Result<Asked, _> = serde_json::from_slice(text);
            asked.map(|asked| asked.request).map_err(|e| at(e, "is a document with a mistake in it"))
        }
        Some(_) => parse_document(text).map(|document| document.request),
    }
}
