//! Orders of trains driven by hand that a recovery interrupted: they are given again once their trains can be driven.

use alloc::vec::Vec;

use crate::control::Notice;
use crate::control::drive::{Order, OrderId, Refusal};
use crate::ids::TrainId;
use crate::time::{TimeSpan, Timestamp};

use super::dispatched_train::InterruptedOrder;
use super::dispatcher::Dispatcher;

/// The time between two attempts.
const TRY_EVERY: TimeSpan = TimeSpan::from_s(1.0);
/// A train that can no longer arrive in time gets the shortest possible time, and this factor for what it predicts anew.
const SLACK: f64 = 1.02;

impl Dispatcher {
    /// Sets how long an order that a recovery interrupted is tried again.
    pub const fn set_wait_limit(&mut self, limit: TimeSpan) {
        self.wait_limit = limit;
    }

    /// The order of a train that a recovery interrupted, and that goes on after it.
    pub fn interrupted(&self, train: TrainId) -> Option<OrderId> {
        let own = || Some(self.trains.get(&train)?.interrupted?.id);
        self.watchdog.interrupted(train).map(|(id, _)| id).or_else(own)
    }

    /// Gives interrupted orders again whose trains are at rest and free. Returns whether there was one.
    pub(super) fn resume_interrupted(&mut self, now: Timestamp) -> bool {
        for (train, (id, order)) in self.watchdog.take_interrupted() {
            if let Some(known) = self.trains.get_mut(&train) {
                known.interrupted = Some(InterruptedOrder { id, order, since: now, tried: None });
            }
        }
        if self.watchdog.has_danger() {
            return false;
        }
        let is_due =
            |interrupted: &InterruptedOrder| interrupted.tried.is_none_or(|tried| now - tried >= TRY_EVERY);
        let ready = self.trains.values().filter(|train| train.is_ready(now));
        let due: Vec<(TrainId, InterruptedOrder)> =
            ready.filter_map(|train| Some((train.id, train.interrupted.filter(is_due)?))).collect();
        for (train, interrupted) in &due {
            self.try_again(now, *train, *interrupted);
        }
        !due.is_empty()
    }

    fn try_again(&mut self, now: Timestamp, train: TrainId, interrupted: InterruptedOrder) {
        let InterruptedOrder { id, order, since, .. } = interrupted;
        let taken = self.give_in_time(now, order);
        let Some(known) = self.trains.get_mut(&train) else { return };
        match taken {
            Ok(order) => {
                known.interrupted = None;
                self.notify(Notice::Resumed { train, interrupted: Some(id), order });
            }
            Err(why)
                if (why.is_passing() || matches!(why, Refusal::Lost { .. }))
                    && now - since < self.wait_limit =>
            {
                known.interrupted = Some(InterruptedOrder { tried: Some(now), ..interrupted });
            }
            Err(why) => {
                known.interrupted = None;
                self.notify(Notice::GivenUp { order: id, train, why });
            }
        }
    }

    /// Gives an order again; one to arrive for the time that it had, or for the earliest that is still possible.
    fn give_in_time(&mut self, now: Timestamp, order: Order) -> Result<OrderId, Refusal> {
        let Order::Arrive { train, target, within } = order else { return self.give(now, order) };
        let by = self.trains.get(&train).and_then(|train| train.arrives_by);
        let within = by.map_or(within, |by| (by - now).max(TRY_EVERY));
        match self.give(now, Order::Arrive { train, target, within }) {
            Err(Refusal::TooSoon { earliest, .. }) => {
                let within = TimeSpan::from_s(SLACK * earliest.as_s());
                self.give(now, Order::Arrive { train, target, within })
            }
            taken => taken,
        }
    }

    /// An operator drives the train otherwise: its interrupted order ends.
    pub(super) fn drop_interrupted(&mut self, train: TrainId) {
        let known = self.trains.get_mut(&train);
        if let Some(InterruptedOrder { id: order, .. }) = known.and_then(|train| train.interrupted.take()) {
            self.notify(Notice::Replaced { order, train });
        }
    }
}
