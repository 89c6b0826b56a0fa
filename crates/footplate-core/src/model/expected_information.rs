//! Expected information: which sums of a model's numbers an experiment would measure, and how well.

use alloc::vec;
use alloc::vec::Vec;

use super::motion_model::{MotionModel, distance_and_time_to_rest, stop_from};
use super::parameters::Answers;
use super::priors::{LATE_START, TRIP_DEVIATION};
use super::segment::{Pace, Segment, SpeedCommand};
use super::short_moves::move_distance;
use crate::event::Approach;
use crate::ids::SpeedStep;
use crate::time::TimeSpan;
use crate::units::Length;

/// Standard deviation of a detection's time (s): its module is polled every 40 ms, 40/√12.
const TIMING: f64 = 0.012;
/// Standard deviation of a sensor's place on the path after some laps (m).
const PLACE: f64 = 0.003;
/// The planned place of rest is about this far short of its sensor (m).
const CREEP: f64 = 0.06;
/// Distance to the next sensor after one passed while braking (m).
const TO_NEXT: f64 = 0.3;
/// A typical hop between two sensors (m).
const HOP: f64 = 0.39;
/// Standard deviation of a law's shape before its end, as part of the stopping distance.
const SHAPE: f64 = 0.01;

/// Sums of the model's numbers that an experiment measures, each with its own noise.
#[derive(Debug, Clone, PartialEq)]
pub struct ExpectedInformation {
    pub(super) seen: Vec<Seen>,
}

/// One of them.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Seen {
    pub(super) slopes: Vec<(usize, f64)>,
    /// In m².
    pub(super) variance: f64,
}

/// The stopping distance (m), from the command on.
pub(super) fn stop_distance(answers: &Answers<'_>, step: u8, above: bool) -> f64 {
    distance_and_time_to_rest(answers, step, above).0
}

pub(super) fn start_to(answers: &Answers<'_>, step: u8) -> Segment {
    Segment::of(&SpeedCommand { sent: 0.0, from: 0, to: step, at_rest: true }, answers, Pace::steady(0.0))
}

/// The time (s) at which a growing function reaches a value, by bisection.
pub(super) fn time_of(value: f64, of: impl Fn(f64) -> f64) -> f64 {
    let (mut early, mut late) = (0.0, 60.0);
    for _ in 0..40 {
        let middle = 0.5 * (early + late);
        if of(middle) < value {
            early = middle;
        } else {
            late = middle;
        }
    }
    late
}

impl MotionModel {
    /// The slopes of a function in the model's numbers.
    pub(super) fn slopes(&self, of: impl Fn(&Answers<'_>) -> f64) -> Vec<(usize, f64)> {
        self.spread.slopes(&self.values, self.steps(), of)
    }

    /// A hop at a steady step.
    pub fn prospect_of_speed(&self, step: SpeedStep, approach: Approach) -> ExpectedInformation {
        let (place, above) = (usize::from(step.get()), approach == Approach::Above);
        let speed = self.answers().speed(place, above).max(0.01);
        let takes = HOP / speed;
        let slopes = self.slopes(|answers| takes * answers.speed(place, above));
        let variance =
            sum_of_squares(&[speed * TIMING * core::f64::consts::SQRT_2, PLACE, TRIP_DEVIATION * HOP]);
        ExpectedInformation { seen: vec![Seen { slopes, variance }] }
    }

    /// A stop from a steady step, then creep to the next sensor. With `past`, the train passes a sensor this far before it comes
    /// to rest, and creeps to the one after it.
    pub fn prospect_of_stop(
        &self,
        step: SpeedStep,
        approach: Approach,
        creep: SpeedStep,
        past: Option<Length>,
    ) -> ExpectedInformation {
        let (step, above) = (step.get(), approach == Approach::Above);
        let answers = self.answers();
        let speed = answers.speed(usize::from(step), above);
        let scatter = self.scatter.of_stop(speed);
        let whole = stop_distance(&answers, step, above);
        // The place of the train at the command.
        let begin = sum_of_squares(&[speed * TIMING, PLACE]);
        let (time, creep_speed) = self.creep(creep, if past.is_some() { TO_NEXT } else { CREEP });
        let started = |answers: &Answers<'_>| start_to(answers, creep.get()).distance(time);
        let late = creep_speed * LATE_START;
        let restart = [late, creep_speed * TIMING, PLACE];
        if let Some(past) = past {
            let until = (whole - past.as_m()).max(0.0);
            let distance = |answers: &Answers<'_>, time: f64| {
                let speed = answers.speed(usize::from(step), above);
                let segment = stop_from(answers, step, speed);
                speed * segment.begins + segment.distance(time)
            };
            let passed = time_of(until, |time| distance(&answers, time));
            let slow = stop_from(&answers, step, speed).speed(passed);
            // The stop's own scatter comes about as it runs. What comes after the sensor is measured from there.
            let before = if whole > 0.0 { until / whole } else { 0.0 };
            let here = [slow * TIMING, SHAPE * whole];
            let first = begin + sum_of_squares(&here) + sum_of_squares(&[before * scatter]);
            let rest = sum_of_squares(&here)
                + sum_of_squares(&restart)
                + sum_of_squares(&[(1.0 - before) * scatter, TRIP_DEVIATION * TO_NEXT]);
            let remaining = |answers: &Answers<'_>| {
                stop_distance(answers, step, above) - distance(answers, passed) + started(answers)
            };
            return ExpectedInformation {
                seen: vec![
                    Seen { slopes: self.slopes(|answers| distance(answers, passed)), variance: first },
                    Seen { slopes: self.slopes(remaining), variance: rest },
                ],
            };
        }
        let slopes = self.slopes(|answers| stop_distance(answers, step, above) + started(answers));
        let variance = begin + sum_of_squares(&restart) + sum_of_squares(&[scatter, TRIP_DEVIATION * CREEP]);
        ExpectedInformation { seen: vec![Seen { slopes, variance }] }
    }

    /// A short move from a place of rest that was reached at creep speed, then creep to the next sensor.
    pub fn prospect_of_move(&self, step: SpeedStep, run: TimeSpan, creep: SpeedStep) -> ExpectedInformation {
        let (time, creep_speed) = self.creep(creep, CREEP);
        let slopes = self.slopes(|answers| {
            stop_distance(answers, creep.get(), false)
                + move_distance(answers, step.get(), run.as_s())
                + start_to(answers, creep.get()).distance(time)
        });
        let answers = self.answers();
        let reached = start_to(&answers, step.get()).speed(run.as_s());
        let late =
            sum_of_squares(&[creep_speed * LATE_START, reached * LATE_START, creep_speed * TIMING, PLACE]);
        let scatter = self.scatter.of_stop(reached);
        ExpectedInformation { seen: vec![Seen { slopes, variance: late + scatter * scatter }] }
    }

    /// The time (s) of creeping over a distance (m) from rest, and the speed (m/s) then.
    fn creep(&self, step: SpeedStep, distance: f64) -> (f64, f64) {
        let answers = self.answers();
        let start = start_to(&answers, step.get());
        let time = time_of(distance, |time| if time <= start.begins { 0.0 } else { start.distance(time) });
        (time, start.speed(time))
    }
}

fn sum_of_squares(of: &[f64]) -> f64 {
    of.iter().map(|one| one * one).sum()
}
