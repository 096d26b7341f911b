//! Stamps in the wrong unit.

use vice_core::time::Stamp;

/// What stamps may have been written in, and how many nanoseconds one of it is.
const UNITS: [(&str, i128); 4] =
    [("seconds", 1_000_000_000), ("milliseconds", 1_000_000), ("microseconds", 1_000), ("nanoseconds", 1)];

/// Whether a time range that does not overlap with another one would do so in another unit.
///
/// Both are first and last stamps as they were read. The sentence names both ranges and the unit suspected; `None`
/// where the ranges overlap as they are, or no unit explains the difference.
pub fn suspect_unit(expected: (Stamp, Stamp), suspect: (Stamp, Stamp)) -> Option<String> {
    let nanos = |range: (Stamp, Stamp)| (i128::from(range.0.as_nanos()), i128::from(range.1.as_nanos()));
    let (expected_ns, suspect_ns) = (nanos(expected), nanos(suspect));
    if near(expected_ns, suspect_ns) {
        return None;
    }
    let both =
        format!("{} to {} ns, where {} to {} ns is expected", suspect.0, suspect.1, expected.0, expected.1);
    // Too small: a coarser unit was read as nanoseconds. Too large: a finer one was read as a coarser one.
    for (unit, factor) in &UNITS[..3] {
        if near(expected_ns, (suspect_ns.0 * factor, suspect_ns.1 * factor)) {
            return Some(format!("the stamps run from {both}: they look like {unit} read as nanoseconds"));
        }
    }
    for (read_as, factor) in &UNITS[..3] {
        if near(expected_ns, (suspect_ns.0 / factor, suspect_ns.1 / factor)) {
            return Some(format!("the stamps run from {both}: they look like nanoseconds read as {read_as}"));
        }
    }
    None
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
    fn units_are_suspected_and_ranges_shown() {
        let range = |from, to| (Stamp::from_nanos(from), Stamp::from_nanos(to));
        let flight = range(1_403_715_273_262_142_976, 1_403_715_418_312_143_104);
        assert_eq!(suspect_unit(flight, flight), None);
        let micros = suspect_unit(flight, range(1_403_715_273_262_142, 1_403_715_418_312_143)).unwrap();
        assert!(micros.contains("microseconds") && micros.contains("1403715273262142 to 1403715418312143"));
        assert!(micros.contains("1403715273262142976 to 1403715418312143104"), "{micros}");
        assert!(suspect_unit(flight, range(1_403_715_273_262, 1_403_715_418_312)).unwrap().contains("milli"));
        assert!(suspect_unit(flight, range(1_403_715_273, 1_403_715_418)).unwrap().contains("like seconds"));
        let large = suspect_unit(range(1_403_715_273_000, 1_403_715_418_000), flight).unwrap();
        assert!(large.contains("nanoseconds read as milliseconds"), "{large}");
        assert_eq!(suspect_unit(flight, range(5, 10)), None, "nothing explains that");
        assert!(suspect_unit(range(0, 60_000_000_000), range(0, 60)).is_none(), "they overlap as they are");
        assert!(suspect_unit(range(i64::MIN, i64::MIN), range(i64::MAX, i64::MAX)).is_none());
    }
}
