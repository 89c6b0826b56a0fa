//! What to try next: the experiment that gains the most for its time.
//!
//! First a staircase, for nothing can be weighed before it was seen once: each step from below on the way up, from above
//! on the way down. Then, for the rest of the budget, whatever has the largest [`gain`] per second.

use alloc::collections::BTreeMap;
use alloc::vec::Vec;

use super::accuracy::usable_steps;
use super::experiment::{Experiment, Why};
use super::gain::{TYPICAL_HOP, gain, objective, past_by};
use crate::event::Approach;
use crate::ids::SpeedStep;
use crate::model::{MotionModel, StepUse};
use crate::time::TimeSpan;
use crate::units::Speed;

/// Below this a hop takes ten seconds, and five minutes bring too few of them: such steps are not tried.
const SLOWEST_WORTH_TRYING: Speed = Speed::from_mm_per_s(40.0);

/// A crawl is at least this fast: slower steps are those that stall.
const SLOWEST_CRAWL: Speed = Speed::from_mm_per_s(70.0);

/// Contacts at a step after which its speed needs no staircase any more.
pub(super) const KNOWN_FROM: u32 = 2;

/// How many measured steps away a step is approached from above, or from below: far enough to show, near enough to be quick.
const RUN_UP: u8 = 2;

/// Runs of short moves, from what just moves a train to what nearly reaches the speed (`s`).
const MOVES: [f64; 3] = [0.7, 1.2, 2.0];

/// A contact is passed in braking only if at least the rest of the stop lies before it.
const MOST_PAST: f64 = 0.5;

/// Short moves are tried at steps up to this speed.
const FASTEST_MOVE: Speed = Speed::from_mm_per_s(300.0);

/// A speed that so many contacts have told is not run for its own sake any more: what is left of its doubt is the survey's,
/// which all speeds share and no run narrows.
const ENOUGH_CONTACTS: u32 = 8;

/// ... and none is run more often than this.
const MOST_RUNS: u32 = 2;

/// From rest to the next command: reports of the last contact are in by then.
const PAUSE: TimeSpan = TimeSpan::from_ms(500);

/// From rest over the better part of a hop, at the step that does it in about this time.
const LONG_CRAWL: TimeSpan = TimeSpan::from_ms(4_000);

/// Experiments that gain less than this in a second are not worth wearing the train out: a thousandth of a stop's scatter
/// squared.
const LEAST_RATE: f64 = 1e-4;

/// How the train goes now.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Stance {
    pub(super) step: SpeedStep,
    pub(super) approach: Approach,
}

impl Stance {
    pub(super) const STANDS: Self = Self { step: SpeedStep::STAND, approach: Approach::Below };
}

/// What was chosen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Choice {
    pub(super) experiment: Experiment,
    pub(super) why: Why,
}

/// What was tried so far, in which direction the staircase goes.
#[derive(Debug, Clone, Default)]
pub(super) struct Planner {
    runs: BTreeMap<(SpeedStep, Approach), u32>,
    stops: BTreeMap<(SpeedStep, Approach), u32>,
    goes_down: bool,
}

impl Planner {
    /// An experiment has been made, or was tried in vain.
    pub(super) fn note(&mut self, experiment: &Experiment) {
        let (table, key) = match *experiment {
            Experiment::Speed { step, approach } => (&mut self.runs, (step, approach)),
            Experiment::Stop { step, approach, .. } => (&mut self.stops, (step, approach)),
            Experiment::Move { .. } => return,
        };
        *table.entry(key).or_default() += 1;
    }

    /// Stops made from a step.
    pub(super) fn stops(&self, step: SpeedStep, approach: Approach) -> u32 {
        self.stops.get(&(step, approach)).copied().unwrap_or(0)
    }

    fn runs_at(&self, step: SpeedStep, approach: Approach) -> u32 {
        self.runs.get(&(step, approach)).copied().unwrap_or(0)
    }

    /// The next experiment, if one fits into the time that is left.
    pub(super) fn choose(&mut self, model: &MotionModel, stance: Stance, left: TimeSpan) -> Option<Choice> {
        let fits = |experiment: &Experiment| cost(model, stance, experiment) <= left;
        let stair = self.staircase(model, stance).filter(|experiment| fits(experiment));
        if let Some(experiment) = stair {
            return Some(Choice { experiment, why: Why::NeverTried });
        }
        let objective = objective(model);
        let mut best: Option<(f64, Choice)> = None;
        for experiment in self.candidates(model).into_iter().filter(fits) {
            let takes = cost(model, stance, &experiment);
            let gain = gain(model, &objective, &experiment);
            let rate = gain / takes.as_s().max(0.1);
            if rate > LEAST_RATE && best.is_none_or(|(most, _)| rate > most) {
                best = Some((rate, Choice { experiment, why: Why::MostPerSecond { gain, takes } }));
            }
        }
        best.map(|(_, choice)| choice)
    }

