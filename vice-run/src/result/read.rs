//! Result documents from files.

use std::path::Path;

use vice_core::error::{DataError, DataResult, ErrorKind};

use super::{ResultDocument, SCHEMA, SCHEMA_OF_RIGS, version_1};

/// What writes a result document.
const HINT: &str = "write one with `vice evaluate --json FILE`";

/// Reads a document of this version or an older one; a newer one is refused, since its numbers may mean something else.
///
/// # Errors
/// [`DataError`] if the file cannot be read or is no result document that this version understands.
pub fn read(path: impl AsRef<Path>) -> DataResult<ResultDocument> {
    let path = path.as_ref();
    parse(&read_bytes(path)?).map_err(|e| e.at(path))
}

/// The bytes of a file.
pub(crate) fn read_bytes(path: &Path) -> DataResult<Vec<u8>> {
    std::fs::read(path).map_err(|e| match e.kind() {
        std::io::ErrorKind::NotFound => DataError::of_kind(ErrorKind::Missing, "no such file").at(path),
        _ => DataError::new("cannot be read").at(path).because(e),
    })
}

pub(crate) fn parse(text: &[u8]) -> DataResult<ResultDocument> {
    #[derive(serde::Deserialize)]
    struct Head {
        schema: Option<String>,
    }
    let head: Head = serde_json::from_slice(text)
        .map_err(|e| DataError::new("is no result document: it is not JSON").hint(HINT).because(e))?;
    let schema =
        head.schema.ok_or_else(|| DataError::new("is no result document: it has no schema").hint(HINT))?;
    let parsed = match check_schema(&schema)? {
        1 => serde_json::from_slice::<version_1::Document>(text).map(ResultDocument::from),
        _ => serde_json::from_slice(text),
    };
    parsed.map_err(|e| DataError::new("is a result document with a mistake in it").because(e))
}

/// The version of a result document that can be read.
pub(crate) fn check_schema(schema: &str) -> DataResult<u32> {
    let version = |s: &str| {
        let (name, version) = s.split_once('/')?;
        Some((name.to_string(), version.parse::<u32>().ok()?))
    };
    match (version(schema), version(SCHEMA)) {
        (Some((name, theirs)), Some((own_name, ours))) if name == own_name => {
            if theirs <= ours {
                return Ok(theirs);
            }
            Err(DataError::of_kind(
                ErrorKind::Unsupported,
                format!("was written by a newer VICE: it is {schema}, this one reads {SCHEMA}"),
            )
            .hint("update VICE"))
        }
        _ if schema == SCHEMA_OF_RIGS => Err(DataError::of_kind(
            ErrorKind::Unsupported,
            "holds the results of several cameras, and one is wanted here",
        )
        .hint("its list `cameras` has a result for each; `vice evaluate --camera NAME` writes that of one")),
        _ => Err(DataError::new(format!("is a document of another kind: {schema}, not {SCHEMA}")).hint(HINT)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::testing::{document, hostile_document};

    #[test]
    fn what_was_written_is_read() {
        let written = serde_json::to_vec(&hostile_document()).unwrap();
        assert_eq!(parse(&written).unwrap(), hostile_document());
    }

    #[test]
    fn an_older_document_lacks_what_came_later() {
        let mut value = serde_json::to_value(document(vec![])).unwrap();
        for (part, field) in [("dataset", "image_size_px"), ("dataset", "first_frame_ns")] {
            value[part].as_object_mut().unwrap().remove(field);
        }
        let read = parse(value.to_string().as_bytes()).unwrap();
        assert_eq!((read.dataset.image_size_px, read.dataset.first_frame_ns), (None, None));
    }

    #[test]
    fn other_documents_are_refused_by_name() {
        let error = |text: &str| parse(text.as_bytes()).unwrap_err().to_string();
        assert!(error("{\"schema\":\"vice.result/3\"}").contains("newer VICE: it is vice.result/3"));
        assert!(error("{\"schema\":\"vice.trajectory/1\"}").contains("another kind: vice.trajectory/1"));
        assert!(error("{\"schema\":\"vice.result/x\"}").contains("another kind"));
        assert!(error("{\"schema\":\"vice.rig/1\"}").contains("several cameras"));
        assert!(error("{}").contains("no schema"));
        assert!(error("point,timestamp").contains("not JSON"));
        assert!(error("{\"schema\":\"vice.result/1\"}").contains("mistake"));
    }
}
