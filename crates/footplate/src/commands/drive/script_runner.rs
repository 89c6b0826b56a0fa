//! Carries out instructions one after the other: hands orders and journeys to the dispatcher, waits, and says what comes
//! of it.

mod outcomes;
mod waiting;

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use footplate_core::control::{
    Dispatcher, Driver, Finished, Journey, Machine, Order, OrderId, Output, Promise, Refusal,
};
use footplate_core::model::MotionFit;
use footplate_core::model::MotionModel;
use footplate_core::track::Landmark;
use footplate_core::tracking::WayPoint;
use footplate_core::{Event, Length, SpeedStep, TimeSpan, Timestamp, TrainId};
use serde::{Deserialize, Serialize};

use self::waiting::{LOOK_AGAIN, Wait, runs_on};
use super::formatter::NoticeFormatter;
use super::instruction::{HELP, Instruction, Until};
use super::learning::Learning;
use super::reader::Known;
use super::script::{Step, step};
use super::spoken::Spoken;
use crate::dashboard::{Painter, TrainTask};
use crate::recorded::{Input, Listener};

/// What waits longer than this waits for nothing, unless another limit is set: a train at a crawl goes once round within it.
pub(super) const WAIT_LIMIT: TimeSpan = TimeSpan::from_s(600.0);
/// Between two parts of a fit, so that everything else has its turn.
const BETWEEN_PARTS: TimeSpan = TimeSpan::from_ms(5);
/// How well a person sees where the end of a shoe is beside a contact, whose own place is known to 5 mm.
const SEEN_BY_HAND: Length = Length::from_mm(12.0);

/// Who gives the instructions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum Giver {
    /// A file, or another program: a train ends one order before it begins the next.
    Script,
    /// A person: a new order takes the place of the one before.
    Person,
}

/// Drives by instructions.
#[derive(Debug)]
pub(crate) struct ScriptRunner {
    dispatcher: Dispatcher,
    learning: Learning,
    /// Models that wait for their trains to stand.
    taught: BTreeMap<TrainId, MotionModel>,
    giver: Giver,
    steps: VecDeque<Step>,
    /// No more will come.
    complete: bool,
    trains: BTreeMap<TrainId, SpeedStep>,
    wait: Option<Wait>,
    /// What is waited for longer than this is waited for in vain.
    wait_limit: TimeSpan,
    /// Since when the next line has waited for a train that cannot be driven now.
    interrupted: Option<Timestamp>,
    pending: BTreeMap<OrderId, Step>,
    /// What was promised last of orders that are under way.
    promises: BTreeMap<OrderId, Promise>,
    /// Trains that are not as they were when the session began.
    changed: BTreeSet<TrainId>,
    /// Trains of which it was said that they break their promises.
    unreliable: BTreeSet<TrainId>,
    /// When journeys were asked for.
    journeys: BTreeMap<OrderId, Timestamp>,
    /// How each train came to rest last.
    rests: BTreeMap<TrainId, Finished>,
    outputs: VecDeque<Output<Spoken>>,
    began: Option<Timestamp>,
    /// When something was last looked at.
    looked: Timestamp,
    is_over: bool,
    fell_short: bool,
}

impl ScriptRunner {
    pub(super) fn new(driver: Driver, learning: Learning, giver: Giver, steps: Vec<Step>) -> Self {
        let highest =
            |train| driver.model(train).map_or(SpeedStep::STAND, footplate_core::model::MotionModel::highest);
        let trains = driver.trains().map(|train| (train, highest(train))).collect();
        Self {
            dispatcher: Dispatcher::watched(Timestamp::ZERO, driver),
            learning,
            taught: BTreeMap::new(),
            giver,
            steps: steps.into(),
            complete: false,
            trains,
            wait: None,
            wait_limit: WAIT_LIMIT,
            interrupted: None,
            pending: BTreeMap::new(),
            promises: BTreeMap::new(),
            changed: BTreeSet::new(),
            unreliable: BTreeSet::new(),
            journeys: BTreeMap::new(),
            rests: BTreeMap::new(),
            outputs: VecDeque::new(),
            began: None,
            looked: Timestamp::ZERO,
            is_over: false,
            fell_short: false,
        }
    }

    /// Whether somebody sits there who may not know what can be said.
    pub(super) fn listens_to_a_person(&self) -> bool {
        self.giver == Giver::Person
    }

    /// What drives the trains.
    fn driver(&self) -> &Driver {
        self.dispatcher.driver()
    }

    /// Whether an order was refused or given up.
    pub(super) const fn fell_short(&self) -> bool {
        self.fell_short
    }

