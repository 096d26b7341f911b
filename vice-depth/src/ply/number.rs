//! Decimal numbers of a text file, fast.
//!
//! Up to 19 digits are gathered in an integer and scaled by one exact power of ten, which gives the nearest double
//! as long as the integer has at most 53 bits and the power is at most 22 (Clinger's fast path). Whatever does not
//! fit, `nan` and `inf` included, goes to the standard library.

const POWERS: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18,
    1e19, 1e20, 1e21, 1e22,
];

/// The number at the start of `text`, behind blanks, and what follows it; `None` where there is none before the end.
pub(crate) fn next_number(text: &[u8]) -> Option<(f64, &[u8])> {
    let begin = text.iter().position(|b| !is_blank(*b))?;
    let text = &text[begin..];
    if let Some((value, used)) = simple(text) {
        return Some((value, &text[used..]));
    }
    let end = text.iter().position(|b| is_blank(*b)).unwrap_or(text.len());
    let value = std::str::from_utf8(&text[..end]).ok()?.parse().ok()?;
    Some((value, &text[end..]))
}

/// What follows the next word; `None` where there is none before the end.
pub(crate) fn skip_word(text: &[u8]) -> Option<&[u8]> {
    let begin = text.iter().position(|b| !is_blank(*b))?;
    let text = &text[begin..];
    let end = text.iter().position(|b| is_blank(*b)).unwrap_or(text.len());
    Some(&text[end..])
}

pub(crate) const fn is_blank(byte: u8) -> bool {
    matches!(byte, b' ' | b'\t' | b'\r' | b'\n')
}

/// A number that the fast path can do, and how many bytes it takes.
fn simple(text: &[u8]) -> Option<(f64, usize)> {
    let at = |i: usize| text.get(i).copied().unwrap_or(b' ');
    let negative = at(0) == b'-';
    let mut i = usize::from(negative || at(0) == b'+');
    let (mut mantissa, mut digits, mut scale) = (0_u64, 0_u32, 0_i32);
    while at(i).is_ascii_digit() {
        mantissa = mantissa.wrapping_mul(10).wrapping_add(u64::from(at(i) - b'0'));
        (digits, i) = (digits + 1, i + 1);
    }
    if at(i) == b'.' {
        i += 1;
        while at(i).is_ascii_digit() {
            mantissa = mantissa.wrapping_mul(10).wrapping_add(u64::from(at(i) - b'0'));
            (digits, scale, i) = (digits + 1, scale - 1, i + 1);
        }
    }
    // Nineteen digits cannot wrap around 64 bits.
    if digits == 0 || digits > 19 {
        return None;
    }
    if matches!(at(i), b'e' | b'E') {
        let minus = at(i + 1) == b'-';
        i += 1 + usize::from(minus || at(i + 1) == b'+');
        let (mut exponent, first) = (0_i32, i);
        while at(i).is_ascii_digit() && i < first + 4 {
            exponent = exponent * 10 + i32::from(at(i) - b'0');
            i += 1;
        }
        if i == first {
            return None;
        }
        scale += if minus { -exponent } else { exponent };
    }
    if !is_blank(at(i)) || mantissa > 1 << 53 {
        return None;
    }
    let power = *POWERS.get(scale.unsigned_abs() as usize)?;
    let value = if scale < 0 { mantissa as f64 / power } else { mantissa as f64 * power };
    Some((if negative { -value } else { value }, i))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn words_that_are_no_plain_number() {
        assert_eq!(next_number(b" 1.5 x").unwrap(), (1.5, &b" x"[..]));
        assert_eq!(next_number(b"\t-.5\r\n").unwrap().0, -0.5);
        assert_eq!(next_number(b"5.").unwrap().0, 5.0);
        assert_eq!(next_number(b"+1E+3 ").unwrap().0, 1000.0);
        assert_eq!(next_number(b"-inf 2").unwrap().0, f64::NEG_INFINITY);
        assert!(next_number(b"nan").unwrap().0.is_nan());
        assert_eq!(next_number(b"1e400").unwrap().0, f64::INFINITY);
        assert_eq!(next_number(b"123456789012345678901234567890").unwrap().0, 1.2345678901234568e29);
        for none in [&b""[..], b"  ", b".", b"-", b"1,5", b"0x10", b"1e", b"1e+", b"1 2".get(1..2).unwrap()] {
            assert!(next_number(none).is_none(), "{none:?}");
        }
        assert_eq!(skip_word(b" red 7"), Some(&b" 7"[..]));
    }

    proptest! {
        #[test]
        fn the_same_double_as_the_standard_library(text in "[+-]?([0-9]{1,20}(\\.[0-9]{0,20})?|\\.[0-9]{1,20})([eE][+-]?[0-9]{1,3})?") {
            let expected: f64 = text.parse().unwrap();
            prop_assert_eq!(next_number(text.as_bytes()).unwrap().0, expected);
        }

        #[test]
        fn a_float_survives_its_text(value in any::<f32>()) {
            let got = next_number(value.to_string().as_bytes()).unwrap().0 as f32;
            prop_assert!(got == value || value.is_nan() && got.is_nan());
        }
    }
}
