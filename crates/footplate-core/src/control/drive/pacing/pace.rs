//! Paced trains: what each is paced for, when its pacing is updated, and the update.

use alloc::boxed::Box;
use alloc::vec::Vec;

use crate::control::drive::driven_train::DrivenTrain;
use crate::control::drive::driver::Driver;
use crate::control::drive::order::Gap;
use crate::control::drive::outputs::Outputs;
use crate::control::drive::task::{Destination, Goal};
use crate::ids::{NodeId, SensorId, SpeedStep, TrainId};
use crate::link::DetectionWindow;
use crate::time::{TimeSpan, Timestamp};
use crate::tracking::{PathPoint, TrackContext};
use crate::units::{Length, Speed};

use super::arrival_plan::ArrivalPlan;
use super::follow::Others;
use super::reference::{GRID_S, IdealLine, SurveyedPath};
use super::step_search::{CommandBudget, SPACING, StepSearch, seconds};

/// What a train is paced for.
#[derive(Debug, Clone)]
pub(in crate::control::drive) enum Pace {
    /// Hold a speed.
    Hold(Holding),
    /// Arrive at a place at a time.
    Arrive(Box<Arriving>),
    /// Follow another train at a gap.
    Follow(Following),
}

/// The pacing of one train.
#[derive(Debug, Clone)]
pub(in crate::control::drive) struct Pacing {
    pub(super) pace: Pace,
    /// The steps that may be commanded, slowest first.
    pub(super) usable: Vec<SpeedStep>,
    pub(super) budget: CommandBudget,
    /// When the pacing is updated next.
    pub(super) next_update: Option<Timestamp>,
}

impl Pacing {
    pub(super) fn new(pace: Pace, usable: Vec<SpeedStep>, now: Timestamp) -> Self {
        Self { pace, usable, budget: CommandBudget::UNUSED, next_update: Some(now) }
    }
}

/// A speed to hold, and its line once it has started.
#[derive(Debug, Clone, Copy)]
pub(in crate::control::drive) struct Holding {
    pub(super) speed: Speed,
    /// When the train has settled at its first step.
    pub(super) settled: Timestamp,
    pub(super) line: Option<IdealLine>,
}

/// A planned arrival.
#[derive(Debug, Clone, Copy)]
pub(in crate::control::drive) struct Arriving {
    pub(super) destination: Destination,
    /// `None` for a path so short that it takes one step and the stop.
    pub(super) plan: Option<ArrivalPlan>,
    /// The time that the plan counts from.
    pub(super) since: Timestamp,
    /// For a train at rest: the step to start with, commanded at `since`.
    pub(super) start: Option<SpeedStep>,
}

/// The leader, and the state of following it.
#[derive(Debug, Clone, Copy)]
pub(in crate::control::drive) struct Following {
    pub(super) leader: TrainId,
    pub(super) gap: Gap,
    /// The follower was stopped because it would have come too close.
    pub(super) is_stopped: bool,
    /// The point before which it must be able to stop, as of the last check, ...
    pub(super) rear: Option<PathPoint>,
    /// ... and the fastest step that allows it to.
    pub(super) fastest: Option<SpeedStep>,
}

impl Driver {
    /// Updates the pacing of the trains whose update is due.
    pub(in crate::control::drive) fn pace(&mut self, now: Timestamp) {
        let due = |train: &DrivenTrain| train.next_pacing_update().is_some_and(|at| at <= now);
        let due: Vec<TrainId> =
            self.trains.values().filter(|train| due(train)).map(DrivenTrain::id).collect();
        let context = self.track.context();
        for id in due {
            // A follower reads the states of the other trains.
            if let Some(mut train) = self.trains.remove(&id) {
                train.pace(context, now, &self.trains, &mut self.outputs);
                self.trains.insert(id, train);
            }
        }
    }

    /// The estimated distance of a train ahead of the line of its held speed, in surveyed lengths; `None` for any
    /// other train, and before the line starts.
    pub fn ahead_of_line(&self, train: TrainId, now: Timestamp) -> Option<Length> {
        self.trains.get(&train)?.ahead_of_line(self.track.context(), now)
    }

