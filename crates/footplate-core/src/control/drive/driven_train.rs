//! One train: its position, motion model, last command and task.

use crate::event::{Approach, Command, Event, EventKind};
use crate::ids::{NodeId, SpeedStep, TrainId};
use crate::link::TimeModel;
use crate::model::{MotionModel, StepUse};
use crate::time::{TimeSpan, Timestamp};
use crate::tracking::{Located, Locator, PassedSensor, PathPoint, TrackContext, landmark_of};
use crate::units::{Length, Speed};

use super::detections::Detections;
use super::order::OrderId;
use super::outputs::Outputs;
use super::pacing::{Pacing, Passages};
use super::refusal::Refusal;
use super::reported_speed::ReportedSpeed;
use super::task::{Destination, Expectation, Goal, SpeedSupervision, Task, TaskPhase};
use crate::control::{Achieved, Finished, Notice, Promise};

/// Time allowed beyond the predicted time to rest, fixed and as a part of it: decoders creep at the end, and nothing
/// is urgent then.
const REST_MARGIN: TimeSpan = TimeSpan::from_ms(300);
const REST_MARGIN_PART: f64 = 0.2;
/// Time to rest where none can be predicted: longer than any train of the published tables takes (up to 5 s).
const REST_UNFORESEEN: TimeSpan = TimeSpan::from_s(8.0);
/// A command is sent within two polls of a few dozen bytes each. If it takes longer than this, the line is disturbed.
const UNCONFIRMED: TimeSpan = TimeSpan::from_s(2.0);
/// A lost train reaches a sensor within this time when it creeps: 3 m at 50 mm/s.
const FIND_LIMIT: TimeSpan = TimeSpan::from_s(60.0);

/// Length from the pickup to either end of a train that was not measured: a long locomotive of the gauge, or a short
/// one with a wagon.
pub(super) const TRAIN_REACH: Length = Length::from_mm(250.0);

/// A train with its motion model and everything that changes as it runs.
#[derive(Debug, Clone)]
pub(super) struct DrivenTrain {
    pub(super) locator: Locator,
    /// Where it is if it runs backward.
    pub(super) backward: Option<Locator>,
    pub(super) model: MotionModel,
    /// One standard deviation of the least precise stop from a step that moves it.
    pub(super) widest_stop: Option<Length>,
    pub(super) task: Option<Task>,
    /// The step commanded last, sent or not.
    pub(super) commanded: SpeedStep,
    /// Whether its direction is the opposite of that at the begin of the session.
    pub(super) is_reversed: bool,
    /// The command that has not been sent yet, and since when it waits.
    unsent: Option<(Command, Timestamp)>,
    /// When its speed is steady at the step sent last.
    pub(super) steady_at: Timestamp,
    /// What should be reported next.
    pub(super) expected: Expectation,
    /// How often it was reported, and how often not.
    pub(super) detections: Detections,
    /// What its decoder reports of its speed.
    pub(super) reported: ReportedSpeed,
    /// Where its movement authority ends; `None` without a limit.
    pub(super) end_of_authority: Option<PathPoint>,
    /// How many authorities it has been given.
    pub(super) authorities_given: u32,
    /// Its lengths ahead of and behind the leading end of the pickup.
    pub(super) reach: [Length; 2],
    /// The state of its speed supervision.
    pub(super) speed_supervision: SpeedSupervision,
    /// How it is paced, while pacing is its goal.
    pub(super) pacing: Option<Pacing>,
    /// When it passed the sensors behind it, for trains that follow it.
    pub(super) passages: Passages,
    /// The timing of the link to the station.
    pub(super) link: TimeModel,
}

impl DrivenTrain {
    pub(super) fn new(model: MotionModel, locator: Locator, link: TimeModel) -> Self {
        Self {
            locator,
            backward: None,
            widest_stop: widest_stop(&model),
            model,
            task: None,
            commanded: SpeedStep::STAND,
            is_reversed: false,
            unsent: None,
            steady_at: Timestamp::ZERO,
            expected: Expectation::default(),
            detections: Detections::default(),
            reported: ReportedSpeed::default(),
            end_of_authority: None,
            authorities_given: 0,
            reach: [TRAIN_REACH; 2],
            speed_supervision: SpeedSupervision::default(),
            pacing: None,
            passages: Passages::default(),
            link,
        }
    }

    /// Replaces the motion model.
    pub(super) fn set_model(&mut self, mut model: MotionModel) {
        self.widest_stop = widest_stop(&model);
        model.keep_length(&self.model);
        self.model = model;
    }

    pub(super) const fn id(&self) -> TrainId {
        self.model.train()
    }

    pub(super) fn located(&self, context: TrackContext<'_>, now: Timestamp) -> Option<Located> {
        self.locator.locate(context, &self.model, now)
    }

