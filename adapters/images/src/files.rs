//! Pictures in a folder, in the order in which a person would count them, and the numbers in their names.

use std::cmp::Ordering;
use std::fs;
use std::path::{Path, PathBuf};

use vice_core::error::{DataError, DataResult, ErrorKind};

/// Endings of the pictures that are read.
const ENDINGS: [&str; 3] = ["png", "jpg", "jpeg"];

/// Whether a name is that of a picture.
pub(crate) fn is_picture(path: &Path) -> bool {
    let ending = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
    let hidden = path.file_name().is_some_and(|n| n.to_string_lossy().starts_with('.'));
    !hidden && ending.is_some_and(|e| ENDINGS.contains(&e.as_str()))
}

/// The pictures of a folder, in natural order.
///
/// # Errors
/// [`DataError`] if the folder cannot be read.
pub(crate) fn pictures(folder: &Path) -> DataResult<Vec<PathBuf>> {
    Ok(entries(folder)?.into_iter().filter(|p| is_picture(p)).collect())
}

/// All that lies in a folder, in natural order.
///
/// # Errors
/// [`DataError`] if the folder cannot be read.
pub(crate) fn entries(folder: &Path) -> DataResult<Vec<PathBuf>> {
    let failed = |e: std::io::Error| match e.kind() {
        std::io::ErrorKind::NotFound => DataError::of_kind(ErrorKind::Missing, "no such folder").at(folder),
        _ => DataError::new("cannot be read").at(folder).because(e),
    };
    let list = fs::read_dir(folder).map_err(failed)?;
    let mut found: Vec<(String, PathBuf)> = Vec::new();
    for entry in list {
        let path = entry.map_err(failed)?.path();
        found.push((name(&path), path));
    }
    found.sort_by(|a, b| natural(&a.0, &b.0));
    Ok(found.into_iter().map(|(_, path)| path).collect())
}

/// Whether a folder holds a picture. Stops at the first.
pub(crate) fn has_picture(folder: &Path) -> bool {
    fs::read_dir(folder).into_iter().flatten().filter_map(Result::ok).any(|e| is_picture(&e.path()))
}

/// The folders in a folder, in natural order; none where it cannot be read.
pub(crate) fn folders(folder: &Path) -> Vec<PathBuf> {
    entries(folder).unwrap_or_default().into_iter().filter(|p| p.is_dir()).collect()
}

/// A path's last part as text.
pub(crate) fn name(path: &Path) -> String {
    path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default()
}

/// The last part without its ending.
pub(crate) fn stem(path: &Path) -> String {
    path.file_stem().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default()
}

/// `frame2` before `frame10`: runs of digits are compared as numbers.
pub(crate) fn natural(a: &str, b: &str) -> Ordering {
    let (mut x, mut y) = (a, b);
    loop {
        let ((text_x, digits_x, rest_x), (text_y, digits_y, rest_y)) = (split(x), split(y));
        let order = text_x.cmp(text_y).then_with(|| {
            let (p, q) = (digits_x.trim_start_matches('0'), digits_y.trim_start_matches('0'));
            p.len().cmp(&q.len()).then_with(|| p.cmp(q))
        });
        if order != Ordering::Equal {
            return order;
        }
        if rest_x.is_empty() && rest_y.is_empty() {
            // Names that count the same differ by their zeros.
            return a.cmp(b);
        }
        (x, y) = (rest_x, rest_y);
    }
}

/// The text before the first digit, the digits, and the rest.
fn split(text: &str) -> (&str, &str, &str) {
    let start = text.find(|c: char| c.is_ascii_digit()).unwrap_or(text.len());
    let (before, from) = text.split_at(start);
    let end = from.find(|c: char| !c.is_ascii_digit()).unwrap_or(from.len());
    let (digits, rest) = from.split_at(end);
    (before, digits, rest)
}

/// The number that a name without its ending holds, as text: its longest run of digits, with a fraction where one
/// follows (`1305031102.175304`, `left_000012`); of two that are equally long the last. `None` where there is none.
pub(crate) fn number_in(stem: &str) -> Option<&str> {
    let bytes = stem.as_bytes();
    let mut best: Option<(usize, usize)> = None;
    let mut at = 0;
    while at < bytes.len() {
        if !bytes[at].is_ascii_digit() {
            at += 1;
            continue;
        }
        let start = at;
        while at < bytes.len() && bytes[at].is_ascii_digit() {
            at += 1;
        }
        let fraction = bytes.get(at) == Some(&b'.') && bytes.get(at + 1).is_some_and(u8::is_ascii_digit);
        if fraction {
            at += 1;
            while at < bytes.len() && bytes[at].is_ascii_digit() {
                at += 1;
            }
        }
        if best.is_none_or(|(s, e)| at - start >= e - s) {
            best = Some((start, at));
        }
    }
    best.map(|(start, end)| &stem[start..end])
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn numbers_count_as_people_count() {
        let mut names = vec!["f10", "f2", "f02", "f1", "g0", "f", "f1.5", "f1.10"];
        names.sort_by(|a, b| natural(a, b));
        assert_eq!(names, ["f", "f1", "f1.5", "f1.10", "f02", "f2", "f10", "g0"]);
    }

    #[test]
    fn the_longest_number_of_a_name_is_its_stamp() {
        for (stem, number) in [
            ("1305031102.175304", Some("1305031102.175304")),
            ("frame-000012.color", Some("000012")),
            ("cam0_1403636579763555584", Some("1403636579763555584")),
            ("image_1_0", Some("0")),
            ("left", None),
            ("v2.final", Some("2")),
            ("", None),
        ] {
            assert_eq!(number_in(stem), number, "{stem}");
        }
    }

    proptest! {
        #[test]
        fn the_order_is_one(a in "[a1.0]{0,6}", b in "[a1.0]{0,6}", c in "[a1.0]{0,6}") {
            prop_assert_eq!(natural(&a, &b), natural(&b, &a).reverse());
            prop_assert_eq!(natural(&a, &b) == Ordering::Equal, a == b);
            if natural(&a, &b) != Ordering::Greater && natural(&b, &c) != Ordering::Greater {
                prop_assert_ne!(natural(&a, &c), Ordering::Greater);
            }
        }

        #[test]
        fn any_name_has_at_most_one_number(name in "\\PC{0,12}") {
            if let Some(number) = number_in(&name) {
                prop_assert!(number.parse::<f64>().is_ok());
            }
        }
    }
}
