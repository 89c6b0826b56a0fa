//! Carries out instructions one after the other: hands orders to the driver, waits, and says what comes of it.

mod outcomes;

use std::collections::{BTreeMap, VecDeque};

use footplate_core::calibration::motion::MotionModel;
use footplate_core::control::{Driver, Machine, Order, OrderId, Output, Promise, Refusal};
use footplate_core::estimation::WayPoint;
use footplate_core::track::Landmark;
use footplate_core::{Command, Event, Length, SpeedStep, TimeSpan, Timestamp, TrainId};
use serde::{Deserialize, Serialize};

use super::instruction::{HELP, Instruction, Until};
use super::learning::Learning;
use super::reader::Known;
use super::script::{Step, step};
use super::spoken::Spoken;
use super::told::Tongue;
use crate::dashboard::{Painter, TrainTask};
use crate::witness::{Input, Listener};

/// What waits longer than this waits for nothing: a train at a crawl goes once round within it.
const WAIT_LIMIT: TimeSpan = TimeSpan::from_s(600.0);
/// How often it is looked whether a train stands.
const LOOK_AGAIN: TimeSpan = TimeSpan::from_ms(100);

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
pub(crate) struct Conductor {
    driver: Driver,
    learning: Learning,
    giver: Giver,
    steps: VecDeque<Step>,
    /// No more will come.
    complete: bool,
    trains: BTreeMap<TrainId, SpeedStep>,
    wait: Option<Wait>,
    pending: BTreeMap<OrderId, Step>,
    /// What was promised last of orders that are under way.
    promises: BTreeMap<OrderId, Promise>,
    outputs: VecDeque<Output<Spoken>>,
    began: Option<Timestamp>,
    /// When something was last looked at.
    looked: Timestamp,
    is_over: bool,
    fell_short: bool,
}

#[derive(Debug, Clone, Copy)]
struct Wait {
    until: Until,
    since: Timestamp,
    is_met: bool,
}