    /// Its estimated speed; 0 where its position is unknown.
    pub(super) fn speed(&self, context: TrackContext<'_>, now: Timestamp) -> Speed {
        self.located(context, now).map_or(Speed::ZERO, |located| located.speed)
    }

    /// Whether it is estimated to be at rest. A train of unknown position counts as at rest once its stop command has
    /// been sent, unless a task waits for its standstill.
    pub(super) fn is_at_rest(&self, context: TrackContext<'_>, now: Timestamp) -> bool {
        let is_stop_sent = self.commanded == SpeedStep::STAND && self.unsent.is_none();
        is_stop_sent
            && self.located(context, now).map_or_else(
                || self.task.is_none() || matches!(self.goal(), Some(Goal::Run)),
                |located| located.at_rest,
            )
    }

    /// Whether it runs, or may run.
    pub(super) fn may_move(&self, context: TrackContext<'_>, now: Timestamp) -> bool {
        !self.is_at_rest(context, now)
    }

    /// Sets its position as an operator entered it.
    pub(super) fn place(
        &mut self,
        context: TrackContext<'_>,
        now: Timestamp,
        at: PathPoint,
        uncertainty: Length,
    ) {
        self.locator.place(now, at, uncertainty);
        self.backward = None;
        self.passages.forget();
        self.clear_missed();
        self.end_authority_here(context, now);
        self.expect_next(context, now);
    }

    pub(super) const fn is_all_sent(&self) -> bool {
        self.unsent.is_none()
    }

    pub(super) fn goal(&self) -> Option<Goal> {
        self.task.map(|task| task.goal)
    }

    /// Replaces its task by another.
    pub(super) fn start_task(&mut self, task: Task, out: &mut Outputs) {
        self.locator.repeat(false);
        if let Some(before) = self.task.replace(task) {
            out.notify(Notice::Replaced { order: before.order, train: self.id() });
        }
    }

    /// Commands a step, or the fastest lower step that the zones around the train permit.
    pub(super) fn command_step(
        &mut self,
        context: TrackContext<'_>,
        now: Timestamp,
        step: SpeedStep,
        out: &mut Outputs,
    ) {
        let step = self.supervised_step(context, now, step, out);
        self.command_unsupervised(now, step, out);
    }

    /// Commands a stop.
    pub(super) fn command_stop(&mut self, now: Timestamp, out: &mut Outputs) {
        self.speed_supervision = SpeedSupervision::default();
        self.command_unsupervised(now, SpeedStep::STAND, out);
    }

    /// Commands a step without speed supervision.
    pub(super) fn command_unsupervised(&mut self, now: Timestamp, step: SpeedStep, out: &mut Outputs) {
        self.commanded = step;
        self.send(now, Command::Speed { train: self.id(), step }, out);
    }

    fn send(&mut self, now: Timestamp, command: Command, out: &mut Outputs) {
        self.unsent = Some((command, now));
        out.command(command);
    }

    /// Runs at a step, or stops if it is 0.
    pub(super) fn run(
        &mut self,
        context: TrackContext<'_>,
        now: Timestamp,
        order: OrderId,
        step: SpeedStep,
        out: &mut Outputs,
    ) {
        let goal = if step == SpeedStep::STAND { Goal::Rest } else { Goal::Run };
        self.start_task(Task { order, goal, phase: TaskPhase::Commanding { promise: None } }, out);
        self.command_step(context, now, step, out);
    }

    /// Reverses, after a stop if it moves.
    pub(super) fn reverse(
        &mut self,
        context: TrackContext<'_>,
        now: Timestamp,
        order: OrderId,
        then: SpeedStep,
        out: &mut Outputs,
    ) {
        let goal = Goal::Reverse(then);
        if self.is_at_rest(context, now) {
            self.start_task(Task { order, goal, phase: TaskPhase::Reversing }, out);
            self.send(now, Command::Reverse { train: self.id() }, out);
        } else {
            self.start_task(Task { order, goal, phase: TaskPhase::Commanding { promise: None } }, out);
            self.command_stop(now, out);
        }
    }

