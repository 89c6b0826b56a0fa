//! Which step to command next, and when, so that a train stays where it should be.
//!
//! All sequences of commands on a grid of times are looked at, none sooner after another than the budget allows, with the
//! steps about the speed that is wanted. Letters: `x(t)` the course that a sequence would bring about, `r(t)` the
//! reference, `z(t)` the course at the end if the speed that it will settle to had always been run at: what the
//! commands of the last moments still will do. What a sequence costs is
//!
//! ```text
//! Σ (x − r)² δ  +  W (z − r)²  +  V (v − v_r)²  +  C per command
//! ```
//!
//! Sequences that already cost more than the best one found are not followed further (branch and bound).

use super::command_budget::CommandBudget;
use super::reference::{GRID, LOOKS, Reference};
use super::surveyed_path::SurveyedPath;
use crate::event::Approach;
use crate::ids::SpeedStep;
use crate::model::MotionModel;
use crate::tracking::Rollout;

/// Commands in one plan: what the budget leaves for its time, and few enough to look at all of them.
const MOST_COMMANDS: usize = 3;
/// Times nearer than this (s) are one.
const SAME_TIME: f64 = 1e-6;
/// Weight of where the course leads at the end, as time (s) for which that error would last.
const END_WEIGHT: f64 = 0.8;
/// Weight of a speed at the end that is not the ideal's (s³): a tenth of it over two seconds counts little.
const SPEED_WEIGHT: f64 = 0.02;
/// A command costs as much as being 1 mm off for a second (m² s).
const COMMAND_COST: f64 = 1e-6;
/// Steps tried: those about the ideal speed, and one more on either side to catch up or fall back with.
const STEPS: usize = 4;

/// A train that is far off is brought back over about this time (s), by no more than so much speed (m/s): nobody wants to
/// see it race.
const CATCHES_UP: f64 = 3.0;
const FASTEST_CATCH: f64 = 0.12;

/// What to do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Choice {
    /// The first command and the grid time at which it should leave.
    pub(super) first: Option<(usize, SpeedStep)>,
    pub(super) cost: f64,
}

/// The commands up to a grid time.
#[derive(Debug, Clone, Copy)]
struct Sequence {
    budget: CommandBudget,
    first: Option<(usize, SpeedStep)>,
    commands: usize,
    cost: f64,
}

/// The search from one moment.
pub(super) struct StepSearch<'a> {
    pub(super) model: &'a MotionModel,
    pub(super) way: &'a SurveyedPath,
    pub(super) reference: &'a Reference,
    /// The moment (s on the clock of the rollout) from which the grid counts, and how much later a command leaves than it
    /// is given.
    pub(super) now: f64,
    pub(super) leaves_after: f64,
    steps: [Option<SpeedStep>; STEPS],
    best: Choice,
}

impl<'a> StepSearch<'a> {
    /// With the steps about the speed that is wanted in the middle of the time looked at, for a train that is so far (m)
    /// behind its reference. Times as in the fields of those names.
    pub(super) fn new(
        model: &'a MotionModel,
        way: &'a SurveyedPath,
        reference: &'a Reference,
        usable: &[SpeedStep],
        [now, leaves_after]: [f64; 2],
        behind: f64,
    ) -> Self {
        let [first, last] = reference.speeds;
        let wanted = 0.5 * (first + last) + (behind / CATCHES_UP).clamp(-FASTEST_CATCH, FASTEST_CATCH);
        let below = |step: &SpeedStep| model.steady_speed(*step, Approach::Below).as_m_per_s() <= wanted;
        let under = usable.iter().take_while(|step| below(step)).count();
        let from = under.saturating_sub(2).min(usable.len().saturating_sub(STEPS));
        let steps = core::array::from_fn(|nth| usable.get(from + nth).copied());
        let best = Choice { first: None, cost: f64::INFINITY };
        Self { model, way, reference, now, leaves_after, steps, best }
    }

    /// The best of all sequences that stay within what is left of a budget.
    pub(super) fn best(mut self, rollout: Rollout, budget: CommandBudget) -> Choice {
        self.go_on(0, &rollout, Sequence { budget, first: None, commands: 0, cost: 0.0 });
        self.best
    }

    fn go_on(&mut self, at: usize, rollout: &Rollout, sequence: Sequence) {
        if sequence.cost >= self.best.cost {
            return;
        }
        let Some(ideal) = self.reference.places.get(at).copied() else {
            return self.end(rollout, sequence);
        };
        let Sequence { budget, first, commands, .. } = sequence;
        let time = self.now + GRID * at as f64;
        let leaves = time + self.leaves_after;
        let commanded = rollout.step();
        let steps = self.steps;
        let may = commands < MOST_COMMANDS && budget.free() <= time + SAME_TIME;
        let others = steps.iter().flatten().filter(|step| may && step.get() != commanded);
        for command in core::iter::once(None).chain(others.map(Some)) {
            let mut next = *rollout;
            let mut paid = 0.0;
            let mut left = budget;
            if let Some(step) = command {
                let doubt = next.doubt_of_interruption(self.model, leaves);
                paid = COMMAND_COST + END_WEIGHT * doubt * doubt;
                next.command(self.model, leaves, *step);
                left.take(time);
            }
            let place = self.way.surveyed(next.place(self.model, time + GRID));
            let off = place - ideal;
            let so_far = Sequence {
                budget: left,
                first: first.or(command.map(|step| (at, *step))),
                commands: commands + usize::from(command.is_some()),
                cost: sequence.cost + paid + off * off * GRID,
            };
            self.go_on(at + 1, &next, so_far);
        }
    }

    fn end(&mut self, rollout: &Rollout, Sequence { cost, first, .. }: Sequence) {
        let time = self.now + GRID * LOOKS as f64;
        let [place, speed] = rollout.settled_place_and_speed(self.model, time);
        let off = self.way.surveyed(place) - self.reference.last();
        let [_, wanted] = self.reference.speeds;
        let faster = speed - wanted;
        let cost = cost + END_WEIGHT * off * off + SPEED_WEIGHT * faster * faster;
        if cost < self.best.cost {
            self.best = Choice { first, cost };
        }
    }
}
