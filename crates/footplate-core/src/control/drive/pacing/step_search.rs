//! Finds the next step and its time so that a train stays on its reference.
//!
//! The search covers all sequences of commands on a time grid within the command budget, with the steps around the
//! desired speed. Letters: `x(t)` predicted place, `r(t)` reference, `z` the place at the end if the speed that it
//! will settle to had applied all the time: it includes what the last commands have yet to do. The cost of a sequence
//! is
//!
//! ```text
//! Σ (x − r)² δ  +  W (z − r)²  +  V (v − v_r)²  +  C per command
//! ```
//!
//! A sequence that costs more than the best one so far is not continued (branch and bound).

use crate::event::Approach;
use crate::ids::SpeedStep;
use crate::model::MotionModel;
use crate::time::{TimeSpan, Timestamp};
use crate::tracking::Rollout;

use super::reference::{GRID_S, POINTS, Reference, SurveyedPath};

/// Commands in one sequence: what the budget allows, and few enough to enumerate.
const MAX_COMMANDS: usize = 3;
/// Times closer than this (s) are equal.
const SAME_TIME: f64 = 1e-6;
/// Weight of the error at the end, as the time (s) that it would last.
const END_WEIGHT: f64 = 0.8;
/// Weight of the speed error at the end (s³): chosen small, a tenth of the speed over two seconds counts little.
const SPEED_WEIGHT: f64 = 0.02;
/// The cost of a command: an error of 1 mm for one second (m² s).
const COMMAND_COST: f64 = 1e-6;
/// Steps searched: those around the desired speed, and one on either side, a measured step further, to catch up or fall back.
const STEPS: usize = 4;

/// A large error is corrected over about this time (s), with at most this difference in speed (m/s), so that the
/// train does not race.
const CATCH_UP_TIME: f64 = 3.0;
const MAX_CATCH_UP_SPEED: f64 = 0.12;

/// The result of a search.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Choice {
    /// The first command and its grid time.
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
    pub(super) path: &'a SurveyedPath,
    pub(super) reference: &'a Reference,
    /// Start of the grid (s on the clock of the rollout), and the delay from a command to its being sent.
    pub(super) now: f64,
    pub(super) leaves_after: f64,
    steps: [Option<SpeedStep>; STEPS],
    best: Choice,
}

impl<'a> StepSearch<'a> {
    /// A search with the steps around the desired speed at the middle of the grid, for a train that is `behind` (m)
    /// its reference.
    pub(super) fn new(
        model: &'a MotionModel,
        path: &'a SurveyedPath,
        reference: &'a Reference,
        usable: &[SpeedStep],
        [now, leaves_after]: [f64; 2],
        behind: f64,
    ) -> Self {
        let [first, last] = reference.speeds;
        let wanted =
            0.5 * (first + last) + (behind / CATCH_UP_TIME).clamp(-MAX_CATCH_UP_SPEED, MAX_CATCH_UP_SPEED);
        let below = |step: &SpeedStep| model.steady_speed(*step, Approach::Below).as_m_per_s() <= wanted;
        let under = usable.iter().take_while(|step| below(step)).count();
        // With finer steps, the outer ones are as far away as they are with 14.
        let further = usize::from(model.stride()) - 1;
        let first = under.saturating_sub(2).min(usable.len().saturating_sub(STEPS));
        let place = |nth: usize| match nth {
            0 => first.saturating_sub(further),
            3 => (first + nth + further).min(usable.len().saturating_sub(1)).max(first + nth),
            nth => first + nth,
        };
        let steps = core::array::from_fn(|nth| usable.get(place(nth)).copied());
        let best = Choice { first: None, cost: f64::INFINITY };
        Self { model, path, reference, now, leaves_after, steps, best }
    }

    /// The best sequence within the rest of a budget.
    pub(super) fn best(mut self, rollout: Rollout, budget: CommandBudget) -> Choice {
        self.extend(0, &rollout, Sequence { budget, first: None, commands: 0, cost: 0.0 });
        self.best
    }

