//! The results of instructions: refusals, notices of the dispatcher, ended orders, refitted models.

use footplate_core::control::{Achieved, Finished, Machine, Notice, Order, OrderId, Output, Refusal};
use footplate_core::model::MotionModel;
use footplate_core::track::Landmark;
use footplate_core::{Length, TimeSpan, Timestamp, TrainId};

use super::ScriptRunner;
use crate::commands::drive::formatter::{promises_broken, trains, verb};
use crate::commands::drive::instruction::{Instruction, Until};
use crate::commands::drive::script::Step;
use crate::commands::drive::session_message::{Ended, SessionMessage, Target};
use crate::dashboard::{Alarm, TrainPassed};

/// Warn about a train once its stop intervals are this much wider, one standard deviation (chosen: ±30 mm is visible at
/// a platform; no train of the usual simulated worlds reaches it).
const UNRELIABLE_FROM: Length = Length::from_mm(15.0);

/// No refit is computed if something is due within this time: one part takes less.
const DUE_SOON: TimeSpan = TimeSpan::from_ms(50);

impl ScriptRunner {
    pub(super) fn refuse(&mut self, now: Timestamp, step: &Step, why: &Refusal) {
        self.fell_short = true;
        self.note_refusal(step, &why.to_string());
        self.say(format!("refused `{}`: {why}", step.text));
        let ended = Ended { refused: Some(why.to_string()), ..self.ended(now, step) };
        self.outputs.push_back(Output::Notice(SessionMessage::Ended(ended)));
    }

    fn ended(&self, time: Timestamp, step: &Step) -> Ended {
        let (train, target) = match step.instruction {
            Instruction::Go(train, journey) => (Some(train), Target::Place(journey.target)),
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
            target_on_arrival: None,
            achieved: None,
            error: None,
            promise: None,
            unseen: None,
            at: self.since_begin(time),
            refused: None,
        }
    }

    /// Reports a notice and acts on it.
    pub(super) fn handle_notice(&mut self, now: Timestamp, notice: &Notice) {
        if let Some(mut line) = self.formatter().line(notice) {
            if let Notice::AuthorityEnds { train } = notice {
                let holders = self.dispatcher.holders_beyond(*train, now);
                if !holders.is_empty() {
                    line = format!(
                        "train {train} stopped: the track ahead is reserved for {}",
                        trains(&holders)
                    );
                    let alarm = Alarm::track_reserved(*train, &holders).said(&line);
                    self.outputs.push_back(Output::Notice(SessionMessage::Alarm(alarm)));
                }
            }
            if let Some(alarm) = Alarm::of_notice(self.driver().layout(), notice) {
                self.outputs.push_back(Output::Notice(SessionMessage::Alarm(alarm.said(&line))));
            }
            if !self.is_repeated(notice, &line) {
                self.say(line);
            }
        }
        if let Some(changed) = self.learning.take_notice(&mut self.dispatcher, notice) {
            self.refitted.remove(&changed);
            self.changed.insert(changed);
        }
        match notice {
            Notice::Planned(plan) => {
                self.promises.insert(plan.order, plan.promise);
            }
            Notice::Passed { train, passed, next } => {
                let passed_by = TrainPassed { train: *train, passed: *passed, next: *next };
                self.outputs.push_back(Output::Notice(SessionMessage::Passed(passed_by)));
                for wait in self.queues.waits_mut() {
                    wait.is_met |= wait.until == Until::At(*train, passed.sensor);
                }
            }
            Notice::Done(finished) => {
                self.done(finished);
                // Later orders use its result.
                self.learning.begin_refit(finished.train);
            }
            Notice::TurnoutThrown { order: Some(order), .. } => {
                if let Some(step) = self.pending.remove(order).filter(|step| !step.is_part) {
                    let ended = self.ended(now, &step);
                    self.outputs.push_back(Output::Notice(SessionMessage::Ended(ended)));
                }
            }
            Notice::GivenUp { order, train, why } => {
                self.promises.remove(order);
                self.rests.remove(train);
                if let Some(step) = self.pending.remove(order) {
                    self.cancelled(now, step, why);
                }
            }
            Notice::Replaced { order, train } => {
                self.promises.remove(order);
                let step = self.pending.remove(order);
                // No other line of a script replaces such a command: the recovery of its train did.
                if let Some(step) =
                    step.filter(|step| self.queues.is_script(step.queue) && ends_at_rest(step))
                {
                    self.cancelled(now, step, &Refusal::InDanger { train: *train });
                }
            }
            Notice::Resumed { interrupted: Some(interrupted), order, .. } => {
                if let Some(step) = self.pending.remove(interrupted) {
                    self.pending.insert(*order, step);
                }
            }
            Notice::Cancelled { train, interrupted, .. } => {
                if let Some(step) = self.pending.remove(interrupted) {
                    self.cancelled(now, step, &Refusal::InDanger { train: *train });
                }
            }
            Notice::NeedsOperator { .. } => self.fell_short = true,
            Notice::Arrived { order, train, error, .. } => self.arrived(now, *order, *train, *error),
            _ => {}
        }
    }

