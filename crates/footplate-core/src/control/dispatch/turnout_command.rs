//! How a turnout was commanded last, and how often.

use crate::time::Timestamp;
use crate::track::Leg;

/// How many times a turnout is commanded. One that fails once in 300 fails twice in a row once in 90 000, if its failures are
/// independent; others show when a train takes the other leg.
pub(super) const SURE: u8 = 2;

/// How a turnout was set.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct TurnoutCommand {
    pub(super) leg: Leg,
    /// How many times in a row.
    pub(super) times: u8,
    pub(super) last: Timestamp,
}

impl TurnoutCommand {
    /// A turnout that is remembered to lie so, or did before a train came elsewhere: it is commanded again before it is
    /// relied on.
    pub(super) const fn remembered(now: Timestamp, leg: Leg) -> Self {
        Self { leg, times: 0, last: now }
    }

    /// A turnout of which a train has shown how it lies.
    pub(super) const fn sure(now: Timestamp, leg: Leg) -> Self {
        Self { leg, times: SURE, last: now }
    }
}
