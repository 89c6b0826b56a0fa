//! How many commands a train that keeps to a pace may take of the line, and what it has taken of late.

use crate::time::{TimeSpan, Timestamp};

/// From one command to a train to its next: decoders hear every command, but a change of speed that has not begun to be
/// felt is not worth another.
pub(super) const SPACING: TimeSpan = TimeSpan::from_ms(200);
/// Within this time a train is paced with no more than [`IN_A_ROW`] commands: four trains then take 6 % of a 2400-baud
/// line.
pub(super) const BUDGET: TimeSpan = TimeSpan::from_s(2.0);
pub(super) const IN_A_ROW: usize = 3;

/// When the last commands left, oldest first, as seconds on any clock; `-∞` where there was none.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct CommandBudget {
    sent: [f64; IN_A_ROW],
}

impl CommandBudget {
    /// Nothing sent yet.
    pub(super) const UNUSED: Self = Self { sent: [f64::NEG_INFINITY; IN_A_ROW] };

    /// A command has left.
    pub(super) fn take(&mut self, sent: f64) {
        self.sent.rotate_left(1);
        if let Some(last) = self.sent.last_mut() {
            *last = sent;
        }
    }

    /// When the next may leave.
    pub(super) fn free(&self) -> f64 {
        let [oldest, .., last] = self.sent;
        (last + SPACING.as_s()).max(oldest + BUDGET.as_s())
    }

    /// When the next may leave that cannot wait for the budget.
    pub(super) fn spaced(&self) -> f64 {
        let [.., last] = self.sent;
        last + SPACING.as_s()
    }

    /// The same on a clock on which all of it is so much later (s).
    pub(super) fn later(self, by: f64) -> Self {
        Self { sent: self.sent.map(|sent| sent + by) }
    }
}

/// Seconds of a time on the clock of budgets.
pub(super) fn seconds(time: Timestamp) -> f64 {
    (time - Timestamp::ZERO).as_s()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_commands_in_a_row_have_to_last_for_two_seconds() {
        let mut budget = CommandBudget::UNUSED;
        assert!(budget.free() < 0.0);
        for sent in [10.0, 10.2] {
            budget.take(sent);
            assert!((budget.free() - (sent + 0.2)).abs() < 1e-9);
        }
        budget.take(10.4);
        assert!((budget.free() - 12.0).abs() < 1e-9);
        assert!((budget.later(-10.0).free() - 2.0).abs() < 1e-9);
    }
}
