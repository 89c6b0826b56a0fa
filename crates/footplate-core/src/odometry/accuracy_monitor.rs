//! Whether the odometer is still accurate enough to be relied on, and when to say that it is not.
//!
//! Source: SUBSET-026-3, 3.6.8, with the values of A.3.1. The amounts by which the odometer may have read too long and
//! too short over the last 5000 m are each held against two lines. Beyond 250 m (5 %) accuracy is impaired and the
//! driver is informed, until another 5000 m were run within 5 m + 5 %. Beyond 1500 m (30 %) it is a system failure.
//!
//! The amounts are looked at in every period, so that a train whose wheels are locked, and whose odometer therefore
//! does not move on, is judged as well. What they were 5000 m ago is remembered every 50 m: the window is at least
//! 5000 m long and at most 50 m more, plus what the train runs in a period.

use super::tolerance::distance_tolerance;
use crate::units::Length;

/// The distance over which the amounts are judged (m); A.3.1.
const WINDOW_M: f64 = 5000.0;
/// An amount beyond this (m) impairs; A.3.1.
const IMPAIRED_BEYOND_M: f64 = 250.0;
/// An amount beyond this (m) is a failure; A.3.1.
const FAILED_BEYOND_M: f64 = 1500.0;
/// From one remembered place to the next (m). Chosen: half of the longest check interval that A.3.1 allows.
const SPACING_M: f64 = 50.0;
/// Both ends of the window, the spaces between, and the one that is being left.
const PLACES: usize = (WINDOW_M / SPACING_M) as usize + 2;

/// Never-decreasing sums since the start. An ETCS on-board unit subtracts two readings of such sums to know the confidence interval
/// of any distance between them (SUBSET-026-3, 3.6.4). Over- and under-reading are separate sums, and both directions of travel add
/// to them (3.6.8.1.1): an error that reversing cancels cannot be distinguished from one that it doubles.
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

/// What may be done with distances.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "lowercase"))]
pub enum OdometerAccuracy {
    /// As accurate as ETCS demands.
    #[default]
    Sound,
    /// Not accurate enough over the last 5000 m, or not long enough since: the driver has to be informed.
    Impaired,
    /// So inaccurate that the on-board unit has failed. It stays failed.
    Failed,
}

/// Watches the amounts over the last 5000 m. Fixed memory.
#[derive(Debug, Clone)]
pub struct AccuracyMonitor {
    /// Readings at most `PLACES` spaces of 50 m apart, in a ring.
    places: [ReadingAmounts; PLACES],
    oldest: usize,
    remembered: usize,
    /// The oldest of them, from which the window begins ...
    start: ReadingAmounts,
    /// ... the place at which the next becomes the oldest ...
    start_moves_at: Length,
    /// ... and the place at which one more is remembered.
    remembers_at: Length,
    accuracy: OdometerAccuracy,
    /// Where the stretch began that has to be run within tolerance before accuracy is no longer impaired.
    recovering_from: ReadingAmounts,
}

impl Default for AccuracyMonitor {
    fn default() -> Self {
        let start = ReadingAmounts::default();
        Self {
            places: [start; PLACES],
            oldest: 0,
            remembered: 1,
            start,
            start_moves_at: Length::from_m(f64::INFINITY),
            remembers_at: Length::from_m(SPACING_M),
            accuracy: OdometerAccuracy::Sound,
            recovering_from: start,
        }
    }
}

impl AccuracyMonitor {
    /// Takes in the sums at the end of a period and judges.
    pub fn take(&mut self, now: ReadingAmounts) -> OdometerAccuracy {
        if now.travelled >= self.start_moves_at {
            self.forget_before(now.travelled - Length::from_m(WINDOW_M));
        }
        let in_window = now.since(&self.start);
        let worst = in_window.over.max(in_window.under);
        let recovered = self.recovered(now);
        self.accuracy = match self.accuracy {
            OdometerAccuracy::Failed => OdometerAccuracy::Failed,
            _ if worst.as_m() > FAILED_BEYOND_M => OdometerAccuracy::Failed,
            _ if worst.as_m() > IMPAIRED_BEYOND_M => OdometerAccuracy::Impaired,
            OdometerAccuracy::Impaired if !recovered => OdometerAccuracy::Impaired,
            _ => OdometerAccuracy::Sound,
        };
        if now.travelled >= self.remembers_at {
            self.remember(now);
        }
        self.accuracy
    }

