//! Starts and follows an arrival at a place at a given time.

use alloc::boxed::Box;
use alloc::string::ToString;
use alloc::vec::Vec;

use crate::control::drive::command_time::CommandTime;
use crate::control::drive::driven_train::DrivenTrain;
use crate::control::drive::order::{Aim, OrderId};
use crate::control::drive::outputs::Outputs;
use crate::control::drive::path::{circuit_length, recount_from};
use crate::control::drive::refusal::Refusal;
use crate::control::drive::stop_planning::name;
use crate::control::drive::task::{Destination, Goal, Task, TaskPhase};
use crate::control::{Notice, PlannedArrival};
use crate::event::Approach;
use crate::ids::{NodeId, SpeedStep};
use crate::model::MotionModel;
use crate::time::{TimeSpan, Timestamp};
use crate::track::Landmark;
use crate::tracking::{Located, PathPoint, TrackContext};
use crate::units::{Length, Speed};

use super::arrival_plan::{ArrivalOptions, ArrivalProfile, Beginning, CREEP_SPEED};
use super::pace::{Arriving, Pace, Pacing};
use super::reference::Reference;

/// A train at rest with more time than this mean speed needs waits rather than creeps.
const MIN_MEAN_SPEED: Speed = Speed::from_mm_per_s(150.0);
/// The starting step has the mean speed times this: a start loses time.
const START_FACTOR: f64 = 1.1;
/// On a circuit, a train with time left runs up to this many laps.
const MAX_LAPS: u8 = 20;

/// An arrival that can be started.
struct PlannedStart {
    arriving: Arriving,
    /// When the train is at rest.
    by: Timestamp,
}

impl Arriving {
    /// When the train starts to follow its plan.
    fn begins(&self) -> Timestamp {
        self.since + self.plan.map_or(TimeSpan::ZERO, |plan| TimeSpan::from_s(plan.begins.after))
    }

    /// When stop planning takes over.
    fn ends(&self) -> Timestamp {
        self.begins() + self.plan.map_or(TimeSpan::ZERO, |plan| plan.profile.motion().duration())
    }

    /// Where the train should be; `None` if the path no longer leads to the target.
    pub(super) fn reference(
        &mut self,
        context: TrackContext<'_>,
        model: &MotionModel,
        now: Timestamp,
        node: NodeId,
    ) -> Option<Reference> {
        let (at, plan) = (self.destination.at?, self.plan?);
        if at.node != node {
            self.destination.at = recount_from(context, model, at, node);
        }
        let zero = self.destination.at?.distance.as_m() - plan.begins.left;
        let since = now - self.begins();
        let state = |ahead: f64| plan.profile.motion().state_at(since + TimeSpan::from_s(ahead));
        let speeds = [0.0, Reference::SPAN].map(|ahead| state(ahead).speed.as_m_per_s());
        Some(Reference::of(|ahead| zero + state(ahead).distance.as_m(), speeds))
    }
}

