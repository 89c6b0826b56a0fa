//! Stops at a place: whether one can be made, from which step, and when the command has to leave.

use alloc::string::{String, ToString};

use crate::estimate::HALF_95;
use crate::ids::{NodeId, SpeedStep};
use crate::time::{TimeSpan, Timestamp};
use crate::tracking::{Located, Rest, TrackContext, WayPoint, landmark_of, way_to_landmark};
use crate::units::Length;

use super::command_time::{CommandTime, command_time, spread};
use super::driven_train::DrivenTrain;
use super::order::{Aim, OrderId, StopOrder};
use super::outputs::Outputs;
use super::path_length::{contacts_until, counted_from, lap, unknown_turnout, way_between};
use super::refusal::Refusal;
use super::task::{Destination, Goal, Phase, Plan, Task};
use crate::control::{Notice, PlannedStop, Promise};

/// A plan that moved by less is no news.
const NEWS: TimeSpan = TimeSpan::from_ms(1);
/// An overshoot that is less than any stop scatters is no news either.
const OVERSHOOT: Length = Length::from_mm(5.0);
/// A train that stands this near to where it should is there.
pub(in crate::control) const THERE: Length = Length::from_mm(1.0);

impl DrivenTrain {
    /// Takes an order to stop somewhere.
    pub(super) fn stop_at(
        &mut self,
        context: TrackContext<'_>,
        now: Timestamp,
        order: OrderId,
        stop: &StopOrder,
        out: &mut Outputs,
    ) -> Result<(), Refusal> {
        let mut destination = Destination {
            named: Some(stop.target),
            at: None,
            aim: stop.aim,
            step: stop.step,
            next_round: stop.next_round,
            in_time: None,
        };
        context.layout.locate(stop.target, context.turnouts).map_err(Refusal::Place)?;
        let stands = self.stands(context, now);
        if !stands && self.commanded == SpeedStep::STAND {
            return Err(Refusal::StillMoves { train: self.id() });
        }
        // Who was not seen where it should have been is looked for first.
        let located = self.located(context, now).filter(|_| self.unseen().is_none() || !stands);
        let Some(located) = located else {
            self.take(
                Task { order, goal: Goal::RestAt(destination), phase: Phase::Finding { since: now } },
                out,
            );
            if stands {
                let step = stop.step.unwrap_or_else(|| self.finding_step());
                self.issue_step(context, now, step, out);
            }
            return Ok(());
        };
        destination.at = Some(self.waypoint(context, now, &located, &destination, stands)?);
        self.head_for(context, now, order, &located, destination, stands, out)
    }

    /// A train that was looked for is located again: goes on to where it should. What is too near is passed once more.
    pub(super) fn set_out(
        &mut self,
        context: TrackContext<'_>,
        now: Timestamp,
        order: OrderId,
        mut destination: Destination,
        out: &mut Outputs,
    ) {
        let Some(located) = self.located(context, now) else { return };
        let mut at = self.waypoint(context, now, &located, &destination, false);
        if let Err(Refusal::TooNear { round: Some(_), .. }) = at {
            destination.next_round = true;
            at = self.waypoint(context, now, &located, &destination, false);
        }
        let headed = at.and_then(|at| {
            destination.at = Some(at);
            self.task = None;
            self.head_for(context, now, order, &located, destination, false, out)
        });
        if let Err(why) = headed {
            self.task =
                Some(Task { order, goal: Goal::RestAt(destination), phase: Phase::Running { plan: None } });
            self.give_up(now, why, out);
        }
    }

    /// Takes an order to move on.
    pub(super) fn move_on(
        &mut self,
        context: TrackContext<'_>,
        now: Timestamp,
        order: OrderId,
        distance: Length,
        out: &mut Outputs,
    ) -> Result<(), Refusal> {
        // Who was not seen where it should have been is not where it is believed to be: no contact would fit the move.
        let located = self.located(context, now).filter(|_| self.unseen().is_none());
        let located = located.ok_or(Refusal::Lost { train: self.id() })?;
        if !self.stands(context, now) {
            return Err(Refusal::StillMoves { train: self.id() });
        }
        let at = WayPoint { way: located.at.way + distance, ..located.at };
        let destination = Destination {
            named: None,
            at: Some(at),
            aim: Aim::Median,
            step: None,
            next_round: false,
            in_time: None,
        };
        self.head_for(context, now, order, &located, destination, true, out)
    }

