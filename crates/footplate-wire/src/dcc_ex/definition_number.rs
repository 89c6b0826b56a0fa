//! The numbers of the session's own definitions.
//!
//! `<a 15 1>` is what is left of `<a 153 1>` without a digit, and throws another turnout. The definition of the decoder output with the
//! linear address 153 has the number 11530: 1000 is added to the address, and a digit appended that makes the sum of all digits a
//! multiple of 10. A number that lost a digit, or has a wrong one, is no definition of the session's.

use footplate_core::TurnoutId;

/// Added to an address, so that all numbers have equally many digits.
const FIRST: u16 = 1_000;

/// The number of a turnout's definition.
pub(super) fn number_of(turnout: TurnoutId) -> u16 {
    let number = FIRST.saturating_add(turnout.0);
    number.saturating_mul(10).saturating_add((10 - sum_of_digits(number) % 10) % 10)
}

/// The turnout of a definition's number.
pub(super) fn turnout_of(id: u16) -> Option<TurnoutId> {
    let turnout = TurnoutId((id / 10).checked_sub(FIRST)?);
    (number_of(turnout) == id).then_some(turnout)
}

fn sum_of_digits(mut number: u16) -> u16 {
    let mut sum = 0;
    while number > 0 {
        sum += number % 10;
        number /= 10;
    }
    sum
}

#[cfg(test)]
mod tests {
    use alloc::string::ToString;

    use super::super::settings::TurnoutRequests;
    use super::*;

    #[test]
    fn a_number_that_lost_a_digit_or_has_a_wrong_one_is_no_definition() {
        // 1 + 1 + 5 + 3 + 0 = 10.
        assert_eq!(number_of(TurnoutId(153)), 11_530);
        for address in TurnoutRequests::Confirmed.numbers() {
            let id = number_of(TurnoutId(address));
            assert_eq!(turnout_of(id), Some(TurnoutId(address)));
            let text = id.to_string();
            assert_eq!(text.len(), 5, "{id}");
            for at in 0..text.len() {
                let mut short = text.clone();
                short.remove(at);
                assert_eq!(short.parse().ok().and_then(turnout_of), None, "{id} as {short}");
                for digit in ('0'..='9').filter(|digit| !text[at..].starts_with(*digit)) {
                    let mut wrong = short.clone();
                    wrong.insert(at, digit);
                    assert_eq!(wrong.parse().ok().and_then(turnout_of), None, "{id} as {wrong}");
                }
            }
        }
    }
}