    /// The nearest step ahead, up and then down, at which nothing was measured yet.
    fn staircase(&mut self, model: &MotionModel, stance: Stance) -> Option<Experiment> {
        if !self.goes_down {
            let up = model.knots().find(|step| {
                *step > stance.step
                    && *step > lowest_start(model)
                    && self.is_new(model, *step, Approach::Below)
            });
            if let Some(step) = up {
                return Some(Experiment::Speed { step, approach: Approach::Below });
            }
            self.goes_down = true;
        }
        let down = model
            .knots()
            .rev()
            .find(|step| *step < stance.step && self.is_new(model, *step, Approach::Above));
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
                if past_by(model, *step, approach) <= MOST_PAST * model.stop(*step, approach).distance {
                    all.push(Experiment::Stop { step: *step, approach, is_past: true });
                }
                if model.speed(*step, approach).count < ENOUGH_CONTACTS
                    && self.runs_at(*step, approach) < MOST_RUNS
                {
                    all.push(Experiment::Speed { step: *step, approach });
                }
            }
        }
        let slow = |step: &&SpeedStep| model.speed(**step, Approach::Below).value <= FASTEST_MOVE;
        for step in usable.iter().filter(slow).skip(1).step_by(2) {
            all.extend(MOVES.map(|run| Experiment::Move { step: *step, run: TimeSpan::from_s(run) }));
        }
        let untried = model.knots().filter(|step| !usable.contains(step));
        let untried = untried.filter(|step| self.is_new(model, *step, Approach::Below));
        all.extend(untried.map(|step| Experiment::Speed { step, approach: Approach::Below }));
        all
    }
}

fn is_worth_trying(model: &MotionModel, step: SpeedStep, approach: Approach) -> bool {
    model.uses(step) != StepUse::Unreliable && model.speed(step, approach).value >= SLOWEST_WORTH_TRYING
}

/// The staircase begins above the steps that were found not to move the train.
fn lowest_start(model: &MotionModel) -> SpeedStep {
    let bad = model.knots().rev().find(|step| model.uses(*step) == StepUse::Unreliable);
    bad.unwrap_or(SpeedStep::STAND)
}

/// The slowest step that can be relied upon to reach a contact with.
pub(super) fn crawl_step(model: &MotionModel) -> Option<SpeedStep> {
    let usable = usable_steps(model);
    let fast_enough = |step: &&SpeedStep| model.speed(**step, Approach::Below).value >= SLOWEST_CRAWL;
    usable.iter().find(fast_enough).or(usable.last()).copied()
}

/// The step from which a step is reached by an approach, when the train does not come from that side anyway.
pub(super) fn run_up_step(model: &MotionModel, step: SpeedStep, approach: Approach) -> SpeedStep {
    if approach == Approach::Above {
        let higher = step.get().saturating_add(RUN_UP * model.stride()).min(model.highest().get());
        return SpeedStep::new(higher).unwrap_or(step);
    }
    let lower = step.get().saturating_sub(RUN_UP * model.stride());
    let lower = SpeedStep::new(lower).filter(|lower| model.uses(*lower) == StepUse::Moves);
    lower.unwrap_or(SpeedStep::STAND)
}

/// Whether the train has to go by [`run_up_step`] first.
pub(super) fn needs_run_up(stance: Stance, step: SpeedStep, approach: Approach) -> bool {
    if stance.step == step {
        return stance.approach != approach;
    }
    (approach == Approach::Above) != (stance.step > step)
}

/// Track time of an experiment, from now to when the next could begin.
pub(super) fn cost(model: &MotionModel, stance: Stance, experiment: &Experiment) -> TimeSpan {
    match *experiment {
        Experiment::Speed { step, approach } => {
            reaching(model, stance, step, approach) + hop_time(model, step, approach, 1.5)
        }
        Experiment::Stop { step, approach, is_past } => {
            let stop = model.stop(step, approach).time + PAUSE;
            let on = if is_past { LONG_CRAWL } else { crawl(model, 0.2) };
            reaching(model, stance, step, approach) + hop_time(model, step, approach, 1.0) + stop + on
        }
        Experiment::Move { step, run } => {
            let slow = crawl_step(model).unwrap_or(step);
            let brake = model.stop(slow, Approach::Below).time + PAUSE;
            let brake_again = model.stop(step, Approach::Below).time + PAUSE;
            let first_contact = hop_time(model, slow, Approach::Below, 0.5);
            reaching(model, stance, slow, stance.approach)
                + first_contact
                + brake
                + run
                + brake_again
                + crawl(model, 0.6)
        }
    }
}

fn reaching(model: &MotionModel, stance: Stance, step: SpeedStep, approach: Approach) -> TimeSpan {
    if stance.step == step && stance.approach == approach {
        return TimeSpan::ZERO;
    }
    if needs_run_up(stance, step, approach) {
        let by = run_up_step(model, step, approach);
        return model.settles_within(stance.step, by) + model.settles_within(by, step);
    }
    model.settles_within(stance.step, step)
}

/// The time over a part of a typical hop.
fn hop_time(model: &MotionModel, step: SpeedStep, approach: Approach, hops: f64) -> TimeSpan {
    let speed = model.speed(step, approach).value.max(Speed::from_mm_per_s(10.0));
    hops * TYPICAL_HOP / speed
}

fn crawl(model: &MotionModel, hops: f64) -> TimeSpan {
    let step = crawl_step(model).unwrap_or(model.highest());
    model.settles_within(SpeedStep::STAND, step) + hop_time(model, step, Approach::Below, hops)
}