    /// The judgement after the latest period.
    #[must_use]
    pub fn accuracy(&self) -> OdometerAccuracy {
        self.accuracy
    }

    /// Whether a window was run within tolerance since accuracy was impaired; outside of it a new stretch begins.
    fn recovered(&mut self, now: ReadingAmounts) -> bool {
        let stretch = now.since(&self.recovering_from);
        let within = stretch.over.max(stretch.under) <= distance_tolerance(stretch.travelled);
        if self.accuracy == OdometerAccuracy::Sound || !within {
            self.recovering_from = now;
        }
        within && stretch.travelled.as_m() >= WINDOW_M
    }

    /// Leaves the newest place at or before the start of the window as the oldest.
    fn forget_before(&mut self, start: Length) {
        while self.remembered > 1 && self.place(1).travelled <= start {
            self.oldest = (self.oldest + 1) % PLACES;
            self.remembered -= 1;
        }
        self.look_ahead();
    }

    fn remember(&mut self, now: ReadingAmounts) {
        if let Some(place) = self.places.get_mut((self.oldest + self.remembered) % PLACES) {
            *place = now;
            self.remembered = (self.remembered + 1).min(PLACES);
        }
        self.remembers_at = now.travelled + Length::from_m(SPACING_M);
        self.look_ahead();
    }

    fn look_ahead(&mut self) {
        self.start = self.place(0);
        self.start_moves_at = if self.remembered > 1 {
            self.place(1).travelled + Length::from_m(WINDOW_M)
        } else {
            Length::from_m(f64::INFINITY)
        };
    }

