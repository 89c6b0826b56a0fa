//! Doing experiments: run, stop short of a contact, crawl on to it.

use super::accuracy::usable_steps;
use super::activity::{Activity, Stage, Trial};
use super::calibrator::Calibrator;
use super::experiment::Experiment;
use super::gain::past_by;
use super::notice::{CalibrationNotice, Done, Ending};
use super::planner::{crawl_step, needs_run_up, run_up_step};
use crate::event::Approach;
use crate::ids::{NodeId, SpeedStep};
use crate::time::{TimeSpan, Timestamp};
use crate::units::{Length, Speed};

/// Kept of the budget to bring the train to rest.
const RESERVE: TimeSpan = TimeSpan::from_ms(5_000);

/// Whatever is being tried is given up this long before the budget ends, or longer if the train takes longer to stop.
const LAST_STOP: TimeSpan = TimeSpan::from_ms(4_000);

/// From when a train should stand to when it surely does, reports of its last contact included.
const AFTER_REST: TimeSpan = TimeSpan::from_ms(1_200);

/// A rest is aimed at least this far short of a contact: a train at a crawl has then been moving for a while ...
const LEAST_SHORT: Length = Length::from_mm(30.0);

/// ... and never farther than this, for a crawl costs time.
const MOST_SHORT: Length = Length::from_mm(150.0);

/// Standard deviations of the rest by which a train stays short of the contact.
const SHORT_BY: f64 = 1.5;

/// The soonest that a stop can be commanded from now.
const SOONEST: TimeSpan = TimeSpan::from_ms(60);

/// A command of two bytes takes this long on a line of 2400 baud: it is asked for so much earlier.
const COMMAND_TAKES: TimeSpan = TimeSpan::from_us(9_170);

/// Contacts ahead that a stop may aim at.
const MOST_AHEAD: usize = 6;

/// The way to the next contact that a train at rest should cover in this time, if it is long.
const CRAWL_TAKES: TimeSpan = TimeSpan::from_ms(2_000);

/// A stop is aimed anew at this many contacts on the way to its moment; then it is made as it was planned.
const AIM_AGAIN: u8 = 3;

/// Hops that take longer than this tell enough alone.
const LONG_HOP: TimeSpan = TimeSpan::from_ms(3_500);

