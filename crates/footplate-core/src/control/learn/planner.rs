//! Chooses the next experiment.
//!
//! First a staircase, because gains are unknown before a step was measured once: each step from below going up,
//! and from above going down. Then, for the rest of the budget, the experiment with the largest [`gain`] per
//! second.

use alloc::collections::BTreeMap;
use alloc::vec::Vec;

use super::accuracy::{steps, usable_steps};
use super::experiment::{Experiment, TYPICAL_HOP, Why, gain, objective, past_by};
use crate::event::Approach;
use crate::ids::SpeedStep;
use crate::model::{MotionModel, StepUse};
use crate::time::TimeSpan;
use crate::units::Speed;

/// Slower steps are not tried: a hop takes ten seconds, and five minutes have too few of them.
const SLOWEST_WORTH_TRYING: Speed = Speed::from_mm_per_s(40.0);

/// The slowest creeping speed: slower steps often stall.
const SLOWEST_CREEP: Speed = Speed::from_mm_per_s(70.0);

/// A step with this many detections is left out of the staircase.
pub(super) const KNOWN_FROM: u32 = 2;

/// A step is approached from this many measured steps above or below: enough for an effect, and quick.
const RUN_UP: u8 = 2;

/// Durations of short moves (s), from just moving to nearly the steady speed.
const MOVES: [f64; 3] = [0.7, 1.2, 2.0];

/// A sensor may be passed while braking only if the overshoot is at most this part of the stopping distance.
const MOST_PAST: f64 = 0.5;

/// The fastest step for short moves.
const FASTEST_MOVE: Speed = Speed::from_mm_per_s(300.0);

/// A speed with this many detections is not measured again: the remaining uncertainty is that of the survey, which all
/// speeds share and no run reduces.
const ENOUGH_DETECTIONS: u32 = 8;

/// ... nor is one measured more often than this.
const MOST_RUNS: u32 = 2;

/// From rest to the next command: the last detection is reported by then.
const PAUSE: TimeSpan = TimeSpan::from_ms(500);

/// Time from rest over most of a hop, at a suitable step.
const LONG_CREEP: TimeSpan = TimeSpan::from_ms(4_000);

/// Experiments that gain less than this per second are not worth the wear (in variances of a stop).
const LEAST_RATE: f64 = 1e-4;

/// The commanded step, and the side from which it was reached.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Throttle {
    pub(super) step: SpeedStep,
    pub(super) approach: Approach,
}

impl Throttle {
    pub(super) const AT_REST: Self = Self { step: SpeedStep::STAND, approach: Approach::Below };
}

/// A chosen experiment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Choice {
    pub(super) experiment: Experiment,
    pub(super) why: Why,
}

/// The experiments so far, and the direction of the staircase.
#[derive(Debug, Clone, Default)]
pub(super) struct Planner {
    runs: BTreeMap<(SpeedStep, Approach), u32>,
    stops: BTreeMap<(SpeedStep, Approach), u32>,
    goes_down: bool,
}

impl Planner {
    /// Counts an experiment, successful or not.
    pub(super) fn note(&mut self, experiment: &Experiment) {
        let (table, key) = match *experiment {
            Experiment::Speed { step, approach } => (&mut self.runs, (step, approach)),
            Experiment::Stop { step, approach, .. } => (&mut self.stops, (step, approach)),
            Experiment::Move { .. } => return,
        };
        *table.entry(key).or_default() += 1;
    }

    /// The number of stops from a step.
    pub(super) fn stops(&self, step: SpeedStep, approach: Approach) -> u32 {
        self.stops.get(&(step, approach)).copied().unwrap_or(0)
    }

    fn runs_at(&self, step: SpeedStep, approach: Approach) -> u32 {
        self.runs.get(&(step, approach)).copied().unwrap_or(0)
    }

    /// The next experiment that fits into the remaining time.
    pub(super) fn choose(
        &mut self,
        model: &MotionModel,
        throttle: Throttle,
        left: TimeSpan,
    ) -> Option<Choice> {
        let fits = |experiment: &Experiment| cost(model, throttle, experiment) <= left;
        let stair = self.staircase(model, throttle).filter(|experiment| fits(experiment));
        if let Some(experiment) = stair {
            return Some(Choice { experiment, why: Why::NeverTried });
        }
        let objective = objective(model);
        let mut best: Option<(f64, Choice)> = None;
        for experiment in self.candidates(model).into_iter().filter(fits) {
            let takes = cost(model, throttle, &experiment);
            let gain = gain(model, &objective, &experiment);
            let rate = gain / takes.as_s().max(0.1);
            if rate > LEAST_RATE && best.is_none_or(|(most, _)| rate > most) {
                best = Some((rate, Choice { experiment, why: Why::MostPerSecond { gain, takes } }));
            }
        }
        best.map(|(_, choice)| choice)
    }

    /// The nearest step, first upwards and then downwards, that was not measured yet.
    fn staircase(&mut self, model: &MotionModel, throttle: Throttle) -> Option<Experiment> {
        if !self.goes_down {
            let up = steps(model).find(|step| {
                *step > throttle.step
                    && *step > lowest_start(model)
                    && self.is_new(model, *step, Approach::Below)
            });
            if let Some(step) = up {
                return Some(Experiment::Speed { step, approach: Approach::Below });
            }
            self.goes_down = true;
        }
        let down = steps(model)
            .rev()
            .find(|step| *step < throttle.step && self.is_new(model, *step, Approach::Above));
        down.map(|step| Experiment::Speed { step, approach: Approach::Above })
    }

