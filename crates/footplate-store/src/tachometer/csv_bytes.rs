//! The fields that nearly every row consists of, read from bytes in one pass.
//!
//! Each function begins at the first byte of a field and says where the field ends. What it does not know at a
//! glance (quotes, spaces, `nan`, a wrong letter) is `None`: the line is then read again, slowly and with an error
//! that says what is wrong with it. Whatever both read, they read to the same bits.

use super::block::MISSING;
use super::run_names::RunNames;
use footplate_core::odometry::wheels::Direction;

const DECIMALS_OF_NS: usize = 9;
const POWERS_OF_TEN: [u64; DECIMALS_OF_NS + 1] =
    [1, 10, 100, 1_000, 10_000, 100_000, 1_000_000, 10_000_000, 100_000_000, 1_000_000_000];
/// Powers of ten that a double holds exactly.
const EXACT_POWERS: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18,
    1e19, 1e20, 1e21, 1e22,
];
/// Whole numbers up to here are exact as doubles.
const LARGEST_EXACT: u64 = 1 << 53;
/// Digits whose number fits an `i64` whatever they are.
const SAFE_DIGITS: usize = 18;

/// The number of the digits from `at` on, and where they end. Too many of them wrap.
#[inline]
fn digits(text: &[u8], mut at: usize) -> (u64, usize) {
    let mut number = 0_u64;
    while let Some(digit) = text.get(at).map(|byte| byte.wrapping_sub(b'0')).filter(|digit| *digit < 10) {
        number = number.wrapping_mul(10).wrapping_add(u64::from(digit));
        at += 1;
    }
    (number, at)
}

#[inline]
fn ends_field(byte: u8) -> bool {
    matches!(byte, b',' | b'\n' | b'\r')
}

#[inline]
fn is_empty(text: &[u8], at: usize) -> bool {
    text.get(at).copied().is_some_and(ends_field)
}

/// Seconds with at most nine decimals, exact in nanoseconds.
#[inline]
pub(super) fn time_ns(text: &[u8], at: usize) -> Option<(i64, usize)> {
    let (whole, end) = digits(text, at);
    // Ten digits of seconds and nine of nanoseconds fit an unsigned number, not always a signed one.
    if !(1..=10).contains(&(end - at)) {
        return None;
    }
    let mut ns = whole * POWERS_OF_TEN[DECIMALS_OF_NS];
    let mut next = end;
    if text.get(end) == Some(&b'.') {
        let (fraction, fraction_end) = digits(text, end + 1);
        let unit = POWERS_OF_TEN.get(DECIMALS_OF_NS.checked_sub(fraction_end - end - 1)?)?;
        ns += fraction * unit;
        next = fraction_end;
    }
    Some((i64::try_from(ns).ok()?, next))
}

/// As [`time_ns`], or [`MISSING`] if nothing stands there.
#[inline]
pub(super) fn time_or_nothing(text: &[u8], at: usize) -> Option<(i64, usize)> {
    if is_empty(text, at) { Some((MISSING, at)) } else { time_ns(text, at) }
}

/// A whole number, also as `12.0`, or [`MISSING`] if nothing stands there.
#[inline]
pub(super) fn count(text: &[u8], at: usize) -> Option<(i64, usize)> {
    let negative = text.get(at) == Some(&b'-');
    let begin = at + usize::from(negative);
    let (number, mut end) = digits(text, begin);
    if end == begin {
        return (!negative && is_empty(text, at)).then_some((MISSING, at));
    }
    if end - begin > SAFE_DIGITS {
        return None;
    }
    if text.get(end) == Some(&b'.') {
        end += 1;
        while text.get(end) == Some(&b'0') {
            end += 1;
        }
    }
    let number = number as i64;
    Some((if negative { -number } else { number }, end))
}

/// A finite number, or NaN if nothing stands there.
#[inline]
pub(super) fn number(text: &[u8], at: usize) -> Option<(f64, usize)> {
    if is_empty(text, at) {
        return Some((f64::NAN, at));
    }
    let negative = text.get(at) == Some(&b'-');
    let begin = at + usize::from(negative);
    let (mut mantissa, mut end) = digits(text, begin);
    let mut written = end - begin;
    let mut decimals = 0;
    if text.get(end) == Some(&b'.') {
        let before = end + 1;
        let (fraction, fraction_end) = digits(text, before);
        decimals = fraction_end - before;
        written += decimals;
        end = fraction_end;
        if let Some(unit) = POWERS_OF_TEN.get(decimals) {
            mantissa = mantissa.wrapping_mul(*unit).wrapping_add(fraction);
        } else {
            written = usize::MAX;
        }
    }
    // Both are exact, so their quotient is the nearest number to what is written.
    if (1..=SAFE_DIGITS).contains(&written) && mantissa <= LARGEST_EXACT && is_empty(text, end) {
        let size = mantissa as f64 / EXACT_POWERS[decimals];
        return Some((if negative { -size } else { size }, end));
    }
    let length = text.get(at..)?.iter().position(|byte| ends_field(*byte))?;
    let written = std::str::from_utf8(text.get(at..at + length)?).ok()?;
    written.parse().ok().filter(|value: &f64| value.is_finite()).map(|value| (value, at + length))
}

