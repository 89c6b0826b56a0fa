//! What the lines of a script wait for: a train that finishes an order or is recovered, a time, a detection.

use footplate_core::control::{Order, OrderId, Refusal};
use footplate_core::{SpeedStep, TimeSpan, Timestamp, TrainId};

use super::ScriptRunner;
use super::queue::Queues;
use crate::commands::drive::instruction::{Instruction, Until};
use crate::commands::drive::script::{QueueId, Step};

/// How often to check whether a train is at rest.
pub(super) const CHECK_INTERVAL: TimeSpan = TimeSpan::from_ms(100);

impl ScriptRunner {
    /// When the oldest journey of a script exceeds the wait limit.
    pub(super) fn journey_deadline(&self) -> Option<Timestamp> {
        let first = self.journeys.iter().filter(|(order, _)| self.is_of_script(**order));
        first.map(|(_, since)| *since + self.wait_limit).min()
    }

    /// Whether a script gave the order of a journey that has not ended.
    fn is_of_script(&self, order: OrderId) -> bool {
        self.pending.get(&order).is_some_and(|step| self.queues.is_script(step.queue))
    }

    /// Cancels the journeys of a script that exceed the wait limit.
    pub(super) fn cancel_late_journeys(&mut self, now: Timestamp) {
        // Those that have ended: a day of them would be looked through in every turn of the loop.
        self.journeys.retain(|order, _| self.pending.contains_key(order));
        if self.journey_deadline().is_none_or(|at| now < at) {
            return;
        }
        for train in self.trains.keys().copied().collect::<Vec<_>>() {
            let Some((order, _)) = self.dispatcher.journey(train) else { continue };
            let is_early = self.journeys.get(&order).is_none_or(|since| now < *since + self.wait_limit);
            if is_early || !self.is_of_script(order) {
                continue;
            }
            self.dispatcher.cancel_journey(now, train);
            if let Some(step) = self.pending.remove(&order) {
                self.refuse(now, &step, &Refusal::NotArrived { train, within: self.wait_limit });
            }
        }
        self.forward_outputs(now);
    }

    /// Whether a line of a script has to wait: for the previous order of its train, for a turnout, or for a train that
    /// brakes or is being recovered.
    pub(super) fn must_wait(&mut self, now: Timestamp, queue: QueueId, instruction: &Instruction) -> bool {
        let is_turnout = |step: &Step| matches!(step.instruction, Instruction::Order(Order::Turnout { .. }));
        let (train, is_stop) = match instruction {
            Instruction::Order(order) => {
                (order.train(), matches!(order, Order::Speed { step: SpeedStep::STAND, .. }))
            }
            Instruction::Go(train, _) => (Some(*train), false),
            _ => return false,
        };
        if train.is_some_and(|train| !is_stop && self.is_blocked_for_now(now, queue, train)) {
            return true;
        }
        let is_busy = train.is_some_and(|train| self.has_finite_order(train));
        let is_of_turnout = matches!(instruction, Instruction::Order(Order::Turnout { .. }));
        is_busy || !is_of_turnout && self.pending.values().any(is_turnout)
    }

    /// Whether the train is at rest and its model is being refitted.
    pub(super) fn waits_for_model(&self, now: Timestamp, instruction: &Instruction) -> bool {
        let train = match instruction {
            Instruction::Order(order) => order.train(),
            Instruction::Go(train, _) => Some(*train),
            _ => None,
        };
        train
            .is_some_and(|train| self.learning.is_refitting_to(train) && self.driver().is_at_rest(train, now))
    }

    /// Whether a train cannot be driven at present but may be soon. Beyond the wait limit the order is tried anyway, so
    /// that its refusal says why.
    fn is_blocked_for_now(&mut self, now: Timestamp, queue: QueueId, train: TrainId) -> bool {
        let comes_to_rest =
            self.driver().commanded(train) == SpeedStep::STAND && !self.driver().is_at_rest(train, now);
        let is_blocked = comes_to_rest || self.dispatcher.is_interrupted(now, train);
        let Some(queue) = self.queues.get_mut(queue) else { return false };
        if !is_blocked {
            queue.interrupted = None;
            return false;
        }
        now - *queue.interrupted.get_or_insert(now) < self.wait_limit
    }

