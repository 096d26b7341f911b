//! Stamps that lost digits on their way: through a spreadsheet (15 digits, or 6 as 1.60000E+18), or a program that keeps
//! them as a double.

use vice_core::error::{DataError, DataResult, ErrorKind};
use vice_core::label::LabelSet;
use vice_core::time::Stamp;

/// Digits of a number in exponent form where the exponent is larger than what they hold: `1.60000E+18` has 6.
pub(super) fn digits_of_exponent_form(text: &str) -> Option<usize> {
    let (mantissa, exponent) = text.trim().split_once(['e', 'E'])?;
    let exponent: usize = exponent.trim_start_matches('+').parse().ok()?;
    let digits = mantissa.bytes().filter(u8::is_ascii_digit).count();
    (digits <= exponent).then_some(digits)
}

/// The error of stamps that were written with too few digits.
pub(super) fn error(digits: usize) -> DataError {
    DataError::of_kind(
        ErrorKind::Corrupt,
        format!("the stamps were rounded to {digits} digits, as a spreadsheet does, so that they no longer tell frames apart"),
    )
    .hint("take the file from before the spreadsheet, or format the column as text before it is opened")
}

/// Refuses labels none of which is at a frame, and whose stamps all end in zeros that those of the frames do not.
pub(super) fn check(labels: &LabelSet, frames: &[Stamp]) -> DataResult<()> {
    let stamps = || labels.points().iter().flat_map(|p| p.observations.stamps()).copied();
    if frames.is_empty() || stamps().any(|s| frames.binary_search(&s).is_ok()) {
        return Ok(());
    }
    let zeros = |all: &mut dyn Iterator<Item = Stamp>| {
        let least = all.map(|s| trailing_zeros(s.as_nanos())).min();
        least.unwrap_or(0)
    };
    let (of_labels, of_frames) = (zeros(&mut stamps()), zeros(&mut frames.iter().copied()));
    let unit = 10_i64.checked_pow(of_labels).unwrap_or(i64::MAX);
    let near = |stamp: Stamp| {
        let after = frames.partition_point(|f| *f < stamp);
        let beside = [after.checked_sub(1), Some(after)].into_iter().flatten().filter_map(|i| frames.get(i));
        beside.map(|f| f.since(stamp).as_nanos().abs()).min().is_some_and(|d| d <= unit)
    };
    if of_labels < 2 || of_labels <= of_frames || !stamps().all(near) {
        return Ok(());
    }
    let digits =
        stamps().map(|s| s.as_nanos().unsigned_abs().checked_ilog10().unwrap_or(0) + 1).max().unwrap_or(0);
    Err(error(digits.saturating_sub(of_labels) as usize))
}

fn trailing_zeros(mut value: i64) -> u32 {
    let mut zeros = 0;
    while value != 0 && value % 10 == 0 {
        value /= 10;
        zeros += 1;
    }
    if value == 0 { 18 } else { zeros }
}

#[cfg(test)]
mod tests {
    use super::*;
    use vice_core::camera::Pixel;
    use vice_core::label::{LabelRow, Observation};

    fn labels(stamps: &[i64]) -> LabelSet {
        LabelSet::from_rows(stamps.iter().map(|s| LabelRow {
            point: "a".to_string(),
            observation: Observation::manual(Stamp::from_nanos(*s), Pixel::new(1.0, 2.0)),
        }))
        .unwrap()
    }

    #[test]
    fn digits_that_were_lost_are_noticed() {
        let frames: Vec<Stamp> =
            (0..5).map(|i| Stamp::from_nanos(1_403_715_280_562_142_976 + 50_000_064 * i)).collect();
        let says = |stamps: &[i64], expected: &str| {
            let error = check(&labels(stamps), &frames).unwrap_err().to_string();
            assert!(error.contains(expected), "{error}");
        };
        says(&[1_403_715_280_562_140_000, 1_403_715_280_612_140_000], "rounded to 15 digits");
        says(&[1_403_715_280_562_143_000, 1_403_715_280_612_143_000], "rounded to 16 digits");
        says(&[1_403_720_000_000_000_000], "rounded to 6 digits");
        check(&labels(&[1_403_715_280_562_142_976]), &frames).unwrap();
        check(&labels(&[1_403_715_280_562_142_977]), &frames).unwrap();
        check(&labels(&[1_300_000_000_000_000_001, 1_403_715_280_562_140_000]), &frames).unwrap();
        let round: Vec<Stamp> = (0..5).map(|i| Stamp::from_nanos(50_000_000 * i)).collect();
        check(&labels(&[60_000_000]), &round).unwrap();
        assert_eq!(digits_of_exponent_form("1.60000E+18"), Some(6));
        assert_eq!(digits_of_exponent_form("1.403715280562142976e18"), None);
        assert_eq!(digits_of_exponent_form("1403715280562142976"), None);
    }
}
