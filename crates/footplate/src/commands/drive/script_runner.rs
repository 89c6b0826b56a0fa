//! Carries out instructions one after the other: passes orders and journeys to the dispatcher, waits for them, and
//! reports their results.

mod outcomes;
mod queue;
mod schedules;
mod unlocated;
mod waiting;

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use footplate_core::control::{
    Dispatcher, Driver, Finished, Journey, Learning, Machine, Order, OrderId, Output, Promise, Refusal,
    WAIT_LIMIT,
};
use footplate_core::model::{MotionFit, MotionModel};
use footplate_core::track::Landmark;
use footplate_core::tracking::PathPoint;
use footplate_core::{Event, Length, SpeedStep, TimeSpan, Timestamp, TrainId};
use footplate_store::Schedule;

use self::queue::{Queues, StepQueue, Wait};
use self::waiting::{CHECK_INTERVAL, is_open_ended};
use super::formatter::NoticeFormatter;
use super::instruction::{HELP, Instruction, Until};
use super::reader::Known;
use super::script::{CommandSource, QueueId, Step, step};
use super::session_message::SessionMessage;
use super::words::Mistake;
use crate::dashboard::{Painter, SchedulePicture, SessionState, TrainTask};
use crate::recorded::{Input, Listener};

/// The pause between two parts of a refit, in which reports and commands are handled.
const FIT_INTERVAL: TimeSpan = TimeSpan::from_ms(5);
/// The standard deviation of a position that an operator reads off: the end of the shoe beside a sensor, whose own
/// place is known to 5 mm.
const READ_OFF_BY_HAND: Length = Length::from_mm(12.0);

/// Drives trains by instructions.
#[derive(Debug)]
pub(crate) struct ScriptRunner {
    dispatcher: Dispatcher,
    learning: Learning,
    /// Refitted models that are used as soon as their trains are at rest.
    refitted: BTreeMap<TrainId, MotionModel>,
    queues: Queues,
    /// The saved schedules of the layout.
    saved: Vec<Schedule>,
    /// The schedules that have ended, the newest last.
    ended_schedules: Vec<SchedulePicture>,
    /// Whether no more lines will come.
    complete: bool,
    trains: BTreeMap<TrainId, SpeedStep>,
    /// The longest wait for a train; a `wait` for a time is not limited.
    wait_limit: TimeSpan,
    pending: BTreeMap<OrderId, Step>,
    /// The last predicted interval of each order in progress.
    promises: BTreeMap<OrderId, Promise>,
    /// Trains whose recovery found a changed model.
    changed: BTreeSet<TrainId>,
    /// Trains whose missed intervals have been reported.
    unreliable: BTreeSet<TrainId>,
    /// When each journey was requested.
    journeys: BTreeMap<OrderId, Timestamp>,
    /// The functions of each train that were switched on, one bit each.
    functions: BTreeMap<TrainId, u32>,
    /// The last stop of each train.
    rests: BTreeMap<TrainId, Finished>,
    /// Trains that were searched for because another one is to be sent.
    sought: BTreeSet<TrainId>,
    /// Trains that others were said not to be kept clear of.
    warned: BTreeSet<TrainId>,
    /// What was last said of each train in a deadlock.
    deadlocks: BTreeMap<TrainId, String>,
    outputs: VecDeque<Output<SessionMessage>>,
    began: Option<Timestamp>,
    /// The time of the last event or timeout.
    last_event: Timestamp,
    is_over: bool,
    fell_short: bool,
}

