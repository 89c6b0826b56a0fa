//! How exactly a train trips each sensor at its usual place: shoe, dirt, sway and what no state explains.
//!
//! Some sensors trip within 2 mm and others within 15, at some steps more than at others. Three levels, each the prior of the
//! next: all sensors of the train, one sensor, one sensor at one step. With `n` hits whose misses, less what poll and motion
//! explain, come to squares with the sum `S`, a level is `(w V + S) / (w + n)`, `V` the level above and `w` what it is worth.

use alloc::collections::BTreeMap;

use crate::ids::{SensorId, SpeedStep};

/// Before a train has shown its own (m): cleaned shoes on the published tracks.
const EXPECTED_M: f64 = 0.003;
/// How many hits that first figure is worth, and each level for the next.
const EXPECTED_WEIGHT: f64 = 15.0;
const LEVEL_WEIGHT: f64 = 12.0;
/// Hits after which the past fades, so that a shoe that gets dirty is noticed.
const MEMORY: f64 = 120.0;
/// What is believed at all (m): below, the poll hides it; above, something else is wrong.
const SMALLEST_M: f64 = 0.001;
const LARGEST_M: f64 = 0.025;
/// One hit counts for at most this many times what was expected, so that an outlier is no scatter.
const HELD_AT: f64 = 4.0;

/// Squares of misses (m²) beyond what was explained, and how many.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Squares {
    sum: f64,
    count: f64,
}

impl Squares {
    fn take(&mut self, square: f64, weight: f64) {
        let kept = ((MEMORY - weight) / self.count.max(f64::MIN_POSITIVE)).min(1.0);
        self.sum = kept * self.sum + weight * square;
        self.count = kept * self.count + weight;
    }

    fn variance(self, above: f64, weight: f64) -> f64 {
        let mean = (weight * above + self.sum) / (weight + self.count);
        mean.clamp(SMALLEST_M * SMALLEST_M, LARGEST_M * LARGEST_M)
    }
}

/// Scatter of a train's contacts about their usual place, learnt from how far forecasts miss.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct SensorScatter {
    all: Squares,
    sensors: BTreeMap<SensorId, Squares>,
    steps: BTreeMap<(SensorId, SpeedStep), Squares>,
}

impl SensorScatter {
    /// A train missed a sensor by `miss` m at a step where the variances `motion` and `poll` (m²) were to be expected without
    /// scatter. A square scatters in proportion to what was expected of it, so a train of which little is known tells little.
    pub(super) fn take(&mut self, sensor: SensorId, step: SpeedStep, miss: f64, motion: f64, poll: f64) {
        let scatter = self.variance(sensor, step);
        let expected = motion + poll + scatter;
        let square = (miss * miss).min(HELD_AT * expected) - motion - poll;
        let part = (poll + scatter) / expected;
        let weight = part * part;
        self.all.take(square, weight);
        self.sensors.entry(sensor).or_default().take(square, weight);
        self.steps.entry((sensor, step)).or_default().take(square, weight);
    }

    /// Variance of where a sensor trips (m²).
    pub(super) fn variance(&self, sensor: SensorId, step: SpeedStep) -> f64 {
        let all = self.all.variance(EXPECTED_M * EXPECTED_M, EXPECTED_WEIGHT);
        let own = self.sensors.get(&sensor).copied().unwrap_or_default().variance(all, LEVEL_WEIGHT);
        self.steps.get(&(sensor, step)).copied().unwrap_or_default().variance(own, LEVEL_WEIGHT)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Scatter found (m) of two sensors, one of which trips within 2 mm and the other within 15, after so many hits of each.
    fn found(hits: usize, poll: f64) -> [f64; 2] {
        let step = SpeedStep::new(8).expect("a step");
        let mut scatter = SensorScatter::default();
        for hit in 0..hits {
            // Both signs in turn: a mean of nothing and exactly this deviation.
            let sign = if hit % 2 == 0 { 1.0 } else { -1.0 };
            for (sensor, own) in [(SensorId(1), 0.002), (SensorId(2), 0.015)] {
                scatter.take(sensor, step, sign * libm::hypot(own, poll), 0.0, poll * poll);
            }
        }
        [SensorId(1), SensorId(2)].map(|sensor| libm::sqrt(scatter.variance(sensor, step)))
    }

    #[test]
    fn a_sensor_that_trips_within_2_mm_and_one_within_15_are_told_apart() {
        // Given 200 hits of each, seen by polls that blur them by 5 mm,
        let [exact, loose] = found(200, 0.005);
        // then each is known by its own figure to a millimetre or two.
        assert!((exact - 0.002).abs() < 0.002, "{exact}");
        assert!((loose - 0.015).abs() < 0.001, "{loose}");
    }

    #[test]
    fn a_sensor_that_is_new_counts_as_the_train_s_others_do() {
        let [exact, loose] = found(4, 0.005);
        assert!(exact > 0.003 && loose < 0.012, "{exact} {loose}");
    }
}