impl Calibrator<'_> {
    /// Chooses the next experiment and begins it, or ends the session.
    pub(super) fn begin_next(&mut self, now: Timestamp) {
        let started = self.started.unwrap_or(now);
        let left = started + self.settings.budget - now - RESERVE;
        let Some(choice) = self.planner.choose(self.fit.model(), self.stance, left) else {
            let is_spent = left < TimeSpan::from_s(20.0);
            self.end(now, if is_spent { Ending::Budget } else { Ending::NothingToGain });
            return;
        };
        let experiment = choice.experiment;
        self.say(CalibrationNotice::Begins { experiment, why: choice.why });
        let approach = match experiment {
            Experiment::Speed { approach, .. } | Experiment::Stop { approach, .. } => approach,
            Experiment::Move { .. } => Approach::Below,
        };
        let before = self.line(experiment.step(), approach);
        self.activity =
            Activity::Trying(Trial { experiment, begun: now, before, stage: Stage::Steady { contacts: 0 } });
        match experiment {
            Experiment::Speed { step, approach } | Experiment::Stop { step, approach, .. } => {
                if needs_run_up(self.stance, step, approach) {
                    let by = run_up_step(self.model(), step, approach);
                    self.set_stage(Stage::RunUp);
                    self.issue(now, by);
                } else {
                    self.go_steady(now, step);
                }
            }
            Experiment::Move { .. } => {
                let slow = crawl_step(self.model()).unwrap_or(experiment.step());
                self.set_stage(Stage::Steady { contacts: 1 });
                self.issue(now, slow);
            }
        }
        self.expect_contact(now);
        self.say_progress(now);
    }

    fn go_steady(&mut self, now: Timestamp, step: SpeedStep) {
        let Some(trial) = self.trial() else { return };
        let contacts = match trial.experiment {
            Experiment::Speed { step, approach } => {
                let speed = self.model().speed(step, approach).value.max(Speed::from_mm_per_s(1.0));
                if super::gain::TYPICAL_HOP / speed > LONG_HOP { 1 } else { 2 }
            }
            Experiment::Stop { .. } | Experiment::Move { .. } => 1,
        };
        self.set_stage(Stage::Steady { contacts });
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

    /// A command to the train has left.
    pub(super) fn on_told(&mut self, now: Timestamp) {
        let Some(trial) = self.trial() else { return };
        let step = self.stance.step;
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

    /// The train passed a contact.
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
        if self.stance.step == SpeedStep::STAND {
            return;
        }
        if matches!(self.activity, Activity::Joining) && self.is_on_circuit(node) {
            self.throw_turnouts(now, node);
            self.go_on_if_set(now, node);
        } else {
            self.join(now, node);
        }
    }

    fn on_trial_passage(&mut self, now: Timestamp) {
        let Some(trial) = self.trial() else { return };
        match trial.stage {
            Stage::Steady { contacts } if now >= self.steady_at && self.asked.is_none() => {
                if contacts > 1 {
                    self.set_stage(Stage::Steady { contacts: contacts - 1 });
                } else {
                    self.on_steady(now);
                }
            }
            Stage::Aiming { again, .. } if self.asked.is_none() && again > 0 => {
                self.set_stage(Stage::Aiming { at: None, again: again - 1 });
                self.aim(now);
            }
            Stage::Crawling => self.conclude(now),
            _ => {}
        }
    }

    /// Steady at the step, and a contact just passed.
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

    /// Works out when to stop so that the train rests a little short of a contact, or a little past it.
    fn aim(&mut self, now: Timestamp) {
        let at = self.moment_to_stop(now);
        let Some(Stage::Aiming { again, .. }) = self.trial().map(|trial| &trial.stage) else { return };
        let again = *again;
        self.set_stage(Stage::Aiming { at, again });
        match at {
            Some(at) => self.hold_line(Some(at)),
            // Where it would rest is not known: then anywhere is as good.
            None => self.issue(now, SpeedStep::STAND),
        }
    }

    fn moment_to_stop(&self, now: Timestamp) -> Option<Timestamp> {
        let (context, model) = (self.context(), self.model());
        let node = self.tracker.last()?;
        let soonest = now + SOONEST;
        let rest = self.locator.rest_if_stopped(context, model, soonest)?;
        let speed = self.locator.locate(context, model, soonest)?.speed;
        if speed <= Speed::ZERO {
            return None;
        }
        let sigma = libm::hypot(rest.doubt.as_m(), rest.scatter.as_m());
        let short = match self.trial()?.experiment {
            Experiment::Stop { step, approach, is_past: true } => -past_by(model, step, approach),
            _ => (LEAST_SHORT + Length::from_m(SHORT_BY * sigma)).min(MOST_SHORT),
        };
        let mut begins = Length::ZERO;
        let mut rest_way = None;
        for hop in context.hops_ahead(node).take(2 * MOST_AHEAD) {
            if hop.from == rest.at.node && rest_way.is_none() {
                rest_way = Some(begins + rest.at.way);
            }
            begins += model.length(&self.sections, &hop)[0];
            if let Some(rest_way) = rest_way {
                let later = begins - short - rest_way;
                if later >= Length::ZERO {
                    return Some(soonest + later / speed);
                }
            }
        }
        None
    }

    /// When the train rests that has been commanded to stop.
    fn rests_at(&self, now: Timestamp) -> Timestamp {
        let rest = self.locator.rest_if_stopped(self.context(), self.model(), now);
        rest.map_or(now + self.stops_within(), |rest| rest.time.max(now) + AFTER_REST)
    }

    /// A span within which the train stands from whatever it does now.
    pub(super) fn stops_within(&self) -> TimeSpan {
        let step = self.asked.map_or(self.stance.step, |(step, _)| step).max(self.stance.step);
        let step = if step == SpeedStep::STAND { self.model().highest() } else { step };
        self.model().stop(step, Approach::Above).time + AFTER_REST + AFTER_REST
    }

    /// What the clock alone brings about.
    pub(super) fn on_clock(&mut self, now: Timestamp) {
        match self.activity {
            Activity::Listening { until } | Activity::Waiting { until } if now >= until => self.find(now),
            Activity::Finding { push_at } if now >= push_at => self.push_up_to_find(now),
            Activity::Turning { at } if now >= at => self.turn(now),
            Activity::Ending { until } if now >= until && self.asked.is_none() => self.finish(),
            Activity::Trying(_) => self.on_trial_clock(now),
            _ => {}
        }
        if self.due_by.is_some_and(|due| now >= due) && self.asked.is_none() {
            self.miss_contact(now);
        }
        if self.last_moment().is_some_and(|last| now >= last) {
            self.end(now, Ending::Budget);
        }
    }

    fn on_trial_clock(&mut self, now: Timestamp) {
        let Some(trial) = self.trial() else { return };
        if self.asked.is_some() {
            return;
        }
        match (&trial.stage, trial.experiment) {
            (Stage::RunUp, Experiment::Speed { step, .. } | Experiment::Stop { step, .. })
                if now >= self.steady_at =>
            {
                self.go_steady(now, step);
            }
            (Stage::Aiming { at: Some(at), .. }, _) if now >= *at - COMMAND_TAKES => {
                self.issue(now, SpeedStep::STAND);
            }
            (Stage::Moving { stop_at }, _) if now >= *stop_at - COMMAND_TAKES => {
                self.issue(now, SpeedStep::STAND);
            }
            (Stage::Braking { until }, Experiment::Move { step, .. }) if now >= *until => {
                // Until it is told: the moment to stop counts from when the command has left.
                self.set_stage(Stage::Moving { stop_at: Timestamp::from_ns(i64::MAX) });
                self.issue(now, step);
            }
            (Stage::Braking { until } | Stage::BrakingAgain { until }, _) if now >= *until => {
                self.refit();
                self.set_stage(Stage::Crawling);
                let step = self.step_to_next_contact(now);
                self.issue(now, step);
            }
            _ => {}
        }
    }

    /// The step at which a train at rest goes on to the next contact: a crawl if it is near.
    fn step_to_next_contact(&self, now: Timestamp) -> SpeedStep {
        let model = self.model();
        let crawl = crawl_step(model).unwrap_or(self.stance.step.max(model.highest()));
        let Some(way) = self.way_to_next_contact(now) else { return crawl };
        let wanted = way / CRAWL_TAKES;
        let usable = usable_steps(model);
        let fit = usable.iter().rev().find(|step| model.speed(**step, Approach::Below).value <= wanted);
        fit.copied().unwrap_or(crawl).max(crawl)
    }

    fn way_to_next_contact(&self, now: Timestamp) -> Option<Length> {
        let at = self.locator.locate(self.context(), self.model(), now)?.at;
        let hop = self.context().hop_from(at.node)?;
        Some(self.model().length(&self.sections, &hop)[0] - at.way)
    }

    /// An experiment has ended.
    fn conclude(&mut self, now: Timestamp) {
        let Activity::Trying(trial) = &self.activity else { return };
        let (experiment, begun, before) = (trial.experiment, trial.begun, trial.before);
        self.planner.note(&experiment);
        self.refit();
        let after = self.line(before.step, before.approach);
        self.say(CalibrationNotice::Done(Done { experiment, took: now - begun, before, after }));
        if !self.goes_where_more_is_unknown(now) {
            self.begin_next(now);
        }
    }

    pub(super) fn say_progress(&mut self, now: Timestamp) {
        let progress = self.progress(now);
        self.say(CalibrationNotice::Progress(progress));
    }

    /// When the train has to be commanded to stop to do so within the budget; `None` while that is done already.
    fn last_moment(&self) -> Option<Timestamp> {
        let is_over =
            matches!(self.activity, Activity::Ending { .. } | Activity::Finished | Activity::Paused);
        let started = self.started.filter(|_| !is_over)?;
        Some(started + self.settings.budget - LAST_STOP.max(self.stops_within() + COMMAND_TAKES))
    }

    /// When the clock alone brings something about.
    pub(super) fn due_activity(&self) -> Option<Timestamp> {
        let next = match &self.activity {
            Activity::Asleep => Some(Timestamp::ZERO),
            Activity::Listening { until }
            | Activity::Waiting { until }
            | Activity::Ending { until }
            | Activity::Finding { push_at: until }
            | Activity::Turning { at: until } => Some(*until),
            Activity::Trying(trial) => match trial.stage {
                Stage::RunUp => Some(self.steady_at),
                Stage::Aiming { at: Some(at), .. } => Some(at - COMMAND_TAKES),
                Stage::Moving { stop_at } => Some(stop_at - COMMAND_TAKES),
                Stage::Braking { until } | Stage::BrakingAgain { until } => Some(until),
                Stage::Aiming { at: None, .. } | Stage::Steady { .. } | Stage::Crawling => None,
            },
            Activity::Joining | Activity::Paused | Activity::Finished => None,
        };
        // While a command is waiting for the line, nothing else is due.
        let next = next.filter(|_| self.asked.is_none());
        [next, self.due_by.filter(|_| self.asked.is_none()), self.last_moment()].into_iter().flatten().min()
    }

    /// A person wants the train to stand for a while; what was learnt is kept.
    pub fn pause(&mut self, now: Timestamp) {
        if self.finished.is_none() && !matches!(self.activity, Activity::Ending { .. }) {
            self.hold_line(None);
            self.issue(now, SpeedStep::STAND);
            self.due_by = None;
            self.activity = Activity::Paused;
            self.say_progress(now);
        }
    }

    /// The person is done: the train is where it was, or is looked for.
    pub fn resume(&mut self, now: Timestamp) {
        if matches!(self.activity, Activity::Paused) {
            self.find(now);
        }
    }

    /// Ends the session: the train stops, everything learnt is kept.
    pub fn stop(&mut self, now: Timestamp) {
        self.end(now, Ending::Told);
    }
}