    /// The sensor that a paced train is about to pass; also schedules when that changes.
    pub(in crate::control::drive) fn next_paced_sensor(&mut self, now: Timestamp) -> Option<SensorId> {
        let paced = || self.trains.values().filter_map(DrivenTrain::watch_span);
        let is_due = |[from, until]: [Timestamp; 2]| from <= now && now < until;
        self.watch_changes = paced().flat_map(|(_, span)| span).filter(|at| *at > now).min();
        paced().find(|(_, span)| is_due(*span)).map(|(sensor, _)| sensor)
    }
}

/// A sensor is polled more often from this long before its detection is due: three standard deviations of the
/// prediction, and the poll of all modules that may be on the line then.
const WATCH_BEFORE: TimeSpan = TimeSpan::from_ms(180);
/// A detection that is later than this may have been missed.
const WATCH_AFTER: TimeSpan = TimeSpan::from_ms(250);
/// Shortest wait before another search: at 30 mm/s, a tenth of a second is 3 mm.
const MIN_WAIT: f64 = 0.5 * GRID_S;
/// A plan is updated after this time (s) without a report.
const REPLAN_INTERVAL: f64 = 1.0;

impl DrivenTrain {
    pub(super) fn paced(&self) -> Option<&Pacing> {
        self.pacing.as_ref().filter(|_| self.goal() == Some(Goal::Pace))
    }

    /// Whether pacing chooses steps at every update, so that no ordered step has to be restored behind a zone.
    pub(in crate::control::drive) fn chooses_steps_itself(&self) -> bool {
        self.paced().is_some_and(|pacing| !matches!(pacing.pace, Pace::Hold(_)))
    }

    /// When its pacing is updated next without a report.
    pub(in crate::control::drive) fn next_pacing_update(&self) -> Option<Timestamp> {
        self.paced()?.next_update.filter(|_| self.is_all_sent())
    }

    /// The next sensor, and the span in which its detection is expected.
    pub(in crate::control::drive) fn watch_span(&self) -> Option<(SensorId, [Timestamp; 2])> {
        self.paced()?;
        let (sensor, time) = self.due()?;
        Some((sensor, [time - WATCH_BEFORE, time + WATCH_AFTER]))
    }

    /// A step has been sent.
    pub(in crate::control::drive) fn pacing_step_sent(&mut self, context: TrackContext<'_>, sent: Timestamp) {
        let stands = self.located(context, sent).is_some_and(|located| located.speed <= Speed::ZERO);
        if stands && self.commanded > SpeedStep::STAND {
            self.passages.set_out();
        }
        if let Some(pacing) = &mut self.pacing {
            pacing.budget.record(seconds(sent));
            pacing.next_update = Some(sent + SPACING);
        }
    }

    /// Learns the length of the hop from a detection that is about to be assigned to the train: a paced train passes
    /// it again.
    pub(in crate::control::drive) fn learn_length(
        &mut self,
        context: TrackContext<'_>,
        sensor: SensorId,
        window: DetectionWindow,
    ) {
        let comes_in_time = matches!(self.goal(), Some(Goal::RestAt(Destination { in_time: Some(_), .. })));
        if self.paced().is_none() && !comes_in_time {
            return;
        }
        if let Some((section, longer)) = self.locator.shown_length(context, &self.model, sensor, window) {
            self.model.set_section(section, longer.mean, longer.variance);
        }
    }

    /// A sensor was passed: update the pacing.
    pub(in crate::control::drive) fn pacing_passed(
        &mut self,
        context: TrackContext<'_>,
        now: Timestamp,
        node: NodeId,
        out: &mut Outputs,
    ) {
        let Some(task) = self.task.filter(|task| task.goal == Goal::Pace) else { return };
        let Some(mut pacing) = self.pacing.take() else { return };
        if let Pace::Hold(holding) = &mut pacing.pace {
            self.start_line(context, now, task.order, holding, out);
        }
        pacing.next_update = Some(now);
        self.pacing = Some(pacing);
        self.recount_arrival_target(context, now, node, out);
    }

