//! One train: where it is, how it moves, what it was told and what it is busy with.

use alloc::string::String;

use crate::event::{Approach, Command, Event, EventKind};
use crate::ids::{NodeId, SensorId, SpeedStep, TrainId};
use crate::link::TimeModel;
use crate::model::{MotionModel, StepUse};
use crate::time::{TimeSpan, Timestamp};
use crate::tracking::{DueContact, Located, Locator, PassedContact, TrackContext, WayPoint, landmark_of};
use crate::units::Length;

use super::order::OrderId;
use super::outputs::Outputs;
use super::pacing::{Pacing, Passages};
use super::path_length::contacts_until;
use super::refusal::Refusal;
use super::task::{Destination, Goal, Phase, Task};
use super::turning::turned;
use crate::control::{Achieved, Finished, Notice, Promise};

/// Beyond the time to rest that is foreseen, and this part of it: decoders creep at the end, and nothing is in a hurry
/// then.
const REST_MARGIN: TimeSpan = TimeSpan::from_ms(300);
const REST_MARGIN_PART: f64 = 0.2;
/// Where no time to rest is foreseen: longer than any train of the published tables takes (up to 5 s).
const REST_UNFORESEEN: TimeSpan = TimeSpan::from_s(8.0);
/// A command is written within two polls of a few dozen bytes; after this long the line is not what it was.
const UNCONFIRMED: TimeSpan = TimeSpan::from_s(2.0);
/// A contact this many standard deviations behind a train should have reported it, if the train runs as it should: a train
/// comes to rest so much shorter once in 44 times, contacts miss one in 300, and one start in 1000 gets stuck on dirt. So
/// of trains that such a contact was silent about most have not come to it.
const SHOULD_HAVE_PASSED: f64 = 2.0;
/// A train that is looked for reaches a contact within this long at a crawl: 3 m of 50 mm/s.
const FIND_LIMIT: TimeSpan = TimeSpan::from_s(60.0);

/// From the pickup to either end of a train, which nobody has measured: a long locomotive of the gauge, or a short one
/// with a wagon.
pub(super) const TRAIN_REACH: Length = Length::from_mm(250.0);

/// A train that is driven.
#[derive(Debug, Clone)]
pub(super) struct DrivenTrain {
    pub(super) locator: Locator,
    pub(super) model: MotionModel,
    /// One standard deviation of its widest stop from a step that moves it.
    pub(super) widest_stop: Option<Length>,
    pub(super) task: Option<Task>,
    /// The step it was commanded last, whether or not that has left yet.
    pub(super) commanded: SpeedStep,
    /// What has not left yet, and since when it waits.
    unsent: Option<(Command, Timestamp)>,
    /// What should come next.
    pub(super) expected: Expectation,
    /// What it shall not pass.
    pub(super) limit: Option<WayPoint>,
    /// How far it reaches ahead of and behind the leading end of its pickup.
    pub(super) reach: [Length; 2],
    /// What keeps it to speed restrictions.
    pub(super) speed_supervision: SpeedSupervision,
    /// What it is paced for, while that is its goal.
    pub(super) pacing: Option<Pacing>,
    /// When it came by the contacts behind it, for who follows it.
    pub(super) passages: Passages,
    /// How long the link to the station takes.
    pub(super) link: TimeModel,
}

/// What is expected of a train, as of when something was last known.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Expectation {
    /// The next contact.
    pub(super) due: Option<DueContact>,
    pub(super) since: Timestamp,
    pub(super) overdue_said: bool,
    /// Contacts in a row that should have reported the train.
    pub(super) silent: u8,
    /// A contact that should have reported it, and nothing has reported it since.
    pub(super) unseen: Option<SensorId>,
    /// When it is lost if nothing reports it until then; only once a contact is overdue.
    pub(super) lost_by: Option<Timestamp>,
    /// When it has to be commanded to stop because the track ends, and where.
    pub(super) end: Option<(Timestamp, NodeId)>,
    /// When it has to be commanded to stop so that it stays within its limit.
    pub(super) limit: Option<Timestamp>,
}

/// What a train would run at if it were allowed to.
#[derive(Debug, Clone, Default)]
pub(super) struct SpeedSupervision {
    /// The step that was asked for, while the train has been told a slower one.
    pub(super) wanted: Option<SpeedStep>,
    /// When the zones about it are looked at next.
    pub(super) look: Option<Timestamp>,
    /// The zone that was said to slow it down.
    pub(super) said: Option<String>,
}