impl Conductor {
    pub(super) fn new(driver: Driver, learning: Learning, giver: Giver, steps: Vec<Step>) -> Self {
        let highest = |train| {
            driver
                .model(train)
                .map_or(SpeedStep::STAND, footplate_core::calibration::motion::MotionModel::highest)
        };
        let trains = driver.trains().map(|train| (train, highest(train))).collect();
        Self {
            driver,
            learning,
            giver,
            steps: steps.into(),
            complete: false,
            trains,
            wait: None,
            pending: BTreeMap::new(),
            promises: BTreeMap::new(),
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

    /// Whether an order was refused or given up.
    pub(super) const fn fell_short(&self) -> bool {
        self.fell_short
    }

    /// What trains taught.
    pub(super) fn learnt(&mut self) -> Vec<MotionModel> {
        let trains: Vec<TrainId> = self.trains.keys().copied().collect();
        trains.into_iter().filter_map(|train| self.learning.model(train)).collect()
    }

    /// A person wrote a line.
    fn hear(&mut self, now: Timestamp, line: &str) {
        let known = Known { layout: self.driver.layout(), trains: &self.trains };
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

    /// No more lines will come: what is under way is ended.
    pub(super) const fn complete(&mut self) {
        self.complete = true;
    }

    fn say(&mut self, line: String) {
        let status = self.tongue().status(self.looked);
        self.outputs.push_back(Output::Notice(Spoken::Line { text: line, status }));
    }

    fn since_begin(&self, time: Timestamp) -> TimeSpan {
        time - self.began.unwrap_or(time)
    }

    fn tongue(&self) -> Tongue<'_> {
        Tongue { driver: &self.driver, began: self.began.unwrap_or_default() }
    }

    /// Does what can be done now.
    fn go_on(&mut self, now: Timestamp) {
        self.began.get_or_insert(now);
        self.looked = now;
        self.hand_on(now);
        while !self.is_over && self.may_go_on(now) {
            let Some(step) = self.steps.front() else { break };
            if self.giver == Giver::Script && self.must_wait(step) {
                break;
            }
            if let Some(step) = self.steps.pop_front() {
                self.carry_out(now, step);
                self.hand_on(now);
            }
        }
        let idle = self.steps.is_empty() && self.wait.is_none() && self.pending.values().all(runs_on);
        if self.complete && idle && !self.is_over {
            self.end();
        }
    }

    /// In a script a train ends one order before it begins the next, and what follows a turnout follows it.
    fn must_wait(&self, step: &Step) -> bool {
        let is_turnout = |step: &Step| matches!(step.instruction, Instruction::Order(Order::Turnout { .. }));
        match step.instruction {
            Instruction::Order(order) => {
                let is_busy = order.train().is_some_and(|train| self.must_end(train));
                is_busy || !is_turnout(step) && self.pending.values().any(is_turnout)
            }
            _ => false,
        }
    }

    /// Whether a train is busy with something that ends by itself.
    fn must_end(&self, train: TrainId) -> bool {
        let order = self.driver.busy(train);
        order.is_some_and(|order| !self.pending.get(&order).is_some_and(runs_on))
    }

    fn end(&mut self) {
        self.is_over = true;
        self.outputs.push_back(Output::Notice(Spoken::Over));
    }

    fn may_go_on(&mut self, now: Timestamp) -> bool {
        let Some(wait) = self.wait else { return true };
        let met = wait.is_met
            || match wait.until {
                Until::Passed(span) => now - wait.since >= span,
                Until::AtRest(train) => self.driver.busy(train).is_none() && self.driver.stands(train, now),
                Until::Located(train) => self.driver.locate(train, now).is_some(),
                Until::At(..) => false,
            };
        if met {
            self.wait = None;
        } else if let Until::AtRest(train) = wait.until
            && self.driver.busy(train).is_none()
            && self.driver.told(train) > SpeedStep::STAND
        {
            self.wait = None;
            self.fell_short = true;
            self.say(format!("train {train} has been told nothing that would bring it to rest; going on"));
            return true;
        } else if !matches!(wait.until, Until::Passed(_)) && now - wait.since >= WAIT_LIMIT {
            self.wait = None;
            self.fell_short = true;
            self.say(format!("waited {:.0} s in vain; going on", WAIT_LIMIT.as_s()));
            return true;
        }
        met
    }

    fn carry_out(&mut self, now: Timestamp, step: Step) {
        match step.instruction {
            Instruction::Order(order) => match self.driver.order(now, order) {
                Ok(id) => {
                    if let (Order::Stop(_) | Order::Move { .. } | Order::Arrive { .. }, Some(train)) =
                        (order, order.train())
                    {
                        self.outputs.push_back(Output::Notice(Spoken::Begun(train)));
                    }
                    self.pending.insert(id, step);
                }
                Err(why) => self.refuse(now, &step, &why),
            },
            Instruction::Straighten => {
                let turnouts: Vec<_> = self.driver.layout().turnouts().map(|(turnout, _)| turnout).collect();
                for (place, turnout) in turnouts.into_iter().rev().enumerate() {
                    let instruction = Instruction::Order(Order::Turnout { turnout, curved: false });
                    let part = Step { text: step.text.clone(), instruction, is_part: place > 0 };
                    self.steps.push_front(part);
                }
            }
            Instruction::Place(train, at) => self.place(now, &step, train, at),
            Instruction::Halt => self.halt(now),
            Instruction::PowerOn => self.outputs.push_back(Output::Command(Command::PowerOn)),
            Instruction::Where(Some(train)) => {
                let line = self.tongue().whereabouts(train, now);
                self.say(line);
            }
            Instruction::Where(None) => {
                for train in self.trains.keys().copied().collect::<Vec<_>>() {
                    let line = self.tongue().whereabouts(train, now);
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

    /// Everything stands, whatever was said before and waits.
    fn halt(&mut self, now: Timestamp) {
        self.steps.clear();
        self.wait = None;
        for train in self.trains.keys().copied().collect::<Vec<_>>() {
            // Step 0 is a step of every train, so that nothing refuses it.
            let _ = self.driver.order(now, Order::Speed { train, step: SpeedStep::STAND });
        }
        self.hand_on(now);
        self.outputs.push_back(Output::Command(Command::PowerOff));
        self.say(
            "halt: all trains are told to stand, and the power goes off; `power on` gives it back".to_owned(),
        );
        self.go_on(now);
    }

    /// What is wrong with a line, if something is.
    pub(super) fn mistake(&self, line: &str) -> Option<String> {
        let known = Known { layout: self.driver.layout(), trains: &self.trains };
        step(line, known).err().map(|mistake| mistake.to_string())
    }

    /// Shows what there is to see now.
    pub(super) fn show(&self, painter: &mut Painter, now: Timestamp) {
        let task = |train: TrainId| {
            let order = self.driver.busy(train)?;
            let step = self.pending.get(&order)?;
            let target = match step.instruction {
                Instruction::Order(Order::Stop(stop)) => Some(stop.target),
                Instruction::Order(Order::Arrive { target, .. }) => Some(target),
                _ => None,
            };
            let promise =
                self.promises.get(&order).map(|promise| [promise.median, promise.low, promise.high]);
            Some((train, TrainTask { text: step.text.clone(), target, promise }))
        };
        let tasks = self.trains.keys().copied().filter_map(task).collect();
        painter.paint(&self.driver, &tasks, now, self.began.unwrap_or(now));
    }

    /// A person says where a train stands.
    fn place(&mut self, now: Timestamp, step: &Step, train: TrainId, at: Landmark) {
        if self.driver.stands(train, now) {
            let at = WayPoint { node: at.node, way: at.offset };
            self.driver.place(now, train, at, SEEN_BY_HAND);
            self.learning.interrupt(train);
            let line = self.tongue().whereabouts(train, now);
            self.say(line);
        } else {
            self.refuse(now, step, &Refusal::StillMoves { train });
        }
    }

    /// Hands on what the driver asks for, and says what it has to say.
    fn hand_on(&mut self, now: Timestamp) {
        while let Some(output) = self.driver.poll_output() {
            match output {
                Output::Command(command) => self.outputs.push_back(Output::Command(command)),
                Output::HoldLine(until) => self.outputs.push_back(Output::HoldLine(until)),
                Output::Watch(sensor) => self.outputs.push_back(Output::Watch(sensor)),
                Output::Notice(notice) => self.notice(now, &notice),
            }
        }
    }
}

/// Whether what a line asks for goes on until something else is asked for.
fn runs_on(step: &Step) -> bool {
    matches!(step.instruction, Instruction::Order(Order::Hold { .. } | Order::Follow { .. }))
}

impl Machine for Conductor {
    type Notice = Spoken;

    fn handle_event(&mut self, now: Timestamp, event: &Event) {
        self.driver.handle_event(now, event);
        self.learning.take(&self.driver, event);
        self.go_on(now);
    }

    fn handle_timeout(&mut self, now: Timestamp) {
        self.driver.handle_timeout(now);
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
            Until::At(..) | Until::Located(_) => wait.since + WAIT_LIMIT,
        });
        [self.driver.next_timeout(), now_and_then].into_iter().flatten().min()
    }
}

impl Listener for Conductor {
    fn handle_word(&mut self, now: Timestamp, word: &Input) {
        match word {
            Input::Line(line) => self.hear(now, line),
            Input::NoMoreLines => self.complete(),
            _ => {}
        }
    }
}
