//! Chooses the step to stop from so that a train arrives on time.
//!
//! A train reaches its last steady run a little early or late, and the last sensors before the target show this best.
//! The rest of the time can still be corrected: a faster or slower step reaches the stop earlier or later, and its
//! stop takes its own time. Each step near the present one is predicted as a whole, up to rest.

use crate::control::drive::command_time::{CommandTime, command_time};
use crate::control::drive::driven_train::DrivenTrain;
use crate::control::drive::outputs::Outputs;
use crate::control::drive::task::{Destination, Goal, Task, TaskPhase};
use crate::ids::SpeedStep;
use crate::model::StandingTimes;
use crate::time::{TimeSpan, Timestamp};
use crate::tracking::{Rest, TrackContext};

use super::step_search::seconds;

/// One standard deviation of the required accuracy in time (s): 0.3 s at the 95th percentile ...
const TIME_TOLERANCE: f64 = 0.15;
/// ... and in place (m): 25 mm.
const PLACE_TOLERANCE: f64 = 0.0125;
/// Smallest gain for a change of step, in squared standard deviations: half of one is worth a command.
const MIN_GAIN: f64 = 0.25;
/// Steps examined on either side.
const STEPS_AROUND: u8 = 2;
/// Shortest time between a change of step and the stop: it must take effect to be worth its command.
const MIN_STEP_TIME: TimeSpan = TimeSpan::from_ms(600);

impl DrivenTrain {
    /// Changes the step of a train on its planned stop if it arrives closer to its time from another one.
    pub(in crate::control::drive) fn keep_time(
        &mut self,
        context: TrackContext<'_>,
        now: Timestamp,
        out: &mut Outputs,
    ) {
        let Some(Task { goal: Goal::RestAt(destination), phase: TaskPhase::Running { plan }, .. }) =
            self.task
        else {
            return;
        };
        let is_soon = plan.is_some_and(|plan| plan.leaves - now < MIN_STEP_TIME);
        if destination.in_time.is_none() || is_soon || !self.is_all_sent() {
            return;
        }
        if let Some(step) = self.step_in_time(context, now, &destination) {
            self.command_step(context, now, step, out);
        }
    }

    /// The step to command now, if one is better than the present one.
    pub(super) fn step_in_time(
        &self,
        context: TrackContext<'_>,
        now: Timestamp,
        destination: &Destination,
    ) -> Option<SpeedStep> {
        let by = destination.in_time?;
        let is_free = self.pacing.as_ref().is_none_or(|pacing| pacing.budget.free() <= seconds(now));
        if !is_free {
            return None;
        }
        let commanded = self.commanded.get();
        let about = commanded.saturating_sub(STEPS_AROUND)..=commanded.saturating_add(STEPS_AROUND);
        let steps = self.usable_steps();
        let others = steps.iter().filter(|step| about.contains(&step.get()) && **step != self.commanded);
        let rest_times = self.model.standing_times();
        let cost = |step: SpeedStep| {
            let found = self.rest_from(context, now, &rest_times, step, destination);
            found.map_or(f64::INFINITY, |(time, rest)| cost_of(by, time, &rest))
        };
        let current_cost = cost(self.commanded);
        let costs = others.map(|step| (*step, cost(*step)));
        let (step, cost) = costs.min_by(|(_, one), (_, other)| one.total_cmp(other))?;
        (cost + MIN_GAIN < current_cost).then_some(step)
    }

    /// When and where the train comes to rest if it is commanded a step now and stops from it.
    fn rest_from(
        &self,
        context: TrackContext<'_>,
        now: Timestamp,
        rest_times: &StandingTimes<'_>,
        step: SpeedStep,
        destination: &Destination,
    ) -> Option<(Timestamp, Rest)> {
        let at = destination.at?;
        let start = now + self.link.usually_left();
        let first = if step == self.commanded { now + self.link.command } else { start + MIN_STEP_TIME };
        let found = command_time(first, |stop| {
            let rest = self.locator.rest_after_move(context, &self.model, start, step, stop)?;
            Some((rest, self.aimed_beyond(context, &rest, at, destination.aim)?))
        });
        match found {
            CommandTime::At(stop, rest) => {
                Some((self.standing_time(rest_times, [start, stop], step, &rest)?, rest))
            }
            CommandTime::TooLate(..) | CommandTime::Never => None,
        }
    }

    /// When a train is at rest that is commanded a step at the first time, and to stop at the second.
    pub(super) fn standing_time(
        &self,
        rest_times: &StandingTimes<'_>,
        [start, stop]: [Timestamp; 2],
        step: SpeedStep,
        rest: &Rest,
    ) -> Option<Timestamp> {
        let mut rollout = self.locator.rollout()?;
        if start < stop {
            rollout.command(&self.model, rollout.seconds(start), step);
        }
        let [_, speed] = rollout.place_and_speed(&self.model, rollout.seconds(stop));
        Some(rest.time + TimeSpan::from_s(rest_times.later(speed)))
    }
}

/// The squared error in time, plus the squared spread in place, in units of the required accuracy.
fn cost_of(by: Timestamp, rest_times: Timestamp, rest: &Rest) -> f64 {
    let (time_cost, spread_cost) =
        ((rest_times - by).as_s() / TIME_TOLERANCE, rest.deviation().as_m() / PLACE_TOLERANCE);
    time_cost * time_cost + spread_cost * spread_cost
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ids::NodeId;
    use crate::tracking::PathPoint;
    use crate::units::Length;

    #[test]
    fn a_stop_costs_the_squares_of_its_errors_over_what_is_required() {
        let rest = Rest {
            at: PathPoint { node: NodeId(1), distance: Length::ZERO },
            // 25 mm together.
            doubt: Length::from_mm(15.0),
            scatter: Length::from_mm(20.0),
            time: Timestamp::ZERO,
        };
        let by = Timestamp::from_s(10.0);
        // One standard deviation is 0.15 s and 12.5 mm.
        for (time, cost) in [(10.0, 4.0), (10.3, 8.0), (9.7, 8.0), (10.15, 5.0)] {
            let found = cost_of(by, Timestamp::from_s(time), &rest);
            assert!((found - cost).abs() < 1e-9, "{found} {cost}");
        }
    }
}
