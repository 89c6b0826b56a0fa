//! What is done in one run: how the train begins, what it is told and when, and how long it lasts.

use footplate_core::{Approach, SpeedStep, TimeSpan};

/// One run, written down before it happens.
#[derive(Debug, Clone, PartialEq)]
pub struct Script {
    /// What the train does when the run begins.
    pub start: Start,
    /// What is done, one after the other.
    pub orders: Vec<Order>,
    /// When the run ends at the latest, a day at most; earlier only once every order is done and the train
    /// rests for good.
    pub lasts: TimeSpan,
    /// Whether there are light gates on the track.
    pub has_gates: bool,
}

/// What the train does when a run begins. It does so just past a sensor, the counted one of the circuit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Start {
    /// It stands.
    AtRest {
        /// The sensor it stands past.
        past: usize,
    },
    /// It has long been running.
    Running {
        /// The sensor it has just passed.
        past: usize,
        /// At which step.
        step: SpeedStep,
        /// From which side it got to that speed; the recording does not tell.
        approach: Approach,
    },
}

/// Something done, and what it waits for once the order before it is done.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Order {
    /// What it waits for.
    pub when: When,
    /// What is done.
    pub what: What,
}

/// What an order waits for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum When {
    /// A time since the order before was sent, or since the start of the run.
    After(TimeSpan),
    /// A report of a contact that no report before it showed closed, and a time after that.
    OnReport {
        /// How many such reports are let pass first.
        skipped: u32,
        /// The time after it.
        wait: TimeSpan,
    },
    /// The train's coming to rest.
    AtRest,
}

/// What is done.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum What {
    /// A throttle step is commanded.
    Speed(SpeedStep),
    /// A person presses a key and lays a tape, from the sensor whose report the last order waited for, or
    /// else from the last one passed.
    Measure,
}

impl Script {
    /// A run from rest past a sensor, without orders yet.
    #[must_use]
    pub const fn from_rest(past: usize, lasts: TimeSpan) -> Self {
        Self { start: Start::AtRest { past }, orders: Vec::new(), lasts, has_gates: false }
    }

    /// A run of a train already running, without orders yet.
    #[must_use]
    pub const fn running(past: usize, step: SpeedStep, approach: Approach, lasts: TimeSpan) -> Self {
        Self { start: Start::Running { past, step, approach }, orders: Vec::new(), lasts, has_gates: false }
    }

    /// With one more order.
    #[must_use]
    pub fn then(mut self, when: When, what: What) -> Self {
        self.orders.push(Order { when, what });
        self
    }
}
