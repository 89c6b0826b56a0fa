//! Two light gates close together, with their own clock: the only true local speed that a layout can have.

use footplate_core::{TimeSpan, Timestamp};

use crate::draws::Draws;

/// Distance between the gates (as in the one recording with gates).
pub(crate) const GATE_SPACING_MM: f64 = 20.0;
/// Resolution of the gates' clock (as in that recording).
const RESOLUTION_NS: i64 = 1_000_000;
/// Drift of the gates' clock against the host's (chosen: two quartz clocks).
const DRIFT: core::ops::Range<f64> = -50e-6..50e-6;
/// How long the gates' clock has been running at the start of the run (chosen).
const UPTIME_S: core::ops::Range<f64> = 1.0..1000.0;

/// A train broke the light beam of a gate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct GatePass {
    /// The gate; a train meets 1 before 0.
    pub gate: u8,
    /// When, on the clock of the gates, in whole milliseconds.
    pub time: Timestamp,
}

/// The gates' clock.
#[derive(Debug, Clone, Copy)]
pub(crate) struct GateClock {
    uptime_s: f64,
    rate: f64,
}

impl GateClock {
    /// A clock with a random origin and drift.
    pub(crate) fn new(draws: &mut Draws) -> Self {
        Self { uptime_s: draws.uniform(UPTIME_S), rate: 1.0 + draws.uniform(DRIFT) }
    }

    /// The passage of a gate at a time in s since the start of the run, as the clock shows it.
    pub(crate) fn pass(&self, gate: u8, at: f64) -> GatePass {
        let shown = TimeSpan::from_s(self.uptime_s + at * self.rate).as_ns();
        GatePass { gate, time: Timestamp::from_ns(shown - shown.rem_euclid(RESOLUTION_NS)) }
    }
}