impl DrivenTrain {
    pub(super) fn new(model: MotionModel, locator: Locator, link: TimeModel) -> Self {
        Self {
            locator,
            widest_stop: widest_stop(&model),
            model,
            task: None,
            commanded: SpeedStep::STAND,
            unsent: None,
            expected: Expectation::default(),
            limit: None,
            reach: [TRAIN_REACH; 2],
            speed_supervision: SpeedSupervision::default(),
            pacing: None,
            passages: Passages::default(),
            link,
        }
    }

    /// Puts something better in the place of what is known of how it moves.
    pub(super) fn set_model(&mut self, model: MotionModel) {
        self.widest_stop = widest_stop(&model);
        self.model = model;
    }

    pub(super) const fn id(&self) -> TrainId {
        self.model.train()
    }

    pub(super) fn located(&self, context: TrackContext<'_>, now: Timestamp) -> Option<Located> {
        self.locator.locate(context, &self.model, now)
    }

    /// As far as is known; a train that nobody can find stands if it was told to and nobody waits for it to.
    pub(super) fn stands(&self, context: TrackContext<'_>, now: Timestamp) -> bool {
        let told_to = self.commanded == SpeedStep::STAND && self.unsent.is_none();
        told_to
            && self.located(context, now).map_or_else(
                || self.task.is_none() || matches!(self.goal(), Some(Goal::Run)),
                |located| located.at_rest,
            )
    }

    /// Whether it runs, or may.
    pub(super) fn may_move(&self, context: TrackContext<'_>, now: Timestamp) -> bool {
        !self.stands(context, now)
    }

    /// A person says where it is.
    pub(super) fn place(
        &mut self,
        context: TrackContext<'_>,
        now: Timestamp,
        at: WayPoint,
        uncertainty: Length,
    ) {
        self.locator.place(now, at, uncertainty);
        self.passages.forget();
        self.seen();
        self.limit_here(context, now);
        self.expect_next(context, now);
    }

    pub(super) const fn is_told(&self) -> bool {
        self.unsent.is_none()
    }

    pub(super) fn goal(&self) -> Option<Goal> {
        self.task.map(|task| task.goal)
    }

    /// Begins something else.
    pub(super) fn take(&mut self, task: Task, out: &mut Outputs) {
        self.locator.repeat(false);
        if let Some(before) = self.task.replace(task) {
            out.say(Notice::Replaced { order: before.order, train: self.id() });
        }
    }

    /// Tells it a step, or the fastest below that the zones about it allow.
    pub(super) fn issue_step(
        &mut self,
        context: TrackContext<'_>,
        now: Timestamp,
        step: SpeedStep,
        out: &mut Outputs,
    ) {
        let step = self.restrained(context, now, step, out);
        self.issue_at_once(now, step, out);
    }

    /// Tells it to stand.
    pub(super) fn issue_stop(&mut self, now: Timestamp, out: &mut Outputs) {
        self.speed_supervision = SpeedSupervision::default();
        self.issue_at_once(now, SpeedStep::STAND, out);
    }

    /// Tells it just this step.
    pub(super) fn issue_at_once(&mut self, now: Timestamp, step: SpeedStep, out: &mut Outputs) {
        self.commanded = step;
        self.issue(now, Command::Speed { train: self.id(), step }, out);
    }

    fn issue(&mut self, now: Timestamp, command: Command, out: &mut Outputs) {
        self.unsent = Some((command, now));
        out.command(command);
    }

    /// Runs at a step, or comes to rest if that is 0.
    pub(super) fn run(
        &mut self,
        context: TrackContext<'_>,
        now: Timestamp,
        order: OrderId,
        step: SpeedStep,
        out: &mut Outputs,
    ) {
        let goal = if step == SpeedStep::STAND { Goal::Rest } else { Goal::Run };
        self.take(Task { order, goal, phase: Phase::Commanding { promise: None } }, out);
        self.issue_step(context, now, step, out);
    }

    /// Comes to rest if it does not, and turns around.
    pub(super) fn reverse(
        &mut self,
        context: TrackContext<'_>,
        now: Timestamp,
        order: OrderId,
        then: SpeedStep,
        out: &mut Outputs,
    ) {
        let goal = Goal::Reverse(then);
        if self.stands(context, now) {
            self.take(Task { order, goal, phase: Phase::Turning }, out);
            self.issue(now, Command::Reverse { train: self.id() }, out);
        } else {
            self.take(Task { order, goal, phase: Phase::Commanding { promise: None } }, out);
            self.issue_stop(now, out);
        }
    }