impl DrivenTrain {
    /// Starts an order to arrive at a place at a time.
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
        let at_rest = self.is_at_rest(context, now);
        if !at_rest && self.commanded == SpeedStep::STAND {
            return Err(Refusal::StillMoves { train: self.id() });
        }
        let located = self.located(context, now).filter(|_| self.missed_sensor().is_none() || !at_rest);
        let located = located.ok_or(Refusal::Lost { train: self.id() })?;
        let mut destination = Destination {
            named: Some(target),
            at: None,
            aim: Aim::Median,
            step: None,
            next_round: false,
            in_time: None,
        };
        let mut at = self.locate_target(context, now, &located, &destination, at_rest);
        if let Err(Refusal::TooNear { round: Some(_), .. }) = at {
            destination.next_round = true;
            at = self.locate_target(context, now, &located, &destination, at_rest);
        }
        let at = at?;
        let lap = circuit_length(context, &self.model, at.node);
        let (mut latest, mut unreached) = (None, None);
        let laps = if lap.is_some() { MAX_LAPS } else { 0 };
        for laps in 0..=laps {
            let further = lap.unwrap_or(Length::ZERO) * f64::from(laps);
            destination.at = Some(PathPoint { distance: at.distance + further, ..at });
            destination.in_time = Some(now + within);
            let found = if at_rest {
                self.plan_from_rest(context, now, &located, destination, within)
            } else {
                self.plan_moving(context, now, destination, within)
            };
            match found {
                Ok(found) => {
                    self.begin_arrival(context, now, order, found, out);
                    return Ok(());
                }
                Err(Refusal::TooSlow { latest: found, .. }) => latest = latest.or(Some(found)),
                // Too little time for another lap, and too much without.
                Err(Refusal::TooSoon { .. }) if latest.is_some() => break,
                Err(why @ Refusal::OutOfReach { .. }) if lap.is_some() => {
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
        PlannedStart { arriving, by }: PlannedStart,
        out: &mut Outputs,
    ) {
        let train = self.id();
        let starts = arriving.start.map(|step| (arriving.since, step));
        let profile = arriving.plan.map(|plan| ArrivalProfile::new(plan, arriving.begins()));
        out.notify(Notice::Arrives(PlannedArrival { order, train, by, starts, profile }));
        self.start_task(Task { order, goal: Goal::Pace, phase: TaskPhase::Pacing }, out);
        self.pacing = Some(Pacing::new(Pace::Arrive(Box::new(arriving)), self.usable_steps(), now));
        self.follows_plan(context, now, out);
    }

    /// The arrival of a moving train.
    fn plan_moving(
        &self,
        context: TrackContext<'_>,
        now: Timestamp,
        destination: Destination,
        within: TimeSpan,
    ) -> Result<PlannedStart, Refusal> {
        let lost = || Refusal::Lost { train: self.id() };
        let (at, mut rollout) = (destination.at.ok_or_else(lost)?, self.locator.rollout().ok_or_else(lost)?);
        let [place, speed] = rollout.place_and_speed(&self.model, rollout.seconds(now));
        let begins = Beginning { after: 0.0, left: at.distance.as_m() - place, speed };
        let options = self.options(context, now, at, &self.usable_steps(), CREEP_SPEED);
        match options.plan(begins, within.as_s()) {
            Some(plan) => {
                let arriving = Arriving { destination, plan: Some(plan), since: now, start: None };
                Ok(PlannedStart { arriving, by: now + within })
            }
            None => Err(self.why_not_in_time(context, &options, begins, within, &destination)),
        }
    }

    /// The arrival of a train at rest, which may start later.
    fn plan_from_rest(
        &self,
        context: TrackContext<'_>,
        now: Timestamp,
        located: &Located,
        destination: Destination,
        within: TimeSpan,
    ) -> Result<PlannedStart, Refusal> {
        let usable = self.usable_steps();
        let at = destination.at.ok_or(Refusal::Lost { train: self.id() })?;
        let options = self.options(context, now, at, &usable, MIN_MEAN_SPEED);
        let left = (at.distance - located.at.distance).as_m();
        let allowed = self.fastest_allowed(context, now);
        let may_start = |step: &SpeedStep| allowed.is_none_or(|allowed| *step <= allowed);
        let starts: Vec<SpeedStep> = usable.iter().copied().filter(may_start).collect();
        let step_for = |within: f64| self.nearest_step(&starts, START_FACTOR * left / within);
        let begins = |within: f64| self.state_after_start(now, step_for(within)?, at);
        let seconds = within.as_s();
        let by = now + within;
        let planned = |seconds: f64, since: Timestamp| {
            let plan = begins(seconds).and_then(|begins| options.plan(begins, seconds))?;
            let arriving = Arriving { destination, plan: Some(plan), since, start: step_for(seconds) };
            Some(PlannedStart { arriving, by })
        };
        if let Some(found) = planned(seconds, now) {
            return Ok(found);
        }
        let soonest = options.shortest_time(begins);
        if let Some(soonest) = soonest.filter(|soonest| *soonest < seconds) {
            let longest = options.longest_time(soonest, begins);
            let waits = TimeSpan::from_s(seconds - longest);
            return planned(longest, now + waits).ok_or(Refusal::Lost { train: self.id() });
        }
        // One step and the stop, from a precise step or a slower one: on a short path a slow step settles where a
        // fast one does not.
        let rest_times = self.model.standing_times();
        let slowest = self.restricted_until(context, now, at).into_iter().map(|(_, step)| step).min();
        let creeps = |step: SpeedStep| self.model.steady_speed(step, Approach::Below) < CREEP_SPEED;
        let precise = || options.last.iter().map(|last| last.step);
        let fastest = precise().max().into_iter().chain(slowest).min();
        let may_run = |step: &SpeedStep| {
            let is_precise = precise().any(|precise| precise == *step);
            fastest.is_none_or(|fastest| *step <= fastest) && (is_precise || !creeps(*step))
        };
        let steps = starts.iter().copied().filter(may_run);
        let runs = steps.filter_map(|step| match self.short_run(context, now, at, step, &destination) {
            CommandTime::At(stop, rest) => {
                let rest_time =
                    self.standing_time(&rest_times, [now + self.link.command, stop], step, &rest)?;
                Some((step, rest_time - now, rest.deviation()))
            }
            _ => None,
        });
        let runs: Vec<_> = runs.collect();
        let in_time = runs.iter().filter(|(_, takes, _)| *takes <= within);
        if let Some((step, takes, _)) = in_time.min_by(|one, other| one.2.as_m().total_cmp(&other.2.as_m())) {
            let since = now + (within - *takes);
            let arriving = Arriving { destination, plan: None, since, start: Some(*step) };
            return Ok(PlannedStart { arriving, by });
        }
        let quickest = runs.iter().map(|(_, takes, _)| *takes).min();
        let soonest = soonest.map(TimeSpan::from_s).into_iter().chain(quickest).min();
        let target = name(context, &destination);
        Err(match soonest {
            Some(earliest) => Refusal::TooSoon { target, earliest },
            None => Refusal::OutOfReach { target },
        })
    }

    /// Why there is no plan, and which time would be possible.
    fn why_not_in_time(
        &self,
        context: TrackContext<'_>,
        options: &ArrivalOptions,
        begins: Beginning,
        within: TimeSpan,
        destination: &Destination,
    ) -> Refusal {
        let target = name(context, destination);
        match options.shortest_time(|_| Some(begins)) {
            Some(soonest) if soonest < within.as_s() => {
                let latest = TimeSpan::from_s(options.longest_time(soonest, |_| Some(begins)));
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

    /// The state after a start has settled.
    fn state_after_start(&self, now: Timestamp, step: SpeedStep, at: PathPoint) -> Option<Beginning> {
        let mut rollout = self.locator.rollout()?;
        let after = self.model.settles_within(SpeedStep::STAND, step).as_s();
        let zero = rollout.seconds(now);
        rollout.command(&self.model, zero + self.link.usually_left().as_s(), step);
        let [place, speed] = rollout.place_and_speed(&self.model, zero + after);
        Some(Beginning { after, left: at.distance.as_m() - place, speed })
    }

    /// Starts the train before its plan and passes it to stop planning after it. Returns whether the plan applies now.
    pub(super) fn follows_plan(
        &mut self,
        context: TrackContext<'_>,
        now: Timestamp,
        out: &mut Outputs,
    ) -> bool {
        let Some(task) = self.task else { return false };
        let Some(Pacing { pace: Pace::Arrive(arriving), next_update, .. }) = &mut self.pacing else {
            return true;
        };
        let (begins, ends, destination) = (arriving.begins(), arriving.ends(), arriving.destination);
        if let Some(step) = arriving.start {
            *next_update = Some(arriving.since);
            if now < arriving.since {
                return false;
            }
            arriving.start = None;
            *next_update = Some(begins);
            if arriving.plan.is_none() {
                self.hand_over_to_stop(task, destination);
            }
            self.command_step(context, now, step, out);
            return false;
        }
        if now < begins {
            *next_update = Some(begins);
            return false;
        }
        if now < ends {
            return true;
        }
        self.hand_over_to_stop(task, destination);
        match self.step_in_time(context, now, &destination) {
            Some(step) => self.command_step(context, now, step, out),
            None => self.plan(context, now, out),
        }
        false
    }

    /// Continues as an ordinary stop.
    fn hand_over_to_stop(&mut self, task: Task, destination: Destination) {
        let goal = Goal::RestAt(destination);
        self.task = Some(Task { goal, phase: TaskPhase::Running { plan: None }, ..task });
    }

    /// Measures the target again after a detection; gives up if no path leads there.
    pub(super) fn recount_arrival_target(
        &mut self,
        context: TrackContext<'_>,
        now: Timestamp,
        node: NodeId,
        out: &mut Outputs,
    ) {
        let Some(Pacing { pace: Pace::Arrive(arriving), .. }) = &mut self.pacing else { return };
        let destination = arriving.destination;
        let again = destination.at.and_then(|at| self.recount_target(context, at, node, &destination));
        match (again, &mut self.pacing) {
            (Some(at), Some(Pacing { pace: Pace::Arrive(arriving), .. })) => {
                arriving.destination.at = Some(at);
            }
            _ => self.give_up(now, self.no_path(context, node, &destination), out),
        }
    }
}