    #[expect(clippy::too_many_arguments, reason = "the last step of two orders, which know all of it")]
    fn head_for(
        &mut self,
        context: TrackContext<'_>,
        now: Timestamp,
        order: OrderId,
        located: &Located,
        destination: Destination,
        stands: bool,
        out: &mut Outputs,
    ) -> Result<(), Refusal> {
        let task = Task { order, goal: Goal::RestAt(destination), phase: Phase::Running { plan: None } };
        if stands {
            let there = destination.at.is_some_and(|at| {
                self.beyond(context, located.at, at).is_some_and(|beyond| beyond.abs() <= THERE)
            });
            if there {
                self.take(task, out);
                self.finish(context, now, order, destination.at, None, out);
                return Ok(());
            }
            let step = self.approach_step(context, now, located, &destination)?;
            self.take(task, out);
            self.issue_step(context, now, step, out);
        } else {
            self.take(task, out);
            match destination.step.filter(|step| *step != self.commanded) {
                Some(step) => self.issue_step(context, now, step, out),
                None => self.plan(context, now, out),
            }
        }
        Ok(())
    }

    /// The target on the way of a train, the first time it comes there and can rest there.
    pub(super) fn waypoint(
        &self,
        context: TrackContext<'_>,
        now: Timestamp,
        located: &Located,
        destination: &Destination,
        stands: bool,
    ) -> Result<WayPoint, Refusal> {
        let node = located.at.node;
        let no_way = || self.no_way(context, node, destination);
        let named = destination.named.ok_or_else(no_way)?;
        context.layout.locate(named, context.turnouts).map_err(Refusal::Place)?;
        let mut way = way_to_landmark(context, &self.model, node, named).ok_or_else(no_way)?;
        let lap = lap(context, &self.model, node);
        let behind = |way: Length| way < located.at.way - THERE;
        if behind(way) {
            way += lap.filter(|lap| !behind(way + *lap)).ok_or_else(no_way)?;
        }
        if destination.next_round {
            way += lap.ok_or_else(no_way)?;
        }
        let at = WayPoint { node, way };
        if !stands {
            let soonest = self.locator.rest_if_stopped(context, &self.model, now + self.link.soonest);
            let reached = soonest
                .and_then(|rest| Some((rest, self.aimed_beyond(context, &rest, at, destination.aim)?)));
            if let Some((_, beyond)) = reached.filter(|(_, beyond)| *beyond > Length::ZERO) {
                return Err(self.too_near(context, at, beyond, destination));
            }
        }
        Ok(at)
    }

    pub(super) fn too_near(
        &self,
        context: TrackContext<'_>,
        at: WayPoint,
        beyond: Length,
        destination: &Destination,
    ) -> Refusal {
        if destination.named.is_none() {
            return Refusal::MoveTooShort { shortest: beyond };
        }
        let nearest = landmark_of(context, &self.model, WayPoint { way: at.way + beyond, ..at });
        let nearest = crate::track::Landmark {
            offset: Length::from_mm(libm::round(nearest.offset.as_mm())),
            ..nearest
        };
        Refusal::TooNear {
            target: name(context, destination),
            nearest: context.layout.display(nearest).to_string(),
            beyond,
            round: lap(context, &self.model, at.node),
        }
    }

    pub(super) fn no_way(
        &self,
        context: TrackContext<'_>,
        from: NodeId,
        destination: &Destination,
    ) -> Refusal {
        Refusal::NoWay {
            target: name(context, destination),
            from: context.layout.node_name(from).to_string(),
            unknown: unknown_turnout(context, from),
        }
    }

    /// The target counted from a contact that the way as it was known did not lead to.
    pub(super) fn waypoint_again(
        &self,
        context: TrackContext<'_>,
        node: NodeId,
        destination: &Destination,
    ) -> Option<WayPoint> {
        Some(WayPoint { node, way: way_to_landmark(context, &self.model, node, destination.named?)? })
    }

    /// A target that has a name, found again from the node that it is counted from: lengths are learnt on the way, and
    /// turnouts thrown. As many rounds from now as before; `None` if no way leads there any more.
    fn named_again(
        &self,
        context: TrackContext<'_>,
        at: WayPoint,
        destination: &Destination,
    ) -> Option<WayPoint> {
        let again = self.waypoint_again(context, at.node, destination)?;
        let Some(round) = lap(context, &self.model, at.node) else { return Some(again) };
        let rounds = libm::round((at.way - again.way) / round).max(0.0);
        Some(WayPoint { way: again.way + round * rounds, ..at })
    }

    /// The target counted from a contact that the train came to since, as its way is known now; `None` if no way leads
    /// there any more.
    pub(super) fn counted_again(
        &self,
        context: TrackContext<'_>,
        at: WayPoint,
        node: NodeId,
        destination: &Destination,
    ) -> Option<WayPoint> {
        let Some(counted) = counted_from(context, &self.model, at, node) else {
            return self.waypoint_again(context, node, destination);
        };
        if destination.in_time.is_some() {
            self.named_again(context, counted, destination)
        } else {
            Some(counted)
        }
    }

    /// The turnouts lie otherwise: is the target still where it was?
    pub(super) fn way_changed(&mut self, context: TrackContext<'_>, now: Timestamp, out: &mut Outputs) {
        self.expect_next(context, now);
        let Some(Task { goal: Goal::RestAt(destination), phase: Phase::Running { .. }, .. }) = self.task
        else {
            return;
        };
        let Some(at) = destination.at else { return };
        if destination.named.is_some() {
            let Some(at) = self.named_again(context, at, &destination) else {
                return self.give_up(now, self.no_way(context, at.node, &destination), out);
            };
            if let Some(task) = &mut self.task {
                task.goal = Goal::RestAt(Destination { at: Some(at), ..destination });
            }
        }
        self.plan(context, now, out);
    }