    fn is_new(&self, model: &MotionModel, step: SpeedStep, approach: Approach) -> bool {
        let speed = model.speed(step, approach);
        let is_known = model.uses(step) != StepUse::Untried && speed.count >= KNOWN_FROM;
        !self.runs.contains_key(&(step, approach)) && !is_known && is_worth_trying(model, step, approach)
    }

    fn candidates(&self, model: &MotionModel) -> Vec<Experiment> {
        let mut all = Vec::new();
        let usable = usable_steps(model);
        for step in &usable {
            for approach in [Approach::Below, Approach::Above] {
                // The highest step is never reached from above.
                if approach == Approach::Above && usable.last() == Some(step) {
                    continue;
                }
                all.push(Experiment::Stop { step: *step, approach, is_past: false });
                if past_by(model, *step, approach) <= MOST_PAST * model.stop_distance(*step, approach) {
                    all.push(Experiment::Stop { step: *step, approach, is_past: true });
                }
                if model.speed(*step, approach).count < ENOUGH_DETECTIONS
                    && self.runs_at(*step, approach) < MOST_RUNS
                {
                    all.push(Experiment::Speed { step: *step, approach });
                }
            }
        }
        let slow = |step: &&SpeedStep| model.steady_speed(**step, Approach::Below) <= FASTEST_MOVE;
        for step in usable.iter().filter(slow).skip(1).step_by(2) {
            all.extend(MOVES.map(|run| Experiment::Move { step: *step, run: TimeSpan::from_s(run) }));
        }
        let untried = steps(model).filter(|step| !usable.contains(step));
        let untried = untried.filter(|step| self.is_new(model, *step, Approach::Below));
        all.extend(untried.map(|step| Experiment::Speed { step, approach: Approach::Below }));
        all
    }
}

fn is_worth_trying(model: &MotionModel, step: SpeedStep, approach: Approach) -> bool {
    model.uses(step) != StepUse::Unreliable && model.steady_speed(step, approach) >= SLOWEST_WORTH_TRYING
}

/// The highest step that does not move the train reliably: the staircase begins above it.
fn lowest_start(model: &MotionModel) -> SpeedStep {
    let bad = steps(model).rev().find(|step| model.uses(*step) == StepUse::Unreliable);
    bad.unwrap_or(SpeedStep::STAND)
}

/// The slowest step that reliably reaches a sensor.
pub(super) fn creep_step(model: &MotionModel) -> Option<SpeedStep> {
    let usable = usable_steps(model);
    let fast_enough = |step: &&SpeedStep| model.steady_speed(**step, Approach::Below) >= SLOWEST_CREEP;
    usable.iter().find(fast_enough).or(usable.last()).copied()
}

/// The step to run at first so that a step is reached from the side of an approach.
pub(super) fn run_up_step(model: &MotionModel, step: SpeedStep, approach: Approach) -> SpeedStep {
    if approach == Approach::Above {
        let higher = step.get().saturating_add(RUN_UP * model.stride()).min(model.highest().get());
        return SpeedStep::new(higher).unwrap_or(step);
    }
    let lower = step.get().saturating_sub(RUN_UP * model.stride());
    let lower = SpeedStep::new(lower).filter(|lower| model.uses(*lower) == StepUse::Moves);
    lower.unwrap_or(SpeedStep::STAND)
}

/// Whether the train has to run at [`run_up_step`] first.
pub(super) fn needs_run_up(throttle: Throttle, step: SpeedStep, approach: Approach) -> bool {
    if throttle.step == step {
        return throttle.approach != approach;
    }
    (approach == Approach::Above) != (throttle.step > step)
}

/// Track time of an experiment, from now until the next one can begin.
pub(super) fn cost(model: &MotionModel, throttle: Throttle, experiment: &Experiment) -> TimeSpan {
    match *experiment {
        Experiment::Speed { step, approach } => {
            reaching(model, throttle, step, approach) + hop_time(model, step, approach, 1.5)
        }
        Experiment::Stop { step, approach, is_past } => {
            let stop = model.stop_time(step, approach) + PAUSE;
            let on = if is_past { LONG_CREEP } else { creep(model, 0.2) };
            reaching(model, throttle, step, approach) + hop_time(model, step, approach, 1.0) + stop + on
        }
        Experiment::Move { step, run } => {
            let slow = creep_step(model).unwrap_or(step);
            let brake = model.stop_time(slow, Approach::Below) + PAUSE;
            let brake_again = model.stop_time(step, Approach::Below) + PAUSE;
            let first_detection = hop_time(model, slow, Approach::Below, 0.5);
            reaching(model, throttle, slow, throttle.approach)
                + first_detection
                + brake
                + run
                + brake_again
                + creep(model, 0.6)
        }
    }
}

fn reaching(model: &MotionModel, throttle: Throttle, step: SpeedStep, approach: Approach) -> TimeSpan {
    if throttle.step == step && throttle.approach == approach {
        return TimeSpan::ZERO;
    }
    if needs_run_up(throttle, step, approach) {
        let by = run_up_step(model, step, approach);
        return model.settles_within(throttle.step, by) + model.settles_within(by, step);
    }
    model.settles_within(throttle.step, step)
}

/// The time for a number of typical hops.
fn hop_time(model: &MotionModel, step: SpeedStep, approach: Approach, hops: f64) -> TimeSpan {
    let speed = model.steady_speed(step, approach).max(Speed::from_mm_per_s(10.0));
    hops * TYPICAL_HOP / speed
}

fn creep(model: &MotionModel, hops: f64) -> TimeSpan {
    let step = creep_step(model).unwrap_or(model.highest());
    model.settles_within(SpeedStep::STAND, step) + hop_time(model, step, Approach::Below, hops)
}