    /// The `n`th remembered place from the oldest.
    fn place(&self, n: usize) -> ReadingAmounts {
        self.places.get((self.oldest + n) % PLACES).copied().unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Runs a distance in steps of 2 m with these parts of over- and under-reading.
    fn run(monitor: &mut AccuracyMonitor, sums: &mut ReadingAmounts, distance_m: f64, over: f64, under: f64) {
        for _ in 0..(distance_m / 2.0) as u32 {
            let distance = Length::from_m(2.0);
            sums.travelled += distance;
            sums.over += distance * over;
            sums.under += distance * under;
            monitor.take(*sums);
        }
    }

    fn fresh() -> (AccuracyMonitor, ReadingAmounts) {
        (AccuracyMonitor::default(), ReadingAmounts::default())
    }

    #[test]
    fn six_per_cent_impair_after_250_of_4167_metres() {
        for (over, under) in [(0.06, 0.0), (0.0, 0.06)] {
            let (mut monitor, mut sums) = fresh();
            run(&mut monitor, &mut sums, 4160.0, over, under);
            assert_eq!(monitor.accuracy(), OdometerAccuracy::Sound);
            run(&mut monitor, &mut sums, 10.0, over, under);
            assert_eq!(monitor.accuracy(), OdometerAccuracy::Impaired);
        }
    }

    #[test]
    fn both_sides_are_judged_by_themselves() {
        let (mut monitor, mut sums) = fresh();
        // 8 % in all, but neither side passes 5 %, however far it goes.
        run(&mut monitor, &mut sums, 60_000.0, 0.04, 0.04);
        assert_eq!(monitor.accuracy(), OdometerAccuracy::Sound);
    }

    #[test]
    fn accuracy_returns_after_another_5000_metres_within_tolerance() {
        let (mut monitor, mut sums) = fresh();
        run(&mut monitor, &mut sums, 5_000.0, 0.06, 0.01);
        assert_eq!(monitor.accuracy(), OdometerAccuracy::Impaired);
        // Impaired at 4168 m. From there 6 % are within 5 m + 5 % for 500 m, and a new stretch begins at 4670 m.
        run(&mut monitor, &mut sums, 4_600.0, 0.01, 0.01);
        assert_eq!(monitor.accuracy(), OdometerAccuracy::Impaired);
        run(&mut monitor, &mut sums, 100.0, 0.01, 0.01);
        assert_eq!(monitor.accuracy(), OdometerAccuracy::Sound);
    }

    #[test]
    fn a_stretch_outside_tolerance_begins_the_5000_metres_anew() {
        let (mut monitor, mut sums) = fresh();
        run(&mut monitor, &mut sums, 5_000.0, 0.06, 0.0);
        run(&mut monitor, &mut sums, 4_000.0, 0.01, 0.0);
        // 200 m of which 40 % may be misread: 80 m on top of 40 m, where 5 m + 5 % allow 215 m. Still within.
        run(&mut monitor, &mut sums, 200.0, 0.4, 0.0);
        run(&mut monitor, &mut sums, 900.0, 0.01, 0.0);
        assert_eq!(monitor.accuracy(), OdometerAccuracy::Sound, "5000 m within 5 m + 5 %");

        let (mut monitor, mut sums) = fresh();
        run(&mut monitor, &mut sums, 5_000.0, 0.06, 0.0);
        run(&mut monitor, &mut sums, 400.0, 0.01, 0.0);
        run(&mut monitor, &mut sums, 100.0, 0.5, 0.0);
        run(&mut monitor, &mut sums, 4_700.0, 0.01, 0.0);
        assert_eq!(monitor.accuracy(), OdometerAccuracy::Impaired, "54 m on 500 m were outside of 30 m");
        run(&mut monitor, &mut sums, 600.0, 0.01, 0.0);
        assert_eq!(monitor.accuracy(), OdometerAccuracy::Sound);
    }

    #[test]
    fn a_third_of_the_distance_is_a_failure_that_stays() {
        let (mut monitor, mut sums) = fresh();
        run(&mut monitor, &mut sums, 4_990.0, 0.0, 0.301);
        assert_eq!(monitor.accuracy(), OdometerAccuracy::Failed);
        run(&mut monitor, &mut sums, 20_000.0, 0.0, 0.0);
        assert_eq!(monitor.accuracy(), OdometerAccuracy::Failed);
    }

    #[test]
    fn locked_wheels_are_judged_though_the_odometer_stands() {
        let (mut monitor, mut sums) = fresh();
        for _ in 0..251 {
            sums.under += Length::from_m(1.0);
            monitor.take(sums);
        }
        assert_eq!(monitor.accuracy(), OdometerAccuracy::Impaired);
    }

    proptest! {
        /// Against all amounts of the run, looked through anew in every period: never milder over 5000 m, never
        /// stricter over 5000 m and what the window may be longer.
        #[test]
        fn the_window_is_neither_shorter_nor_much_longer_than_it_says(
            distances in prop::collection::vec((0.0..200.0_f64, 0.0..0.12_f64), 1..400),
        ) {
            let mut monitor = AccuracyMonitor::default();
            let mut history = std::vec![ReadingAmounts::default()];
            for (distance, part) in distances {
                let mut now = *history.last().unwrap();
                let distance = Length::from_m(distance);
                now.travelled += distance;
                now.over += distance * part;
                let longest_period = 200.0;
                let over = |window: f64| {
                    let start = history.iter().rev().find(|at| (now.travelled - at.travelled).as_m() >= window);
                    now.since(start.unwrap_or(&history[0])).over.as_m()
                };
                let (least, most) = (over(WINDOW_M), over(WINDOW_M + SPACING_M + longest_period));
                let was = monitor.accuracy();
                let judged = monitor.take(now);
                if least > IMPAIRED_BEYOND_M {
                    prop_assert!(judged >= OdometerAccuracy::Impaired);
                }
                if was == OdometerAccuracy::Sound && judged == OdometerAccuracy::Impaired {
                    prop_assert!(most > IMPAIRED_BEYOND_M);
                }
                history.push(now);
            }
        }
    }
}
