//! The driver of the trains of a score, with a count of its commands.

use std::collections::BTreeMap;

use footplate_core::control::{
    Dispatcher, Driver, Learning, Machine, Notice, Order, OrderId, Output, Refusal, TrainLengths,
};
use footplate_core::model::MotionFit;
use footplate_core::track::Layout;
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
    /// The dispatcher with its watchdog, and with what a session learns if fits are given, as in operation.
    Dispatched(Box<Dispatcher>, Option<Box<Learning>>),
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
        let control = Control::Dispatched(Box::new(Dispatcher::watched(now, driver)), None);
        Self { control, steps: BTreeMap::new() }
    }

    /// The same, learning from what the trains do as a session does.
    pub(super) fn learning(self, layout: &Layout, fits: Vec<MotionFit>) -> Self {
        let control = match self.control {
            Control::Dispatched(dispatcher, _) => {
                Control::Dispatched(dispatcher, Some(Box::new(Learning::new(layout, fits))))
            }
            bare @ Control::Bare(_) => bare,
        };
        Self { control, ..self }
    }

    /// Drives with the driver alone.
    pub(super) fn bare(driver: Driver) -> Self {
        Self { control: Control::Bare(Box::new(driver)), steps: BTreeMap::new() }
    }

    pub(super) const fn driver(&self) -> &Driver {
        match &self.control {
            Control::Dispatched(dispatcher, _) => dispatcher.driver(),
            Control::Bare(driver) => driver,
        }
    }

    /// Sets the lengths of a train.
    pub(super) fn set_lengths(&mut self, now: Timestamp, train: TrainId, lengths: TrainLengths) {
        match &mut self.control {
            Control::Dispatched(dispatcher, _) => dispatcher.set_lengths(now, train, lengths),
            Control::Bare(driver) => driver.set_reach(train, lengths.ahead(), lengths.behind()),
        }
    }

    pub(super) fn order(&mut self, now: Timestamp, order: Order) -> Result<OrderId, Refusal> {
        match &mut self.control {
            Control::Dispatched(dispatcher, _) => dispatcher.order(now, order),
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
            if let (Control::Dispatched(dispatcher, _), Some(news)) = (&mut counted.control, notice.news()) {
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

/// Whether a notice says that a train is stopped to be recovered, or because of another one that is.
pub(super) fn interrupts(notice: &Notice, train: TrainId) -> bool {
    matches!(notice, Notice::Danger { train: lost, stopped, .. } if *lost == train || stopped.contains(&train))
}

impl Machine for Counted {
    type Notice = Notice;

    fn handle_event(&mut self, now: Timestamp, event: &Event) {
        match &mut self.control {
            Control::Dispatched(dispatcher, learning) => {
                dispatcher.handle_event(now, event);
                if let Some(learning) = learning {
                    learning.take(dispatcher.driver(), event);
                }
            }
            Control::Bare(driver) => driver.handle_event(now, event),
        }
    }

    fn handle_timeout(&mut self, now: Timestamp) {
        match &mut self.control {
            Control::Dispatched(dispatcher, _) => dispatcher.handle_timeout(now),
            Control::Bare(driver) => driver.handle_timeout(now),
        }
    }

    fn poll_output(&mut self) -> Option<Output<Notice>> {
        let output = match &mut self.control {
            Control::Dispatched(dispatcher, learning) => {
                let output = dispatcher.poll_output()?;
                if let (Output::Notice(notice), Some(learning)) = (&output, learning) {
                    learning.take_notice(dispatcher, notice);
                    if let Notice::Done(finished) = notice {
                        // A train at rest gets its new model at once.
                        learning
                            .model(finished.train)
                            .into_iter()
                            .for_each(|model| dispatcher.set_model(model));
                    }
                }
                output
            }
            Control::Bare(driver) => driver.poll_output()?,
        };
        if let Output::Command(Command::Speed { train, .. }) = output {
            *self.steps.entry(train).or_default() += 1;
        }
        Some(output)
    }

    fn next_timeout(&self) -> Option<Timestamp> {
        match &self.control {
            Control::Dispatched(dispatcher, _) => dispatcher.next_timeout(),
            Control::Bare(driver) => driver.next_timeout(),
        }
    }
}
