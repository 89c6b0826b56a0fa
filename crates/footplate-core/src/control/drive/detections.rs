//! How often sensors miss a train at a speed, learnt while it is driven.
//!
//! A sensor is closed while the train runs a certain length over it. An interface that latches keeps that until it is
//! polled; of one that does not, a poll sees a sensor that closes for less than the interval between polls only now
//! and then. The length is not known: each of some is a hypothesis, whose probability follows from the detections that
//! came and those that did not (Bayes).

use crate::time::TimeSpan;
use crate::track::MAX_MISSED;
use crate::units::{Length, Speed};

/// The share of missed detections of a well-kept layout whose interface latches: 0.3 %.
const USUAL_MISSED: f64 = 0.003;
/// The lengths for which a sensor may be closed, in mm; of the first, every poll sees it. Published pickup shoes and
/// magnets close one for 20 to 70 mm.
const CLOSED_MM: [f64; 7] = [f64::INFINITY, 110.0, 75.0, 55.0, 40.0, 28.0, 20.0];
/// The probability, before anything is known, that an interface latches: S88 modules and reporting stations do, and one
/// missed detection must not be taken for an interface that does not (chosen: two at a high speed are).
const LATCHES: f64 = 0.999;
/// A train is lost after a number of missed detections in a row that sensors miss by chance less often than this:
/// ten times as often as trains stall, derail or are lifted between two sensors, as a train that is taken for lost
/// is stopped in the middle of its order.
const BY_CHANCE: f64 = 1e-3;
/// From this speed on trains do not stall on dirt.
pub(super) const STALL_FREE_SPEED: Speed = Speed::from_mm_per_s(150.0);
/// One missed detection alone never means that a train is lost, ...
const LEAST_MISSED: u8 = 2;
/// ... and of a train too fast to stall on dirt, two do not: it is still running, and the next sensor is no farther than a stop would
/// take (chosen: the train of the row that was looked at was where it was estimated).
const LEAST_MISSED_FAST: u8 = 3;

/// The detections of a train in this session.
#[derive(Debug, Clone, Copy)]
pub(super) struct Detections {
    /// ln of the probability of each length, up to a constant.
    log_probability: [f64; CLOSED_MM.len()],
    /// The interval of the last poll that saw it.
    poll: TimeSpan,
}

impl Default for Detections {
    fn default() -> Self {
        let mut log_probability =
            [libm::log((1.0 - LATCHES) / (CLOSED_MM.len() - 1) as f64); CLOSED_MM.len()];
        if let Some(latches) = log_probability.first_mut() {
            *latches = libm::log(LATCHES);
        }
        Self { log_probability, poll: TimeSpan::ZERO }
    }
}

impl Detections {
    /// A sensor reported the train at a speed within a poll, after so many that did not, at a speed of up to another.
    pub(super) fn take(&mut self, (missed, missed_at): (usize, Speed), speed: Speed, poll: TimeSpan) {
        self.poll = poll;
        for (log, closed) in self.log_probability.iter_mut().zip(CLOSED_MM) {
            let silent = libm::log(1.0 - seen(closed, missed_at, poll));
            *log += libm::log(seen(closed, speed, poll)) + missed as f64 * silent;
        }
        let likeliest = self.log_probability.into_iter().fold(f64::NEG_INFINITY, f64::max);
        self.log_probability.iter_mut().for_each(|log| *log -= likeliest);
    }

    /// The share of detections that sensors miss at a speed.
    pub(super) fn missed_share(&self, speed: Speed) -> f64 {
        let (mut missed, mut total) = (0.0, 0.0);
        for (log, closed) in self.log_probability.iter().zip(CLOSED_MM) {
            let probability = libm::exp(*log);
            missed += probability * (1.0 - seen(closed, speed, self.poll));
            total += probability;
        }
        missed / total
    }

    /// The number of missed detections in a row after which a train is lost that has run at up to a speed, and may have stalled on dirt
    /// or not. Data association looks no further than over [`MAX_MISSED`].
    pub(super) fn lost_after(&self, speed: Speed, may_stall: bool) -> u8 {
        let share = self.missed_share(speed);
        let most = u8::try_from(MAX_MISSED).unwrap_or(u8::MAX).saturating_add(1);
        let least = if may_stall { LEAST_MISSED } else { LEAST_MISSED_FAST };
        (least..most).find(|nth| libm::pow(share, f64::from(*nth)) < BY_CHANCE).unwrap_or(most)
    }
}