    /// A command to this train has been sent.
    pub(super) fn command_sent(
        &mut self,
        context: TrackContext<'_>,
        now: Timestamp,
        event: &Event,
        out: &mut Outputs,
    ) {
        match event.kind {
            EventKind::Speed { step, .. } => {
                let before =
                    self.located(context, event.time).map_or(SpeedStep::STAND, |located| located.step);
                if before != step {
                    self.steady_at = event.time + self.model.settles_within(before, step);
                }
                self.command_backward(context, event, step);
                self.locator.handle_command(context, &self.model, event);
                let train = self.id();
                let waits_for = self.unsent.map(|(command, _)| command);
                if waits_for == Some(Command::Speed { train, step }) {
                    self.unsent = None;
                } else if waits_for.is_none() {
                    self.commanded = step;
                }
                self.expect_after_command(context, now);
                self.pacing_step_sent(context, event.time);
                self.step_sent(context, now, step, out);
            }
            EventKind::Reverse { .. } => {
                self.is_reversed = !self.is_reversed;
                let rest = self.back_at_rest(context, event.time);
                self.locator.handle_command(context, &self.model, event);
                if matches!(self.unsent, Some((Command::Reverse { .. }, _))) {
                    self.unsent = None;
                }
                self.backward = None;
                match rest {
                    Some((at, uncertainty)) => self.locator.place(now, at, uncertainty),
                    None => self.locator.lose(),
                }
                self.passages.forget();
                self.end_authority_here(context, now);
                self.expect_next(context, now);
                if let Some(Task { order, goal: Goal::Reverse(then), phase: TaskPhase::Reversing }) =
                    self.task
                {
                    if then > SpeedStep::STAND {
                        self.task = Some(Task {
                            order,
                            goal: Goal::Run,
                            phase: TaskPhase::Commanding { promise: None },
                        });
                        self.command_step(context, now, then, out);
                    } else {
                        self.finish(context, now, order, None, None, out);
                    }
                }
            }
            _ => {}
        }
    }

    fn step_sent(&mut self, context: TrackContext<'_>, now: Timestamp, step: SpeedStep, out: &mut Outputs) {
        let Some(task) = self.task else { return };
        match (task.phase, task.goal) {
            (TaskPhase::Commanding { .. }, Goal::Run) if step > SpeedStep::STAND => {
                self.finish(context, now, task.order, None, None, out);
            }
            // A stop that is sent after a new step has been commanded belongs to the earlier task.
            (TaskPhase::Commanding { .. } | TaskPhase::Running { .. }, _)
                if step == SpeedStep::STAND && self.commanded == SpeedStep::STAND =>
            {
                let rest = self.locator.rest_if_stopped(context, &self.model, now);
                let promise = match task.goal {
                    Goal::RestAt(Destination { at: Some(at), .. }) => {
                        rest.and_then(|rest| self.promise(context, &rest, at))
                    }
                    _ => None,
                };
                let promise = promise.or(match task.phase {
                    TaskPhase::Commanding { promise } => promise,
                    _ => None,
                });
                let until = rest.map_or(now + REST_UNFORESEEN, |rest| {
                    let takes = (rest.time - now).max(TimeSpan::ZERO);
                    now + TimeSpan::from_s(takes.as_s() * (1.0 + REST_MARGIN_PART)) + REST_MARGIN
                });
                self.task = Some(Task { phase: TaskPhase::Settling { promise, until }, ..task });
            }
            (TaskPhase::Running { .. }, Goal::RestAt(_)) => self.plan(context, now, out),
            _ => {}
        }
    }

    /// This train has caused a detection.
    pub(super) fn passed(
        &mut self,
        context: TrackContext<'_>,
        now: Timestamp,
        node: NodeId,
        passed: PassedSensor,
        out: &mut Outputs,
    ) {
        let missed_at = self.missed_at(context, passed.at);
        self.clear_missed();
        self.backward = None;
        let speed = self.speed(context, passed.at);
        self.detections.take((passed.missed, missed_at), speed, passed.window.width());
        self.learn_reported_speed(context, node, &passed, out);
        self.note_passage(context, node, passed.at);
        if !passed.is_origin {
            self.recount_end_of_authority(context, node);
        }
        self.expect_next(context, now);
        out.notify(Notice::Passed { train: self.id(), passed, next: self.expected.due });
        self.pacing_passed(context, now, node, out);
        let Some(task) = self.task else { return };
        let Goal::RestAt(destination) = task.goal else { return };
        match (task.phase, destination.at) {
            (TaskPhase::Locating { .. }, _) => {
                self.resume_to_target(context, now, task.order, destination, out);
            }
            (_, Some(at)) => {
                let counted = match passed.is_origin {
                    true => Some(at),
                    false => self.recount_target(context, at, node, &destination),
                };
                let Some(at) = counted else {
                    return self.give_up(now, self.no_path(context, node, &destination), out);
                };
                let goal = Goal::RestAt(Destination { at: Some(at), ..destination });
                self.task = Some(Task { goal, ..task });
                self.plan(context, now, out);
                self.keep_time(context, now, out);
            }
            _ => {}
        }
    }

    /// Notes the time of a passage. The report gives it within one poll; the predicted time within that poll is more
    /// precise.
    fn note_passage(&mut self, context: TrackContext<'_>, node: NodeId, middle: Timestamp) {
        let located =
            self.located(context, middle).filter(|located| located.at.node == node && !located.at_rest);
        let since = located.filter(|located| located.speed.as_m_per_s() > 0.0);
        let since = since.map_or(TimeSpan::ZERO, |located| located.at.distance / located.speed);
        self.passages.note(node, middle - since);
    }

