//! "The future is no longer like the past": a test on the errors of forecasts.
//!
//! Two cumulative sums (Page, 1954) over standardised errors `z`: `S⁺ ← max(0, S⁺ + z − k)` and the mirror
//! image; an alarm when either passes `h`. A single wild error is held at a bound first: it is for the gate
//! to judge, not a drift.

/// Half the lasting shift, in standard deviations, that should be found soonest: 1 σ.
const HALF_SHIFT: f64 = 0.5;
/// With k = 0.5 and h = 8 a train without drift alarms once in about 9 500 hits (Siegmund's approximation,
/// both sides), a shift of 1 σ after 17.
const ALARM_AT: f64 = 8.0;
/// One error counts for at most this many standard deviations.
const HELD_AT: f64 = 3.0;

/// A side to which forecasts go wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "lowercase"))]
pub enum Drift {
    /// Hits come later than forecast: the train has become slower.
    Slower,
    /// Hits come earlier than forecast: the train has become faster.
    Faster,
}

/// The two sums.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct DriftTest {
    late: f64,
    early: f64,
}

impl DriftTest {
    /// Takes in one error in standard deviations, positive when late, and says whether it is a drift now.
    /// After an alarm the sums begin anew.
    pub fn take(&mut self, standardised: f64) -> Option<Drift> {
        if standardised.is_nan() {
            return None;
        }
        let z = standardised.clamp(-HELD_AT, HELD_AT);
        self.late = (self.late + z - HALF_SHIFT).max(0.0);
        self.early = (self.early - z - HALF_SHIFT).max(0.0);
        let drift = if self.late > ALARM_AT {
            Some(Drift::Slower)
        } else if self.early > ALARM_AT {
            Some(Drift::Faster)
        } else {
            None
        };
        if drift.is_some() {
            *self = Self::default();
        }
        drift
    }

    /// How far the larger sum is towards an alarm, 0 to 1.
    pub fn level(&self) -> f64 {
        self.late.max(self.early) / ALARM_AT
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lasting_shift_is_found_and_named() {
        let mut test = DriftTest::default();
        let found = (1..100).find_map(|n| test.take(1.2).map(|drift| (n, drift)));
        // 8 / (1.2 − 0.5) = 11.4 hits.
        assert_eq!(found, Some((12, Drift::Slower)));
        assert_eq!((0..40).find_map(|_| test.take(-1.5)), Some(Drift::Faster));
    }

    #[test]
    fn its_level_is_the_part_of_an_alarm_that_has_come_together_on_either_side() {
        for sign in [1.0, -1.0] {
            let mut test = DriftTest::default();
            assert_eq!(test.level(), 0.0);
            // 1.2 − 0.5 of 8 for each.
            for n in 1..=11 {
                assert_eq!(test.take(sign * 1.2), None);
                assert!((test.level() - 0.7 * f64::from(n) / 8.0).abs() < 1e-9, "{}", test.level());
            }
        }
    }

    #[test]
    fn one_wild_error_and_balanced_scatter_are_no_drift() {
        let mut test = DriftTest::default();
        assert_eq!(test.take(1e9), None);
        assert_eq!(test.take(f64::NAN), None);
        assert!((0..10_000).all(|n| test.take(if n % 2 == 0 { 1.0 } else { -1.0 }).is_none()));
    }
}