/// The probability that a poll sees a sensor that is closed for a length.
fn seen(closed_mm: f64, speed: Speed, poll: TimeSpan) -> f64 {
    let runs = Length::from_m(speed.as_m_per_s().abs() * poll.as_s()).as_mm();
    let part = if closed_mm >= runs { 1.0 } else { closed_mm / runs };
    part * (1.0 - USUAL_MISSED)
}

#[cfg(test)]
mod tests {
    use super::*;

    const POLL: TimeSpan = TimeSpan::from_ms(128);
    const FAST: Speed = Speed::from_m_per_s(0.5);
    const SLOW: Speed = Speed::from_m_per_s(0.1);

    #[test]
    fn sensors_of_a_well_kept_layout_hardly_miss_a_train() {
        let mut detections = Detections::default();
        assert_eq!(detections.lost_after(FAST, true), 2);
        assert_eq!(detections.lost_after(FAST, false), 3, "the next sensor decides");
        for nth in 0..200 {
            detections.take((usize::from(nth == 90), FAST), FAST, POLL);
        }
        assert_eq!(detections.lost_after(FAST, true), 2, "one of 200");
        assert!(detections.missed_share(FAST) < 0.01, "{}", detections.missed_share(FAST));
    }

    #[test]
    fn a_fast_train_is_missed_by_an_interface_that_does_not_latch_and_a_slow_one_is_not() {
        let mut detections = Detections::default();
        // Closed for 35 mm, and run over 64 mm within a poll: 45 of 100 are missed.
        for nth in 0..20 {
            detections.take((usize::from(nth % 5 < 4), FAST), FAST, POLL);
        }
        let share = detections.missed_share(FAST);
        assert!((share - 0.44).abs() < 0.1, "{share}");
        assert_eq!(detections.lost_after(FAST, false), 9);
        assert!(detections.missed_share(SLOW) < 0.01, "{}", detections.missed_share(SLOW));
        assert_eq!(detections.lost_after(SLOW, true), 2);
    }

    #[test]
    fn one_silent_sensor_of_a_circuit_does_not_make_an_interface_that_does_not_latch() {
        let mut detections = Detections::default();
        for nth in 0..60 {
            detections.take((usize::from(nth % 12 == 0), SLOW), SLOW, POLL);
        }
        assert_eq!(detections.lost_after(SLOW, true), 2);
    }

    /// The likelihood of every length as a plain product: no logarithms, nothing scaled.
    #[test]
    fn the_share_of_missed_detections_is_the_mean_over_all_lengths_by_bayes() {
        let history = [(2, 0.5, 0.4), (0, 0.1, 0.2), (1, 0.3, 0.3), (3, 0.6, 0.5), (0, 0.5, 0.6)];
        let mut detections = Detections::default();
        let mut products = CLOSED_MM.map(|closed| if closed.is_finite() { 0.001 / 6.0 } else { 0.999 });
        // Of a poll every 128 ms a sensor that is closed for 35 mm, say, is seen by 35 mm over what the train runs in 128 ms.
        let seen = |closed_mm: f64, metres_per_s: f64| 0.997 * (closed_mm / (128.0 * metres_per_s)).min(1.0);
        for (missed, missed_at, speed) in history {
            detections.take((missed, Speed::from_m_per_s(missed_at)), Speed::from_m_per_s(speed), POLL);
            for (product, closed) in products.iter_mut().zip(CLOSED_MM) {
                *product *= seen(closed, speed);
                (0..missed).for_each(|_| *product *= 1.0 - seen(closed, missed_at));
            }
        }
        for speed in [0.1, 0.3, 0.5, 0.8] {
            let all: f64 = products.iter().sum();
            let missed: f64 =
                products.iter().zip(CLOSED_MM).map(|(p, closed)| p * (1.0 - seen(closed, speed))).sum();
            let found = detections.missed_share(Speed::from_m_per_s(speed));
            assert!((found - missed / all).abs() < 1e-9, "{found}, not {} at {speed} m/s", missed / all);
        }
    }
}
