//! A motion model as plain numbers, to be kept and taken up again.

use alloc::collections::BTreeMap;
use alloc::vec::Vec;
use core::fmt;

use super::motion_model::{Counts, MotionModel, StepUse};
use super::scatter::Scatter;
use super::sensor_scatter::SensorVariances;
use super::spread::Spread;
use super::stop_offset::StopOffsets;
use crate::ids::{SensorId, SpeedStep, TrainId};
use crate::time::Timestamp;

/// All that a [`MotionModel`] is made of, to the last bit. What it means for a step or a section the model says.
#[derive(Debug, Clone, PartialEq)]
pub struct MotionNumbers {
    /// The train.
    pub train: TrainId,
    /// The highest step of its decoder.
    pub highest: SpeedStep,
    /// The numbers by which it answers its commands, in SI units and the order of the model.
    pub values: Vec<f64>,
    /// The covariance of the numbers: the lower triangle, row after row.
    pub covariance: Vec<f64>,
    /// By [section](crate::model::survey::SectionIndex), by how much it is longer than surveyed (m), with the variance.
    pub sections: Vec<(usize, f64, f64)>,
    /// By [edge](crate::EdgeId) that stops ran over, by how much they are longer there (m), with the variance.
    pub stop_offsets: Vec<(usize, f64, f64)>,
    /// One standard deviation of that from edge to edge (m).
    pub stop_offset_deviation: f64,
    /// By how much more than usual the laws of stops and of starts leave over: factors on a standard deviation.
    pub residual_scales: [f64; 2],
    /// By step from 0 on, what experience says of it.
    pub uses: Vec<StepUse>,
    /// By step from 0 on, detections and stops made from below and then from above.
    pub counts: Vec<[(u32, u32); 2]>,
    /// How far stops scatter against what trains usually do.
    pub scatter_scale: f64,
    /// What stops scatter by besides, whatever their speed (m): slopes, loads, shapes of laws that are none of ours.
    pub scatter_floor: f64,
    /// Standard deviation of the time until a stop begins (s).
    pub stop_delay_scatter: f64,
    /// Standard deviation (m) of where a sensor trips that the train has not passed often, and of each that it has.
    pub usual_sensor_scatter: f64,
    /// See [`usual_sensor_scatter`](Self::usual_sensor_scatter).
    pub sensor_scatter: Vec<(SensorId, f64)>,
    /// How late or early starts are against what trains usually do.
    pub start_scale: f64,
    /// What each number is off by for one standard deviation of the survey's scale.
    pub scale: Vec<f64>,
    /// When the newest event was.
    pub date: Timestamp,
}

/// Why numbers make no model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum NumbersError {
    /// There are not as many as the model of a decoder with this highest step has.
    WrongCount {
        /// Which of them.
        what: &'static str,
        /// How many there should be.
        expected: usize,
        /// How many there are.
        found: usize,
    },
    /// A number that is none, or a variance below zero.
    NoNumber {
        /// Which of them.
        what: &'static str,
    },
}

impl fmt::Display for NumbersError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::WrongCount { what, expected, found } => {
                write!(f, "{found} {what}, where a model of this decoder has {expected}")
            }
            Self::NoNumber { what } => write!(f, "among the {what} is one that cannot be"),
        }
    }
}

impl core::error::Error for NumbersError {}

fn of_places(places: &BTreeMap<usize, (f64, f64)>) -> Vec<(usize, f64, f64)> {
    places.iter().map(|(place, (by, variance))| (*place, *by, *variance)).collect()
}

fn by_place(places: &[(usize, f64, f64)]) -> BTreeMap<usize, (f64, f64)> {
    places.iter().map(|(place, by, variance)| (*place, (*by, *variance))).collect()
}

impl MotionModel {
    /// The model as plain numbers; [`from_numbers`](Self::from_numbers) makes the same model of them.
    pub fn numbers(&self) -> MotionNumbers {
        let side = self.values.len();
        let counts = |one: &Counts| (one.contacts, one.stops);
        let deviation = |(sensor, variance): (&SensorId, &f64)| (*sensor, libm::sqrt(*variance));
        MotionNumbers {
            train: self.train(),
            highest: self.highest(),
            values: self.values.clone(),
            covariance: (0..side).flat_map(|i| (0..=i).map(move |j| self.spread.between(i, j))).collect(),
            sections: of_places(&self.sections),
            stop_offsets: of_places(&self.stop_offsets.of_edge),
            stop_offset_deviation: self.stop_offsets.deviation,
            residual_scales: self.residual_scales,
            uses: self.uses.clone(),
            counts: self.counts.iter().map(|both| both.each_ref().map(counts)).collect(),
            scatter_scale: self.scatter.stops,
            scatter_floor: self.scatter.floor,
            stop_delay_scatter: self.scatter.delay,
            start_scale: self.scatter.starts,
            usual_sensor_scatter: libm::sqrt(self.sensor_variances.usual),
            sensor_scatter: self.sensor_variances.of_sensor.iter().map(deviation).collect(),
            scale: self.scale.clone(),
            date: self.date,
        }
    }

