//! Runs experiments: run, stop short of a sensor, creep on to it.

use super::accuracy::usable_steps;
use super::activity::{Activity, Stage, Trial};
use super::calibrator::Calibrator;
use super::experiment::{Experiment, TYPICAL_HOP, past_by};
use super::finding::THROWN_WITHIN;
use super::notice::{CalibrationNotice, Done, Ending};
use super::planner::{creep_step, needs_run_up, run_up_step};
use crate::event::Approach;
use crate::ids::{NodeId, SpeedStep};
use crate::time::{TimeSpan, Timestamp};
use crate::units::{Length, Speed};

/// Part of the budget kept to bring the train to rest.
const RESERVE: TimeSpan = TimeSpan::from_ms(5_000);

/// An experiment is aborted this long before the budget ends, or earlier if the train takes longer to stop.
const LAST_STOP: TimeSpan = TimeSpan::from_ms(4_000);

/// From the predicted time of rest to when the train is surely at rest and its last detection reported.
const AFTER_REST: TimeSpan = TimeSpan::from_ms(1_200);

/// A stop is aimed at least this far short of a sensor, so that the train creeps at a steady speed when it gets there
/// ...
const LEAST_SHORT: Length = Length::from_mm(30.0);

/// ... and at most this far, because creeping takes time.
const MOST_SHORT: Length = Length::from_mm(150.0);

/// Margin of a stop before the sensor, in standard deviations of the stopping distance.
const SHORT_BY: f64 = 1.5;

/// The shortest time from now to a stop command.
const SOONEST: TimeSpan = TimeSpan::from_ms(60);

/// Two bytes take this long on a line of 2400 baud: a command is requested this much earlier.
const COMMAND_TIME: TimeSpan = TimeSpan::from_us(9_170);

/// Number of sensors ahead at which a stop may be aimed.
const MAX_AHEAD: usize = 6;

/// A train at rest should reach the next sensor in about this time.
const CREEP_TIME: TimeSpan = TimeSpan::from_ms(2_000);

/// The time of a stop is computed again at this many sensors; then it is final.
const AIM_AGAIN: u8 = 3;

/// One hop that takes longer than this is enough.
const LONG_HOP: TimeSpan = TimeSpan::from_ms(3_500);