    /// A command to this train has left the line.
    pub(super) fn command_left(
        &mut self,
        context: TrackContext<'_>,
        now: Timestamp,
        event: &Event,
        out: &mut Outputs,
    ) {
        match event.kind {
            EventKind::Speed { step, .. } => {
                self.locator.handle_command(context, &self.model, event);
                let train = self.id();
                let waits_for = self.unsent.map(|(command, _)| command);
                if waits_for == Some(Command::Speed { train, step }) {
                    self.unsent = None;
                } else if waits_for.is_none() {
                    self.commanded = step;
                }
                self.expect_on(context, now);
                self.paced_step_left(event.time);
                self.step_left(context, now, step, out);
            }
            EventKind::Reverse { .. } => {
                let stood = self.stands_at(context, event.time);
                self.locator.handle_command(context, &self.model, event);
                if matches!(self.unsent, Some((Command::Reverse { .. }, _))) {
                    self.unsent = None;
                }
                match stood.and_then(|located| turned(context, &self.model, located)) {
                    Some((at, uncertainty)) => self.locator.place(now, at, uncertainty),
                    None => self.locator.lose(),
                }
                self.passages.forget();
                self.limit_here(context, now);
                self.expect_next(context, now);
                if let Some(Task { order, goal: Goal::Reverse(then), phase: Phase::Turning }) = self.task {
                    if then > SpeedStep::STAND {
                        self.task =
                            Some(Task { order, goal: Goal::Run, phase: Phase::Commanding { promise: None } });
                        self.issue_step(context, now, then, out);
                    } else {
                        self.finish(context, now, order, None, None, out);
                    }
                }
            }
            _ => {}
        }
    }

    fn stands_at(&self, context: TrackContext<'_>, time: Timestamp) -> Option<Located> {
        self.located(context, time).filter(|located| located.at_rest)
    }