/// −1 backward, 0 or nothing unknown, 1 forward.
#[inline]
pub(super) fn direction(text: &[u8], at: usize) -> Option<(Direction, usize)> {
    match text.get(at)? {
        b'1' => Some((Direction::Forward, at + 1)),
        b'0' => Some((Direction::Unknown, at + 1)),
        b'-' if text.get(at + 1) == Some(&b'1') => Some((Direction::Backward, at + 2)),
        byte if ends_field(*byte) => Some((Direction::Unknown, at)),
        _ => None,
    }
}

/// The number of a run that was named before.
#[inline]
pub(super) fn run(text: &[u8], at: usize, runs: &mut RunNames) -> Option<(u32, usize)> {
    let end = skip(text, at)?;
    runs.known(text.get(at..end)?).map(|run| (run, end))
}

/// Passes over a field that is not used.
#[inline]
pub(super) fn skip(text: &[u8], at: usize) -> Option<usize> {
    let rest = text.get(at..)?;
    let length = rest.iter().position(|byte| ends_field(*byte) || *byte == b'"')?;
    (rest.get(length) != Some(&b'"')).then_some(at + length)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::{any, prop_assert_eq, proptest};

    use super::*;
    use crate::decimal::scaled;

    #[test]
    fn times_are_exact_to_the_nanosecond() {
        assert_eq!(time_ns(b"0.05,", 0), Some((50_000_000, 4)));
        assert_eq!(time_ns(b"1583740245.914000001\n", 0), Some((1_583_740_245_914_000_001, 20)));
        assert_eq!(time_ns(b"7\n", 0), Some((7_000_000_000, 1)));
        assert_eq!(time_ns(b"9999999999,", 0), None, "beyond 2262");
        for unusual in [&b",1"[..], b"-1,", b"0.0000000001,", b" 1,", b"nan,", b".5,", b"12345678901,"] {
            assert_eq!(time_ns(unusual, 0), None, "{unusual:?}");
        }
    }

    #[test]
    fn counts_may_look_like_numbers_with_a_point() {
        assert_eq!(count(b"17,", 0), Some((17, 2)));
        assert_eq!(count(b"-3\n", 0), Some((-3, 2)));
        assert_eq!(count(b"12.00\r\n", 0), Some((12, 5)));
        assert_eq!(count(b",", 0), Some((MISSING, 0)));
        assert_eq!(count(b"12.5,", 0).map(|(_, end)| end), Some(3), "the 5 is where a comma should be");
        for unusual in [&b"-,"[..], b"nan,", b"\"1\",", b"1234567890123456789,"] {
            assert_eq!(count(unusual, 0).filter(|(_, end)| is_empty(unusual, *end)), None, "{unusual:?}");
        }
    }

    #[test]
    fn directions_are_signs() {
        let read = |text: &[u8]| direction(text, 0).map(|(direction, _)| direction);
        assert_eq!(read(b"1,"), Some(Direction::Forward));
        assert_eq!(read(b"-1,"), Some(Direction::Backward));
        assert_eq!([read(b"0,"), read(b",")], [Some(Direction::Unknown); 2]);
        assert_eq!([read(b"-2,"), read(b"f,"), read(b"")], [None; 3]);
    }

    proptest! {
        #[test]
        fn numbers_are_those_of_the_standard_library(value in any::<f64>(), decimals in 0_usize..25) {
            for text in [format!("{value}"), format!("{value:e}"), format!("{:.decimals$}", value % 1e6)] {
                let expected: f64 = text.parse().unwrap();
                let line = format!("{text},");
                let read = number(line.as_bytes(), 0).map(|(value, end)| (value.to_bits(), end));
                let fits = expected.is_finite().then_some((expected.to_bits(), text.len()));
                prop_assert_eq!(read, fits, "{}", text);
            }
        }

        #[test]
        fn times_are_those_of_the_slow_reader(ns in 0..=i64::MAX, decimals in 0_usize..=9) {
            let text = format!("{}.{:09}", ns / 1_000_000_000, ns % 1_000_000_000);
            let text = text[..text.len() - 9 + decimals].trim_end_matches('.').to_owned();
            let line = format!("{text}\n");
            prop_assert_eq!(time_ns(line.as_bytes(), 0).map(|(ns, _)| ns), scaled(&text, 9), "{}", text);
        }

        #[test]
        fn no_bytes_lead_beyond_their_end(bytes in any::<Vec<u8>>(), at in 0_usize..40) {
            let ends = [
                time_or_nothing(&bytes, at).map(|(_, end)| end),
                count(&bytes, at).map(|(_, end)| end),
                number(&bytes, at).map(|(_, end)| end),
                direction(&bytes, at).map(|(_, end)| end),
                skip(&bytes, at),
            ];
            for end in ends.into_iter().flatten() {
                prop_assert_eq!((at..=bytes.len()).contains(&end), true);
            }
        }
    }
}
