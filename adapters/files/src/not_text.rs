//! Files that are given where a table of text is expected: recordings, archives, pictures, folders.

use std::path::Path;

use vice_core::error::{DataError, ErrorKind};

/// First bytes of files that are no text, and what they are.
const KINDS: [(&[u8], &str); 15] = [
    (b"#ROSBAG V", "a ROS 1 bag"),
    (b"\x89MCAP0\r\n", "an MCAP recording"),
    (b"SQLite format 3\0", "an SQLite file, such as the .db3 of a ROS 2 recording"),
    (b"PK\x03\x04", "a ZIP archive (also .npz and .xlsx are)"),
    (b"\x1f\x8b", "a file compressed by gzip"),
    (b"\x28\xb5\x2f\xfd", "a file compressed by zstd"),
    (b"BZh", "a file compressed by bzip2"),
    (b"\xfd7zXZ\0", "a file compressed by xz"),
    (b"\x04\x22\x4d\x18", "a file compressed by lz4"),
    (b"\x93NUMPY", "an array of NumPy"),
    (b"\x89HDF\r\n", "an HDF5 file"),
    (b"\x89PNG\r\n", "a PNG picture"),
    (b"\xff\xd8\xff", "a JPEG picture"),
    (b"\xff\xfe", "text in UTF-16"),
    (b"\xfe\xff", "text in UTF-16"),
];

/// What bytes at the start of a file are, where they are not the text that is expected.
pub fn what(start: &[u8]) -> Option<&'static str> {
    KINDS.iter().find(|(magic, _)| start.starts_with(magic)).map(|(_, what)| *what)
}

/// The error of such a file.
pub(crate) fn error(what: &str) -> DataError {
    let hint = if what.contains("UTF-16") {
        "save it as UTF-8"
    } else if what.contains("ROS") || what.contains("MCAP") {
        "write its poses to a file first: vice convert RECORDING --stream NAME --to tum OUT; vice info RECORDING lists the streams"
    } else if what.contains("compress") || what.contains("archive") {
        "unpack it first"
    } else {
        "write it as text, a row for each stamp"
    };
    DataError::of_kind(ErrorKind::Unsupported, format!("is {what}, not a table of text")).hint(hint)
}

/// The error of a folder where a file is expected.
pub(crate) fn folder(path: &Path) -> DataError {
    DataError::of_kind(ErrorKind::Unsupported, "is a folder, not a file")
        .at(path)
        .hint("of a data set write a stream to a file first: vice convert FOLDER --stream NAME --to tum OUT")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn recordings_and_archives_are_told_by_their_first_bytes() {
        let folder = tempfile::tempdir().unwrap();
        for (bytes, expected) in [
            (
                &b"#ROSBAG V2.0\nxx"[..],
                "is a ROS 1 bag, not a table of text (write its poses to a file first",
            ),
            (b"\x89MCAP0\r\n\x01", "is an MCAP recording"),
            (b"SQLite format 3\0\x10", "is an SQLite file"),
            (b"PK\x03\x04\x14", "unpack it first"),
            (b"\xff\xfe1\0 \0", "UTF-16, not a table of text (save it as UTF-8)"),
            (b"\x93NUMPY\x01", "an array of NumPy"),
        ] {
            let path = folder.path().join("poses");
            std::fs::write(&path, bytes).unwrap();
            let error = crate::rows::open(&path).unwrap_err().to_string();
            assert!(error.contains(expected) && error.contains("poses"), "{error}");
        }
        assert_eq!(what(b"# timestamp tx ty tz"), None);
        assert_eq!(what(b""), None);
        let error = crate::rows::open(folder.path()).unwrap_err().to_string();
        assert!(error.contains("is a folder") && error.contains("vice convert"), "{error}");
    }
}