impl ScriptRunner {
    pub(super) fn new(driver: Driver, learning: Learning, source: CommandSource, steps: Vec<Step>) -> Self {
        let highest =
            |train| driver.model(train).map_or(SpeedStep::STAND, footplate_core::model::MotionModel::highest);
        let trains = driver.trains().map(|train| (train, highest(train))).collect();
        Self {
            dispatcher: Dispatcher::watched(Timestamp::ZERO, driver),
            learning,
            refitted: BTreeMap::new(),
            queues: Queues::new(StepQueue::new(source, steps)),
            saved: Vec::new(),
            ended_schedules: Vec::new(),
            complete: false,
            trains,
            wait_limit: WAIT_LIMIT,
            pending: BTreeMap::new(),
            promises: BTreeMap::new(),
            changed: BTreeSet::new(),
            unreliable: BTreeSet::new(),
            journeys: BTreeMap::new(),
            functions: BTreeMap::new(),
            rests: BTreeMap::new(),
            sought: BTreeSet::new(),
            warned: BTreeSet::new(),
            deadlocks: BTreeMap::new(),
            outputs: VecDeque::new(),
            began: None,
            last_event: Timestamp::ZERO,
            is_over: false,
            fell_short: false,
        }
    }

    /// The trains of the session.
    pub(super) fn trains(&self) -> impl Iterator<Item = TrainId> {
        self.trains.keys().copied()
    }

    pub(crate) fn driver(&self) -> &Driver {
        self.dispatcher.driver()
    }