    /// What trains taught.
    pub(super) fn learnt(&mut self) -> Vec<MotionModel> {
        let trains: Vec<TrainId> = self.trains.keys().copied().collect();
        let learnt = trains.into_iter().filter_map(|train| {
            // One that was measured again is kept as it was found then.
            let measured_again =
                self.changed.contains(&train).then(|| self.dispatcher.driver().model(train).cloned());
            measured_again.flatten().or_else(|| self.learning.model(train))
        });
        learnt.collect()
    }

    /// What the next session goes on from.
    pub(crate) fn handed_over(&mut self) -> (Vec<MotionModel>, Vec<MotionFit>) {
        (self.learnt(), self.learning.handed_over())
    }

    /// A person wrote a line.
    fn hear(&mut self, now: Timestamp, line: &str) {
        let known = Known { layout: self.driver().layout(), trains: &self.trains };
        match step(line, known) {
            Ok(Some(Step { instruction: Instruction::Halt, .. })) => return self.halt(now),
            Ok(heard) => {
                // Who says something else has waited long enough.
                if heard.is_some() && self.giver == Giver::Person {
                    self.wait = None;
                }
                self.steps.extend(heard);
            }
            Err(mistake) => self.say(mistake.to_string()),
        }
        self.go_on(now);
    }

    /// Waits no longer than this for anything but time.
    pub(super) const fn set_wait_limit(&mut self, limit: TimeSpan) {
        self.wait_limit = limit;
    }

    /// No more lines will come: what is under way is ended.
    pub(super) const fn complete(&mut self) {
        self.complete = true;
    }

    fn say(&mut self, line: String) {
        let status = self.formatter().status(self.looked);
        self.outputs.push_back(Output::Notice(Spoken::Line { text: line, status }));
    }

    fn since_begin(&self, time: Timestamp) -> TimeSpan {
        time - self.began.unwrap_or(time)
    }

    fn formatter(&self) -> NoticeFormatter<'_> {
        NoticeFormatter { driver: self.driver(), began: self.began.unwrap_or_default() }
    }

    /// Does what can be done now.
    fn go_on(&mut self, now: Timestamp) {
        self.began.get_or_insert(now);
        self.looked = now;
        self.hand_on(now);
        self.learn_on(now);
        while !self.is_over && self.may_go_on(now) {
            let Some(instruction) = self.steps.front().map(|step| step.instruction) else { break };
            if self.waits_for_model(now, instruction)
                || self.giver == Giver::Script && self.must_wait(now, instruction)
            {
                break;
            }
            if let Some(step) = self.steps.pop_front() {
                self.carry_out(now, step);
                self.hand_on(now);
            }
        }
        self.tire_of_waiting(now);
        let idle = self.steps.is_empty() && self.wait.is_none() && self.pending.values().all(runs_on);
        if self.complete && idle && !self.is_over {
            self.end();
        }
    }

    fn end(&mut self) {
        self.is_over = true;
        self.outputs.push_back(Output::Notice(Spoken::Over));
    }

    fn carry_out(&mut self, now: Timestamp, step: Step) {
        match step.instruction {
            Instruction::Order(order) => match self.hand_down(now, order) {
                Ok(id) => {
                    if let (Order::Stop(_) | Order::Move { .. } | Order::Arrive { .. }, Some(train)) =
                        (order, order.train())
                    {
                        self.outputs.push_back(Output::Notice(Spoken::Begun(train)));
                    }
                    self.pending.insert(id, step);
                }
                Err(Refusal::Lost { train }) if !step.is_again => self.find_first(train, step),
                Err(why) => self.refuse(now, &step, &why),
            },
            Instruction::Go(train, journey) => self.send(now, step, train, journey),
            Instruction::Straighten => {
                let turnouts: Vec<_> =
                    self.driver().layout().turnouts().map(|(turnout, _)| turnout).collect();
                for (place, turnout) in turnouts.into_iter().rev().enumerate() {
                    let instruction = Instruction::Order(Order::Turnout { turnout, curved: false });
                    let part =
                        Step { text: step.text.clone(), instruction, is_part: place > 0, is_again: false };
                    self.steps.push_front(part);
                }
            }
            Instruction::Place(train, at) => self.place(now, &step, train, at),
            Instruction::Length(train, lengths) => {
                self.dispatcher.set_lengths(now, train, lengths);
                let [ahead, behind] = [lengths.ahead(), lengths.behind()].map(Length::as_mm);
                self.say(format!(
                    "train {train} extends {ahead:.0} mm ahead of the leading end of its pickup, and \
                     {behind:.0} mm behind it"
                ));
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
            Instruction::Wait(until) => self.wait = Some(Wait { until, since: now, is_met: false }),
            Instruction::Help => self.say(HELP.to_owned()),
            Instruction::Quit => {
                self.steps.clear();
                self.end();
            }
        }
    }

    /// Hands an order down; it takes the place of a journey.
    fn hand_down(&mut self, now: Timestamp, order: Order) -> Result<OrderId, Refusal> {
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
        let before = self.dispatcher.journey(train);
        match self.dispatcher.go(now, train, journey) {
            Ok(id) => {
                if let Some((before, _)) = before {
                    self.pending.remove(&before);
                }
                self.journeys.insert(id, now);
                self.outputs.push_back(Output::Notice(Spoken::Begun(train)));
                self.pending.insert(id, step);
            }
            Err(Refusal::Lost { train } | Refusal::OtherNowhere { other: train, .. }) if !step.is_again => {
                self.find_first(train, step);
            }
            Err(why) => self.refuse(now, &step, &why),
        }
    }

    /// Everything stands, whatever was said before and waits.
    fn halt(&mut self, now: Timestamp) {
        self.steps.clear();
        self.wait = None;
        for train in self.trains.keys().copied().collect::<Vec<_>>() {
            // Step 0 is a step of every train, so that nothing refuses it.
            let _ = self.hand_down(now, Order::Speed { train, step: SpeedStep::STAND });
        }
        self.dispatcher.switch_power(now, false);
        self.hand_on(now);
        self.say("halt: all trains stopped, track power off; enter `power on` to switch it on".to_owned());
        self.go_on(now);
    }

    /// What is wrong with a line, if something is.
    pub(super) fn mistake(&self, line: &str) -> Option<String> {
        let known = Known { layout: self.driver().layout(), trains: &self.trains };
        step(line, known).err().map(|mistake| mistake.to_string())
    }

    /// Shows what there is to see now.
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
            // A journey promises no more than the run that it is on, and only the last one leads to its end.
            let promise = self.promises.get(&order).filter(|_| busy == Some(order));
            let promise = promise.map(|promise| [promise.median, promise.low, promise.high]);
            Some((train, TrainTask { text: step.text.clone(), target, promise }))
        };
        let tasks = self.trains.keys().copied().filter_map(task).collect();
        painter.paint(&self.dispatcher, &tasks, now, self.began.unwrap_or(now));
    }

    /// A person says where a train stands.
    fn place(&mut self, now: Timestamp, step: &Step, train: TrainId, at: Landmark) {
        if self.driver().stands(train, now) {
            let at = WayPoint { node: at.node, way: at.offset };
            self.dispatcher.place(now, train, at, SEEN_BY_HAND);
            self.learning.interrupt(train);
            let line = self.formatter().whereabouts(train, now);
            self.say(line);
        } else {
            self.refuse(now, step, &Refusal::StillMoves { train });
        }
    }

    /// Hands on what the driver asks for, and says what it has to say.
    fn hand_on(&mut self, now: Timestamp) {
        while let Some(output) = self.dispatcher.poll_output() {
            match output {
                Output::Command(command) => self.outputs.push_back(Output::Command(command)),
                Output::HoldLine(until) => self.outputs.push_back(Output::HoldLine(until)),
                Output::Watch(sensor) => self.outputs.push_back(Output::Watch(sensor)),
                Output::Notice(notice) => self.dispatched(now, &notice),
            }
        }
    }
}