    /// Whether a given-up order is retried: in a script, once, if the order has a target and its train was lost on the
    /// route.
    pub(super) fn is_retried(&self, step: &Step, why: &Refusal) -> bool {
        let is_to_place =
            matches!(step.instruction, Instruction::Order(Order::Stop(_) | Order::Arrive { .. }));
        let was_lost = matches!(why, Refusal::Lost { .. } | Refusal::InDanger { .. });
        self.queues.is_script(step.queue) && !step.is_retry && is_to_place && was_lost
    }

    /// Takes a line of an operator. It ends a wait, and a search if it is for the train that is searched for. What stops a train waits
    /// for nothing.
    pub(super) fn hear(&mut self, now: Timestamp, step: Step) {
        let is_at_once = step.instruction.is_at_once() && !self.waits_for_others(now, &step.instruction);
        let Some(session) = self.queues.get_mut(QueueId::SESSION) else { return };
        let train = step.instruction.driven();
        let searched = session.wait.filter(|wait| wait.is_part).and_then(|wait| wait.until.train());
        let is_stop = step.instruction.is_plain_stop();
        if is_stop || searched.is_some() && searched == train {
            session.steps.retain(|waiting| waiting.instruction.concerned() != train);
            session.wait = session.wait.filter(|wait| wait.until.train() != train);
        }
        if is_stop {
            self.carry_out(now, step);
        } else if searched.is_some() && searched != train && is_at_once {
            // Not searched for in its turn: that would wait behind this search.
            self.carry_out(now, Step { is_retry: true, ..step });
        } else {
            session.wait = session.wait.filter(|wait| wait.is_part);
            session.steps.push_back(step);
        }
    }

    /// Has a lost train run to a sensor and stop before its order is carried out.
    pub(super) fn locate_first(&mut self, train: TrainId, step: &Step) {
        self.say(format!("train {train} is located first"));
        self.queues.push_front(Step { is_retry: true, ..step.clone() });
        self.find(train, step);
    }

    /// Has a train run to a sensor and stop there, before all other steps.
    pub(super) fn find(&mut self, train: TrainId, step: &Step) {
        let speed = |step| Instruction::Order(Order::Speed { train, step });
        let parts = [
            speed(self.driver().finding_step(train)),
            Instruction::Wait(Until::Located(train)),
            speed(SpeedStep::STAND),
            Instruction::Wait(Until::AtRest(train)),
        ];
        for instruction in parts.into_iter().rev() {
            let part = Step { instruction, is_part: true, is_retry: true, ..step.clone() };
            self.queues.push_front(part);
        }
    }

    /// Whether a train carries out something that ends by itself.
    fn has_finite_order(&self, train: TrainId) -> bool {
        let order = self.dispatcher.interrupted(train).or_else(|| self.driver().busy(train));
        let is_open_ended = order.and_then(|order| self.pending.get(&order)).is_some_and(is_open_ended);
        self.dispatcher.journey(train).is_some() || order.is_some() && !is_open_ended
    }

    /// Whether a train has neither an order nor a journey, nor one that a recovery interrupted.
    pub(super) fn is_idle(&self, train: TrainId) -> bool {
        self.driver().busy(train).is_none()
            && self.dispatcher.journey(train).is_none()
            && self.dispatcher.interrupted(train).is_none()
    }