    /// What a line may refer to.
    fn known(&self) -> Known<'_> {
        Known { layout: self.driver().layout(), trains: &self.trains, schedules: &self.saved }
    }

    /// Whether an order was refused or given up.
    pub(super) const fn fell_short(&self) -> bool {
        self.fell_short
    }

    /// The models fitted in this session.
    pub(super) fn learnt(&mut self) -> Vec<MotionModel> {
        let trains: Vec<TrainId> = self.trains.keys().copied().collect();
        let learnt = trains.into_iter().filter_map(|train| {
            // A train without a fit that a recovery measured again has a model as measured.
            let measured_again = self.changed.contains(&train);
            let fitted = self.learning.model(train);
            fitted.or_else(|| self.dispatcher.driver().model(train).filter(|_| measured_again).cloned())
        });
        learnt.collect()
    }

    /// The models and fits that the next session starts from.
    pub(crate) fn handed_over(&mut self) -> (Vec<MotionModel>, Vec<MotionFit>) {
        (self.learnt(), self.learning.handed_over())
    }

    /// Takes in a line of the operator.
    fn handle_line(&mut self, now: Timestamp, line: &str) {
        match self.read_line(line) {
            Ok(step) => self.take(now, step),
            Err(mistake) => {
                self.say(mistake.to_string());
                self.advance(now);
            }
        }
    }

    /// Reads a line of the operator; an empty one is no step.
    pub(super) fn read_line(&self, line: &str) -> Result<Option<Step>, Mistake> {
        step(line, self.known())
    }

    /// Takes in what a line of the operator says.
    pub(super) fn take(&mut self, now: Timestamp, step: Option<Step>) {
        match step {
            Some(Step { instruction: Instruction::Halt, .. }) => return self.halt(now),
            Some(step) if self.is_interactive() => self.hear(now, step),
            step => {
                if let Some(session) = self.queues.get_mut(QueueId::SESSION) {
                    session.steps.extend(step);
                }
            }
        }
        self.advance(now);
    }

    /// States the saved schedules of the layout.
    pub(super) fn set_saved(&mut self, saved: Vec<Schedule>) {
        self.saved = saved;
    }

    pub(super) const fn set_wait_limit(&mut self, limit: TimeSpan) {
        self.wait_limit = limit;
        self.dispatcher.set_wait_limit(limit);
    }

    /// States that no more lines will come: the session ends when its orders have ended.
    pub(super) const fn complete(&mut self) {
        self.complete = true;
    }

    fn say(&mut self, line: String) {
        let status = self.formatter().status(self.last_event);
        self.outputs.push_back(Output::Notice(SessionMessage::Line { text: line, status }));
    }

    fn since_begin(&self, time: Timestamp) -> TimeSpan {
        time - self.began.unwrap_or(time)
    }

    fn formatter(&self) -> NoticeFormatter<'_> {
        NoticeFormatter { driver: self.driver(), began: self.began.unwrap_or_default() }
    }

    /// Handles everything that is due now.
    fn advance(&mut self, now: Timestamp) {
        self.began.get_or_insert(now);
        self.last_event = now;
        self.forward_outputs(now);
        self.continue_refit(now);
        let mut queue = Some(QueueId::SESSION);
        while let Some(id) = queue {
            self.advance_queue(now, id);
            self.continue_schedule(now, id);
            queue = self.queues.after(id);
        }
        self.cancel_late_journeys(now);
        let is_idle = |(_, queue): (_, &StepQueue)| {
            queue.run.is_none() && queue.steps.is_empty() && queue.wait.is_none()
        };
        let idle = self.queues.iter().all(is_idle) && self.pending.values().all(is_open_ended);
        if self.complete && idle && !self.is_over {
            self.end();
        }
    }

    /// Carries out the steps of a queue that need not wait.
    fn advance_queue(&mut self, now: Timestamp, queue: QueueId) {
        while !self.is_over && self.may_advance(now, queue) {
            let front = self.queues.get(queue).and_then(|queue| queue.steps.front());
            let Some(instruction) = front.map(|step| step.instruction.clone()) else { break };
            if self.waits_for_model(now, &instruction)
                || self.queues.is_script(queue) && self.must_wait(now, queue, &instruction)
            {
                break;
            }
            if let Some(step) = self.queues.get_mut(queue).and_then(|queue| queue.steps.pop_front()) {
                self.carry_out(now, step);
                self.forward_outputs(now);
            }
        }
    }

    fn end(&mut self) {
        self.is_over = true;
        self.outputs.push_back(Output::Notice(SessionMessage::Over));
    }

    fn carry_out(&mut self, now: Timestamp, step: Step) {
        if let Some(train) = step.instruction.driven().filter(|_| step.queue == QueueId::SESSION) {
            self.take_over(train);
        }
        match step.instruction {
            Instruction::Order(order) if self.locates_before(now, &step, &order) => {}
            Instruction::Order(order) => match self.give_order(now, order) {
                Ok(id) => {
                    self.warn_of_unlocated(now, &step, &order);
                    if let (Order::Stop(_) | Order::Move { .. } | Order::Arrive { .. }, Some(train)) =
                        (order, order.train())
                    {
                        self.outputs.push_back(Output::Notice(SessionMessage::Begun(train)));
                    }
                    self.pending.insert(id, step);
                }
                Err(Refusal::Lost { train }) if !step.is_retry => self.locate_first(train, &step),
                Err(why) => self.refuse(now, &step, &why),
            },
            Instruction::Go(train, journey) => self.send(now, step, train, journey),
            Instruction::Straighten => {
                let turnouts: Vec<_> =
                    self.driver().layout().turnouts().map(|(turnout, _)| turnout).collect();
                for (place, turnout) in turnouts.into_iter().rev().enumerate() {
                    let instruction = Instruction::Order(Order::Turnout { turnout, curved: false });
                    self.queues.push_front(Step { instruction, is_part: place > 0, ..step.clone() });
                }
            }
            Instruction::Find(train) if self.driver().locate(train, now).is_some() => {
                let line = self.formatter().whereabouts(train, now);
                self.say(line);
            }
            Instruction::Find(train) => self.find(train, &step),
            Instruction::Place(train, at) => self.place(now, &step, train, at),
            Instruction::Length(train, lengths) => {
                self.dispatcher.set_lengths(now, train, lengths);
                let [ahead, behind] = [lengths.ahead(), lengths.behind()].map(Length::as_mm);
                self.say(format!(
                    "train {train} extends {ahead:.0} mm ahead of the leading end of its pickup, and \
                     {behind:.0} mm behind it"
                ));
            }
            Instruction::Function(train, function, on) => {
                let functions = self.functions.entry(train).or_default();
                *functions = if on { *functions | function.bit() } else { *functions & !function.bit() };
                self.dispatcher.switch_function(now, train, function, on);
            }
            Instruction::Halt => self.halt(now),
            Instruction::PowerOn => self.dispatcher.switch_power(now, true),
            Instruction::Where(Some(train)) => {
                let line = self.formatter().whereabouts(train, now);
                self.say(line);
            }
            Instruction::Where(None) => {
                for train in self.trains.keys().copied().collect::<Vec<_>>() {
                    let line = self.formatter().whereabouts(train, now);
                    self.say(line);
                }
            }
            Instruction::Wait(until) => {
                if let Some(queue) = self.queues.get_mut(step.queue) {
                    let Step { line, is_part, .. } = step;
                    queue.wait = Some(Wait { until, since: now, is_met: false, is_part, line });
                }
            }
            Instruction::ListSchedules => self.list_schedules(),
            Instruction::RunSchedule(schedule) => self.begin_schedule(now, schedule),
            Instruction::EndSchedule(name) => self.end_schedule(now, &name),
            Instruction::Help => self.say(HELP.to_owned()),
            Instruction::Quit => {
                self.close_schedules();
                self.queues.clear();
                self.end();
            }
        }
    }

    /// Gives an order to the dispatcher; it replaces a journey of the same train.
    fn give_order(&mut self, now: Timestamp, order: Order) -> Result<OrderId, Refusal> {
        let journey = order.train().and_then(|train| self.dispatcher.journey(train));
        let taken = self.dispatcher.order(now, order);
        if let Some((journey, _)) =
            journey.filter(|_| order.train().is_some_and(|train| self.dispatcher.journey(train).is_none()))
        {
            self.pending.remove(&journey);
        }
        taken
    }

    fn send(&mut self, now: Timestamp, step: Step, train: TrainId, journey: Journey) {
        if !step.is_retry {
            // A new order looks for trains anew.
            self.sought.clear();
        }
        let before = self.dispatcher.journey(train);
        match self.dispatcher.go(now, train, journey) {
            Ok(id) => {
                if let Some((before, _)) = before {
                    self.pending.remove(&before);
                }
                self.deadlocks.remove(&train);
                self.journeys.insert(id, now);
                self.outputs.push_back(Output::Notice(SessionMessage::Begun(train)));
                self.pending.insert(id, step);
            }
            Err(Refusal::Lost { train }) if !step.is_retry => self.locate_first(train, &step),
            // One after the other: each train that could be in the path is located once.
            Err(Refusal::OtherNowhere { other, .. }) if self.sought.insert(other) => {
                self.locate_first(other, &step);
            }
            Err(why) => self.refuse(now, &step, &why),
        }
    }

    /// Stops all trains, switches the track power off, and drops all waiting lines.
    fn halt(&mut self, now: Timestamp) {
        self.close_schedules();
        self.queues.clear();
        for train in self.trains.keys().copied().collect::<Vec<_>>() {
            // Step 0 is a step of every train, so that nothing refuses it.
            let _ = self.give_order(now, Order::Speed { train, step: SpeedStep::STAND });
        }
        self.dispatcher.switch_power(now, false);
        self.forward_outputs(now);
        self.say("halt: all trains stopped, track power off; enter `power on` to switch it on".to_owned());
        self.advance(now);
    }

    /// Paints the current state for dashboard and terminal.
    pub(crate) fn show(&self, painter: &mut Painter, now: Timestamp) {
        let task = |train: TrainId| {
            let busy = self.driver().busy(train);
            let order = busy.filter(|order| self.pending.contains_key(order));
            let order = order.or_else(|| Some(self.dispatcher.journey(train)?.0))?;
            let step = self.pending.get(&order)?;
            let target = match step.instruction {
                Instruction::Go(_, journey) => Some(journey.target),
                Instruction::Order(Order::Stop(stop)) => Some(stop.target),
                Instruction::Order(Order::Arrive { target, .. }) => Some(target),
                _ => None,
            };
            // The interval belongs to the current run of a journey; only the last run ends at the journey's target.
            let promise = self.promises.get(&order).filter(|_| busy == Some(order));
            let promise = promise.map(|promise| [promise.median, promise.low, promise.high]);
            Some((train, TrainTask { text: step.text.clone(), target, promise }))
        };
        let tasks = self.trains.keys().copied().filter_map(task).collect();
        let session =
            SessionState { tasks, functions: self.functions.clone(), schedules: self.schedule_pictures() };
        painter.paint(&self.dispatcher, session, now, self.began.unwrap_or(now));
    }

    /// Takes in the position of a train at rest from the operator.
    fn place(&mut self, now: Timestamp, step: &Step, train: TrainId, at: Landmark) {
        if self.driver().is_at_rest(train, now) {
            let at = PathPoint { node: at.node, distance: at.offset };
            self.dispatcher.place(now, train, at, READ_OFF_BY_HAND);
            self.learning.interrupt(train);
            self.outputs.push_back(Output::Notice(SessionMessage::Placed(train)));
            let line = self.formatter().whereabouts(train, now);
            self.say(line);
        } else {
            self.refuse(now, step, &Refusal::StillMoves { train });
        }
    }

    /// Forwards commands and notices of the dispatcher.
    fn forward_outputs(&mut self, now: Timestamp) {
        while let Some(output) = self.dispatcher.poll_output() {
            match output {
                Output::Command(command) => self.outputs.push_back(Output::Command(command)),
                Output::HoldLine(until) => self.outputs.push_back(Output::HoldLine(until)),
                Output::Watch(sensor) => self.outputs.push_back(Output::Watch(sensor)),
                Output::Notice(notice) => self.handle_notice(now, &notice),
            }
        }
    }
}