impl Calibrator<'_> {
    /// Chooses the next experiment and begins it, or ends the session.
    pub(super) fn begin_next(&mut self, now: Timestamp) {
        self.joins_since = None;
        let started = self.started.unwrap_or(now);
        let left = started + self.settings.budget - now - RESERVE;
        let Some(choice) = self.planner.choose(self.fit.model(), self.throttle, left) else {
            let is_spent = left < TimeSpan::from_s(20.0);
            self.end(now, if is_spent { Ending::Budget } else { Ending::NothingToGain });
            return;
        };
        let experiment = choice.experiment;
        self.notify(CalibrationNotice::Begins { experiment, why: choice.why });
        let approach = match experiment {
            Experiment::Speed { approach, .. } | Experiment::Stop { approach, .. } => approach,
            Experiment::Move { .. } => Approach::Below,
        };
        let before = self.line(experiment.step(), approach);
        self.activity =
            Activity::Trying(Trial { experiment, begun: now, before, stage: Stage::Steady { sensors: 0 } });
        match experiment {
            Experiment::Speed { step, approach } | Experiment::Stop { step, approach, .. } => {
                if needs_run_up(self.throttle, step, approach) {
                    let by = run_up_step(self.model(), step, approach);
                    self.set_stage(Stage::RunUp);
                    self.issue(now, by);
                } else {
                    self.go_steady(now, step);
                }
            }
            Experiment::Move { .. } => {
                let slow = creep_step(self.model()).unwrap_or(experiment.step());
                self.set_stage(Stage::Steady { sensors: 1 });
                self.issue(now, slow);
            }
        }
        self.expect_detection(now);
        self.report_progress(now);
    }

    fn go_steady(&mut self, now: Timestamp, step: SpeedStep) {
        let Some(trial) = self.trial() else { return };
        let sensors = match trial.experiment {
            Experiment::Speed { step, approach } => {
                let speed = self.model().steady_speed(step, approach).max(Speed::from_mm_per_s(1.0));
                if TYPICAL_HOP / speed > LONG_HOP { 1 } else { 2 }
            }
            Experiment::Stop { .. } | Experiment::Move { .. } => 1,
        };
        self.set_stage(Stage::Steady { sensors });
        self.issue(now, step);
    }

    pub(super) fn trial(&self) -> Option<&Trial> {
        match &self.activity {
            Activity::Trying(trial) => Some(trial),
            _ => None,
        }
    }

    fn set_stage(&mut self, stage: Stage) {
        if let Activity::Trying(trial) = &mut self.activity {
            trial.stage = stage;
        }
    }

    /// A speed command to the train was sent.
    pub(super) fn on_speed_sent(&mut self, now: Timestamp) {
        let Some(trial) = self.trial() else { return };
        let step = self.throttle.step;
        match (&trial.stage, trial.experiment) {
            (Stage::Aiming { .. }, _) if step == SpeedStep::STAND => {
                self.hold_line(None);
                self.set_stage(Stage::Braking { until: self.rests_at(now) });
            }
            (Stage::Moving { .. }, _) if step == SpeedStep::STAND => {
                self.hold_line(None);
                self.set_stage(Stage::BrakingAgain { until: self.rests_at(now) });
            }
            (Stage::Moving { .. }, Experiment::Move { run, .. }) => {
                let stop_at = self.commanded_at + run;
                self.hold_line(Some(stop_at));
                self.set_stage(Stage::Moving { stop_at });
            }
            _ => {}
        }
    }

    /// The train passed a sensor.
    pub(super) fn on_passage(&mut self, now: Timestamp, node: NodeId) {
        match &self.activity {
            Activity::Listening { .. } | Activity::Finding { .. } | Activity::Joining => {
                self.on_found(now, node);
            }
            Activity::Trying(_) if !self.is_on_circuit(node) => self.on_found(now, node),
            Activity::Trying(_) => {
                self.throw_turnouts(now, node);
                self.on_trial_passage(now);
            }
            _ => {}
        }
    }

    fn on_found(&mut self, now: Timestamp, node: NodeId) {
        if self.throttle.step == SpeedStep::STAND {
            return;
        }
        if matches!(self.activity, Activity::Joining) && self.is_on_circuit(node) {
            if !self.layout.is_measured() {
                // The speed bounds the distance in which turnouts are too near: as soon as it is known, more can be thrown.
                self.refit();
            }
            self.throw_turnouts(now, node);
            self.go_on_if_set(now, node);
        } else {
            self.join(now, node);
        }
        self.note_unset(now);
    }

    fn on_trial_passage(&mut self, now: Timestamp) {
        let Some(trial) = self.trial() else { return };
        match trial.stage {
            Stage::Steady { sensors } if now >= self.steady_at && self.requested.is_none() => {
                if sensors > 1 {
                    self.set_stage(Stage::Steady { sensors: sensors - 1 });
                } else {
                    self.on_steady(now);
                }
            }
            Stage::Aiming { again, .. } if self.requested.is_none() && again > 0 => {
                self.set_stage(Stage::Aiming { at: None, again: again - 1 });
                self.aim(now);
            }
            Stage::Creeping => self.conclude(now),
            _ => {}
        }
    }

    /// The speed is steady, and a sensor was just passed.
    fn on_steady(&mut self, now: Timestamp) {
        match self.trial().map(|trial| trial.experiment) {
            Some(Experiment::Speed { .. }) => self.conclude(now),
            Some(Experiment::Stop { .. }) => {
                self.set_stage(Stage::Aiming { at: None, again: AIM_AGAIN });
                self.aim(now);
            }
            Some(Experiment::Move { .. }) => {
                self.set_stage(Stage::Aiming { at: None, again: AIM_AGAIN });
                self.issue(now, SpeedStep::STAND);
            }
            None => {}
        }
    }

    /// Computes when to stop so that the train comes to rest a little short of a sensor, or a little past it.
    fn aim(&mut self, now: Timestamp) {
        let at = self.stop_time(now);
        let Some(Stage::Aiming { again, .. }) = self.trial().map(|trial| &trial.stage) else { return };
        let again = *again;
        self.set_stage(Stage::Aiming { at, again });
        match at {
            Some(at) => self.hold_line(Some(at)),
            // The place of rest cannot be predicted: any place will do.
            None => self.issue(now, SpeedStep::STAND),
        }
    }

    fn stop_time(&self, now: Timestamp) -> Option<Timestamp> {
        let (context, model) = (self.context(), self.model());
        let node = self.tracker.last()?;
        let soonest = now + SOONEST;
        let rest = self.locator.rest_if_stopped(context, model, soonest)?;
        let speed = self.locator.locate(context, model, soonest)?.speed;
        if speed <= Speed::ZERO {
            return None;
        }
        let short = match self.trial()?.experiment {
            Experiment::Stop { step, approach, is_past: true } => -past_by(model, step, approach),
            _ => (LEAST_SHORT + SHORT_BY * rest.deviation()).min(MOST_SHORT),
        };
        let mut begins = Length::ZERO;
        let mut rest_distance = None;
        for hop in context.hops_ahead(node).take(2 * MAX_AHEAD) {
            if hop.from == rest.at.node && rest_distance.is_none() {
                rest_distance = Some(begins + rest.at.distance);
            }
            begins += model.length(&self.sections, &hop)[0];
            if let Some(rest_distance) = rest_distance {
                let later = begins - short - rest_distance;
                if later >= Length::ZERO {
                    return Some(soonest + later / speed);
                }
            }
        }
        None
    }

    /// When a train that was commanded to stop is at rest.
    fn rests_at(&self, now: Timestamp) -> Timestamp {
        let rest = self.locator.rest_if_stopped(self.context(), self.model(), now);
        rest.map_or(now + self.stops_within(), |rest| rest.time.max(now) + AFTER_REST)
    }

    /// An upper bound of the time to stop, whatever the train does now.
    pub(super) fn stops_within(&self) -> TimeSpan {
        let step = self.requested.map_or(self.throttle.step, |(step, _)| step).max(self.throttle.step);
        let step = if step == SpeedStep::STAND { self.model().highest() } else { step };
        self.model().stop_time(step, Approach::Above) + AFTER_REST + AFTER_REST
    }

    /// Does what is due by the clock.
    pub(super) fn on_clock(&mut self, now: Timestamp) {
        match self.activity {
            Activity::Listening { until } | Activity::Waiting { until } if now >= until => self.find(now),
            Activity::Finding { push_at } if now >= push_at => self.push_up_to_find(now),
            Activity::Reversing { at } if now >= at => self.reverse(now),
            Activity::Ending { until } if now >= until && self.requested.is_none() => self.finish(),
            Activity::Trying(_) => self.on_trial_clock(now),
            _ => {}
        }
        if self.due_by.is_some_and(|due| now >= due) && self.requested.is_none() {
            self.miss_detection(now);
        }
        if self.last_moment().is_some_and(|last| now >= last) {
            self.end(now, Ending::Budget);
        }
    }

    fn on_trial_clock(&mut self, now: Timestamp) {
        let Some(trial) = self.trial() else { return };
        if self.requested.is_some() {
            return;
        }
        match (&trial.stage, trial.experiment) {
            (Stage::RunUp, Experiment::Speed { step, .. } | Experiment::Stop { step, .. })
                if now >= self.steady_at =>
            {
                self.go_steady(now, step);
            }
            (Stage::Aiming { at: Some(at), .. }, _) if now >= *at - COMMAND_TIME => {
                self.issue(now, SpeedStep::STAND);
            }
            (Stage::Moving { stop_at }, _) if now >= *stop_at - COMMAND_TIME => {
                self.issue(now, SpeedStep::STAND);
            }
            (Stage::Braking { until }, Experiment::Move { step, .. }) if now >= *until => {
                // The run counts from the time at which the command is sent.
                self.set_stage(Stage::Moving { stop_at: Timestamp::from_ns(i64::MAX) });
                self.issue(now, step);
            }
            (Stage::Braking { until } | Stage::BrakingAgain { until }, _) if now >= *until => {
                self.refit();
                if let Some(thrown) = self.change_circuit_at_rest(now).filter(|thrown| *thrown > 0) {
                    let takes = TimeSpan::from_ns(THROWN_WITHIN.as_ns() * (thrown as i64));
                    self.set_stage(Stage::BrakingAgain { until: now + takes });
                    return;
                }
                self.set_stage(Stage::Creeping);
                let step = self.step_to_next_sensor(now);
                self.issue(now, step);
            }
            _ => {}
        }
    }

    /// The step at which a train at rest continues to the next sensor: creeping if it is near.
    fn step_to_next_sensor(&self, now: Timestamp) -> SpeedStep {
        let model = self.model();
        let creep = creep_step(model).unwrap_or(self.throttle.step.max(model.highest()));
        let Some(distance) = self.distance_to_next_sensor(now) else { return creep };
        let wanted = distance / CREEP_TIME;
        let usable = usable_steps(model);
        let fit = usable.iter().rev().find(|step| model.steady_speed(**step, Approach::Below) <= wanted);
        fit.copied().unwrap_or(creep).max(creep)
    }

    fn distance_to_next_sensor(&self, now: Timestamp) -> Option<Length> {
        let at = self.locator.locate(self.context(), self.model(), now)?.at;
        let hop = self.context().hop_from(at.node)?;
        Some(self.model().length(&self.sections, &hop)[0] - at.distance)
    }

    /// An experiment has ended.
    fn conclude(&mut self, now: Timestamp) {
        let Activity::Trying(trial) = &self.activity else { return };
        let (experiment, begun, before) = (trial.experiment, trial.begun, trial.before);
        self.planner.note(&experiment);
        self.refit();
        let after = self.line(before.step, before.approach);
        self.notify(CalibrationNotice::Done(Done { experiment, took: now - begun, before, after }));
        if !self.change_circuit(now) {
            self.begin_next(now);
        }
    }

    pub(super) fn report_progress(&mut self, now: Timestamp) {
        let progress = self.progress(now);
        self.notify(CalibrationNotice::Progress(progress));
    }

    /// The last time to command a stop within the budget; `None` if it is commanded already.
    fn last_moment(&self) -> Option<Timestamp> {
        let is_over = matches!(self.activity, Activity::Ending { .. } | Activity::Finished);
        let started = self.started.filter(|_| !is_over)?;
        Some(started + self.settings.budget - LAST_STOP.max(self.stops_within() + COMMAND_TIME))
    }

    /// When something is due by the clock.
    pub(super) fn due_activity(&self) -> Option<Timestamp> {
        let next = match &self.activity {
            Activity::NotStarted => Some(Timestamp::ZERO),
            Activity::Listening { until }
            | Activity::Waiting { until }
            | Activity::Ending { until }
            | Activity::Finding { push_at: until }
            | Activity::Reversing { at: until } => Some(*until),
            Activity::Trying(trial) => match trial.stage {
                Stage::RunUp => Some(self.steady_at),
                Stage::Aiming { at: Some(at), .. } => Some(at - COMMAND_TIME),
                Stage::Moving { stop_at } => Some(stop_at - COMMAND_TIME),
                Stage::Braking { until } | Stage::BrakingAgain { until } => Some(until),
                Stage::Aiming { at: None, .. } | Stage::Steady { .. } | Stage::Creeping => None,
            },
            Activity::Joining | Activity::Finished => None,
        };
        // While a command waits for the line, nothing else is due.
        let next = next.filter(|_| self.requested.is_none());
        [next, self.due_by.filter(|_| self.requested.is_none()), self.last_moment()]
            .into_iter()
            .flatten()
            .min()
    }
}
