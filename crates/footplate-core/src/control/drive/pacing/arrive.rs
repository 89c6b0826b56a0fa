//! A train that comes to rest at a place, and does so in time.

use alloc::boxed::Box;
use alloc::string::ToString;
use alloc::vec::Vec;

use crate::control::drive::command_time::{CommandTime, spread};
use crate::control::drive::driven_train::DrivenTrain;
use crate::control::drive::order::{Aim, OrderId};
use crate::control::drive::outputs::Outputs;
use crate::control::drive::path_length::{counted_from, lap};
use crate::control::drive::refusal::Refusal;
use crate::control::drive::stop_planning::name;
use crate::control::drive::task::{Destination, Goal, Phase, Task};
use crate::control::{Notice, PlannedArrival};
use crate::event::Approach;
use crate::ids::{NodeId, SpeedStep};
use crate::model::MotionModel;
use crate::time::{TimeSpan, Timestamp};
use crate::track::Landmark;
use crate::tracking::{Located, TrackContext, WayPoint};
use crate::units::{Length, Speed};

use super::arrival_plan::{ArrivalProfile, Beginning, CREEPING, Means};
use super::pace::{Arriving, Pace, Pacing};
use super::reference::Reference;

/// A standing train that has more time than this speed needs waits rather than creeps.
const UNHURRIED: Speed = Speed::from_mm_per_s(150.0);
/// A start loses time: the step to start with is that of the mean speed and so much more.
const START_LOSS: f64 = 1.1;
/// On a circuit a train that has time for it goes round so many times.
const MOST_ROUNDS: u8 = 20;

/// What to do of all that could be done.
struct Found {
    arriving: Arriving,
    /// When it stands.
    by: Timestamp,
}

impl Arriving {
    /// When the train begins to follow its plan.
    fn begins(&self) -> Timestamp {
        self.since + self.plan.map_or(TimeSpan::ZERO, |plan| TimeSpan::from_s(plan.begins.after))
    }

    /// When the stop is left to who plans stops.
    fn ends(&self) -> Timestamp {
        self.begins() + self.plan.map_or(TimeSpan::ZERO, |plan| plan.profile.motion().duration())
    }

    /// Where it should be; `None` when the way does not lead to the target any more.
    pub(super) fn reference(
        &mut self,
        context: TrackContext<'_>,
        model: &MotionModel,
        now: Timestamp,
        node: NodeId,
    ) -> Option<Reference> {
        let (at, plan) = (self.destination.at?, self.plan?);
        if at.node != node {
            self.destination.at = counted_from(context, model, at, node);
        }
        let zero = self.destination.at?.way.as_m() - plan.begins.left;
        let since = now - self.begins();
        let state = |ahead: f64| plan.profile.motion().state_at(since + TimeSpan::from_s(ahead));
        let speeds = [0.0, Reference::SPAN].map(|ahead| state(ahead).speed.as_m_per_s());
        Some(Reference::of(|ahead| zero + state(ahead).distance.as_m(), speeds))
    }
}

impl DrivenTrain {
    /// Takes an order to come to rest at a place in time.
    pub(in crate::control::drive) fn arrive(
        &mut self,
        context: TrackContext<'_>,
        now: Timestamp,
        order: OrderId,
        target: Landmark,
        within: TimeSpan,
        out: &mut Outputs,
    ) -> Result<(), Refusal> {
        context.layout.locate(target, context.turnouts).map_err(Refusal::Place)?;
        let stands = self.stands(context, now);
        if !stands && self.commanded == SpeedStep::STAND {
            return Err(Refusal::StillMoves { train: self.id() });
        }
        let located = self.located(context, now).filter(|_| self.unseen().is_none() || !stands);
        let located = located.ok_or(Refusal::Lost { train: self.id() })?;
        let mut destination = Destination {
            named: Some(target),
            at: None,
            aim: Aim::Median,
            step: None,
            next_round: false,
            in_time: None,
        };
        let mut at = self.waypoint(context, now, &located, &destination, stands);
        if let Err(Refusal::TooNear { round: Some(_), .. }) = at {
            destination.next_round = true;
            at = self.waypoint(context, now, &located, &destination, stands);
        }
        let at = at?;
        let round = lap(context, &self.model, at.node);
        let (mut latest, mut unreached) = (None, None);
        let rounds = if round.is_some() { MOST_ROUNDS } else { 0 };
        for rounds in 0..=rounds {
            let further = round.unwrap_or(Length::ZERO) * f64::from(rounds);
            destination.at = Some(WayPoint { way: at.way + further, ..at });
            destination.in_time = Some(now + within);
            let found = if stands {
                self.begun_at_rest(context, now, &located, destination, within)
            } else {
                self.on_the_run(context, now, destination, within)
            };
            match found {
                Ok(found) => {
                    self.begin_arrival(context, now, order, found, out);
                    return Ok(());
                }
                Err(Refusal::TooSlow { latest: found, .. }) => latest = latest.or(Some(found)),
                // There is no time for another round, and too much without.
                Err(Refusal::TooSoon { .. }) if latest.is_some() => break,
                Err(why @ Refusal::OutOfReach { .. }) if round.is_some() => {
                    unreached = unreached.or(Some(why));
                }
                Err(why) => return Err(why),
            }
        }
        let target = context.layout.display(target).to_string();
        Err(match latest {
            Some(latest) => Refusal::TooSlow { target, latest },
            None => unreached.unwrap_or(Refusal::OutOfReach { target }),
        })
    }

