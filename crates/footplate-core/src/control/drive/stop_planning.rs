//! Plans stops at a place: whether the train can stop there, from which step, and when to send the command.

use alloc::string::{String, ToString};

use crate::estimate::HALF_95;
use crate::ids::{NodeId, SpeedStep};
use crate::time::{TimeSpan, Timestamp};
use crate::tracking::{Located, PathPoint, Rest, TrackContext, distance_to_landmark, landmark_of};
use crate::units::Length;

use super::command_time::{CommandTime, command_time};
use super::driven_train::DrivenTrain;
use super::order::{Aim, OrderId, StopOrder};
use super::outputs::Outputs;
use super::path::{circuit_length, distance_between, recount_from, sensors_within, unknown_turnout};
use super::refusal::Refusal;
use super::task::{Destination, Goal, StopPlan, Task, TaskPhase};
use crate::control::{Notice, PlannedStop, Promise};

/// Smallest change of a plan that is reported.
const REPORTABLE_CHANGE: TimeSpan = TimeSpan::from_ms(1);
/// Smallest overshoot that is reported: less than the spread of any stop.
const REPORTABLE_OVERSHOOT: Length = Length::from_mm(5.0);
/// A train at rest this close to its target has arrived.
pub(in crate::control) const AT_TARGET: Length = Length::from_mm(1.0);

