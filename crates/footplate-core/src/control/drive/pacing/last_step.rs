//! The step from which a train stops that shall stand somewhere in time.
//!
//! Whatever the plan was, a train comes to its last steady stretch a little early or late, and the last contacts before the
//! target say so better than anything before. What is left of the time can still be chosen: a step faster or slower brings it
//! to where the stop begins sooner or later, and its own stop takes as long as it takes. Each step about the one that it runs
//! at is looked at as a whole, up to the standstill.

use crate::control::drive::command_time::{CommandTime, command_time, spread};
use crate::control::drive::driven_train::DrivenTrain;
use crate::control::drive::outputs::Outputs;
use crate::control::drive::task::{Destination, Goal, Phase, Task};
use crate::ids::SpeedStep;
use crate::model::StandingTimes;
use crate::time::{TimeSpan, Timestamp};
use crate::tracking::{Rest, TrackContext};

use super::command_budget::seconds;

/// One standard deviation of what is asked for in time (s): 0.3 s at the 95th percentile ...
const LATE: f64 = 0.15;
/// ... and in place (m): 25 mm.
const BESIDE: f64 = 0.0125;
/// Another step has to be better by this, in squares of both: half of either is worth a command.
const BETTER: f64 = 0.25;
/// Steps looked at on either side.
const ABOUT: u8 = 2;
/// A step that is told is followed by the stop no sooner than this: it has to be felt to be worth its command.
const FELT: TimeSpan = TimeSpan::from_ms(600);

impl DrivenTrain {
    /// Looks whether a train that will stop by itself should do so from another step to stand in time, and tells it.
    pub(in crate::control::drive) fn keep_time(
        &mut self,
        context: TrackContext<'_>,
        now: Timestamp,
        out: &mut Outputs,
    ) {
        let Some(Task { goal: Goal::RestAt(destination), phase: Phase::Running { plan }, .. }) = self.task
        else {
            return;
        };
        let is_soon = plan.is_some_and(|plan| plan.leaves - now < FELT);
        if destination.in_time.is_none() || is_soon || !self.is_all_sent() {
            return;
        }
        if let Some(step) = self.step_in_time(context, now, &destination) {
            self.command_step(context, now, step, out);
        }
    }

    /// The step that it should be commanded now, if another is better than the one it has been told.
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
        let about = commanded.saturating_sub(ABOUT)..=commanded.saturating_add(ABOUT);
        let steps = self.usable_steps();
        let others = steps.iter().filter(|step| about.contains(&step.get()) && **step != self.commanded);
        let stands = self.model.standing_times();
        let cost = |step: SpeedStep| {
            let found = self.rest_from(context, now, &stands, step, destination);
            found.map_or(f64::INFINITY, |(time, rest)| cost_of(by, time, &rest))
        };
        let as_it_is = cost(self.commanded);
        let costs = others.map(|step| (*step, cost(*step)));
        let (step, cost) = costs.min_by(|(_, one), (_, other)| one.total_cmp(other))?;
        (cost + BETTER < as_it_is).then_some(step)
    }

    /// When and where it stands if it is told a step now and stops from there.
    fn rest_from(
        &self,
        context: TrackContext<'_>,
        now: Timestamp,
        stands: &StandingTimes<'_>,
        step: SpeedStep,
        destination: &Destination,
    ) -> Option<(Timestamp, Rest)> {
        let at = destination.at?;
        let start = now + self.link.usually_left();
        let first = if step == self.commanded { now + self.link.command } else { start + FELT };
        let found = command_time(first, |stop| {
            let rest = self.locator.rest_after_move(context, &self.model, start, step, stop)?;
            Some((rest, self.aimed_beyond(context, &rest, at, destination.aim)?))
        });
        match found {
            CommandTime::At(stop, rest) => {
                Some((self.standing_time(stands, [start, stop], step, &rest)?, rest))
            }
            CommandTime::TooLate(..) | CommandTime::Never => None,
        }
    }

    /// When it stands that is told a step at the first time, if it runs at another, and to stop at the second, and so comes to
    /// rest.
    pub(super) fn standing_time(
        &self,
        stands: &StandingTimes<'_>,
        [start, stop]: [Timestamp; 2],
        step: SpeedStep,
        rest: &Rest,
    ) -> Option<Timestamp> {
        let mut rollout = self.locator.rollout()?;
        if start < stop {
            rollout.command(&self.model, rollout.seconds(start), step);
        }
        let [_, speed] = rollout.place_and_speed(&self.model, rollout.seconds(stop));
        Some(rest.time + TimeSpan::from_s(stands.later(speed)))
    }
}

/// How far off it is in time, and may be in place.
fn cost_of(by: Timestamp, stands: Timestamp, rest: &Rest) -> f64 {
    let (late, beside) = ((stands - by).as_s() / LATE, spread(rest).as_m() / BESIDE);
    late * late + beside * beside
}
