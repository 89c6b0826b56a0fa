//! A driver whose commands are counted on their way out.

use std::collections::BTreeMap;

use footplate_core::control::{Driver, Machine, Notice, Output};
use footplate_core::{Command, Event, Timestamp, TrainId};

/// Passes everything on, and counts the steps told to each train.
pub(super) struct Counted {
    pub(super) driver: Driver,
    steps: BTreeMap<TrainId, usize>,
}

impl Counted {
    pub(super) const fn new(driver: Driver) -> Self {
        Self { driver, steps: BTreeMap::new() }
    }

    /// How many steps a train has been told so far.
    pub(super) fn steps(&self, train: TrainId) -> usize {
        self.steps.get(&train).copied().unwrap_or_default()
    }
}

impl Machine for Counted {
    type Notice = Notice;

    fn handle_event(&mut self, now: Timestamp, event: &Event) {
        self.driver.handle_event(now, event);
    }

    fn handle_timeout(&mut self, now: Timestamp) {
        self.driver.handle_timeout(now);
    }

    fn poll_output(&mut self) -> Option<Output<Notice>> {
        let output = self.driver.poll_output()?;
        if let Output::Command(Command::Speed { train, .. }) = output {
            *self.steps.entry(train).or_default() += 1;
        }
        Some(output)
    }

    fn next_timeout(&self) -> Option<Timestamp> {
        self.driver.next_timeout()
    }
}