    /// The model of which these are the numbers.
    ///
    /// # Errors
    /// They are not as many as they should be, or make no sense.
    pub fn from_numbers(numbers: &MotionNumbers) -> Result<Self, NumbersError> {
        let mut model = Self::unknown(numbers.train, numbers.highest);
        let side = model.values.len();
        let steps = usize::from(numbers.highest.get()) + 1;
        let counts = [
            ("numbers", side, numbers.values.len()),
            ("parts of the scale", side, numbers.scale.len()),
            ("covariances", side * (side + 1) / 2, numbers.covariance.len()),
            ("uses of steps", steps, numbers.uses.len()),
            ("counts of steps", steps, numbers.counts.len()),
        ];
        for (what, expected, found) in counts {
            if expected != found {
                return Err(NumbersError::WrongCount { what, expected, found });
            }
        }
        let wrong = |what| Err(NumbersError::NoNumber { what });
        if !numbers.values.iter().chain(&numbers.scale).all(|value| value.is_finite()) {
            return wrong("numbers");
        }
        // The n-th of the diagonal ends the n-th row.
        let mut diagonal = (0..side).filter_map(|i| numbers.covariance.get((i + 1) * (i + 2) / 2 - 1));
        if !numbers.covariance.iter().all(|value| value.is_finite())
            || diagonal.any(|variance| *variance < 0.0)
        {
            return wrong("covariances");
        }
        let is_known = |(_, by, variance): &(usize, f64, f64)| {
            by.is_finite() && variance.is_finite() && *variance >= 0.0
        };
        if !numbers.sections.iter().all(is_known) {
            return wrong("sections");
        }
        if !numbers.stop_offsets.iter().all(is_known) {
            return wrong("offsets of stops");
        }
        let scatters = [
            numbers.scatter_scale,
            numbers.scatter_floor,
            numbers.stop_delay_scatter,
            numbers.start_scale,
            numbers.stop_offset_deviation,
            numbers.residual_scales[0],
            numbers.residual_scales[1],
            numbers.usual_sensor_scatter,
        ];
        let sensors = numbers.sensor_scatter.iter().map(|(_, scatter)| scatter);
        if scatters.iter().chain(sensors).any(|scatter| !scatter.is_finite() || *scatter < 0.0) {
            return wrong("scatters");
        }
        model.values.clone_from(&numbers.values);
        model.spread = Spread::of_lower_triangle(side, &numbers.covariance);
        model.sections = by_place(&numbers.sections);
        model.stop_offsets = StopOffsets {
            of_edge: by_place(&numbers.stop_offsets),
            deviation: numbers.stop_offset_deviation,
        };
        model.residual_scales = numbers.residual_scales;
        for (step, found) in (0..=numbers.highest.get()).filter_map(SpeedStep::new).zip(&numbers.uses) {
            model.note_use(step, *found);
        }
        model.counts = numbers
            .counts
            .iter()
            .map(|both| both.map(|(contacts, stops)| Counts { contacts, stops }))
            .collect();
        model.scatter = Scatter {
            stops: numbers.scatter_scale,
            floor: numbers.scatter_floor,
            delay: numbers.stop_delay_scatter,
            starts: numbers.start_scale,
        };
        let variance = |(sensor, scatter): &(SensorId, f64)| (*sensor, scatter * scatter);
        model.sensor_variances = SensorVariances {
            usual: numbers.usual_sensor_scatter * numbers.usual_sensor_scatter,
            of_sensor: numbers.sensor_scatter.iter().map(variance).collect(),
        };
        model.scale.clone_from(&numbers.scale);
        model.date = numbers.date;
        Ok(model)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::event::Approach;

    fn model() -> MotionModel {
        let mut model = MotionModel::unknown(TrainId(24), SpeedStep::new(14).unwrap());
        model.note_use(SpeedStep::new(1).unwrap(), StepUse::Unreliable);
        model.note_use(SpeedStep::new(9).unwrap(), StepUse::Moves);
        model.sections.insert(3, (0.012, 1e-6));
        model.stop_offsets.of_edge.insert(5, (-0.02, 1e-5));
        model.stop_offsets.deviation = 0.015;
        model.counts[9][1] = Counts { contacts: 41, stops: 7 };
        model.scatter = Scatter { stops: 1.25, floor: 0.002, delay: 0.04, ..Scatter::USUAL };
        model.date = Timestamp::from_ns(5);
        model
    }

    #[test]
    fn a_model_comes_back_from_its_numbers_to_the_last_bit() {
        let model = model();
        let again = MotionModel::from_numbers(&model.numbers()).unwrap();
        assert_eq!(again, model);
        let step = SpeedStep::new(9).unwrap();
        assert_eq!(again.stop(step, Approach::Above), model.stop(step, Approach::Above));
    }

    #[test]
    fn numbers_that_cannot_be_make_no_model() {
        let good = model().numbers();
        let refused = |spoil: &dyn Fn(&mut MotionNumbers)| {
            let mut numbers = good.clone();
            spoil(&mut numbers);
            MotionModel::from_numbers(&numbers).unwrap_err()
        };
        let count = refused(&|numbers| numbers.values.truncate(3));
        assert!(matches!(count, NumbersError::WrongCount { what: "numbers", found: 3, .. }), "{count}");
        assert!(matches!(
            refused(&|numbers| numbers.covariance.truncate(9)),
            NumbersError::WrongCount { .. }
        ));
        for (what, error) in [
            ("numbers", refused(&|numbers| numbers.values[0] = f64::NAN)),
            ("covariances", refused(&|numbers| numbers.covariance[0] = -1.0)),
            ("sections", refused(&|numbers| numbers.sections[0].2 = -1.0)),
            ("offsets of stops", refused(&|numbers| numbers.stop_offsets[0].1 = f64::NAN)),
            ("scatters", refused(&|numbers| numbers.scatter_scale = f64::INFINITY)),
        ] {
            assert_eq!(error, NumbersError::NoNumber { what });
        }
    }
}