    /// When it has to be called again without a report.
    pub(super) fn next_timeout(&self) -> Option<Timestamp> {
        let phase = match self.task.map(|task| task.phase) {
            Some(TaskPhase::Running { plan: Some(plan) }) => Some(plan.leaves - self.link.command),
            Some(TaskPhase::Settling { until, .. }) => Some(until),
            Some(TaskPhase::Locating { since }) => Some(since + FIND_LIMIT),
            _ => None,
        };
        let unsent = self.unsent.map(|(_, since)| since + UNCONFIRMED);
        let checks = [self.next_pacing_update(), self.next_zone_check()];
        [phase, unsent, self.next_overdue(), self.latest_safe_stop()]
            .into_iter()
            .chain(checks)
            .flatten()
            .min()
    }

    pub(super) fn handle_timeout(&mut self, context: TrackContext<'_>, now: Timestamp, out: &mut Outputs) {
        if let Some((command, _)) = self.unsent.filter(|(_, since)| now - *since >= UNCONFIRMED) {
            out.notify(Notice::Unconfirmed { command });
            self.unsent = None;
            if matches!(command, Command::Speed { step: SpeedStep::STAND, .. }) {
                self.send(now, command, out);
            }
        }
        self.enforce_track_limits(context, now, out);
        if let Some(task) = self.task {
            self.continue_task(context, now, task, out);
        }
        self.check_overdue(context, now, out);
    }

    fn continue_task(&mut self, context: TrackContext<'_>, now: Timestamp, task: Task, out: &mut Outputs) {
        match task.phase {
            TaskPhase::Running { plan: Some(plan) } if plan.leaves - self.link.command <= now => {
                self.stop_now(now, task, Some(plan.promise), out);
            }
            TaskPhase::Locating { since } if now - since >= FIND_LIMIT => {
                let why = Refusal::NotFound { train: self.id(), within: FIND_LIMIT };
                self.give_up(now, why, out);
            }
            TaskPhase::Settling { promise, until } if until <= now => {
                self.handle_rest(context, now, task, promise, out);
            }
            _ => {}
        }
    }

    pub(super) fn stop_now(
        &mut self,
        now: Timestamp,
        task: Task,
        promise: Option<Promise>,
        out: &mut Outputs,
    ) {
        self.task = Some(Task { phase: TaskPhase::Commanding { promise }, ..task });
        self.command_stop(now, out);
    }

    /// Ends the task and stops the train.
    pub(super) fn give_up(&mut self, now: Timestamp, why: Refusal, out: &mut Outputs) {
        if let Some(task) = self.task.take() {
            out.notify(Notice::GivenUp { order: task.order, train: self.id(), why });
        }
        if self.commanded > SpeedStep::STAND {
            self.command_stop(now, out);
        }
    }

    fn handle_rest(
        &mut self,
        context: TrackContext<'_>,
        now: Timestamp,
        task: Task,
        promise: Option<Promise>,
        out: &mut Outputs,
    ) {
        if let Some(located) = self.located(context, now) {
            self.locator.settle(now, located.at, located.uncertainty);
        }
        match task.goal {
            Goal::Reverse(_) => {
                self.task = Some(Task { phase: TaskPhase::Reversing, ..task });
                self.send(now, Command::Reverse { train: self.id() }, out);
            }
            Goal::RestAt(Destination { at, .. }) => self.finish(context, now, task.order, at, promise, out),
            Goal::Rest | Goal::Run | Goal::Pace => self.finish(context, now, task.order, None, None, out),
        }
    }

    /// Reports that an order has been carried out.
    pub(super) fn finish(
        &mut self,
        context: TrackContext<'_>,
        time: Timestamp,
        order: OrderId,
        target: Option<PathPoint>,
        promise: Option<Promise>,
        out: &mut Outputs,
    ) {
        let located = self.located(context, time);
        let achieved = located.map(|located| Achieved {
            at: landmark_of(context, &self.model, located.at),
            uncertainty: located.uncertainty,
            error: target.and_then(|target| self.beyond(context, located.at, target)),
        });
        if let Some(located) = located {
            self.expected.missed_sensor =
                self.expected.missed_sensor.or(self.sensor_missed_before(context, &located));
        }
        self.task = None;
        let unseen = self.expected.missed_sensor;
        out.notify(Notice::Done(Finished { order, train: self.id(), time, achieved, promise, unseen }));
    }
}

fn widest_stop(model: &MotionModel) -> Option<Length> {
    let steps = (1..=model.highest().get()).filter_map(SpeedStep::new);
    let moves = steps.filter(|step| model.uses(*step) == StepUse::Moves);
    moves.map(|step| model.stop(step, Approach::Below).deviation()).reduce(Length::max)
}