    fn extend(&mut self, at: usize, rollout: &Rollout, sequence: Sequence) {
        if sequence.cost >= self.best.cost {
            return;
        }
        let Some(ideal) = self.reference.places.get(at).copied() else {
            return self.end(rollout, sequence);
        };
        let Sequence { budget, first, commands, .. } = sequence;
        let time = self.now + GRID_S * at as f64;
        let leaves = time + self.leaves_after;
        let commanded = rollout.step();
        let steps = self.steps;
        let may = commands < MAX_COMMANDS && budget.free() <= time + SAME_TIME;
        let others = steps.iter().flatten().filter(|step| may && step.get() != commanded);
        for command in core::iter::once(None).chain(others.map(Some)) {
            let mut next = *rollout;
            let mut command_cost = 0.0;
            let mut left = budget;
            if let Some(step) = command {
                let deviation = next.interruption_deviation(self.model, leaves);
                command_cost = COMMAND_COST + END_WEIGHT * deviation * deviation;
                next.command(self.model, leaves, *step);
                left.record(time);
            }
            let place = self.path.surveyed(next.place(self.model, time + GRID_S));
            let error = place - ideal;
            let so_far = Sequence {
                budget: left,
                first: first.or(command.map(|step| (at, *step))),
                commands: commands + usize::from(command.is_some()),
                cost: sequence.cost + command_cost + error * error * GRID_S,
            };
            self.extend(at + 1, &next, so_far);
        }
    }

    fn end(&mut self, rollout: &Rollout, Sequence { cost, first, .. }: Sequence) {
        let time = self.now + GRID_S * POINTS as f64;
        let [place, speed] = rollout.settled_place_and_speed(self.model, time);
        let error = self.path.surveyed(place) - self.reference.last();
        let [_, wanted] = self.reference.speeds;
        let faster = speed - wanted;
        let cost = cost + END_WEIGHT * error * error + SPEED_WEIGHT * faster * faster;
        if cost < self.best.cost {
            self.best = Choice { first, cost };
        }
    }
}

/// Shortest time between two commands to a train: decoders receive each command, but one before the last has taken
/// effect is useless.
pub(super) const SPACING: TimeSpan = TimeSpan::from_ms(200);
/// A paced train sends at most [`IN_A_ROW`] commands within this time: four trains then use 6 % of a 2400-baud line.
pub(super) const BUDGET: TimeSpan = TimeSpan::from_s(2.0);
pub(super) const IN_A_ROW: usize = 3;

/// When the last commands were sent, oldest first (s on any clock); `-∞` for none.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct CommandBudget {
    sent: [f64; IN_A_ROW],
}

impl CommandBudget {
    /// No command sent yet.
    pub(super) const UNUSED: Self = Self { sent: [f64::NEG_INFINITY; IN_A_ROW] };

    /// Records a command.
    pub(super) fn record(&mut self, sent: f64) {
        self.sent.rotate_left(1);
        if let Some(last) = self.sent.last_mut() {
            *last = sent;
        }
    }

    /// When the next command may be sent.
    pub(super) fn free(&self) -> f64 {
        let [oldest, .., last] = self.sent;
        (last + SPACING.as_s()).max(oldest + BUDGET.as_s())
    }

    /// The same budget on a clock that is ahead by a time (s).
    pub(super) fn later(self, by: f64) -> Self {
        Self { sent: self.sent.map(|sent| sent + by) }
    }
}

/// A time in seconds on the clock of budgets.
pub(super) fn seconds(time: Timestamp) -> f64 {
    (time - Timestamp::ZERO).as_s()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_commands_in_a_row_use_up_the_budget_of_two_seconds() {
        let mut budget = CommandBudget::UNUSED;
        assert!(budget.free() < 0.0);
        for sent in [10.0, 10.2] {
            budget.record(sent);
            assert!((budget.free() - (sent + 0.2)).abs() < 1e-9);
        }
        budget.record(10.4);
        assert!((budget.free() - 12.0).abs() < 1e-9);
        assert!((budget.later(-10.0).free() - 2.0).abs() < 1e-9);
    }
}