    fn begin_arrival(
        &mut self,
        context: TrackContext<'_>,
        now: Timestamp,
        order: OrderId,
        Found { arriving, by }: Found,
        out: &mut Outputs,
    ) {
        let train = self.id();
        let starts = arriving.start.map(|step| (arriving.since, step));
        let profile = arriving.plan.map(|plan| ArrivalProfile::new(plan, arriving.begins()));
        out.say(Notice::Arrives(PlannedArrival { order, train, by, starts, profile }));
        self.take(Task { order, goal: Goal::Pace, phase: Phase::Pacing }, out);
        self.pacing = Some(Pacing::new(Pace::Arrive(Box::new(arriving)), self.usable_steps(), now));
        self.goes_by_plan(context, now, out);
    }

    /// From a train that runs.
    fn on_the_run(
        &self,
        context: TrackContext<'_>,
        now: Timestamp,
        destination: Destination,
        within: TimeSpan,
    ) -> Result<Found, Refusal> {
        let lost = || Refusal::Lost { train: self.id() };
        let (at, mut rollout) = (destination.at.ok_or_else(lost)?, self.locator.rollout().ok_or_else(lost)?);
        let [place, speed] = rollout.place_and_speed(&self.model, rollout.seconds(now));
        let begins = Beginning { after: 0.0, left: at.way.as_m() - place, speed };
        let means = self.means(context, now, at, &self.usable_steps(), CREEPING);
        match means.plan(begins, within.as_s()) {
            Some(plan) => {
                let arriving = Arriving { destination, plan: Some(plan), since: now, start: None };
                Ok(Found { arriving, by: now + within })
            }
            None => Err(self.out_of_time(context, &means, begins, within, &destination)),
        }
    }

    /// From a train at rest, which may start later.
    fn begun_at_rest(
        &self,
        context: TrackContext<'_>,
        now: Timestamp,
        located: &Located,
        destination: Destination,
        within: TimeSpan,
    ) -> Result<Found, Refusal> {
        let usable = self.usable_steps();
        let at = destination.at.ok_or(Refusal::Lost { train: self.id() })?;
        let means = self.means(context, now, at, &usable, UNHURRIED);
        let left = (at.way - located.at.way).as_m();
        let allowed = self.fastest_allowed(context, now);
        let may_start = |step: &SpeedStep| allowed.is_none_or(|allowed| *step <= allowed);
        let starts: Vec<SpeedStep> = usable.iter().copied().filter(may_start).collect();
        let step_for = |within: f64| self.nearest_step(&starts, START_LOSS * left / within);
        let begins = |within: f64| self.started(now, step_for(within)?, at);
        let seconds = within.as_s();
        let by = now + within;
        let planned = |seconds: f64, since: Timestamp| {
            let plan = begins(seconds).and_then(|begins| means.plan(begins, seconds))?;
            let arriving = Arriving { destination, plan: Some(plan), since, start: step_for(seconds) };
            Some(Found { arriving, by })
        };
        if let Some(found) = planned(seconds, now) {
            return Ok(found);
        }
        let soonest = means.soonest(begins);
        if let Some(soonest) = soonest.filter(|soonest| *soonest < seconds) {
            let unhurried = means.latest(soonest, begins);
            let waits = TimeSpan::from_s(seconds - unhurried);
            return planned(unhurried, now + waits).ok_or(Refusal::Lost { train: self.id() });
        }
        // One step and the stop, from one that is sure or slower: on a short way that is steady by then where a fast one is not.
        let stands = self.model.standing_times();
        let slowest = self.restricted_until(context, now, at).into_iter().map(|(_, step)| step).min();
        let creeps = |step: SpeedStep| self.model.steady_speed(step, Approach::Below) < CREEPING;
        let sure = || means.last.iter().map(|last| last.step);
        let fastest = sure().max().into_iter().chain(slowest).min();
        let may_run = |step: &SpeedStep| {
            let is_sure = sure().any(|sure| sure == *step);
            fastest.is_none_or(|fastest| *step <= fastest) && (is_sure || !creeps(*step))
        };
        let steps = starts.iter().copied().filter(may_run);
        let runs = steps.filter_map(|step| match self.short_run(context, now, at, step, &destination) {
            CommandTime::At(stop, rest) => {
                let stands = self.standing_time(&stands, [now + self.link.command, stop], step, &rest)?;
                Some((step, stands - now, spread(&rest)))
            }
            _ => None,
        });
        let runs: Vec<_> = runs.collect();
        let in_time = runs.iter().filter(|(_, takes, _)| *takes <= within);
        if let Some((step, takes, _)) = in_time.min_by(|one, other| one.2.as_m().total_cmp(&other.2.as_m())) {
            let since = now + (within - *takes);
            let arriving = Arriving { destination, plan: None, since, start: Some(*step) };
            return Ok(Found { arriving, by });
        }
        let quickest = runs.iter().map(|(_, takes, _)| *takes).min();
        let soonest = soonest.map(TimeSpan::from_s).into_iter().chain(quickest).min();
        let target = name(context, &destination);
        Err(match soonest {
            Some(earliest) => Refusal::TooSoon { target, earliest },
            None => Refusal::OutOfReach { target },
        })
    }

