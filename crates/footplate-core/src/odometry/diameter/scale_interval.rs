//! Guaranteed bounds of the scale of a wheelset.
//!
//! The scale is the true distance for a counted distance of 1. Bounds have no probabilities: the assumptions give a
//! set of possible scales, every measurement another, and the truth lies in all of them (set membership, Schweppe,
//! 1968). An empty intersection shows that an assumption is wrong; it is returned and not used.

use crate::units::Length;

/// Lowest and highest scale that are possible.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ScaleInterval {
    /// The scale is at least this ...
    pub low: f64,
    /// ... and at most this.
    pub high: f64,
}

impl ScaleInterval {
    /// The scales of a wheel whose diameter lies within this part of the assumed one.
    #[must_use]
    pub fn of_tolerance(tolerance: f64) -> Self {
        Self { low: 1.0 - tolerance, high: 1.0 + tolerance }
    }

    /// The scales that a true distance and a counted one within these bounds allow; `None` when nothing was
    /// counted for certain.
    #[must_use]
    pub fn of_distances(
        [true_low, true_high]: [Length; 2],
        [counted_low, counted_high]: [Length; 2],
    ) -> Option<Self> {
        let interval = Self { low: true_low / counted_high, high: true_high / counted_low };
        (counted_low > Length::ZERO && interval.low <= interval.high && interval.high.is_finite())
            .then_some(interval)
    }

    /// The intersection; `None` if it is empty.
    #[must_use]
    pub fn meet(self, other: Self) -> Option<Self> {
        let both = Self { low: self.low.max(other.low), high: self.high.min(other.high) };
        (both.low <= both.high).then_some(both)
    }

    /// The same after the scale may have changed by this part of itself, up or down.
    #[must_use]
    pub fn widened(self, part: f64) -> Self {
        Self { low: self.low * (1.0 - part), high: self.high * (1.0 + part) }
    }

    /// Whether a scale is possible.
    #[must_use]
    pub fn holds(self, scale: f64) -> bool {
        self.low <= scale && scale <= self.high
    }
}

/// A scale beyond the tolerance that pairs of balises, one after the other, agree on. One wrong balise makes two such pairs,
/// which disagree: its error makes one longer and the other shorter.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct AgreedBeyond {
    agreed: Option<ScaleInterval>,
    pairs: u32,
}

/// So many pairs in a row are no chance.
const PAIRS: u32 = 3;

impl AgreedBeyond {
    /// Takes in what the latest pair allows; `None` for one that agrees with the tolerance, or that says nothing.
    pub(super) fn take(&mut self, allowed: Option<ScaleInterval>) {
        let both = self.agreed.zip(allowed).and_then(|(agreed, allowed)| agreed.meet(allowed));
        self.pairs = both.map_or_else(|| u32::from(allowed.is_some()), |_| self.pairs.saturating_add(1));
        self.agreed = both.or(allowed);
    }

    /// The middle of the interval that enough pairs agree on.
    pub(super) fn scale(self) -> Option<f64> {
        self.agreed.filter(|_| self.pairs >= PAIRS).map(|agreed| 0.5 * (agreed.low + agreed.high))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_longer_distance_allows_a_smaller_range() {
        // A kilometre ±2 m counted as 990 m ±34 mm.
        let lengths = |middle, half| [middle - half, middle + half].map(Length::from_m);
        let interval = ScaleInterval::of_distances(lengths(1000.0, 2.0), lengths(990.0, 0.034)).unwrap();
        assert!((interval.low - 998.0 / 990.034).abs() < 1e-12);
        assert!((interval.high - 1002.0 / 989.966).abs() < 1e-12);
    }

    #[test]
    fn what_contradicts_is_handed_back() {
        let tolerance = ScaleInterval::of_tolerance(0.01);
        assert_eq!(tolerance.meet(ScaleInterval { low: 1.02, high: 1.03 }), None);
        assert_eq!(
            tolerance.meet(ScaleInterval { low: 1.005, high: 1.03 }),
            Some(ScaleInterval { low: 1.005, high: 1.01 })
        );
        assert_eq!(ScaleInterval::of_distances([Length::ZERO; 2], [Length::ZERO; 2]), None);
    }

    #[test]
    fn three_pairs_that_agree_beyond_the_tolerance_are_no_chance() {
        let around = |scale: f64| Some(ScaleInterval { low: scale - 0.004, high: scale + 0.004 });
        let mut beyond = AgreedBeyond::default();
        for (pair, scale) in [1.05, 1.051].into_iter().enumerate() {
            beyond.take(around(scale));
            assert_eq!(beyond.scale(), None, "after {pair}");
        }
        beyond.take(around(1.052));
        // 1.048 to 1.054 are left of all three.
        assert!((beyond.scale().unwrap() - 1.051).abs() < 1e-12);
        // A wrong balise: one pair too long, the next too short.
        let mut wrong = AgreedBeyond::default();
        for scale in [1.05, 0.95, 1.05] {
            wrong.take(around(scale));
        }
        assert_eq!(wrong.scale(), None);
        beyond.take(None);
        assert_eq!(beyond.scale(), None, "a pair that fits");
    }
}
