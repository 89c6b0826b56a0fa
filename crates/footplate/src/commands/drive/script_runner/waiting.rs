//! What the lines of a script wait for: a train to end what it does or to be brought back, time, contacts.

use footplate_core::control::{Order, Refusal};
use footplate_core::{SpeedStep, TimeSpan, Timestamp, TrainId};

use super::{Giver, ScriptRunner};
use crate::commands::drive::instruction::{Instruction, Until};
use crate::commands::drive::script::Step;

/// How often it is looked whether a train stands.
pub(super) const LOOK_AGAIN: TimeSpan = TimeSpan::from_ms(100);

/// The line that is waited at.
#[derive(Debug, Clone, Copy)]
pub(super) struct Wait {
    pub(super) until: Until,
    pub(super) since: Timestamp,
    pub(super) is_met: bool,
}

impl ScriptRunner {
    /// When the first journey of a script has lasted too long.
    pub(super) fn tires(&self) -> Option<Timestamp> {
        let asked = self.journeys.iter().filter(|(order, _)| self.pending.contains_key(order));
        let first = asked.map(|(_, since)| *since).min().filter(|_| self.giver == Giver::Script);
        first.map(|since| since + self.wait_limit)
    }

    /// Calls off the journeys of a script that have lasted too long.
    pub(super) fn tire_of_waiting(&mut self, now: Timestamp) {
        if self.tires().is_none_or(|at| now < at) {
            return;
        }
        for train in self.trains.keys().copied().collect::<Vec<_>>() {
            let Some((order, _)) = self.dispatcher.journey(train) else { continue };
            if self.journeys.get(&order).is_none_or(|since| now < *since + self.wait_limit) {
                continue;
            }
            self.dispatcher.call_off(now, train);
            if let Some(step) = self.pending.remove(&order) {
                self.refuse(now, &step, &Refusal::NotArrived { train, within: self.wait_limit });
            }
        }
        self.journeys.retain(|order, _| self.pending.contains_key(order));
        self.hand_on(now);
    }

    /// In a script a train ends one order before it begins the next, what follows a turnout follows it, and a train that
    /// comes to rest or is being brought back is waited for.
    pub(super) fn must_wait(&mut self, now: Timestamp, instruction: Instruction) -> bool {
        let is_turnout = |step: &Step| matches!(step.instruction, Instruction::Order(Order::Turnout { .. }));
        let (train, stands) = match instruction {
            Instruction::Order(order) => {
                (order.train(), matches!(order, Order::Speed { step: SpeedStep::STAND, .. }))
            }
            Instruction::Go(train, _) => (Some(train), false),
            _ => return false,
        };
        if train.is_some_and(|train| !stands && self.is_kept_waiting(now, train)) {
            return true;
        }
        let is_busy = train.is_some_and(|train| self.must_end(train));
        let is_of_turnout = matches!(instruction, Instruction::Order(Order::Turnout { .. }));
        is_busy || !is_of_turnout && self.pending.values().any(is_turnout)
    }

    /// Whether a train stands of which is being learnt how it moves.
    pub(super) fn waits_for_model(&self, now: Timestamp, instruction: Instruction) -> bool {
        let train = match instruction {
            Instruction::Order(order) => order.train(),
            Instruction::Go(train, _) => Some(train),
            _ => None,
        };
        train.is_some_and(|train| self.learning.is_fitting_to(train) && self.driver().is_at_rest(train, now))
    }

    /// Whether a train cannot be driven now and may be soon; not for ever, so that in the end it is refused and said why.
    fn is_kept_waiting(&mut self, now: Timestamp, train: TrainId) -> bool {
        let comes_to_rest =
            self.driver().commanded(train) == SpeedStep::STAND && !self.driver().is_at_rest(train, now);
        if !comes_to_rest && !self.dispatcher.is_interrupted(now, train) {
            self.interrupted = None;
            return false;
        }
        now - *self.interrupted.get_or_insert(now) < self.wait_limit
    }

    /// Whether what was given up is taken up again: in a script, once, where it was because its train was lost on the way, and
    /// it is to a place.
    pub(super) fn takes_up_again(&self, step: &Step, why: &Refusal) -> bool {
        let is_to_place =
            matches!(step.instruction, Instruction::Order(Order::Stop(_) | Order::Arrive { .. }));
        let was_lost = matches!(why, Refusal::Lost { .. } | Refusal::InDanger { .. });
        self.giver == Giver::Script && !step.is_again && is_to_place && was_lost
    }

    /// Lets a train that nobody has seen run over a contact and come to rest, before what was asked for.
    pub(super) fn find_first(&mut self, train: TrainId, step: Step) {
        self.say(format!("train {train} is located first"));
        let speed = |step| Instruction::Order(Order::Speed { train, step });
        let parts = [
            speed(self.driver().finding_step(train)),
            Instruction::Wait(Until::Located(train)),
            speed(SpeedStep::STAND),
            Instruction::Wait(Until::AtRest(train)),
        ];
        let text = step.text.clone();
        self.steps.push_front(Step { is_again: true, ..step });
        for instruction in parts.into_iter().rev() {
            self.steps.push_front(Step { text: text.clone(), instruction, is_part: true, is_again: true });
        }
    }

    /// Whether a train is busy with something that ends by itself.
    fn must_end(&self, train: TrainId) -> bool {
        let order = self.driver().busy(train);
        let runs_on = order.and_then(|order| self.pending.get(&order)).is_some_and(runs_on);
        self.dispatcher.journey(train).is_some() || order.is_some() && !runs_on
    }

    /// Whether a train has nothing to do.
    pub(super) fn is_idle(&self, train: TrainId) -> bool {
        self.driver().busy(train).is_none() && self.dispatcher.journey(train).is_none()
    }

    pub(super) fn may_go_on(&mut self, now: Timestamp) -> bool {
        let Some(wait) = self.wait else { return true };
        let met = wait.is_met
            || match wait.until {
                Until::Passed(span) => now - wait.since >= span,
                Until::AtRest(train) => self.is_idle(train) && self.driver().is_at_rest(train, now),
                Until::Located(train) => self.driver().locate(train, now).is_some(),
                Until::At(..) => false,
            };
        if met {
            self.wait = None;
        } else if let Until::AtRest(train) = wait.until
            && self.is_idle(train)
            && self.driver().commanded(train) > SpeedStep::STAND
        {
            self.wait = None;
            self.fell_short = true;
            self.say(format!(
                "train {train} has no command that would bring it to rest; the script goes \
                              on"
            ));
            return true;
        } else if !matches!(wait.until, Until::Passed(_)) && now - wait.since >= self.wait_limit {
            self.wait = None;
            self.fell_short = true;
            self.say(format!("nothing happened within {:.0} s; the script goes on", self.wait_limit.as_s()));
            return true;
        }
        met
    }
}

/// Whether what a line asks for goes on until something else is asked for.
pub(super) fn runs_on(step: &Step) -> bool {
    matches!(step.instruction, Instruction::Order(Order::Hold { .. } | Order::Follow { .. }))
}
