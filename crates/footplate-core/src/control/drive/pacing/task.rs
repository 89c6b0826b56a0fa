//! What a train is paced for, and when it is looked at next.

use crate::control::drive::driven_train::DrivenTrain;
use crate::control::drive::outputs::Outputs;
use crate::control::drive::task::{Destination, Goal};
use crate::ids::{NodeId, SensorId};
use crate::link::ContactWindow;
use crate::time::{TimeSpan, Timestamp};
use crate::tracking::TrackContext;

use super::command_budget::{SPACING, seconds};
use super::follow::Others;
use super::pace::{Pace, Pacing};
use super::reference::GRID;
use super::step_search::StepSearch;
use super::surveyed_path::SurveyedPath;

/// The module of a contact is watched from this long before the contact is due: three standard deviations of an
/// expectation, and the poll of all modules that may be on the line then.
const WATCHED_BEFORE: TimeSpan = TimeSpan::from_ms(180);
/// A contact that has not reported after this long may have been missed.
const WATCHED_AFTER: TimeSpan = TimeSpan::from_ms(250);
/// Nothing is planned finer than this: a tenth of a second of 30 mm/s is 3 mm.
const FINE: f64 = 0.5 * GRID;
/// A plan is looked at again after this time (s), whether or not anything was learnt.
const AGAIN: f64 = 1.0;

impl DrivenTrain {
    pub(super) fn paced(&self) -> Option<&Pacing> {
        self.pacing.as_ref().filter(|_| self.goal() == Some(Goal::Pace))
    }

    /// Whether what it should do is looked at again and again, so that no step is owed to it.
    pub(in crate::control::drive) fn is_paced_by_itself(&self) -> bool {
        self.paced().is_some_and(|pacing| !matches!(pacing.pace, Pace::Hold(_)))
    }

    /// When it wants to be looked at, if nothing is reported before.
    pub(in crate::control::drive) fn next_pacing_update(&self) -> Option<Timestamp> {
        self.paced()?.look.filter(|_| self.is_all_sent())
    }

    /// The contact that it comes to next, and from when until when its report is waited for.
    pub(in crate::control::drive) fn due_span(&self) -> Option<(SensorId, [Timestamp; 2])> {
        self.paced()?;
        let (sensor, time) = self.due()?;
        Some((sensor, [time - WATCHED_BEFORE, time + WATCHED_AFTER]))
    }

    /// A step has left the line.
    pub(in crate::control::drive) fn paced_step_left(&mut self, sent: Timestamp) {
        if let Some(pacing) = &mut self.pacing {
            pacing.budget.take(seconds(sent));
            pacing.look = Some(sent + SPACING);
        }
    }

    /// It is about to be judged to have closed a contact. Who keeps to a pace goes round and round: what the hop is like is
    /// kept in mind for the next time.
    pub(in crate::control::drive) fn learn_length(
        &mut self,
        context: TrackContext<'_>,
        sensor: SensorId,
        window: ContactWindow,
    ) {
        let comes_in_time = matches!(self.goal(), Some(Goal::RestAt(Destination { in_time: Some(_), .. })));
        if self.paced().is_none() && !comes_in_time {
            return;
        }
        if let Some((section, longer)) = self.locator.shown_length(context, &self.model, sensor, window) {
            self.model.set_section(section, longer.mean, longer.variance);
        }
    }

    /// A contact was passed: all is looked at again.
    pub(in crate::control::drive) fn paced_passed(
        &mut self,
        context: TrackContext<'_>,
        now: Timestamp,
        node: NodeId,
        out: &mut Outputs,
    ) {
        let Some(task) = self.task.filter(|task| task.goal == Goal::Pace) else { return };
        let Some(mut pacing) = self.pacing.take() else { return };
        if let Pace::Hold(holding) = &mut pacing.pace {
            self.begin_line(context, now, task.order, holding, out);
        }
        pacing.look = Some(now);
        self.pacing = Some(pacing);
        self.count_target_from(context, now, node, out);
    }

    /// Looks at what it does against what it should do, and commands what is due.
    pub(in crate::control::drive) fn pace(
        &mut self,
        context: TrackContext<'_>,
        now: Timestamp,
        others: &Others,
        out: &mut Outputs,
    ) {
        // Who holds a speed that a zone does not allow waits until it has left that.
        let is_holding = matches!(&self.pacing, Some(Pacing { pace: Pace::Hold(_), .. }));
        if is_holding && self.is_speed_limited() {
            self.pacing.iter_mut().for_each(|pacing| pacing.look = None);
            return;
        }
        if !self.goes_by_plan(context, now, out) || !self.may_follow(context, now, others, out) {
            return;
        }
        let Some(rollout) = self.locator.rollout() else { return };
        let (node, model) = (rollout.node(), &self.model);
        let followed = match self.pacing.as_ref().map(|pacing| &pacing.pace) {
            Some(Pace::Follow(following)) => self.follow_reference(context, now, *following, node, others),
            _ => None,
        };
        let allowed = self.fastest_allowed(context, now);
        let Some(pacing) = &mut self.pacing else { return };
        let guard = pacing.look.take().filter(|_| matches!(pacing.pace, Pace::Follow(_)));
        let (reference, way) = match &mut pacing.pace {
            Pace::Hold(holding) => {
                (holding.reference(context, now, node), SurveyedPath::ahead(context, model, node))
            }
            Pace::Arrive(arriving) => {
                pacing.look = Some(now + TimeSpan::from_s(AGAIN));
                (arriving.reference(context, model, now, node), SurveyedPath::unscaled())
            }
            Pace::Follow(_) => (followed, SurveyedPath::ahead(context, model, node)),
        };
        let Some(reference) = reference else {
            pacing.look = guard.or(pacing.look);
            return;
        };
        let leaves = self.link.usually_left().as_s();
        let at = rollout.seconds(now);
        let mut here = rollout;
        let behind = reference.now() - way.surveyed(here.place(&self.model, at));
        let fastest = match pacing.pace {
            Pace::Follow(following) => following.fastest(),
            Pace::Hold(_) | Pace::Arrive(_) => None,
        };
        let fastest = fastest.into_iter().chain(allowed).min();
        let usable = pacing.usable.partition_point(|step| fastest.is_none_or(|fastest| *step <= fastest));
        let usable = pacing.usable.get(..usable).unwrap_or_default();
        let search = StepSearch::new(&self.model, &way, &reference, usable, [at, leaves], behind);
        let choice = search.best(rollout, pacing.budget.later(at - seconds(now)));
        match choice.first {
            Some((0, step)) => {
                pacing.look = Some(now + SPACING);
                if self.could_still_stop(context, now, step) {
                    self.command_step(context, now, step, out);
                }
            }
            Some((grid, _)) => {
                let wait = (GRID * grid as f64 - FINE).clamp(FINE, AGAIN);
                pacing.look = Some(now + TimeSpan::from_s(wait));
            }
            None => pacing.look = Some(now + TimeSpan::from_s(AGAIN)),
        }
        if let Some(pacing) = &mut self.pacing {
            pacing.look = pacing.look.into_iter().chain(guard).min();
        }
    }
}
