//! The decisions of a machine, and their form in the store.

use std::fmt::Debug;

use footplate_core::control::Output;
use footplate_store::ContentHash;

/// A notice longer than this (bytes) is kept as its beginning and a hash: the tables of a calibration would be ten times all
/// the rest, and the hash shows a difference all the same.
const LONGEST_NOTICE: usize = 600;
/// Length of that beginning, in bytes.
const BEGINNING: usize = 160;

/// A decision of a machine. Two decisions are equal if their rows are.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Decision {
    pub(crate) kind: &'static str,
    pub(crate) text: String,
}

impl Decision {
    pub(crate) const COMMAND: &'static str = "command";
    pub(crate) const HOLD_LINE: &'static str = "hold-line";
    pub(crate) const WATCH: &'static str = "watch";
    pub(crate) const NOTICE: &'static str = "notice";

    /// Returns the row of an output. Numbers have all their digits, so that the last bit counts.
    pub(crate) fn of<Notice: Debug>(output: &Output<Notice>) -> Self {
        let (kind, text) = match output {
            Output::Command(command) => (Self::COMMAND, command.to_string()),
            Output::HoldLine(Some(until)) => (Self::HOLD_LINE, format!("until {} ns", until.as_ns())),
            Output::HoldLine(None) => (Self::HOLD_LINE, "no longer".to_owned()),
            Output::Watch(Some(sensor)) => (Self::WATCH, format!("sensor {sensor}")),
            Output::Watch(None) => (Self::WATCH, "all alike".to_owned()),
            Output::Notice(notice) => (Self::NOTICE, shortened(format!("{notice:?}"))),
        };
        Self { kind, text }
    }
}

fn shortened(text: String) -> String {
    if text.len() <= LONGEST_NOTICE {
        return text;
    }
    let end = (0..=BEGINNING).rev().find(|end| text.is_char_boundary(*end)).unwrap_or(0);
    let beginning = text.get(..end).unwrap_or_default();
    format!("{beginning} … {} bytes, sha256 {}", text.len(), ContentHash::of(text.as_bytes()))
}

#[cfg(test)]
mod tests {
    use footplate_core::Timestamp;

    use super::*;

    #[test]
    fn the_last_bit_of_a_number_makes_another_decision() {
        let notice = |number: f64| Decision::of(&Output::Notice(number));
        assert_eq!(notice(0.3), notice(0.3));
        assert_ne!(notice(0.3), notice(0.1 + 0.2));
        let long = |last: f64| {
            let mut numbers = vec![1.0_f64; 1_000];
            numbers.push(last);
            Decision::of(&Output::Notice(numbers))
        };
        assert_eq!(long(0.3), long(0.3));
        assert_ne!(long(0.3), long(0.1 + 0.2));
        assert!(long(0.3).text.len() < LONGEST_NOTICE);
        let hold = |ns| Decision::of(&Output::<()>::HoldLine(Some(Timestamp::from_ns(ns))));
        assert_ne!(hold(1_000_000_000), hold(1_000_000_001));
    }
}
