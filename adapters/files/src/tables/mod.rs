//! Tables in columns, as Parquet files have them: for pandas, polars, DuckDB and whatever else reads Parquet.
//!
//! Only flat tables of text and numbers. Without the feature `parquet` nothing is read or written, and the error says
//! so.

#[cfg(feature = "parquet")]
mod read;
#[cfg(feature = "parquet")]
mod write;

#[cfg(feature = "parquet")]
pub use read::read;
#[cfg(feature = "parquet")]
pub(crate) use write::{CREATED_BY, ZSTD_LEVEL};
#[cfg(feature = "parquet")]
pub use write::{Rows, write};

use std::path::Path;
use std::sync::Arc;

/// Whether this build has Parquet.
pub const HAS_PARQUET: bool = cfg!(feature = "parquet");

/// Whether a file is Parquet by its name.
pub fn is_parquet(path: &Path) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case("parquet"))
}

/// The values of a column; `None` where there is none.
#[derive(Clone, Debug, PartialEq)]
pub enum Values {
    /// Text.
    Text(Vec<Option<Arc<str>>>),
    /// Numbers in double precision.
    Numbers(Vec<Option<f64>>),
    /// Whole numbers.
    Counts(Vec<Option<i64>>),
}

impl Values {
    /// How many.
    pub const fn len(&self) -> usize {
        match self {
            Self::Text(values) => values.len(),
            Self::Numbers(values) => values.len(),
            Self::Counts(values) => values.len(),
        }
    }

    /// Whether there is none.
    pub const fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// A column with its name, which ends in its unit where it has one.
pub type Column = (String, Values);

#[cfg(not(feature = "parquet"))]
mod without;
#[cfg(not(feature = "parquet"))]
pub(crate) use without::unavailable;
#[cfg(not(feature = "parquet"))]
pub use without::{read, write};

#[cfg(test)]
#[cfg(feature = "parquet")]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::fs;
    use vice_core::error::DataError;

    fn columns(rows: &[(Option<String>, Option<f64>, Option<i64>)]) -> Vec<Column> {
        vec![
            ("name".to_string(), Values::Text(rows.iter().map(|r| r.0.as_deref().map(Arc::from)).collect())),
            ("error_px".to_string(), Values::Numbers(rows.iter().map(|r| r.1).collect())),
            ("timestamp_ns".to_string(), Values::Counts(rows.iter().map(|r| r.2).collect())),
        ]
    }

    fn written(path: &Path, parts: &[Vec<Column>]) -> Vec<u8> {
        let failed = |e| DataError::new("a part cannot be written").because(e);
        write(path, &parts[0], |rows| parts.iter().try_for_each(|part| rows(part).map_err(failed))).unwrap();
        fs::read(path).unwrap()
    }

    proptest! {
        #[test]
        fn what_is_written_is_read(
            rows in prop::collection::vec(
                (prop::option::of("[a-zé\u{0}]{0,5}"), prop::option::of(-1e9..1e9_f64), prop::option::of(any::<i64>())),
                0..40,
            ),
        ) {
            let folder = tempfile::tempdir().unwrap();
            let path = folder.path().join("t.parquet");
            let table = columns(&rows);
            let bytes = written(&path, std::slice::from_ref(&table));
            prop_assert_eq!(read(&path).unwrap(), table.clone());
            prop_assert_eq!(written(&path, std::slice::from_ref(&table)), bytes);
            // In two parts it is the same table.
            let (first, second) = rows.split_at(rows.len() / 2);
            written(&path, &[columns(first), columns(second)]);
            prop_assert_eq!(read(&path).unwrap(), table);
        }

        #[test]
        fn no_damage_is_worse_than_an_error(at in 0.0..1.0_f64, value in any::<u8>(), cut in 0.0..1.0_f64) {
            let folder = tempfile::tempdir().unwrap();
            let path = folder.path().join("t.parquet");
            let rows: Vec<_> = (0..50).map(|i| (Some(format!("n{}", i % 3)), Some(f64::from(i)), Some(i64::from(i)))).collect();
            let mut bytes = written(&path, &[columns(&rows)]);
            let place = (at * bytes.len() as f64) as usize % bytes.len();
            bytes[place] ^= value;
            bytes.truncate(bytes.len() - (cut * cut * cut * bytes.len() as f64) as usize);
            fs::write(&path, &bytes).unwrap();
            if let Err(error) = read(&path) {
                prop_assert!(!error.to_string().contains('\n'), "{}", error);
            }
        }
    }
}
