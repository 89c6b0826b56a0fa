//! The turnout whose coil is powered until the host releases it.

use footplate_core::{TimeSpan, Timestamp, TurnoutId};

/// How long a coil is powered (another program was seen to release it after 200 ms).
const PULSE: TimeSpan = TimeSpan::from_ms(200);

/// A coil under power.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Solenoid {
    pub(super) turnout: TurnoutId,
    pub(super) curved: bool,
    pub(super) release_at: Timestamp,
}

impl Solenoid {
    pub(super) fn powered(turnout: TurnoutId, curved: bool, now: Timestamp) -> Self {
        Self { turnout, curved, release_at: now + PULSE }
    }
}