    /// Whether the steps of a queue need not wait; a wait that is over is removed.
    pub(super) fn may_advance(&mut self, now: Timestamp, queue: QueueId) -> bool {
        let Some(wait) = self.queues.get(queue).and_then(|queue| queue.wait) else { return true };
        let met = wait.is_met
            || match wait.until {
                Until::Passed(span) => now - wait.since >= span,
                Until::AtRest(train) => self.is_idle(train) && self.driver().is_at_rest(train, now),
                Until::Located(train) => self.driver().locate(train, now).is_some(),
                Until::At(..) => false,
            };
        let end = |queues: &mut Queues| queues.get_mut(queue).map(|queue| queue.wait.take());
        if met {
            end(&mut self.queues);
        } else if let Until::AtRest(train) = wait.until
            && self.is_idle(train)
            && self.driver().commanded(train) > SpeedStep::STAND
        {
            end(&mut self.queues);
            self.fell_short = true;
            self.say(format!(
                "train {train} has no command that would bring it to rest; the script goes \
                              on"
            ));
            return true;
        } else if let Some(train) = self.searched_by(&wait)
            && now - wait.since >= self.limit_of(&wait)
        {
            end(&mut self.queues);
            self.say(format!(
                "train {train} was not found within {:.0} s: if it is on the track, enter where it is, for example \
                 `place {train} at C13`",
                self.limit_of(&wait).as_s()
            ));
            return true;
        } else if !matches!(wait.until, Until::Passed(_)) && now - wait.since >= self.wait_limit {
            end(&mut self.queues);
            self.fell_short = true;
            self.say(format!(
                "nothing happened within {:.0} s; the script continues",
                self.wait_limit.as_s()
            ));
            return true;
        }
        met
    }
}

/// Whether an order continues until another one replaces it.
pub(super) fn is_open_ended(step: &Step) -> bool {
    matches!(step.instruction, Instruction::Order(Order::Hold { .. } | Order::Follow { .. }))
}

#[cfg(test)]
mod tests {
    use footplate_core::Command;
    use footplate_core::control::{Machine as _, Output};

    use super::super::schedules::tests::runner;
    use super::*;
    use crate::recorded::{Input, Listener as _};

    const T24: TrainId = TrainId(24);
    const T58: TrainId = TrainId(58);

    /// An operator's session with two trains whose places are unknown, 24 being searched for.
    fn searching() -> ScriptRunner {
        let mut runner = runner(&[T24, T58]);
        runner.handle_word(Timestamp::from_s(1.0), &Input::Line("speed 58 8".to_owned()));
        runner.handle_word(Timestamp::from_s(2.0), &Input::Line("find 24".to_owned()));
        assert!(speeds(&mut runner).iter().any(|(train, step)| *train == T24 && *step > 0));
        runner
    }

    /// The commanded speeds since the last call.
    fn speeds(runner: &mut ScriptRunner) -> Vec<(TrainId, u8)> {
        let outputs = std::iter::from_fn(|| runner.poll_output());
        let speed = |output| match output {
            Output::Command(Command::Speed { train, step }) => Some((train, step.get())),
            _ => None,
        };
        outputs.filter_map(speed).collect()
    }

    #[test]
    fn a_stop_overtakes_a_search_which_goes_on() {
        let mut runner = searching();
        runner.handle_word(Timestamp::from_s(3.0), &Input::Line("stop 58".to_owned()));
        assert_eq!(speeds(&mut runner), [(T58, 0)]);
        runner.handle_word(Timestamp::from_s(4.0), &Input::Line("light 58 on".to_owned()));
        assert_eq!(speeds(&mut runner), []);
        assert_eq!(runner.driver().commanded(T24), runner.driver().finding_step(T24));
    }

    #[test]
    fn a_line_for_the_train_that_is_searched_for_ends_the_search() {
        for (line, expected) in [("stop 24", (T24, 0)), ("speed 24 9", (T24, 9))] {
            let mut runner = searching();
            runner.handle_word(Timestamp::from_s(3.0), &Input::Line(line.to_owned()));
            assert_eq!(speeds(&mut runner), [expected]);
            // Nothing of the search is left.
            runner.handle_timeout(Timestamp::from_s(3.1));
            assert_eq!(speeds(&mut runner), []);
        }
    }
}
