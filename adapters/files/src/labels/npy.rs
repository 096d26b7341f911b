//! NumPy's array files (numpy.lib.format) and archives of them: the little that tracks of points need.

use std::io::{Cursor, Read};

use vice_core::budget::Budget;
use vice_core::error::{DataError, DataResult, ErrorKind};

/// What starts an array file, and an archive.
pub(super) const NPY: &[u8] = b"\x93NUMPY";
pub(super) const NPZ: &[u8] = b"PK\x03\x04";
/// Arrays of more numbers are refused before anything is taken for them.
const MOST_NUMBERS: u64 = 1 << 28;
/// Bytes that any archive may unpack to, and how many times its size a larger one may: places of points do not repeat.
const FREE_BYTES: u64 = 32 << 20;
const MOST_TIMES: u64 = 8;

/// An array, the last index running fastest.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Array {
    pub(super) shape: Vec<usize>,
    pub(super) values: Vec<f64>,
    /// Whether it is one of truth values.
    pub(super) is_bool: bool,
}

/// The arrays of an archive by name, in its order; one without a name for an array file.
///
/// # Errors
/// [`DataError`] if the bytes are neither, or an array is of a type that is not read.
pub(super) fn read(bytes: &[u8]) -> DataResult<Vec<(String, Array)>> {
    if bytes.starts_with(NPY) {
        return Ok(vec![(String::new(), array(bytes, Budget::in_use().most(8 * bytes.len() as u64))?)]);
    }
    let broken = |e: zip::result::ZipError| DataError::new("the archive cannot be read").because(e);
    let mut archive = zip::ZipArchive::new(Cursor::new(bytes)).map_err(broken)?;
    let mut arrays = Vec::new();
    let budget = Budget::in_use();
    let usual = FREE_BYTES.max(MOST_TIMES.saturating_mul(bytes.len() as u64));
    let mut left = budget.most(usual);
    for index in 0..archive.len() {
        let mut entry = archive.by_index(index).map_err(broken)?;
        let name = entry.name().map_err(broken)?.into_owned();
        let Some(name) = name.strip_suffix(".npy").map(str::to_string) else { continue };
        let mut content = Vec::new();
        // What the directory says of its size is not believed.
        let read = entry.by_ref().take(left + 1).read_to_end(&mut content);
        read.map_err(|e| DataError::new(format!("the array `{name}` cannot be unpacked")).because(e))?;
        left = left.checked_sub(content.len() as u64).ok_or_else(|| {
            let claimed = budget.most(usual).max(entry.size());
            DataError::new(format!(
                "the archive unpacks to more than the budget of {} bytes",
                budget.most(usual)
            ))
            .hint(format!("where it is right, {}", Budget::raised(claimed, usual)))
        })?;
        match array(&content, left) {
            Ok(array) => {
                left = left.saturating_sub(8 * array.values.len() as u64);
                arrays.push((name, array));
            }
            // Others may stand beside those that are looked for.
            Err(error) if error.kind() == ErrorKind::Unsupported => {}
            Err(error) => return Err(DataError::new(format!("the array `{name}`: {error}"))),
        }
    }
    Ok(arrays)
}

/// The array of some bytes, whose numbers may take so many as doubles.
fn array(bytes: &[u8], most_bytes: u64) -> DataResult<Array> {
    let broken = || DataError::new("is no array of NumPy, or the file is cut off");
    let version = *bytes.get(6).filter(|_| bytes.starts_with(NPY)).ok_or_else(broken)?;
    let (start, length): (usize, usize) = match version {
        1 => (
            10,
            usize::from(u16::from_le_bytes(
                bytes.get(8..10).and_then(|b| b.try_into().ok()).ok_or_else(broken)?,
            )),
        ),
        _ => (
            12,
            u32::from_le_bytes(bytes.get(8..12).and_then(|b| b.try_into().ok()).ok_or_else(broken)?) as usize,
        ),
    };
    let header = bytes.get(start..start.saturating_add(length)).ok_or_else(broken)?;
    let header = std::str::from_utf8(header).map_err(|_| broken())?;
    let after =
        |key: &str| header.split_once(key).map(|(_, rest)| rest.trim_start_matches(['\'', '"', ':', ' ']));
    let code = after("'descr'").and_then(|rest| rest.split(['\'', '"']).next()).unwrap_or_default();
    let fortran = after("'fortran_order'").is_some_and(|rest| rest.starts_with("True"));
    let sizes =
        after("'shape'").and_then(|rest| rest.strip_prefix('(')).and_then(|rest| rest.split(')').next());
    let shape: Vec<usize> = sizes
        .ok_or_else(broken)?
        .split(',')
        .map(str::trim)
        .filter(|s| !s.is_empty())
        .map(|s| s.parse().map_err(|_| broken()))
        .collect::<DataResult<_>>()?;
    // An empty side makes an array of none, whatever its other sides are: they are counted as well.
    let count = shape.iter().try_fold(1_usize, |n, size| n.checked_mul((*size).max(1)));
    let numbers = count.map_or(u64::MAX, |n| n as u64);
    let what = format!("numbers in an array of the shape {shape:?}");
    Budget::in_use().check(numbers, &what, MOST_NUMBERS)?;
    let count: usize = shape.iter().product();
    let data = &bytes[start + length..];
    let unsupported = || {
        DataError::of_kind(ErrorKind::Unsupported, format!("arrays of the type `{code}` are not read"))
            .hint("save it as float32 or float64, truth values as bool")
    };
    let (order, kind) = code.split_at_checked(1).ok_or_else(unsupported)?;
    let size = match kind {
        "f4" | "i4" | "u4" => 4,
        "f8" | "i8" => 8,
        "b1" | "u1" | "i1" => 1,
        _ => return Err(unsupported()),
    };
    if order == ">" {
        return Err(unsupported());
    }
    let data = data.get(..count * size).ok_or_else(broken)?;
    if 8 * count as u64 > most_bytes {
        let hint = format!("where it is right, {}", Budget::raised(8 * count as u64, most_bytes));
        return Err(DataError::new(format!(
            "its {count} numbers take more than the budget of {most_bytes} bytes"
        ))
        .hint(hint));
    }
    let values =
        data.chunks_exact(size).map(|b| number(kind, b)).collect::<Option<Vec<f64>>>().ok_or_else(broken)?;
    let values = if fortran { turned(&shape, &values) } else { values };
    Ok(Array { shape, values, is_bool: kind == "b1" })
}

fn number(kind: &str, bytes: &[u8]) -> Option<f64> {
    Some(match kind {
        "f4" => f64::from(f32::from_le_bytes(bytes.try_into().ok()?)),
        "f8" => f64::from_le_bytes(bytes.try_into().ok()?),
        "i4" => f64::from(i32::from_le_bytes(bytes.try_into().ok()?)),
        "u4" => f64::from(u32::from_le_bytes(bytes.try_into().ok()?)),
        "i8" => i64::from_le_bytes(bytes.try_into().ok()?) as f64,
        "i1" => f64::from(i8::from_le_bytes(bytes.try_into().ok()?)),
        _ => f64::from(*bytes.first()?),
    })
}

/// From Fortran's order, the first index running fastest.
fn turned(shape: &[usize], values: &[f64]) -> Vec<f64> {
    let mut index = vec![0; shape.len()];
    (0..values.len())
        .map(|_| {
            let at = index.iter().zip(shape).rev().fold(0, |at, (i, size)| at * size + i);
            for (i, size) in index.iter_mut().zip(shape).rev() {
                *i += 1;
                if *i < *size {
                    break;
                }
                *i = 0;
            }
            values[at]
        })
        .collect()
}
