//! Checks the position of each balise against the distance interval, and corrects the distance by it.
//!
//! A balise has a known position within a stated bound, and the train is within its distance interval. If the two overlap,
//! the train is in the overlap. Otherwise the balise is unexpected and changes nothing. Two consecutive unexpected balises
//! that agree with each other show that the odometer was wrong, and are accepted.
//!
//! Linking (SUBSET-026-3, 3.4.4) announces the position of the next balise, so that a missing balise is detected, too. It is
//! expected within a window, and missed once the whole distance interval lies beyond that.

use super::diameter::BaliseAccuracy;
use crate::units::Length;

/// Squared width of a uniform distribution over its variance.
const EVEN: f64 = 12.0;

/// A distance and its bounds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DistanceInterval {
    /// The best estimate.
    pub estimate: Length,
    /// The distance is at least this ...
    pub low: Length,
    /// ... and at most this.
    pub high: Length,
}

/// The result of checking a balise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum BaliseVerdict {
    /// Its position is possible. This is the corrected distance.
    Accepted(DistanceInterval),
    /// Its position is impossible. The distance is unchanged.
    Unexpected {
        /// Its stated position.
        place: Length,
        /// The least position by the odometer ...
        low: Length,
        /// ... and the largest.
        high: Length,
    },
    /// Its position is impossible, but agrees with the unexpected balise before it: the bounds were wrong. This is the
    /// corrected distance.
    Contradicts(DistanceInterval),
}

/// Compares balises with the odometer. Positions are measured from where the distance is 0.
#[derive(Debug, Clone)]
pub struct BaliseLink {
    accuracy: BaliseAccuracy,
    /// The latest unexpected balise since the last accepted one, and the bounds when the train passed it.
    unexpected: Option<(Length, DistanceInterval)>,
}

impl BaliseLink {
    /// For balises of this accuracy.
    #[must_use]
    pub fn new(accuracy: BaliseAccuracy) -> Self {
        Self { accuracy, unexpected: None }
    }

    /// Checks a balise that the train passed within the last period, and returns the distance at the end of that period. The
    /// train ran no further than `ran` in it.
    pub fn pass(&mut self, place: Length, ran: Length, now: &DistanceInterval) -> BaliseVerdict {
        let bound = self.accuracy.bound;
        // Forward or backward, it lies somewhere within the distance run in the period.
        let [least, most] = [place - bound + ran.min(Length::ZERO), place + bound + ran.max(Length::ZERO)];
        let (low, high) = (now.low.max(least), now.high.min(most));
        if place.is_finite() && ran.is_finite() && low <= high {
            self.unexpected = None;
            let middle = place + ran * 0.5;
            return BaliseVerdict::Accepted(self.between(middle, ran, now, [low, high]));
        }
        match self.unexpected {
            Some((before, then)) if agree(place - before, bound + ran.abs(), &then, now) => {
                self.unexpected = None;
                BaliseVerdict::Contradicts(DistanceInterval {
                    estimate: place + ran * 0.5,
                    low: least,
                    high: most,
                })
            }
            _ => {
                self.unexpected = Some((place, *now));
                let (low, high) = (now.low - (most - place), now.high + (place - least));
                BaliseVerdict::Unexpected { place, low, high }
            }
        }
    }

    /// Combines the position with the estimate, whose error is taken as uniform within its bounds.
    fn between(
        &self,
        place: Length,
        ran: Length,
        now: &DistanceInterval,
        [low, high]: [Length; 2],
    ) -> DistanceInterval {
        let square = |length: Length| length.as_m() * length.as_m();
        let odometer = square(now.high - now.low) / EVEN;
        let balise = square(self.accuracy.deviation) + square(ran) / EVEN;
        let both = odometer + balise;
        let gain = if both > 0.0 { odometer / both } else { 0.0 };
        let estimate = (now.estimate + (place - now.estimate) * gain).max(low).min(high);
        DistanceInterval { estimate, low, high }
    }
}

