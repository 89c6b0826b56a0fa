//! What is done in one run: the start, the orders and their times, and the duration.

use footplate_core::{Approach, SpeedStep, TimeSpan};

/// The plan of one run.
#[derive(Debug, Clone, PartialEq)]
pub struct Script {
    /// The state of the train at the start.
    pub start: Start,
    /// The orders, one after the other.
    pub orders: Vec<Order>,
    /// When the run ends at the latest, a day at most; earlier once every order is done and the train stays at rest.
    pub lasts: TimeSpan,
    /// Whether there are light gates on the track.
    pub has_gates: bool,
}

/// The state of the train at the start of a run, just past a sensor of the circuit, given by its index.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Start {
    /// At rest.
    AtRest {
        /// The sensor behind it.
        past: usize,
    },
    /// Running steadily for long.
    Running {
        /// The sensor it has just passed.
        past: usize,
        /// At which step.
        step: SpeedStep,
        /// From which side it reached that speed; the recording does not show it.
        approach: Approach,
    },
}

/// An action, and the condition it waits for once the previous order is done.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Order {
    /// The condition.
    pub when: When,
    /// The action.
    pub what: What,
}

/// The condition of an order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum When {
    /// A time since the previous order was sent, or since the start of the run.
    After(TimeSpan),
    /// A report of a sensor that was open in the previous report, and a time after that.
    OnReport {
        /// How many such reports are skipped first.
        skipped: u32,
        /// The time after it.
        wait: TimeSpan,
    },
    /// The train has come to rest.
    AtRest,
}

/// The action of an order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum What {
    /// A throttle step is commanded.
    Speed(SpeedStep),
    /// An operator presses a key and measures with a tape, from the sensor whose report the last order waited for, or
    /// else from the last one passed.
    Measure,
}

impl Script {
    /// A run from rest past a sensor, without orders yet.
    pub const fn from_rest(past: usize, lasts: TimeSpan) -> Self {
        Self { start: Start::AtRest { past }, orders: Vec::new(), lasts, has_gates: false }
    }

    /// A run of a train already running, without orders yet.
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
