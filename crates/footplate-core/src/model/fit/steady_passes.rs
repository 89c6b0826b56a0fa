//! The scatter of sensors, from steady runs over three of them.
//!
//! A train that runs steadily passes the middle one of three sensors between the other two. By how much (m) it passes it before the
//! place that their times interpolate follows from the true lengths, and is the same whenever the train runs there. What differs from
//! pass to pass is scatter of the three sensors, timing and a little wander of the speed. Neither the lengths nor the numbers of the
//! train need to be known for that, so no error of a fit counts as scatter.

use alloc::collections::BTreeMap;
use alloc::vec::Vec;

use super::trip::TripDetection;
use crate::ids::{SensorId, SpeedStep};
use crate::model::priors::WANDER;
use crate::model::sensor_scatter::{SensorScatter, SensorVariances};

/// A deviation counts for at most this many standard deviations in the mean: one outlier costs one outlier.
const MOST_DEVIATIONS: f64 = 2.5;
/// Passes after which the mean follows new ones as fast as it ever does: sensors are bent, and cleaned.
const MEMORY: f64 = 60.0;
/// The speed between three sensors wanders by this part of [`WANDER`], which is that of twice the time.
const WANDER_PART: f64 = 0.25;

/// A sensor passed on a steady run.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct Pass {
    sensor: SensorId,
    /// When (s), with the variance.
    time: f64,
    variance: f64,
    /// From the sensor before (m, surveyed).
    length: f64,
}

/// By how much (m) a train passes a sensor between two others before the place that their times interpolate.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct Usual {
    before: SensorId,
    after: SensorId,
    mean: f64,
    count: f64,
}

/// What steady runs have shown of each sensor.
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct SteadyPasses {
    /// The last two passes of a steady run in progress.
    recent: Vec<Pass>,
    usual: BTreeMap<SensorId, Vec<Usual>>,
    scatter: SensorScatter,
}

impl SteadyPasses {
    /// The train is no longer known to run steadily.
    pub(super) fn interrupt(&mut self) {
        self.recent.clear();
    }

    /// The train has passed a sensor, running steadily at a step since the pass before if there is one.
    pub(super) fn pass(&mut self, sensor: SensorId, step: SpeedStep, detection: &TripDetection) {
        let &TripDetection { time, variance, length, .. } = detection;
        let last = Pass { sensor, time, variance, length };
        if let [first, middle] = *self.recent.as_slice() {
            self.compare(step, [first, middle, last]);
            self.recent.remove(0);
        }
        self.recent.push(last);
    }

    fn compare(&mut self, step: SpeedStep, [first, middle, last]: [Pass; 3]) {
        let (length, lasts) = (middle.length + last.length, last.time - first.time);
        if middle.length <= 0.0 || last.length <= 0.0 || lasts <= 0.0 {
            return;
        }
        let speed = length / lasts;
        let part = (last.time - middle.time) / lasts;
        let ahead = speed * (middle.time - first.time) - middle.length;
        let poll = |pass: &Pass| speed * speed * pass.variance;
        let end =
            |pass: &Pass, part: f64| part * part * (poll(pass) + self.scatter.variance(pass.sensor, step));
        let wander = WANDER_PART * WANDER * length;
        let motion = end(&first, part) + end(&last, 1.0 - part) + wander * wander;
        let expected = motion + poll(&middle) + self.scatter.variance(middle.sensor, step);
        let all = self.usual.entry(middle.sensor).or_default();
        let usual = all.iter_mut().find(|usual| usual.before == first.sensor && usual.after == last.sensor);
        let Some(usual) = usual else {
            all.push(Usual { before: first.sensor, after: last.sensor, mean: ahead, count: 1.0 });
            return;
        };
        // The mean of so many passes differs from the true one, too.
        let kept = usual.count / (usual.count + 1.0);
        let off = ahead - usual.mean;
        let most = MOST_DEVIATIONS * libm::sqrt(expected / kept);
        usual.mean += off.clamp(-most, most) / (usual.count + 1.0);
        usual.count = (usual.count + 1.0).min(MEMORY);
        self.scatter.take(middle.sensor, step, kept * off * off, [motion, poll(&middle)]);
    }

    /// The variances of where sensors trip.
    pub(super) fn variances(&self) -> SensorVariances {
        self.scatter.variances()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ids::NodeId;

    const STEP: u8 = 8;
    const SPEED: f64 = 0.25;
    const HOP: f64 = 0.4;
    /// Poll intervals of 65 ms.
    const WINDOW: f64 = 0.065;

    /// Numbers in -1..1 that repeat late.
    fn noise(nth: usize) -> f64 {
        2.0 * libm::fmod(0.5 + 0.618_033_988_749_895 * nth as f64, 1.0) - 1.0
    }

    /// Laps over four sensors that scatter by so much (m); `wild` is added to the time (s) of one passage.
    fn found(laps: usize, scatter: [f64; 4], wild: f64) -> [f64; 4] {
        let mut passes = SteadyPasses::default();
        let step = SpeedStep::new(STEP).expect("a step");
        for nth in 0..4 * laps {
            let (place, lap) = (nth % 4, nth / 4);
            // Even noise of this width has the standard deviation asked for.
            let off = scatter[place] * libm::sqrt(3.0) * noise(7 * lap + place);
            let late = 0.5 * WINDOW * noise(nth) + if nth == 2 * laps { wild } else { 0.0 };
            // No length is as surveyed.
            let true_place = HOP * nth as f64 + [0.0, 0.02, -0.03, 0.01][place];
            let detection = TripDetection {
                node: NodeId(place as u16),
                sensor: Some(SensorId(place as u16)),
                time: (true_place + off) / SPEED + late,
                variance: WINDOW * WINDOW / 12.0,
                length: HOP,
                sections: Vec::new(),
            };
            passes.pass(SensorId(place as u16), step, &detection);
        }
        let variances = passes.variances();
        [0, 1, 2, 3].map(|place| libm::sqrt(variances.of(Some(SensorId(place)))))
    }

    #[test]
    fn sensors_that_scatter_are_distinguished_whatever_the_lengths_are() {
        let [exact, loose, other, middle] = found(60, [0.001, 0.012, 0.001, 0.006], 0.0);
        assert!((loose - 0.012).abs() < 0.003, "{loose}");
        assert!((middle - 0.006).abs() < 0.003, "{middle}");
        // Beside sensors that scatter an exact one seems to, by half of theirs.
        assert!(exact.max(other) < 0.008, "{exact} {other}");
    }

    #[test]
    fn one_report_a_second_late_is_no_scatter() {
        let without = found(30, [0.002; 4], 0.0);
        let with = found(30, [0.002; 4], 1.0);
        for (one, other) in without.into_iter().zip(with) {
            assert!((one - other).abs() < 0.002, "{one} {other}");
        }
    }
}