/// Whether the train can have run the distance between two balises.
fn agree(distance: Length, bound: Length, then: &DistanceInterval, now: &DistanceInterval) -> bool {
    let [least, most] = [now.low - then.low, now.high - then.high];
    distance >= least - 2.0 * bound && distance <= most + 2.0 * bound
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn interval(estimate: f64, low: f64, high: f64) -> DistanceInterval {
        let [estimate, low, high] = [estimate, low, high].map(Length::from_m);
        DistanceInterval { estimate, low, high }
    }

    fn link() -> BaliseLink {
        BaliseLink::new(BaliseAccuracy { deviation: Length::from_m(0.5), bound: Length::from_m(2.0) })
    }

    #[test]
    fn a_balise_narrows_the_bounds_to_what_both_allow() {
        let verdict = link().pass(Length::from_m(1512.0), Length::ZERO, &interval(1500.0, 1485.0, 1513.0));
        let BaliseVerdict::Accepted(now) = verdict else { panic!("{verdict:?}") };
        assert_eq!((now.low.as_m(), now.high.as_m()), (1510.0, 1513.0));
        // Uniform over 28 m is a deviation of 8.1 m, 16 times that of the balise: 12 m shrink to 5 cm.
        assert!((now.estimate.as_m() - 1511.95).abs() < 0.01, "{now:?}");
    }

    #[test]
    fn an_odometer_that_knows_better_keeps_its_estimate() {
        let verdict = link().pass(Length::from_m(100.4), Length::ZERO, &interval(100.0, 99.9, 100.1));
        assert!(
            matches!(verdict, BaliseVerdict::Accepted(now) if now.estimate.as_m() < 100.01),
            "{verdict:?}"
        );
    }

    #[test]
    fn an_impossible_balise_is_refused_with_its_numbers() {
        for place in [700.0, 1483.0 - 0.1, 1515.0 + 0.1] {
            let verdict = link().pass(Length::from_m(place), Length::ZERO, &interval(1500.0, 1485.0, 1513.0));
            let [place, low, high] = [place, 1483.0, 1515.0].map(Length::from_m);
            assert_eq!(verdict, BaliseVerdict::Unexpected { place, low, high });
        }
        let nothing = link().pass(Length::from_m(f64::NAN), Length::ZERO, &interval(1500.0, 1485.0, 1513.0));
        assert!(matches!(nothing, BaliseVerdict::Unexpected { .. }));
    }

    #[test]
    fn two_impossible_balises_that_agree_are_accepted() {
        let mut link = link();
        let then = interval(1500.0, 1485.0, 1515.0);
        let now = interval(2500.0, 2475.0, 2525.0);
        link.pass(Length::from_m(1800.0), Length::ZERO, &then);
        let verdict = link.pass(Length::from_m(2803.0), Length::ZERO, &now);
        assert_eq!(verdict, BaliseVerdict::Contradicts(interval(2803.0, 2801.0, 2805.0)));

        link.pass(Length::from_m(1800.0), Length::ZERO, &then);
        let apart = link.pass(Length::from_m(9000.0), Length::ZERO, &now);
        assert!(matches!(apart, BaliseVerdict::Unexpected { .. }), "they are too far apart");
    }

    proptest! {
        /// Bounds that contained the true distance still contain it after each balise within its bound, wherever in the period
        /// the train passed it, and are no wider.
        #[test]
        fn bounds_go_on_holding_the_truth(
            passages in prop::collection::vec(
                (0.0..2000.0_f64, 0.0..0.05_f64, 0.0..0.05_f64, 0.0..=1.0_f64, -2.0..2.0_f64, -4.0..4.0_f64, 0.0..=1.0_f64),
                1..30,
            ),
        ) {
            let mut link = link();
            let mut now = interval(0.0, 0.0, 0.0);
            let mut truth = 0.0;
            for (distance, below, above, place, error, ran, part) in passages {
                now.low += Length::from_m(distance * (1.0 - below));
                now.high += Length::from_m(distance * (1.0 + above));
                now.estimate += Length::from_m(distance);
                truth += distance * (1.0 - below + (below + above) * place);
                let said = Length::from_m(truth - ran * part + error);
                let verdict = link.pass(said, Length::from_m(ran), &now);
                let BaliseVerdict::Accepted(after) = verdict else {
                    return Err(TestCaseError::fail(std::format!("{verdict:?}")));
                };
                prop_assert!(after.low.as_m() <= truth + 1e-9 && truth <= after.high.as_m() + 1e-9);
                prop_assert!(after.low >= now.low && after.high <= now.high);
                prop_assert!(after.low <= after.estimate && after.estimate <= after.high);
                now = after;
            }
        }
    }
}