    fn step_left(&mut self, context: TrackContext<'_>, now: Timestamp, step: SpeedStep, out: &mut Outputs) {
        let Some(task) = self.task else { return };
        match (task.phase, task.goal) {
            (Phase::Commanding { .. }, Goal::Run) if step > SpeedStep::STAND => {
                self.finish(context, now, task.order, None, None, out);
            }
            // A stop that leaves after it has been commanded to run again was of what it did before.
            (Phase::Commanding { .. } | Phase::Running { .. }, _)
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
                    Phase::Commanding { promise } => promise,
                    _ => None,
                });
                let until = rest.map_or(now + REST_UNFORESEEN, |rest| {
                    let takes = (rest.time - now).max(TimeSpan::ZERO);
                    now + TimeSpan::from_s(takes.as_s() * (1.0 + REST_MARGIN_PART)) + REST_MARGIN
                });
                self.task = Some(Task { phase: Phase::Settling { promise, until }, ..task });
            }
            (Phase::Running { .. }, Goal::RestAt(_)) => self.plan(context, now, out),
            _ => {}
        }
    }

    /// A contact was judged to have been closed by this train.
    pub(super) fn passed(
        &mut self,
        context: TrackContext<'_>,
        now: Timestamp,
        node: NodeId,
        passed: PassedContact,
        out: &mut Outputs,
    ) {
        self.seen();
        self.note_passage(context, node, passed.at);
        self.count_limit_from(context, node);
        self.expect_next(context, now);
        out.say(Notice::Passed { train: self.id(), passed, next: self.expected.due });
        self.paced_passed(context, now, node, out);
        let Some(task) = self.task else { return };
        let Goal::RestAt(destination) = task.goal else { return };
        match (task.phase, destination.at) {
            (Phase::Finding { .. }, _) => self.set_out(context, now, task.order, destination, out),
            (_, Some(at)) => match self.counted_again(context, at, node, &destination) {
                Some(at) => {
                    let goal = Goal::RestAt(Destination { at: Some(at), ..destination });
                    self.task = Some(Task { goal, ..task });
                    self.plan(context, now, out);
                    self.keep_time(context, now, out);
                }
                None => self.give_up(now, self.no_way(context, node, &destination), out),
            },
            _ => {}
        }
    }

    /// The report says when within a poll, and where it was expected just then says it better.
    fn note_passage(&mut self, context: TrackContext<'_>, node: NodeId, middle: Timestamp) {
        let located =
            self.located(context, middle).filter(|located| located.at.node == node && !located.at_rest);
        let since = located.filter(|located| located.speed.as_m_per_s() > 0.0);
        let since = since.map_or(TimeSpan::ZERO, |located| located.at.way / located.speed);
        self.passages.note(node, middle - since);
    }

    /// When it wants to look at the clock.
    pub(super) fn next_timeout(&self) -> Option<Timestamp> {
        let phase = match self.task.map(|task| task.phase) {
            Some(Phase::Running { plan: Some(plan) }) => Some(plan.leaves - self.link.command),
            Some(Phase::Settling { until, .. }) => Some(until),
            Some(Phase::Finding { since }) => Some(since + FIND_LIMIT),
            _ => None,
        };
        let unsent = self.unsent.map(|(_, since)| since + UNCONFIRMED);
        let looks = [self.next_look(), self.zone_look()];
        [phase, unsent, self.next_doubt(), self.guard()].into_iter().chain(looks).flatten().min()
    }

    pub(super) fn handle_timeout(&mut self, context: TrackContext<'_>, now: Timestamp, out: &mut Outputs) {
        if let Some((command, _)) = self.unsent.filter(|(_, since)| now - *since >= UNCONFIRMED) {
            out.say(Notice::Unconfirmed { command });
            self.unsent = None;
            if matches!(command, Command::Speed { step: SpeedStep::STAND, .. }) {
                self.issue(now, command, out);
            }
        }
        self.keep_on_track(context, now, out);
        if let Some(task) = self.task {
            self.go_on(context, now, task, out);
        }
        self.doubt(context, now, out);
    }

    fn go_on(&mut self, context: TrackContext<'_>, now: Timestamp, task: Task, out: &mut Outputs) {
        match task.phase {
            Phase::Running { plan: Some(plan) } if plan.leaves - self.link.command <= now => {
                self.stop_now(now, task, Some(plan.promise), out);
            }
            Phase::Finding { since } if now - since >= FIND_LIMIT => {
                let why = Refusal::NotFound { train: self.id(), within: FIND_LIMIT };
                self.give_up(now, why, out);
            }
            Phase::Settling { promise, until } if until <= now => {
                self.rested(context, now, task, promise, out);
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
        self.task = Some(Task { phase: Phase::Commanding { promise }, ..task });
        self.issue_stop(now, out);
    }

    /// Ends what cannot be done, and the run with it.
    pub(super) fn give_up(&mut self, now: Timestamp, why: Refusal, out: &mut Outputs) {
        if let Some(task) = self.task.take() {
            out.say(Notice::GivenUp { order: task.order, train: self.id(), why });
        }
        if self.commanded > SpeedStep::STAND {
            self.issue_stop(now, out);
        }
    }

    fn rested(
        &mut self,
        context: TrackContext<'_>,
        now: Timestamp,
        task: Task,
        promise: Option<Promise>,
        out: &mut Outputs,
    ) {
        // From now on it stands, whatever a better model may make of its way to here.
        if let Some(located) = self.located(context, now) {
            self.locator.place(now, located.at, located.uncertainty);
        }
        match task.goal {
            Goal::Reverse(_) => {
                self.task = Some(Task { phase: Phase::Turning, ..task });
                self.issue(now, Command::Reverse { train: self.id() }, out);
            }
            Goal::RestAt(Destination { at, .. }) => self.finish(context, now, task.order, at, promise, out),
            Goal::Rest | Goal::Run | Goal::Pace => self.finish(context, now, task.order, None, None, out),
        }
    }

    /// A contact that it should have passed, without a report.
    pub(super) fn passed_unheard(&self, context: TrackContext<'_>, located: &Located) -> Option<SensorId> {
        let passed = located.at.way - located.uncertainty * SHOULD_HAVE_PASSED;
        contacts_until(context, &self.model, located.at.node, passed).last().map(|(sensor, _)| sensor)
    }

    /// The order has been carried out.
    pub(super) fn finish(
        &mut self,
        context: TrackContext<'_>,
        time: Timestamp,
        order: OrderId,
        target: Option<WayPoint>,
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
            self.expected.unseen = self.expected.unseen.or(self.passed_unheard(context, &located));
        }
        self.task = None;
        let unseen = self.expected.unseen;
        out.say(Notice::Done(Finished { order, train: self.id(), time, achieved, promise, unseen }));
    }
}

fn widest_stop(model: &MotionModel) -> Option<Length> {
    let steps = (1..=model.highest().get()).filter_map(SpeedStep::new);
    let moves = steps.filter(|step| model.uses(*step) == StepUse::Moves);
    let spread = |step| {
        let stop = model.stop(step, Approach::Below);
        Length::from_m(libm::hypot(stop.doubt.as_m(), stop.scatter.as_m()))
    };
    moves.map(spread).reduce(Length::max)
}
