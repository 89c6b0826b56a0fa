//! The step from which a train at rest approaches a target.

use alloc::vec::Vec;

use crate::event::Approach;
use crate::ids::SpeedStep;
use crate::model::StepUse;
use crate::time::{TimeSpan, Timestamp};
use crate::tracking::{Located, PathPoint, TrackContext};
use crate::units::{Length, Speed};

use super::command_time::{CommandTime, command_time};
use super::driven_train::DrivenTrain;
use super::path::sensors_within;
use super::refusal::Refusal;
use super::task::Destination;

/// Shortest time from a start to its stop: two commands and the poll between them.
const SHORTEST_RUN: TimeSpan = TimeSpan::from_ms(80);
/// Longest duration of a short run that is chosen for its precision.
const MOVE_LIMIT: TimeSpan = TimeSpan::from_s(30.0);
/// Speed at which a lost train is run over a sensor: slow enough to stop anywhere.
const FINDING_SPEED: Speed = Speed::from_mm_per_s(150.0);
/// A faster step is worth its time if its stops spread at most this many times as much as the most precise ones ...
const SPREAD_RATIO: f64 = 1.5;
/// ... or at most this: the repeatability of stops from medium steps (4 mm), and an equal uncertainty.
const GOOD_SPREAD: Length = Length::from_mm(8.0);
/// Margin before a stop, in standard deviations of the stopping distance, that remains for the settled run.
const STOP_MARGIN: f64 = 3.0;

impl DrivenTrain {
    /// The steps known to move the train; if none is known, all that are not known to be unreliable.
    pub(super) fn usable_steps(&self) -> Vec<SpeedStep> {
        let steps = || (1..=self.model.highest().get()).filter_map(SpeedStep::new);
        let known: Vec<SpeedStep> = steps().filter(|step| self.model.uses(*step) == StepUse::Moves).collect();
        if known.is_empty() {
            steps().filter(|step| self.model.uses(*step) != StepUse::Unreliable).collect()
        } else {
            known
        }
    }

    /// The step at which a lost train runs to a sensor.
    pub(super) fn finding_step(&self) -> SpeedStep {
        let steps = self.usable_steps();
        let fast_enough =
            steps.iter().find(|step| self.model.steady_speed(**step, Approach::Below) >= FINDING_SPEED);
        fast_enough.or(steps.last()).copied().unwrap_or(self.model.highest())
    }

    /// The step from which a train at rest approaches a target. If its speed can settle before a sensor that it
    /// passes in time before the command: the fastest step with about the smallest spread of stops. On shorter paths:
    /// the step whose predicted rest has the smallest spread.
    pub(super) fn approach_step(
        &self,
        context: TrackContext<'_>,
        now: Timestamp,
        located: &Located,
        destination: &Destination,
    ) -> Result<SpeedStep, Refusal> {
        let out_of_reach = || Refusal::OutOfReach { target: alloc::string::String::new() };
        let at = destination.at.ok_or_else(out_of_reach)?;
        if let Some(step) = destination.step {
            return match self.short_run(context, now, at, step, destination) {
                CommandTime::At(..) => Ok(step),
                CommandTime::TooLate(_, beyond) => Err(self.too_near(context, at, beyond, destination)),
                CommandTime::Never => Err(self.no_path(context, at.node, destination)),
            };
        }
        let steps = self.usable_steps();
        let settled: Vec<(SpeedStep, Length)> = steps
            .iter()
            .filter(|step| self.settles_before(context, located, at, **step))
            .map(|step| (*step, self.stop_spread(*step)))
            .collect();
        let least_spread = settled.iter().map(|(_, spread)| *spread).reduce(Length::min);
        if let Some(most_precise) = least_spread {
            let good_spread = (most_precise * SPREAD_RATIO).max(GOOD_SPREAD);
            let is_fast_enough =
                |step: SpeedStep| self.model.steady_speed(step, Approach::Below) >= FINDING_SPEED;
            let precise = || settled.iter().filter(|(_, spread)| *spread <= good_spread);
            let fastest = precise().next_back().filter(|(step, _)| is_fast_enough(*step));
            // A train does not creep over the whole distance for a few millimetres; it might also stall.
            let fastest =
                fastest.or(settled.iter().find(|(step, _)| is_fast_enough(*step))).or(precise().next_back());
            return fastest.map(|(step, _)| *step).ok_or_else(out_of_reach);
        }
        let mut most_precise: Option<(SpeedStep, Length)> = None;
        let mut quickest: Option<(SpeedStep, TimeSpan)> = None;
        let mut nearest: Option<Length> = None;
        // A short run ends before the train leaves a zone.
        let fastest = self.fastest_allowed(context, now);
        for step in steps.into_iter().filter(|step| fastest.is_none_or(|fastest| *step <= fastest)) {
            match self.short_run(context, now, at, step, destination) {
                CommandTime::At(_, rest) if rest.time - now <= MOVE_LIMIT => {
                    if most_precise.is_none_or(|(_, least)| rest.deviation() < least) {
                        most_precise = Some((step, rest.deviation()));
                    }
                }
                CommandTime::At(_, rest) => {
                    let takes = rest.time - now;
                    if quickest.is_none_or(|(_, least)| takes < least) {
                        quickest = Some((step, takes));
                    }
                }
                CommandTime::TooLate(_, beyond) => {
                    nearest = Some(nearest.map_or(beyond, |least| least.min(beyond)));
                }
                CommandTime::Never => {}
            }
        }
        if let Some((step, _)) = most_precise {
            return Ok(step);
        }
        if let Some((step, _)) = quickest {
            return Ok(step);
        }
        Err(match nearest {
            Some(beyond) => self.too_near(context, at, beyond, destination),
            None => self.no_path(context, at.node, destination),
        })
    }