    /// Plans the stop anew with what is known now. A stop for which it is too late is made at once.
    pub(super) fn plan(&mut self, context: TrackContext<'_>, now: Timestamp, out: &mut Outputs) {
        let Some(task) = self.task.filter(|_| self.is_told()) else { return };
        let (Goal::RestAt(Destination { at: Some(at), aim, .. }), Phase::Running { plan: before }) =
            (task.goal, task.phase)
        else {
            return;
        };
        let found = command_time(now + self.link.command, |leaves| {
            let rest = self.locator.rest_if_stopped(context, &self.model, leaves)?;
            Some((rest, self.aimed_beyond(context, &rest, at, aim)?))
        });
        match found {
            CommandTime::At(leaves, rest) => {
                let Some(promise) = self.promise(context, &rest, at) else { return };
                let triggers = self.triggers(context, now, leaves);
                let plan = Plan { leaves, triggers, promise };
                self.task = Some(Task { phase: Phase::Running { plan: Some(plan) }, ..task });
                let is_news = before.is_none_or(|before| {
                    (before.leaves - leaves).abs() >= NEWS || before.triggers[0] != triggers[0]
                });
                if is_news {
                    out.say(Notice::Planned(self.planned(context, task.order, plan)));
                }
            }
            CommandTime::TooLate(rest, beyond) => {
                if beyond > OVERSHOOT {
                    out.say(Notice::Overshoots { order: task.order, train: self.id(), by: beyond });
                }
                self.stop_now(now, task, self.promise(context, &rest, at), out);
            }
            // What was planned before is kept by the clock.
            CommandTime::Never if before.is_some() => {}
            CommandTime::Never => {
                let target = match task.goal {
                    Goal::RestAt(destination) => name(context, &destination),
                    _ => String::new(),
                };
                self.give_up(now, Refusal::OutOfReach { target }, out);
            }
        }
    }

    fn planned(&self, context: TrackContext<'_>, order: OrderId, plan: Plan) -> PlannedStop {
        let [trigger, _] = plan.triggers;
        let passes = trigger.and_then(|sensor| {
            let node = context.node_of(sensor)?;
            let located = self.located(context, plan.leaves)?;
            let since = located.at.way - way_between(context, &self.model, located.at.node, node)?;
            (located.speed.as_m_per_s() > 0.0).then(|| since / located.speed)
        });
        PlannedStop {
            order,
            train: self.id(),
            leaves: plan.leaves,
            trigger,
            after_trigger: passes,
            promise: plan.promise,
        }
    }

    /// The last two contacts whose reports come in time to move a command that leaves then.
    fn triggers(
        &self,
        context: TrackContext<'_>,
        now: Timestamp,
        leaves: Timestamp,
    ) -> [Option<crate::ids::SensorId>; 2] {
        let (Some(here), Some(there)) = (self.located(context, now), self.located(context, leaves)) else {
            return [None; 2];
        };
        let last = there.at.way - there.speed * self.link.reaction;
        let mut triggers = [None; 2];
        for (sensor, way) in contacts_until(context, &self.model, here.at.node, last) {
            if way > here.at.way {
                triggers = [Some(sensor), triggers[0]];
            }
        }
        triggers
    }

    /// Where a rest lies against the target.
    pub(super) fn promise(&self, context: TrackContext<'_>, rest: &Rest, at: WayPoint) -> Option<Promise> {
        let median = self.beyond(context, rest.at, at)?;
        let half = spread(rest) * HALF_95;
        Some(Promise { median, low: median - half, high: median + half })
    }

    /// How far beyond the target the part of a rest lies that is aimed with.
    pub(super) fn aimed_beyond(
        &self,
        context: TrackContext<'_>,
        rest: &Rest,
        at: WayPoint,
        aim: Aim,
    ) -> Option<Length> {
        Some(self.beyond(context, rest.at, at)? + spread(rest) * aim.margin())
    }

    /// How far one point of the way lies beyond another.
    pub(super) fn beyond(
        &self,
        context: TrackContext<'_>,
        point: WayPoint,
        target: WayPoint,
    ) -> Option<Length> {
        if let Some(between) = way_between(context, &self.model, target.node, point.node) {
            return Some(between + point.way - target.way);
        }
        let between = way_between(context, &self.model, point.node, target.node)?;
        Some(point.way - between - target.way)
    }
}

/// What people call a target.
pub(super) fn name(context: TrackContext<'_>, destination: &Destination) -> String {
    destination
        .named
        .map_or_else(|| "the end of the move".into(), |named| context.layout.display(named).to_string())
}