    /// Whether the same was said of this deadlock before, and the train has not arrived since.
    fn is_repeated(&mut self, notice: &Notice, line: &str) -> bool {
        match notice {
            Notice::Deadlock { train, .. } | Notice::Deadlocked { train } => {
                self.deadlocks.insert(*train, line.to_owned()).is_some_and(|before| before == line)
            }
            Notice::Arrived { train, .. } => {
                self.deadlocks.remove(train);
                false
            }
            _ => false,
        }
    }

    /// Ends a journey with the place where the train came to rest.
    fn arrived(&mut self, now: Timestamp, order: OrderId, train: TrainId, error: Option<Length>) {
        let Some(step) = self.pending.remove(&order) else { return };
        let rest = self.rests.remove(&train);
        let achieved = match &rest {
            Some(rest) => rest.achieved,
            None => self.rest_position(now, train),
        };
        let target_on_arrival = achieved.zip(error);
        let target_on_arrival = target_on_arrival
            .map(|(Achieved { at, .. }, error)| Landmark { offset: at.offset - error, ..at });
        let ended = Ended { error, target_on_arrival, ..self.ended(now, &step) };
        let achieved = achieved.map(|achieved| self.formatter().place(achieved.at));
        let ended = rest.map_or(ended.clone(), |rest| self.at_rest(&rest, ended));
        self.outputs.push_back(Output::Notice(SessionMessage::Ended(Ended { achieved, ..ended })));
    }

    /// What a line asked for was cancelled: a script tries it again once the train can be driven, or the line is refused.
    fn cancelled(&mut self, now: Timestamp, step: Step, why: &Refusal) {
        if self.is_retried(&step, why) {
            self.say(format!("`{}` waits: {why}", step.text));
            self.queues.push_front(Step { is_retry: true, ..step });
        } else {
            self.refuse(now, &step, why);
        }
    }

    fn done(&mut self, finished: &Finished) {
        self.promises.remove(&finished.order);
        self.rests.insert(finished.train, *finished);
        let Some(step) = self.pending.remove(&finished.order).filter(|step| !step.is_part) else { return };
        self.fell_short |= finished.unseen.is_some();
        let ended = Ended {
            error: finished.achieved.and_then(|achieved| achieved.error),
            ..self.ended(finished.time, &step)
        };
        let ended = self.at_rest(finished, ended);
        self.outputs.push_back(Output::Notice(SessionMessage::Ended(ended)));
    }

    /// The place of a train that was stopped before the end of its run.
    fn rest_position(&self, now: Timestamp, train: TrainId) -> Option<Achieved> {
        let located = self.driver().locate(train, now)?;
        let at = self.driver().landmark(train, located.at)?;
        Some(Achieved { at, uncertainty: located.uncertainty, error: None })
    }

    /// Adds the place of rest, and the interval that was predicted for it.
    fn at_rest(&self, rest: &Finished, ended: Ended) -> Ended {
        let name = |achieved: Achieved| self.formatter().place(achieved.at);
        Ended {
            achieved: rest.achieved.map(name),
            promise: rest.promise,
            unseen: rest.unseen.map(|sensor| self.formatter().sensor(sensor).to_owned()),
            ..ended
        }
    }

    /// Computes the next part of a refit unless something is due, and replaces the models of trains at rest. A moving
    /// train keeps the model that its order was planned with.
    pub(super) fn continue_refit(&mut self, now: Timestamp) {
        let is_free = self.dispatcher.next_timeout().is_none_or(|due| due > now + DUE_SOON);
        if is_free && let Some(model) = self.learning.advance_refit() {
            self.refitted.insert(model.train(), model);
        }
        let is_at_rest = |train: &TrainId| self.driver().is_at_rest(*train, now);
        let at_rest: Vec<TrainId> = self.refitted.keys().copied().filter(is_at_rest).collect();
        for model in at_rest.iter().filter_map(|train| self.refitted.remove(train)).collect::<Vec<_>>() {
            self.use_model(model);
        }
    }

    fn use_model(&mut self, model: MotionModel) {
        let (train, unexplained) = (model.train(), model.unexplained_scatter());
        self.dispatcher.set_model(model);
        if unexplained >= UNRELIABLE_FROM && self.unreliable.insert(train) {
            let line = promises_broken(train, unexplained);
            let alarm = Alarm::promises_broken(train, unexplained).said(&line);
            self.outputs.push_back(Output::Notice(SessionMessage::Alarm(alarm)));
            self.say(line);
        }
    }
}

/// Whether what a line asks for ends with its train at rest.
const fn ends_at_rest(step: &Step) -> bool {
    matches!(step.instruction, Instruction::Order(Order::Stop(_) | Order::Move { .. } | Order::Arrive { .. }))
}
