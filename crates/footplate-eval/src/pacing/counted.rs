//! The driver of the trains of a score, with a count of its commands.

use std::collections::BTreeMap;

use footplate_core::control::{
    Dispatcher, Driver, Machine, Notice, Order, OrderId, Output, Refusal, TrainLengths,
};
use footplate_core::{Command, Event, Timestamp, TrainId};
use footplate_wire::LinkNotice;

use crate::testbed::VirtualLine;

/// The driver of a train.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum By {
    Footplate,
    /// Footplate with a motion model made from the truth: what is left is what no calibration could remove.
    Oracle,
    /// A driver that only knows the speeds of steps.
    Step,
}

impl By {
    pub(super) const ALL: [Self; 3] = [Self::Footplate, Self::Oracle, Self::Step];

    /// Its name in tables; `step` is what the one does that only knows the speeds of steps.
    pub(super) const fn key(self, step: &'static str) -> &'static str {
        match self {
            Self::Footplate => "footplate",
            Self::Oracle => "oracle",
            Self::Step => step,
        }
    }
}

/// What is above the driver.
enum Control {
    /// The dispatcher with its watchdog, as in operation.
    Dispatched(Box<Dispatcher>),
    /// The driver alone, for simpler methods.
    Bare(Box<Driver>),
}

/// A driver that counts the steps commanded to each train.
pub(super) struct Counted {
    control: Control,
    steps: BTreeMap<TrainId, usize>,
}

impl Counted {
    /// Drives through the dispatcher and its watchdog.
    pub(super) fn dispatched(now: Timestamp, driver: Driver) -> Self {
        let control = Control::Dispatched(Box::new(Dispatcher::watched(now, driver)));
        Self { control, steps: BTreeMap::new() }
    }

    /// Drives with the driver alone.
    pub(super) fn bare(driver: Driver) -> Self {
        Self { control: Control::Bare(Box::new(driver)), steps: BTreeMap::new() }
    }

    pub(super) const fn driver(&self) -> &Driver {
        match &self.control {
            Control::Dispatched(dispatcher) => dispatcher.driver(),
            Control::Bare(driver) => driver,
        }
    }

    /// Sets the lengths of a train.
    pub(super) fn set_lengths(&mut self, now: Timestamp, train: TrainId, lengths: TrainLengths) {
        match &mut self.control {
            Control::Dispatched(dispatcher) => dispatcher.set_lengths(now, train, lengths),
            Control::Bare(driver) => driver.set_reach(train, lengths.ahead(), lengths.behind()),
        }
    }

    pub(super) fn order(&mut self, now: Timestamp, order: Order) -> Result<OrderId, Refusal> {
        match &mut self.control {
            Control::Dispatched(dispatcher) => dispatcher.order(now, order),
            Control::Bare(driver) => driver.order(now, order),
        }
    }

    /// The number of steps commanded to a train so far.
    pub(super) fn steps(&self, train: TrainId) -> usize {
        self.steps.get(&train).copied().unwrap_or_default()
    }

    /// Drives until a notice or a time.
    pub(super) fn drive(&mut self, line: &mut VirtualLine<'_>, until: Timestamp) -> Option<Notice> {
        line.drive_hearing(self, until, |counted, now, notice: &LinkNotice| {
            if let (Control::Dispatched(dispatcher), Some(news)) = (&mut counted.control, notice.news()) {
                dispatcher.handle_link(now, news);
            }
        })
    }
}

/// The train whose order failed according to a notice, with the number of the order if there is one, and the reason.
pub(super) fn cut_short(notice: &Notice) -> Option<(TrainId, Option<OrderId>, String)> {
    match notice {
        Notice::GivenUp { train, order, why } => Some((*train, Some(*order), why.to_string())),
        Notice::Cancelled { train, .. } => {
            Some((*train, None, "its order was cancelled while it was located again".to_owned()))
        }
        _ => None,
    }
}

impl Machine for Counted {
    type Notice = Notice;

    fn handle_event(&mut self, now: Timestamp, event: &Event) {
        match &mut self.control {
            Control::Dispatched(dispatcher) => dispatcher.handle_event(now, event),
            Control::Bare(driver) => driver.handle_event(now, event),
        }
    }

    fn handle_timeout(&mut self, now: Timestamp) {
        match &mut self.control {
            Control::Dispatched(dispatcher) => dispatcher.handle_timeout(now),
            Control::Bare(driver) => driver.handle_timeout(now),
        }
    }

    fn poll_output(&mut self) -> Option<Output<Notice>> {
        let output = match &mut self.control {
            Control::Dispatched(dispatcher) => dispatcher.poll_output()?,
            Control::Bare(driver) => driver.poll_output()?,
        };
        if let Output::Command(Command::Speed { train, .. }) = output {
            *self.steps.entry(train).or_default() += 1;
        }
        Some(output)
    }

    fn next_timeout(&self) -> Option<Timestamp> {
        match &self.control {
            Control::Dispatched(dispatcher) => dispatcher.next_timeout(),
            Control::Bare(driver) => driver.next_timeout(),
        }
    }
}
