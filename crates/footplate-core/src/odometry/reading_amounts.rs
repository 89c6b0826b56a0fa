//! Distance travelled, over-reading and under-reading: three sums that never decrease.
//!
//! An ETCS on-board unit subtracts two readings of such sums to know the confidence interval of any distance between
//! them (SUBSET-026-3, 3.6.4). Over- and under-reading are separate sums, and both directions of travel add to them
//! (3.6.8.1.1): an error that reversing cancels cannot be distinguished from one that it doubles.

use crate::units::Length;

/// Never-decreasing sums since the start.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ReadingAmounts {
    /// Estimated distance travelled, forward plus backward.
    pub travelled: Length,
    /// Over-reading: the largest amount by which it can exceed the true distance.
    pub over: Length,
    /// Under-reading: the largest amount by which it can fall short of the true distance.
    pub under: Length,
}

impl ReadingAmounts {
    /// Adds a period: its estimated distance (negative backwards) and the bounds of the true one.
    ///
    /// If the estimate lies outside the bounds, only one side grows. NaN adds nothing.
    pub fn add(&mut self, distance: Length, low: Length, high: Length) {
        let too_far_forward = (distance - low).max(Length::ZERO);
        let too_far_backward = (high - distance).max(Length::ZERO);
        let (over, under) = if distance < Length::ZERO {
            (too_far_backward, too_far_forward)
        } else {
            (too_far_forward, too_far_backward)
        };
        self.travelled += distance.abs().max(Length::ZERO);
        self.over += over;
        self.under += under;
    }

    /// Returns the amounts since an earlier reading.
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

    fn added(distance: f64, low: f64, high: f64) -> ReadingAmounts {
        let mut amounts = ReadingAmounts::default();
        amounts.add(Length::from_m(distance), Length::from_m(low), Length::from_m(high));
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
    fn nan_adds_nothing() {
        assert_eq!(added(f64::NAN, f64::NAN, f64::NAN), ReadingAmounts::default());
    }

    proptest! {
        /// The sums bound the error of the distance travelled, forward and backward.
        #[test]
        fn the_error_never_passes_the_amounts(
            periods in prop::collection::vec((-5.0..5.0_f64, 0.0..1.0_f64, 0.0..1.0_f64, 0.0..=1.0_f64), 1..200),
        ) {
            let mut amounts = ReadingAmounts::default();
            let mut truly = 0.0;
            for (distance, below, above, place) in periods {
                // Within a period a train runs in one direction: the whole interval has its sign.
                let low = if distance < 0.0 { distance - below } else { (distance - below).max(0.0) };
                let high = if distance < 0.0 { (distance + above).min(0.0) } else { distance + above };
                truly += (low + (high - low) * place).abs();
                let before = amounts;
                amounts.add(Length::from_m(distance), Length::from_m(low), Length::from_m(high));
                let added = amounts.since(&before);
                prop_assert!(added.over.as_m() >= 0.0 && added.under.as_m() >= 0.0);
            }
            prop_assert!(truly >= (amounts.travelled - amounts.over).as_m() - 1e-9);
            prop_assert!(truly <= (amounts.travelled + amounts.under).as_m() + 1e-9);
        }
    }
}