    /// Compares the train with its reference and commands the next step if it is due.
    pub(in crate::control::drive) fn pace(
        &mut self,
        context: TrackContext<'_>,
        now: Timestamp,
        others: &Others,
        out: &mut Outputs,
    ) {
        // A train whose held speed exceeds a zone's limit waits until it has left the zone.
        let is_holding = matches!(&self.pacing, Some(Pacing { pace: Pace::Hold(_), .. }));
        if is_holding && self.is_speed_limited() {
            self.pacing.iter_mut().for_each(|pacing| pacing.next_update = None);
            return;
        }
        if !self.follows_plan(context, now, out) || !self.may_follow(context, now, others, out) {
            return;
        }
        let Some(rollout) = self.locator.rollout() else {
            // A lost train is paced again from the next sensor on.
            self.pacing.iter_mut().for_each(|pacing| {
                pacing.next_update.take_if(|at| *at <= now);
            });
            return;
        };
        let starts_until = self.locator.started_by(&self.model).filter(|started| now < *started);
        if let (Some(started), Some(pacing)) = (starts_until, &mut self.pacing) {
            // Decoders that are commanded again before their train has started begin to start anew.
            pacing.next_update =
                Some(pacing.next_update.filter(|at| now < *at).map_or(started, |at| at.min(started)));
            return;
        }
        let (node, model) = (rollout.node(), &self.model);
        let followed = match self.pacing.as_ref().map(|pacing| &pacing.pace) {
            Some(Pace::Follow(following)) => self.follow_reference(context, now, *following, node, others),
            _ => None,
        };
        let allowed = self.fastest_allowed(context, now);
        let Some(pacing) = &mut self.pacing else { return };
        let leader_check = pacing.next_update.take().filter(|_| matches!(pacing.pace, Pace::Follow(_)));
        let (reference, path) = match &mut pacing.pace {
            Pace::Hold(holding) => {
                (holding.reference(context, now, node), SurveyedPath::ahead(context, model, node))
            }
            Pace::Arrive(arriving) => {
                pacing.next_update = Some(now + TimeSpan::from_s(REPLAN_INTERVAL));
                (arriving.reference(context, model, now, node), SurveyedPath::unscaled())
            }
            Pace::Follow(_) => (followed, SurveyedPath::ahead(context, model, node)),
        };
        let Some(reference) = reference else {
            pacing.next_update = leader_check.or(pacing.next_update);
            return;
        };
        let leaves = self.link.usually_left().as_s();
        let at = rollout.seconds(now);
        let mut here = rollout;
        let behind = reference.now() - path.surveyed(here.place(&self.model, at));
        let fastest = match pacing.pace {
            Pace::Follow(following) => following.fastest(),
            Pace::Hold(_) | Pace::Arrive(_) => None,
        };
        let fastest = fastest.into_iter().chain(allowed).min();
        let usable = pacing.usable.partition_point(|step| fastest.is_none_or(|fastest| *step <= fastest));
        let usable = pacing.usable.get(..usable).unwrap_or_default();
        let search = StepSearch::new(&self.model, &path, &reference, usable, [at, leaves], behind);
        let choice = search.best(rollout, pacing.budget.later(at - seconds(now)));
        match choice.first {
            Some((0, step)) => {
                pacing.next_update = Some(now + SPACING);
                if self.could_still_stop(context, now, step) {
                    self.command_step(context, now, step, out);
                }
            }
            Some((grid, _)) => {
                let wait = (GRID_S * grid as f64 - MIN_WAIT).clamp(MIN_WAIT, REPLAN_INTERVAL);
                pacing.next_update = Some(now + TimeSpan::from_s(wait));
            }
            None => pacing.next_update = Some(now + TimeSpan::from_s(REPLAN_INTERVAL)),
        }
        if let Some(pacing) = &mut self.pacing {
            pacing.next_update = pacing.next_update.into_iter().chain(leader_check).min();
        }
    }
}
