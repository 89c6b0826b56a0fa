//! Orders: which are carried out now, and those of recoveries.

use alloc::vec::Vec;

use crate::control::drive::{Order, OrderId};
use crate::control::{Notice, Refusal};
use crate::ids::{SpeedStep, TrainId};
use crate::time::Timestamp;

use super::recovery_phase::RecoveryPhase;
use super::watchdog::Watchdog;

impl Watchdog {
    /// Carries out an order; see [`Driver::order`](crate::control::Driver::order).
    ///
    /// # Errors
    /// As [`Driver::order`](crate::control::Driver::order), and if the train is held, the station silent or the power off.
    pub fn order(&mut self, now: Timestamp, order: Order) -> Result<OrderId, Refusal> {
        self.check(now, &order)?;
        self.carry_out(now, order)
    }

    /// Carries out an order that was checked.
    pub(in crate::control) fn carry_out(&mut self, now: Timestamp, order: Order) -> Result<OrderId, Refusal> {
        if let Order::Speed { train, step: SpeedStep::STAND } = order {
            // What an operator has stopped stays at rest until an operator moves it, also if it only waits to be located.
            self.need_operator(now, train);
        } else if let Some(train) = self.trusted_by(&order) {
            self.trust_again(train);
        }
        self.give(now, order)
    }

    /// The train that an order trusts again although its recovery was given up: the only one, which an operator runs over a sensor to
    /// locate it.
    fn trusted_by(&self, order: &Order) -> Option<TrainId> {
        let Order::Speed { train, .. } = order else { return None };
        let is_given_up =
            self.dangers.get(train).is_some_and(|danger| danger.phase == RecoveryPhase::GivenUp);
        (is_given_up && self.driver.trains().count() == 1).then_some(*train)
    }

    /// Refuses an order that is not carried out now.
    pub(in crate::control) fn check(&self, now: Timestamp, order: &Order) -> Result<(), Refusal> {
        self.driver.check(order)?;
        let stops = matches!(order, Order::Speed { step: SpeedStep::STAND, .. });
        let Some(train) = order.train().filter(|_| !stops) else { return Ok(()) };
        let is_trusted = self.trusted_by(order).is_some();
        let is_blocked =
            if is_trusted { self.has_intruder() } else { self.is_held(train) || self.could_meet(now, train) };
        if is_blocked {
            let is_moved = (is_trusted || self.dangers.is_empty()) && self.has_intruder();
            return Err(if is_moved { Refusal::TrackNotClear } else { Refusal::InDanger { train } });
        }
        if self.noise.is_on() {
            return Err(Refusal::Noise);
        }
        if self.is_silent() {
            return Err(Refusal::NoAnswer);
        }
        if !self.is_powered() {
            return Err(Refusal::NoPower);
        }
        if matches!(order, Order::Reverse { .. })
            && self.driver.is_at_rest(train, now)
            && let Some(need) = self.driver.missing_for_reversal(now, train)
        {
            let (turnout, curved) = (need.turnout, need.leg.is_curved());
            return Err(Refusal::PositionLost { train, turnout, curved });
        }
        Ok(())
    }

    /// Stops a train, as a dispatcher: its recovery goes on.
    pub(in crate::control) fn halt(&mut self, now: Timestamp, train: TrainId) {
        let _ = self.give(now, Order::Speed { train, step: SpeedStep::STAND });
    }

    fn give(&mut self, now: Timestamp, order: Order) -> Result<OrderId, Refusal> {
        let id = self.driver.order(now, order)?;
        if let Some(train) = order.train() {
            if matches!(order, Order::Speed { step: SpeedStep::STAND, .. }) {
                self.unfinished.remove(&train);
                if let Some((order, _)) = self.held.get_mut(&train).and_then(Option::take) {
                    self.notify(Notice::Replaced { order, train });
                }
            } else {
                self.unfinished.insert(train, (id, order));
            }
        }
        self.act(now);
        Ok(id)
    }

    /// Restores the earlier model of a train that could not be recovered, after an operator has checked it.
    pub(super) fn trust_again(&mut self, train: TrainId) {
        let given_up = self.dangers.get(&train).filter(|danger| danger.phase == RecoveryPhase::GivenUp);
        if let Some(base) = given_up.map(|danger| danger.base().clone()) {
            self.driver.set_model(base);
            self.forget(train);
        }
    }

    /// Gives an order of a recovery.
    pub(super) fn issue(&mut self, now: Timestamp, order: Order) -> Option<OrderId> {
        let id = self.driver.order(now, order).ok()?;
        if let Some(train) = order.train() {
            self.own.insert(id, train);
        }
        Some(id)
    }

    /// The order of a train that a recovery has interrupted and that may go on after it.
    pub(in crate::control) fn interrupted(&self, train: TrainId) -> Option<(OrderId, Order)> {
        let of_recovery = self.dangers.get(&train).and_then(|recovery| recovery.interrupted);
        let order = of_recovery.or_else(|| self.held.get(&train).copied().flatten());
        order.filter(|(_, order)| self.goes_on(order))
    }

    /// Whether an order that was interrupted will be given again.
    pub(super) fn will_resume(&self, train: TrainId, order: OrderId) -> bool {
        self.interrupted(train).is_some_and(|(interrupted, _)| interrupted == order)
    }

    /// Whether an order goes on by itself after a recovery. An operator who drives with a dispatcher starts other trains again.
    const fn goes_on(&self, order: &Order) -> bool {
        self.is_watching()
            && match order {
                Order::Hold { .. } | Order::Follow { .. } | Order::Arrive { .. } => true,
                // The progress of a move or a reversal is unknown.
                Order::Move { .. } | Order::Reverse { .. } => false,
                Order::Speed { .. } | Order::Stop(_) | Order::Turnout { .. } => self.permits_all,
            }
    }

    /// Carries out the order that a recovery had interrupted, leaves that to the dispatcher, or cancels it.
    pub(super) fn resume(&mut self, now: Timestamp, train: TrainId, id: OrderId, order: Order) {
        let can_go_on = self.goes_on(&order);
        if can_go_on && !self.permits_all {
            return self.interrupted.push((train, (id, order)));
        }
        let resumed = if can_go_on { self.order(now, order).ok() } else { None };
        match resumed {
            Some(order) => self.notify(Notice::Resumed { train, interrupted: Some(id), order }),
            None => self.cancel(train, id, order),
        }
    }

    /// Says that an interrupted order does not go on.
    pub(super) fn cancel(&mut self, train: TrainId, interrupted: OrderId, order: Order) {
        self.notify(Notice::Cancelled { train, interrupted, order });
    }

    /// The orders that recoveries interrupted, for the dispatcher to give again.
    pub(in crate::control) fn take_interrupted(&mut self) -> Vec<(TrainId, (OrderId, Order))> {
        core::mem::take(&mut self.interrupted)
    }
}