impl Machine for ScriptRunner {
    type Notice = SessionMessage;

    fn handle_event(&mut self, now: Timestamp, event: &Event) {
        self.dispatcher.handle_event(now, event);
        self.learning.take(self.dispatcher.driver(), event);
        self.advance(now);
    }

    fn handle_timeout(&mut self, now: Timestamp) {
        self.dispatcher.handle_timeout(now);
        self.advance(now);
    }

    fn poll_output(&mut self) -> Option<Output<SessionMessage>> {
        self.outputs.pop_front()
    }

    fn next_timeout(&self) -> Option<Timestamp> {
        if self.began.is_none() {
            return Some(Timestamp::ZERO);
        }
        let ends = |wait: Wait| match wait.until {
            Until::Passed(span) => wait.since + span,
            Until::AtRest(_) => self.last_event + CHECK_INTERVAL,
            Until::At(..) | Until::Located(_) => wait.since + self.limit_of(&wait),
        };
        let waited_for = self.queues.iter().filter_map(|(_, queue)| queue.wait.map(ends)).min();
        let learns = self.learning.is_refitting().then(|| self.last_event + FIT_INTERVAL);
        let retries = |since: Timestamp| (self.last_event + CHECK_INTERVAL).min(since + self.wait_limit);
        let retried = self.queues.iter().filter_map(|(_, queue)| queue.interrupted.map(retries)).min();
        let round = self.round_due();
        [self.dispatcher.next_timeout(), waited_for, self.journey_deadline(), retried, learns, round]
            .into_iter()
            .flatten()
            .min()
    }
}

impl Listener for ScriptRunner {
    fn handle_word(&mut self, now: Timestamp, word: &Input) {
        match word {
            Input::Line(line) => self.handle_line(now, line),
            Input::EmergencyStop => self.halt(now),
            Input::Schedule(schedule) => self.begin_schedule(now, schedule.clone()),
            Input::EndSchedule(name) => self.end_schedule(now, name),
            Input::Schedules(saved) => self.set_saved(saved.clone()),
            Input::NoMoreLines => self.complete(),
            Input::Link(news) => {
                self.dispatcher.handle_link(now, *news);
                self.advance(now);
            }
            _ => {}
        }
    }
}
