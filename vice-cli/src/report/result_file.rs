//! Result documents from files.

use std::path::Path;

use vice_core::error::{DataError, DataResult};
use vice_core::result::{ResultDocument, SCHEMA};

/// Reads a document of this version or an older one; a newer one is refused, since its numbers may mean something else.
///
/// # Errors
/// [`DataError`] if the file cannot be read or is no result document that this version understands.
pub(crate) fn read(path: &Path) -> DataResult<ResultDocument> {
    let text = std::fs::read(path).map_err(|e| match e.kind() {
        std::io::ErrorKind::NotFound => DataError::new("no such file").at(path),
        _ => DataError::new("cannot be read").at(path).because(e),
    })?;
    parse(&text).map_err(|e| e.at(path))
}

fn parse(text: &[u8]) -> DataResult<ResultDocument> {
    #[derive(serde::Deserialize)]
    struct Head {
        schema: Option<String>,
    }
    let hint = "write one with `vice evaluate --json FILE`";
    let head: Head = serde_json::from_slice(text)
        .map_err(|e| DataError::new("is no result document: it is not JSON").hint(hint).because(e))?;
    let schema =
        head.schema.ok_or_else(|| DataError::new("is no result document: it has no schema").hint(hint))?;
    check_schema(&schema)?;
    serde_json::from_slice(text)
        .map_err(|e| DataError::new("is a result document with a mistake in it").because(e))
}

fn check_schema(schema: &str) -> DataResult<()> {
    let version = |s: &str| {
        let (name, version) = s.split_once('/')?;
        Some((name.to_string(), version.parse::<u32>().ok()?))
    };
    match (version(schema), version(SCHEMA)) {
        (Some((name, theirs)), Some((own_name, ours))) if name == own_name => {
            if theirs <= ours {
                return Ok(());
            }
            Err(DataError::new(format!(
                "was written by a newer VICE: it is {schema}, this one reads {SCHEMA}"
            ))
            .hint("update VICE"))
        }
        _ => Err(DataError::new(format!("is a document of another kind: {schema}, not {SCHEMA}"))
            .hint("write one with `vice evaluate --json FILE`")),
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
        assert!(error("{\"schema\":\"vice.result/2\"}").contains("newer VICE: it is vice.result/2"));
        assert!(error("{\"schema\":\"vice.trajectory/1\"}").contains("another kind: vice.trajectory/1"));
        assert!(error("{\"schema\":\"vice.result/x\"}").contains("another kind"));
        assert!(error("{}").contains("no schema"));
        assert!(error("point,timestamp").contains("not JSON"));
        assert!(error("{\"schema\":\"vice.result/1\"}").contains("mistake"));
    }
}