    /// Why there is no plan, and which time would do.
    fn out_of_time(
        &self,
        context: TrackContext<'_>,
        means: &Means,
        begins: Beginning,
        within: TimeSpan,
        destination: &Destination,
    ) -> Refusal {
        let target = name(context, destination);
        match means.soonest(|_| Some(begins)) {
            Some(soonest) if soonest < within.as_s() => {
                let latest = TimeSpan::from_s(means.latest(soonest, |_| Some(begins)));
                Refusal::TooSlow { target, latest }
            }
            Some(soonest) => Refusal::TooSoon { target, earliest: TimeSpan::from_s(soonest) },
            None => Refusal::OutOfReach { target },
        }
    }

    fn nearest_step(&self, usable: &[SpeedStep], speed: f64) -> Option<SpeedStep> {
        let off =
            |step: &SpeedStep| (self.model.steady_speed(*step, Approach::Below).as_m_per_s() - speed).abs();
        usable.iter().copied().min_by(|one, other| off(one).total_cmp(&off(other)))
    }

    /// Where a start leads that has settled.
    fn started(&self, now: Timestamp, step: SpeedStep, at: WayPoint) -> Option<Beginning> {
        let mut rollout = self.locator.rollout()?;
        let after = self.model.settles_within(SpeedStep::STAND, step).as_s();
        let zero = rollout.seconds(now);
        rollout.command(&self.model, zero + self.link.usually_left().as_s(), step);
        let [place, speed] = rollout.place_and_speed(&self.model, zero + after);
        Some(Beginning { after, left: at.way.as_m() - place, speed })
    }

    /// Does what comes before the plan is followed, and after; says whether it is followed now.
    pub(super) fn goes_by_plan(
        &mut self,
        context: TrackContext<'_>,
        now: Timestamp,
        out: &mut Outputs,
    ) -> bool {
        let Some(task) = self.task else { return false };
        let Some(Pacing { pace: Pace::Arrive(arriving), look, .. }) = &mut self.pacing else {
            return true;
        };
        let (begins, ends, destination) = (arriving.begins(), arriving.ends(), arriving.destination);
        if let Some(step) = arriving.start {
            *look = Some(arriving.since);
            if now < arriving.since {
                return false;
            }
            arriving.start = None;
            *look = Some(begins);
            if arriving.plan.is_none() {
                self.leave_to_stop(task, destination);
            }
            self.issue_step(context, now, step, out);
            return false;
        }
        if now < begins {
            *look = Some(begins);
            return false;
        }
        if now < ends {
            return true;
        }
        self.leave_to_stop(task, destination);
        match self.step_in_time(context, now, &destination) {
            Some(step) => self.issue_step(context, now, step, out),
            None => self.plan(context, now, out),
        }
        false
    }

    /// From here on it is a stop like any other.
    fn leave_to_stop(&mut self, task: Task, destination: Destination) {
        let goal = Goal::RestAt(destination);
        self.task = Some(Task { goal, phase: Phase::Running { plan: None }, ..task });
    }

    /// A contact was passed on the way: is the target still ahead?
    pub(super) fn count_target_from(
        &mut self,
        context: TrackContext<'_>,
        now: Timestamp,
        node: NodeId,
        out: &mut Outputs,
    ) {
        let Some(Pacing { pace: Pace::Arrive(arriving), .. }) = &mut self.pacing else { return };
        let destination = arriving.destination;
        let again = destination.at.and_then(|at| self.counted_again(context, at, node, &destination));
        match (again, &mut self.pacing) {
            (Some(at), Some(Pacing { pace: Pace::Arrive(arriving), .. })) => {
                arriving.destination.at = Some(at);
            }
            _ => self.give_up(now, self.no_way(context, node, &destination), out),
        }
    }
}