impl DrivenTrain {
    /// Starts an order to stop at a place.
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
        let at_rest = self.is_at_rest(context, now);
        if !at_rest && self.commanded == SpeedStep::STAND {
            return Err(Refusal::StillMoves { train: self.id() });
        }
        // A train that a sensor should have reported and did not is located first.
        let located = self.located(context, now).filter(|_| self.missed_sensor().is_none() || !at_rest);
        let Some(located) = located else {
            self.start_task(
                Task { order, goal: Goal::RestAt(destination), phase: TaskPhase::Locating { since: now } },
                out,
            );
            if at_rest {
                let step = stop.step.unwrap_or_else(|| self.finding_step());
                self.command_step(context, now, step, out);
            }
            return Ok(());
        };
        destination.at = Some(self.locate_target(context, now, &located, &destination, at_rest)?);
        self.start_towards(context, now, order, &located, destination, at_rest, out)
    }

    /// Continues to the target once the train has been located. A target that is too near is passed once first.
    pub(super) fn resume_to_target(
        &mut self,
        context: TrackContext<'_>,
        now: Timestamp,
        order: OrderId,
        mut destination: Destination,
        out: &mut Outputs,
    ) {
        let Some(located) = self.located(context, now) else { return };
        let mut at = self.locate_target(context, now, &located, &destination, false);
        if let Err(Refusal::TooNear { round: Some(_), .. }) = at {
            destination.next_round = true;
            at = self.locate_target(context, now, &located, &destination, false);
        }
        let headed = at.and_then(|at| {
            destination.at = Some(at);
            self.task = None;
            self.start_towards(context, now, order, &located, destination, false, out)
        });
        if let Err(why) = headed {
            self.task = Some(Task {
                order,
                goal: Goal::RestAt(destination),
                phase: TaskPhase::Running { plan: None },
            });
            self.give_up(now, why, out);
        }
    }

    /// Starts an order to move ahead.
    pub(super) fn start_move(
        &mut self,
        context: TrackContext<'_>,
        now: Timestamp,
        order: OrderId,
        distance: Length,
        out: &mut Outputs,
    ) -> Result<(), Refusal> {
        // A train that a sensor should have reported and did not is not where it is estimated: no later detection
        // would fit the move.
        let located = self.located(context, now).filter(|_| self.missed_sensor().is_none());
        let located = located.ok_or(Refusal::Lost { train: self.id() })?;
        if !self.is_at_rest(context, now) {
            return Err(Refusal::StillMoves { train: self.id() });
        }
        let at = PathPoint { distance: located.at.distance + distance, ..located.at };
        let destination = Destination {
            named: None,
            at: Some(at),
            aim: Aim::Median,
            step: None,
            next_round: false,
            in_time: None,
        };
        self.start_towards(context, now, order, &located, destination, true, out)
    }

    #[expect(clippy::too_many_arguments, reason = "the last step of two orders, which know all of it")]
    fn start_towards(
        &mut self,
        context: TrackContext<'_>,
        now: Timestamp,
        order: OrderId,
        located: &Located,
        destination: Destination,
        at_rest: bool,
        out: &mut Outputs,
    ) -> Result<(), Refusal> {
        let task = Task { order, goal: Goal::RestAt(destination), phase: TaskPhase::Running { plan: None } };
        if at_rest {
            let is_at_target = destination.at.is_some_and(|at| {
                self.beyond(context, located.at, at).is_some_and(|beyond| beyond.abs() <= AT_TARGET)
            });
            if is_at_target {
                self.start_task(task, out);
                self.finish(context, now, order, destination.at, None, out);
                return Ok(());
            }
            let step = self.approach_step(context, now, located, &destination)?;
            self.start_task(task, out);
            self.command_step(context, now, step, out);
        } else {
            self.start_task(task, out);
            match destination.step.filter(|step| *step != self.commanded) {
                Some(step) => self.command_step(context, now, step, out),
                None => self.plan(context, now, out),
            }
        }
        Ok(())
    }

    /// The target as a point of the path: the first passage at which the train can stop there.
    pub(super) fn locate_target(
        &self,
        context: TrackContext<'_>,
        now: Timestamp,
        located: &Located,
        destination: &Destination,
        at_rest: bool,
    ) -> Result<PathPoint, Refusal> {
        let node = located.at.node;
        let no_path = || self.no_path(context, node, destination);
        let named = destination.named.ok_or_else(no_path)?;
        context.layout.locate(named, context.turnouts).map_err(Refusal::Place)?;
        let mut distance = distance_to_landmark(context, &self.model, node, named).ok_or_else(no_path)?;
        let circuit_length = circuit_length(context, &self.model, node);
        let behind = |distance: Length| distance < located.at.distance - AT_TARGET;
        if behind(distance) {
            distance += circuit_length
                .filter(|circuit_length| !behind(distance + *circuit_length))
                .ok_or_else(no_path)?;
        }
        if destination.next_round {
            distance += circuit_length.ok_or_else(no_path)?;
        }
        let at = PathPoint { node, distance };
        if !at_rest {
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
        at: PathPoint,
        beyond: Length,
        destination: &Destination,
    ) -> Refusal {
        if destination.named.is_none() {
            return Refusal::MoveTooShort { shortest: beyond };
        }
        let nearest = landmark_of(context, &self.model, PathPoint { distance: at.distance + beyond, ..at });
        let nearest = crate::track::Landmark {
            offset: Length::from_mm(libm::round(nearest.offset.as_mm())),
            ..nearest
        };
        Refusal::TooNear {
            target: name(context, destination),
            nearest: context.layout.display(nearest).to_string(),
            beyond,
            round: circuit_length(context, &self.model, at.node),
        }
    }

    pub(super) fn no_path(
        &self,
        context: TrackContext<'_>,
        from: NodeId,
        destination: &Destination,
    ) -> Refusal {
        Refusal::NoPath {
            target: name(context, destination),
            from: context.layout.node_name(from).to_string(),
            unknown: unknown_turnout(context, from),
        }
    }

    /// The target measured from a node that the earlier path did not lead to.
    pub(super) fn target_from(
        &self,
        context: TrackContext<'_>,
        node: NodeId,
        destination: &Destination,
    ) -> Option<PathPoint> {
        Some(PathPoint {
            node,
            distance: distance_to_landmark(context, &self.model, node, destination.named?)?,
        })
    }

    /// A named target, measured again from the same node: path lengths are learnt and turnouts thrown on the run.
    /// Keeps the number of laps; `None` if no path leads there any more.
    fn relocate_named_target(
        &self,
        context: TrackContext<'_>,
        at: PathPoint,
        destination: &Destination,
    ) -> Option<PathPoint> {
        let again = self.target_from(context, at.node, destination)?;
        let Some(lap) = circuit_length(context, &self.model, at.node) else { return Some(again) };
        let laps = libm::round((at.distance - again.distance) / lap).max(0.0);
        Some(PathPoint { distance: again.distance + lap * laps, ..at })
    }

    /// The target measured from a sensor that the train has passed since; `None` if no path leads there any more.
    pub(super) fn recount_target(
        &self,
        context: TrackContext<'_>,
        at: PathPoint,
        node: NodeId,
        destination: &Destination,
    ) -> Option<PathPoint> {
        let Some(counted) = recount_from(context, &self.model, at, node) else {
            return self.target_from(context, node, destination);
        };
        if destination.in_time.is_some() {
            self.relocate_named_target(context, counted, destination)
        } else {
            Some(counted)
        }
    }

    /// Measures the target again after a turnout was thrown.
    pub(super) fn turnouts_changed(&mut self, context: TrackContext<'_>, now: Timestamp, out: &mut Outputs) {
        self.expect_next(context, now);
        let Some(Task { goal: Goal::RestAt(destination), phase: TaskPhase::Running { .. }, .. }) = self.task
        else {
            return;
        };
        let Some(at) = destination.at else { return };
        if destination.named.is_some() {
            let Some(at) = self.relocate_named_target(context, at, &destination) else {
                return self.give_up(now, self.no_path(context, at.node, &destination), out);
            };
            if let Some(task) = &mut self.task {
                task.goal = Goal::RestAt(Destination { at: Some(at), ..destination });
            }
        }
        self.plan(context, now, out);
    }

    /// Plans the stop again. If it is too late, the train stops at once.
    pub(super) fn plan(&mut self, context: TrackContext<'_>, now: Timestamp, out: &mut Outputs) {
        let Some(task) = self.task.filter(|_| self.is_all_sent()) else { return };
        let (Goal::RestAt(Destination { at: Some(at), aim, .. }), TaskPhase::Running { plan: before }) =
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
                let plan = StopPlan { leaves, triggers, promise };
                self.task = Some(Task { phase: TaskPhase::Running { plan: Some(plan) }, ..task });
                let is_reportable = before.is_none_or(|before| {
                    (before.leaves - leaves).abs() >= REPORTABLE_CHANGE || before.triggers[0] != triggers[0]
                });
                if is_reportable {
                    out.notify(Notice::Planned(self.planned(context, task.order, plan)));
                }
            }
            CommandTime::TooLate(rest, beyond) => {
                if beyond > REPORTABLE_OVERSHOOT {
                    out.notify(Notice::Overshoots { order: task.order, train: self.id(), by: beyond });
                }
                self.stop_now(now, task, self.promise(context, &rest, at), out);
            }
            // The clock carries out the earlier plan.
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

    fn planned(&self, context: TrackContext<'_>, order: OrderId, plan: StopPlan) -> PlannedStop {
        let [trigger, _] = plan.triggers;
        let passes = trigger.and_then(|sensor| {
            let node = context.node_of(sensor)?;
            let located = self.located(context, plan.leaves)?;
            let since = located.at.distance - distance_between(context, &self.model, located.at.node, node)?;
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

    /// The last two sensors whose reports can still change a command sent at a time, the later one first.
    fn triggers(
        &self,
        context: TrackContext<'_>,
        now: Timestamp,
        leaves: Timestamp,
    ) -> [Option<crate::ids::SensorId>; 2] {
        let (Some(here), Some(there)) = (self.located(context, now), self.located(context, leaves)) else {
            return [None; 2];
        };
        let last = there.at.distance - there.speed * self.link.reaction;
        let mut triggers = [None; 2];
        for (sensor, distance) in sensors_within(context, &self.model, here.at.node, last) {
            if distance > here.at.distance {
                triggers = [Some(sensor), triggers[0]];
            }
        }
        triggers
    }

    /// The rest relative to the target, with its 95 % interval.
    pub(super) fn promise(&self, context: TrackContext<'_>, rest: &Rest, at: PathPoint) -> Option<Promise> {
        let median = self.beyond(context, rest.at, at)?;
        let half = rest.deviation() * HALF_95;
        Some(Promise { median, low: median - half, high: median + half })
    }

    /// How far the aimed quantile of a rest lies beyond the target.
    pub(super) fn aimed_beyond(
        &self,
        context: TrackContext<'_>,
        rest: &Rest,
        at: PathPoint,
        aim: Aim,
    ) -> Option<Length> {
        Some(self.beyond(context, rest.at, at)? + rest.deviation() * aim.margin())
    }

    /// How far one point of the path lies beyond another.
    pub(super) fn beyond(
        &self,
        context: TrackContext<'_>,
        point: PathPoint,
        target: PathPoint,
    ) -> Option<Length> {
        if let Some(between) = distance_between(context, &self.model, target.node, point.node) {
            return Some(between + point.distance - target.distance);
        }
        let between = distance_between(context, &self.model, point.node, target.node)?;
        Some(point.distance - between - target.distance)
    }
}

/// The name of a target, as operators know it.
pub(super) fn name(context: TrackContext<'_>, destination: &Destination) -> String {
    destination
        .named
        .map_or_else(|| "the end of the move".into(), |named| context.layout.display(named).to_string())
}
