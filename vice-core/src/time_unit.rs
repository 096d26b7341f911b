//! Stamps in the wrong unit: the commonest reason why two recordings do not overlap.

use crate::error::DataError;
use crate::time::{Span, Stamp};

/// What stamps may have been written in, and how many nanoseconds one of it is.
const UNITS: [(&str, i128); 3] =
    [("seconds", 1_000_000_000), ("milliseconds", 1_000_000), ("microseconds", 1_000)];

/// Whether a range of stamps that does not overlap with the expected one would do so in another unit.
///
/// Both are first and last stamps as they were read. The words follow "the poses look like" or "they look like" in a
/// message that prints both ranges; `None` where the ranges overlap as they are, or no unit explains the difference.
pub fn suspect_unit(expected: (Stamp, Stamp), suspect: (Stamp, Stamp)) -> Option<String> {
    let nanos = |range: (Stamp, Stamp)| (i128::from(range.0.as_nanos()), i128::from(range.1.as_nanos()));
    let (expected, suspect) = (nanos(expected), nanos(suspect));
    if near(expected, suspect) {
        return None;
    }
    // Another unit moves the ends together, and makes the length one of the same order: seconds from zero on, taken a
    // milliard times, reach into any range, but are decades long.
    let near = |expected: (i128, i128), scaled: (i128, i128)| {
        let length = (expected.1 - expected.0).abs().max(1);
        let slack = expected.1.abs().max(expected.0.abs()) / 1000;
        near(expected, scaled) && scaled.1 - scaled.0 <= slack.max(100 * length)
    };
    // Too small: a coarser unit was read as nanoseconds. Too large: nanoseconds were read as a coarser one.
    let coarser = UNITS.iter().find(|(_, factor)| near(expected, (suspect.0 * factor, suspect.1 * factor)));
    if let Some((unit, _)) = coarser {
        return Some(format!("{unit} read as nanoseconds"));
    }
    let finer = UNITS.iter().find(|(_, factor)| near(expected, (suspect.0 / factor, suspect.1 / factor)));
    finer.map(|(read_as, _)| format!("nanoseconds read as {read_as}"))
}

/// Which of two ranges that should overlap has the wrong unit, in words: the one with the smaller numbers, since
/// recordings are in nanoseconds.
pub fn mixed_up(a: (&str, (Stamp, Stamp)), b: (&str, (Stamp, Stamp))) -> Option<String> {
    let size = |(from, to): (Stamp, Stamp)| from.as_nanos().unsigned_abs().max(to.as_nanos().unsigned_abs());
    let (suspect, expected) = if size(a.1) <= size(b.1) { (a, b) } else { (b, a) };
    match suspect_unit(expected.1, suspect.1) {
        Some(unit) => Some(format!("the {} look like {unit}", suspect.0)),
        None => {
            let offset = own_start(b.1, a.1)?;
            let option = if a.0 == "poses" { " (--time-offset)" } else { "" };
            Some(format!(
                "the {} count from their own start, the {} from 1970: {} s added to the {}{option} would put both starts together",
                suspect.0,
                expected.0,
                offset.to_seconds_text(),
                a.0
            ))
        }
    }
}

/// Where one of two ranges counts from its own start and the other from 1970: what, added to `moved`, would put both
/// starts together. `None` where both have the same clock, or other ones.
pub fn own_start(fixed: (Stamp, Stamp), moved: (Stamp, Stamp)) -> Option<Span> {
    // From 1980 on, and less than a year and a half of running.
    let epoch = |range: (Stamp, Stamp)| range.0.as_nanos() >= 315_000_000_000_000_000;
    let own = |range: (Stamp, Stamp)| {
        range.0.as_nanos() >= -1_000_000_000 && range.1.as_nanos() < 50_000_000_000_000_000
    };
    ((epoch(fixed) && own(moved)) || (own(fixed) && epoch(moved))).then(|| fixed.0.since(moved.0))
}

/// The error of a file whose stamps have another unit than the expected range, with both ranges; `None` as for
/// [`suspect_unit`].
pub fn unit_mixup(expected: (Stamp, Stamp), suspect: (Stamp, Stamp)) -> Option<DataError> {
    let unit = suspect_unit(expected, suspect)?;
    Some(DataError::new(format!(
        "the stamps run from {} to {} ns, where {} to {} ns is expected: they look like {unit}",
        suspect.0, suspect.1, expected.0, expected.1
    )))
}

/// Ranges that overlap, or lie within a tenth of a percent of each other (days, at today's epoch).
fn near(a: (i128, i128), b: (i128, i128)) -> bool {
    let slack = a.1.abs().max(a.0.abs()) / 1000;
    a.0 - slack <= b.1 && b.0 <= a.1 + slack
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_suspected() {
        let range = |from, to| (Stamp::from_nanos(from), Stamp::from_nanos(to));
        let flight = range(1_403_715_273_262_142_976, 1_403_715_418_312_143_104);
        let said = |suspect| suspect_unit(flight, suspect);
        assert_eq!(said(flight), None);
        let error = unit_mixup(flight, range(1_403_715_273, 1_403_715_418)).unwrap().to_string();
        assert!(
            error.contains("1403715273 to 1403715418 ns, where 1403715273262142976 to 1403715418312143104"),
            "{error}"
        );
        let micros = said(range(1_403_715_273_262_142, 1_403_715_418_312_143));
        assert_eq!(micros.as_deref(), Some("microseconds read as nanoseconds"));
        let millis = said(range(1_403_715_273_262, 1_403_715_418_312));
        assert_eq!(millis.as_deref(), Some("milliseconds read as nanoseconds"));
        assert_eq!(said(range(1_403_715_273, 1_403_715_418)).as_deref(), Some("seconds read as nanoseconds"));
        let large = suspect_unit(range(1_403_715_273_000, 1_403_715_418_000), flight);
        assert_eq!(large.as_deref(), Some("nanoseconds read as milliseconds"));
        assert_eq!(said(range(5, 10)), None, "nothing explains that");
        assert!(suspect_unit(range(0, 60_000_000_000), range(0, 60)).is_none(), "they overlap as they are");
        // Seconds from zero on, a milliard times, reach from 1970 to beyond any flight.
        let own = range(0, 2_950_000_000);
        assert_eq!(suspect_unit(range(1_700_000_000_000_000_000, 1_700_000_002_950_000_000), own), None);
        let offset = own_start(flight, own).unwrap();
        assert_eq!(offset.as_nanos(), flight.0.as_nanos());
        assert_eq!(own_start(own, flight).unwrap().as_nanos(), -flight.0.as_nanos());
        assert_eq!((own_start(flight, flight), own_start(own, range(5, 10))), (None, None));
        let said = mixed_up(("poses", own), ("frames", flight)).unwrap();
        assert!(
            said.contains(
                "the poses count from their own start, the frames from 1970: 1403715273.262142976 s added"
            ),
            "{said}"
        );
        let said = mixed_up(("poses", flight), ("frames", own)).unwrap();
        assert!(
            said.contains("the frames count from their own start") && said.contains("-1403715273.262"),
            "{said}"
        );
        assert!(suspect_unit(range(i64::MIN, i64::MIN), range(i64::MAX, i64::MAX)).is_none());
    }
}