    /// Of some steps, those with about the smallest spread of stops that do not creep; all of them if there is none.
    pub(super) fn precise_steps(&self, steps: &[SpeedStep]) -> Vec<SpeedStep> {
        let most_precise = steps.iter().map(|step| self.stop_spread(*step)).reduce(Length::min);
        let good_spread = (most_precise.unwrap_or(Length::ZERO) * SPREAD_RATIO).max(GOOD_SPREAD);
        let is_fast_enough =
            |step: SpeedStep| self.model.steady_speed(step, Approach::Below) >= FINDING_SPEED;
        let precise = steps.iter().copied().filter(|step| self.stop_spread(*step) <= good_spread);
        let fast: Vec<SpeedStep> = precise.filter(|step| is_fast_enough(*step)).collect();
        if !fast.is_empty() {
            return fast;
        }
        let fast: Vec<SpeedStep> =
            steps.iter().copied().filter(|step| is_fast_enough(*step)).take(1).collect();
        if fast.is_empty() { steps.to_vec() } else { fast }
    }

    /// One standard deviation of stops from a settled step.
    fn stop_spread(&self, step: SpeedStep) -> Length {
        self.model.stop(step, Approach::Below).deviation()
    }

    /// Whether the train passes a sensor at a settled speed, in time before the stop command.
    pub(super) fn settles_before(
        &self,
        context: TrackContext<'_>,
        located: &Located,
        at: PathPoint,
        step: SpeedStep,
    ) -> bool {
        let speed = self.model.steady_speed(step, Approach::Below);
        let stop = self.model.stop(step, Approach::Below);
        // A start never runs faster than its final speed.
        let settled = located.at.distance + speed * self.model.settles_within(SpeedStep::STAND, step);
        let last = at.distance - stop.distance - stop.doubt * STOP_MARGIN - speed * self.link.reaction;
        at.node == located.at.node
            && sensors_within(context, &self.model, at.node, last).any(|(_, distance)| distance > settled)
    }

    pub(super) fn short_run(
        &self,
        context: TrackContext<'_>,
        now: Timestamp,
        at: PathPoint,
        step: SpeedStep,
        destination: &Destination,
    ) -> CommandTime {
        let start = now + self.link.command;
        command_time(start + SHORTEST_RUN, |stop| {
            let rest = self.locator.rest_after_move(context, &self.model, start, step, stop)?;
            Some((rest, self.aimed_beyond(context, &rest, at, destination.aim)?))
        })
    }
}
