//! The way travelled and by how much at most it was read too long or too short: three sums that never decrease.
//!
//! An ETCS on-board unit subtracts two readings of such sums to know the confidence interval of any distance between
//! them (SUBSET-026-3, 3.6.4). Over- and under-reading are kept apart, and running forward and backward both add
//! (3.6.8.1.1): an error that running back would undo cannot be told from one that it would double.

use crate::units::Length;

/// Never-decreasing sums since the start.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ReadingAmounts {
    /// The way travelled as estimated, forward and backward added up.
    pub travelled: Length,
    /// By how much at most it can be longer than the true way.
    pub over: Length,
    /// By how much at most it can be shorter than the true way.
    pub under: Length,
}

impl ReadingAmounts {
    /// Adds what happened in one period: the estimated way, which is negative backwards, and the lowest and highest
    /// that the true way can have been.
    ///
    /// An interval that does not hold the estimate adds to the side on which it lies and nothing to the other. What is
    /// no number adds nothing.
    pub fn add(&mut self, way: Length, low: Length, high: Length) {
        let too_far_forward = (way - low).max(Length::ZERO);
        let too_far_backward = (high - way).max(Length::ZERO);
        let (over, under) = if way < Length::ZERO {
            (too_far_backward, too_far_forward)
        } else {
            (too_far_forward, too_far_backward)
        };
        self.travelled += way.abs().max(Length::ZERO);
        self.over += over;
        self.under += under;
    }

    /// What was added since an earlier reading of the same sums.
    #[must_use]
    pub fn since(&self, earlier: &Self) -> Self {
        Self {
            travelled: self.travelled - earlier.travelled,
            over: self.over - earlier.over,
            under: self.under - earlier.under,
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn added(way: f64, low: f64, high: f64) -> ReadingAmounts {
        let mut amounts = ReadingAmounts::default();
        amounts.add(Length::from_m(way), Length::from_m(low), Length::from_m(high));
        amounts
    }

    fn amounts(travelled: f64, over: f64, under: f64) -> ReadingAmounts {
        ReadingAmounts {
            travelled: Length::from_m(travelled),
            over: Length::from_m(over),
            under: Length::from_m(under),
        }
    }

    #[test]
    fn backward_is_the_mirror_image_of_forward() {
        // Read 4 m, went 3 to 6 m: 1 m too long at most, or 2 m too short.
        assert_eq!(added(4.0, 3.0, 6.0), amounts(4.0, 1.0, 2.0));
        assert_eq!(added(-4.0, -6.0, -3.0), amounts(4.0, 1.0, 2.0));
    }

    #[test]
    fn a_locked_wheel_under_reads_without_travelling() {
        assert_eq!(added(0.0, 0.0, 0.7), amounts(0.0, 0.0, 0.7));
    }

    #[test]
    fn an_estimate_outside_its_interval_adds_to_one_side_only() {
        assert_eq!(added(1.0, 2.0, 3.0), amounts(1.0, 0.0, 2.0));
        assert_eq!(added(4.0, 2.0, 3.0), amounts(4.0, 2.0, 0.0));
    }

    #[test]
    fn what_is_no_number_adds_nothing() {
        assert_eq!(added(f64::NAN, f64::NAN, f64::NAN), ReadingAmounts::default());
    }

    proptest! {
        /// The sums bound the error of the way travelled, to and fro: neither can pass its amount.
        #[test]
        fn the_error_never_passes_the_amounts(
            periods in prop::collection::vec((-5.0..5.0_f64, 0.0..1.0_f64, 0.0..1.0_f64, 0.0..=1.0_f64), 1..200),
        ) {
            let mut amounts = ReadingAmounts::default();
            let mut truly = 0.0;
            for (way, below, above, place) in periods {
                // A train that runs one way within a period runs that way by the whole interval.
                let low = if way < 0.0 { way - below } else { (way - below).max(0.0) };
                let high = if way < 0.0 { (way + above).min(0.0) } else { way + above };
                truly += (low + (high - low) * place).abs();
                let before = amounts;
                amounts.add(Length::from_m(way), Length::from_m(low), Length::from_m(high));
                let added = amounts.since(&before);
                prop_assert!(added.over.as_m() >= 0.0 && added.under.as_m() >= 0.0);
            }
            prop_assert!(truly >= (amounts.travelled - amounts.over).as_m() - 1e-9);
            prop_assert!(truly <= (amounts.travelled + amounts.under).as_m() + 1e-9);
        }
    }
}
