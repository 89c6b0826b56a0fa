//! How exactly a train trips each sensor at its usual place: shoe, dirt, sway and what no state explains.
//!
//! Some sensors trip within 2 mm and others within 15, at some steps more than at others. Three levels, each the prior of the
//! next: all sensors of the train, one sensor, one sensor at one step. With `n` detections whose squared residuals, less what
//! timing and motion explain, have the sum `S`, the variance of a level is `(w V + S) / (w + n)`, with `V` that of the level above
//! and `w` its weight.

use alloc::collections::BTreeMap;

use crate::ids::{SensorId, SpeedStep};

/// Before a train has shown its own (m): cleaned shoes on the published tracks.
const EXPECTED_M: f64 = 0.003;
/// How many detections that prior is worth, and each level for the next.
const EXPECTED_WEIGHT: f64 = 15.0;
const LEVEL_WEIGHT: f64 = 12.0;
/// Detections after which the past fades, so that a shoe that gets dirty is noticed.
const MEMORY: f64 = 120.0;
/// Bounds of an estimate (m): below, the poll hides it; above, something else is wrong.
const SMALLEST_M: f64 = 0.001;
const LARGEST_M: f64 = 0.025;
/// One detection counts for at most this many times its expected square: one outlier is not scatter.
const MOST_TIMES_EXPECTED: f64 = 4.0;

/// Squared residuals (m²) beyond what was explained, and their number.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
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

/// One sensor at all steps, and at each.
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct OfSensor {
    all: Squares,
    steps: BTreeMap<SpeedStep, Squares>,
}

/// Variances (m²) of where sensors trip about their usual places, as a model keeps them.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct SensorVariances {
    /// Of a sensor that the train has not passed often.
    pub(super) usual: f64,
    pub(super) of_sensor: BTreeMap<SensorId, f64>,
}

impl Default for SensorVariances {
    fn default() -> Self {
        SensorScatter::default().variances()
    }
}

impl SensorVariances {
    pub(crate) fn of(&self, sensor: Option<SensorId>) -> f64 {
        sensor.and_then(|sensor| self.of_sensor.get(&sensor).copied()).unwrap_or(self.usual)
    }
}

/// What a train's detections have shown of the scatter of its sensors.
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct SensorScatter {
    all: Squares,
    sensors: BTreeMap<SensorId, OfSensor>,
}

impl SensorScatter {
    /// Takes a squared residual (m²) at a sensor, of which motion and the timing of the report explain these variances (m²).
    ///
    /// A square scatters in proportion to its expected value, so that a detection after uncertain motion has little weight.
    pub(crate) fn take(&mut self, sensor: SensorId, step: SpeedStep, square: f64, [motion, poll]: [f64; 2]) {
        let scatter = self.variance(sensor, step);
        let expected = motion + poll + scatter;
        let square = square.min(MOST_TIMES_EXPECTED * expected) - motion - poll;
        let part = (poll + scatter) / expected;
        let weight = part * part;
        self.all.take(square, weight);
        let own = self.sensors.entry(sensor).or_default();
        own.all.take(square, weight);
        own.steps.entry(step).or_default().take(square, weight);
    }

    /// Variance of where a sensor trips (m²).
    pub(crate) fn variance(&self, sensor: SensorId, step: SpeedStep) -> f64 {
        let all = self.all.variance(EXPECTED_M * EXPECTED_M, EXPECTED_WEIGHT);
        let Some(own) = self.sensors.get(&sensor) else { return all };
        let of_sensor = own.all.variance(all, LEVEL_WEIGHT);
        own.steps.get(&step).copied().unwrap_or_default().variance(of_sensor, LEVEL_WEIGHT)
    }

    /// The variances of all sensors, over all steps.
    pub(super) fn variances(&self) -> SensorVariances {
        let usual = self.all.variance(EXPECTED_M * EXPECTED_M, EXPECTED_WEIGHT);
        let of_sensor =
            self.sensors.iter().map(|(sensor, own)| (*sensor, own.all.variance(usual, LEVEL_WEIGHT)));
        SensorVariances { usual, of_sensor: of_sensor.collect() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Scatter found (m) of two sensors, one of which trips within 2 mm and the other within 15, after so many detections of each.
    fn found(detections: usize, poll: f64) -> [f64; 2] {
        let step = SpeedStep::new(8).expect("a step");
        let mut scatter = SensorScatter::default();
        for _ in 0..detections {
            for (sensor, own) in [(SensorId(1), 0.002), (SensorId(2), 0.015)] {
                scatter.take(sensor, step, own * own + poll * poll, [0.0, poll * poll]);
            }
        }
        [SensorId(1), SensorId(2)].map(|sensor| libm::sqrt(scatter.variance(sensor, step)))
    }

    #[test]
    fn a_sensor_that_trips_within_2_mm_and_one_within_15_are_distinguished() {
        // Given 200 detections of each, blurred by 5 mm of polling,
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
