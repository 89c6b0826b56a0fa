//! Decimal numbers as exact integers: a time of nine decimals is read to the nanosecond, whatever stands
//! before the point.

/// `text` times ten to the power of `decimals`, to the nearest integer; halves go away from zero.
///
/// `None` for what is no finite number or does not fit. Numbers with an exponent pass through `f64`.
pub(crate) fn scaled(text: &str, decimals: u32) -> Option<i64> {
    if text.contains(['e', 'E']) {
        return scaled_float(text, decimals);
    }
    let (negative, digits) = match text.strip_prefix('-') {
        Some(digits) => (true, digits),
        None => (false, text.strip_prefix('+').unwrap_or(text)),
    };
    let (whole, fraction) = digits.split_once('.').unwrap_or((digits, ""));
    if whole.len() + fraction.len() == 0 {
        return None;
    }
    let mut number = whole.bytes().try_fold(0_i64, append_digit)?;
    let mut fraction = fraction.bytes();
    for _ in 0..decimals {
        number = append_digit(number, fraction.next().unwrap_or(b'0'))?;
    }
    let round_up = match fraction.next() {
        Some(digit @ b'0'..=b'9') => digit >= b'5',
        Some(_) => return None,
        None => false,
    };
    if !fraction.all(|digit| digit.is_ascii_digit()) {
        return None;
    }
    number = number.checked_add(i64::from(round_up))?;
    Some(if negative { -number } else { number })
}

fn append_digit(number: i64, digit: u8) -> Option<i64> {
    if !digit.is_ascii_digit() {
        return None;
    }
    number.checked_mul(10)?.checked_add(i64::from(digit - b'0'))
}

fn scaled_float(text: &str, decimals: u32) -> Option<i64> {
    let scaled = (text.parse::<f64>().ok()? * 10_u64.pow(decimals) as f64).round();
    // The next float below 2^63 is the largest that an i64 holds.
    (scaled.abs() < i64::MAX as f64).then_some(scaled as i64)
}

/// `number` divided by ten to the power of `decimals`, without the zeros that say nothing.
pub(crate) fn unscaled(number: i64, decimals: u32) -> String {
    let mut text = Vec::new();
    push_unscaled(&mut text, number, decimals);
    text.into_iter().map(char::from).collect()
}

/// Writes what [`unscaled`] returns, without memory of its own.
pub(crate) fn push_unscaled(text: &mut Vec<u8>, number: i64, decimals: u32) {
    /// As many as the largest `u64` has, which is more than any `i64` has with its leading zeros.
    const DIGITS: usize = 20;
    let mut digits = [b'0'; DIGITS];
    let mut rest = number.unsigned_abs();
    for digit in digits.iter_mut().rev() {
        *digit += (rest % 10) as u8;
        rest /= 10;
        if rest == 0 {
            break;
        }
    }
    let (whole, fraction) = digits.split_at(DIGITS - decimals as usize);
    if number < 0 {
        text.push(b'-');
    }
    let leading = whole.iter().take_while(|digit| **digit == b'0').count();
    text.extend(whole.get(leading.min(whole.len() - 1)..).unwrap_or_default());
    let kept = fraction.iter().rposition(|digit| *digit != b'0').map_or(0, |last| last + 1);
    if let Some(fraction) = fraction.get(..kept).filter(|fraction| !fraction.is_empty()) {
        text.push(b'.');
        text.extend(fraction);
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::{any, prop_assert_eq, proptest};

    use super::*;

    #[test]
    fn digits_are_kept_to_the_last() {
        assert_eq!(scaled("0.313821", 9), Some(313_821_000));
        assert_eq!(scaled("1583740245.914", 9), Some(1_583_740_245_914_000_000));
        assert_eq!(scaled("-.5", 3), Some(-500));
        assert_eq!(scaled("+7.", 0), Some(7));
        assert_eq!(scaled("1e-5", 9), Some(10_000));
    }

    #[test]
    fn what_is_left_over_rounds_to_the_nearest() {
        assert_eq!(scaled("0.0005", 3), Some(1));
        assert_eq!(scaled("0.00049", 3), Some(0));
        assert_eq!(scaled("-2.5", 0), Some(-3));
    }

    #[test]
    fn what_is_no_number_is_refused() {
        for text in
            ["", "-", ".", "NaN", "inf", "-inf", "1e999", "1,5", "1.2.3", "0x10", "1_000", "12.5s", "٣"]
        {
            assert_eq!(scaled(text, 9), None, "{text}");
        }
        assert_eq!(scaled("9223372036.854775807", 9), Some(i64::MAX));
        assert_eq!(scaled("9223372036.854775808", 9), None);
        assert_eq!(scaled("1e10", 9), None);
    }

    proptest! {
        #[test]
        fn written_numbers_read_back_as_themselves(number in -i64::MAX..=i64::MAX, decimals in 0_u32..=9) {
            prop_assert_eq!(scaled(&unscaled(number, decimals), decimals), Some(number));
        }

        #[test]
        fn no_text_panics(text in any::<String>(), decimals in 0_u32..=9) {
            let _ = scaled(&text, decimals);
        }
    }
}