impl Machine for ScriptRunner {
    type Notice = Spoken;

    fn handle_event(&mut self, now: Timestamp, event: &Event) {
        self.dispatcher.handle_event(now, event);
        self.learning.take(self.dispatcher.driver(), event);
        self.go_on(now);
    }

    fn handle_timeout(&mut self, now: Timestamp) {
        self.dispatcher.handle_timeout(now);
        self.go_on(now);
    }

    fn poll_output(&mut self) -> Option<Output<Spoken>> {
        self.outputs.pop_front()
    }

    fn next_timeout(&self) -> Option<Timestamp> {
        if self.began.is_none() {
            return Some(Timestamp::ZERO);
        }
        let now_and_then = self.wait.map(|wait| match wait.until {
            Until::Passed(span) => wait.since + span,
            Until::AtRest(_) => self.looked + LOOK_AGAIN,
            Until::At(..) | Until::Located(_) => wait.since + self.wait_limit,
        });
        let learns = self.learning.is_fitting().then(|| self.looked + BETWEEN_PARTS);
        let tried_again =
            self.interrupted.map(|since| (self.looked + LOOK_AGAIN).min(since + self.wait_limit));
        [self.dispatcher.next_timeout(), now_and_then, self.tires(), tried_again, learns]
            .into_iter()
            .flatten()
            .min()
    }
}

impl Listener for ScriptRunner {
    fn handle_word(&mut self, now: Timestamp, word: &Input) {
        match word {
            Input::Line(line) => self.hear(now, line),
            Input::EmergencyStop => self.halt(now),
            Input::NoMoreLines => self.complete(),
            Input::Link(news) => {
                self.dispatcher.handle_link(now, *news);
                self.go_on(now);
            }
            _ => {}
        }
    }
}
