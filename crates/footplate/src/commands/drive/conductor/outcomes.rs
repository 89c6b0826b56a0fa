//! What comes of instructions: refusals, notices of the driver, orders that have ended, and what trains taught.

use footplate_core::control::{Achieved, DriveNotice, Finished, Order, Output, Refusal};
use footplate_core::{Timestamp, TrainId};

use super::Conductor;
use crate::commands::drive::instruction::{Instruction, Until};
use crate::commands::drive::script::Step;
use crate::commands::drive::spoken::{Ended, Spoken, Target};
use crate::commands::drive::told::verb;
use crate::dashboard::TrainPassed;

impl Conductor {
    pub(super) fn refuse(&mut self, now: Timestamp, step: &Step, why: &Refusal) {
        self.fell_short = true;
        self.say(format!("refused `{}`: {why}", step.text));
        let ended = Ended { refused: Some(why.to_string()), ..self.ended(now, step) };
        self.outputs.push_back(Output::Notice(Spoken::Ended(ended)));
    }

    fn ended(&self, time: Timestamp, step: &Step) -> Ended {
        let (train, target) = match step.instruction {
            Instruction::Order(order) => (
                order.train(),
                match order {
                    Order::Stop(stop) => Target::Place(stop.target),
                    Order::Arrive { target, .. } => Target::Place(target),
                    Order::Move { distance, .. } => Target::Ahead(distance),
                    _ => Target::None,
                },
            ),
            _ => (None, Target::None),
        };
        Ended {
            text: step.text.clone(),
            command: verb(&step.instruction),
            train,
            target,
            achieved: None,
            error: None,
            promise: None,
            unseen: None,
            at: self.since_begin(time),
            refused: None,
        }
    }

    pub(super) fn notice(&mut self, now: Timestamp, notice: &DriveNotice) {
        if let Some(line) = self.tongue().line(notice) {
            self.say(line);
        }
        match notice {
            DriveNotice::Planned(plan) => {
                self.promises.insert(plan.order, plan.promise);
            }
            DriveNotice::Passed { train, passed, next } => {
                let passed_by = TrainPassed { train: *train, passed: *passed, next: *next };
                self.outputs.push_back(Output::Notice(Spoken::Passed(passed_by)));
                self.learning.passed(*train, &self.driver, passed);
                if let Some(wait) = &mut self.wait {
                    wait.is_met |= wait.until == Until::At(*train, passed.sensor);
                }
            }
            DriveNotice::Done(finished) => {
                self.done(finished);
                self.learn(now, finished);
            }
            DriveNotice::Lost { train } | DriveNotice::TurnoutLiesOtherwise { train, .. } => {
                self.learning.interrupt(*train);
            }
            DriveNotice::Thrown { order: Some(order), .. } => {
                if let Some(step) = self.pending.remove(order).filter(|step| !step.is_part) {
                    let ended = self.ended(now, &step);
                    self.outputs.push_back(Output::Notice(Spoken::Ended(ended)));
                }
            }
            DriveNotice::GivenUp { order, why, .. } => {
                self.promises.remove(order);
                if let Some(step) = self.pending.remove(order) {
                    self.refuse(now, &step, why);
                }
            }
            DriveNotice::Replaced { order, .. } => {
                self.promises.remove(order);
                self.pending.remove(order);
            }
            _ => {}
        }
    }

    fn done(&mut self, finished: &Finished) {
        self.promises.remove(&finished.order);
        let Some(step) = self.pending.remove(&finished.order) else { return };
        let achieved = finished.achieved;
        self.fell_short |= finished.unseen.is_some();
        let name = |achieved: Achieved| self.tongue().place(achieved.at);
        let ended = Ended {
            achieved: achieved.map(name),
            error: achieved.and_then(|achieved| achieved.error),
            promise: finished.promise,
            unseen: finished.unseen.map(|sensor| self.tongue().sensor(sensor).to_owned()),
            ..self.ended(finished.time, &step)
        };
        self.outputs.push_back(Output::Notice(Spoken::Ended(ended)));
    }
    /// What trains taught is used from the next order on. Only while all of them stand, so that nobody waits for it.
    fn learn(&mut self, now: Timestamp, finished: &Finished) {
        if finished.unseen.is_some() {
            self.learning.interrupt(finished.train);
        }
        let trains: Vec<TrainId> = self.trains.keys().copied().collect();
        if trains.iter().all(|train| self.driver.stands(*train, now))
            && let Some(model) = self.learning.model(finished.train)
        {
            self.driver.set_model(model);
        }
    }
}
