//! The one output of a turnout that is powered.
//!
//! Older firmware has no queue: a client releases outputs itself and must not power two at once. Footplate does this with every
//! station, one turnout after the other.

use footplate_core::{TimeSpan, Timestamp};

use super::request::Request;

/// How long an output is powered: at least 100 ms, usually 150 ms.
const PULSE: TimeSpan = TimeSpan::from_ms(150);
/// How often its release is written: a datagram may be lost, and no answer confirms it.
const RELEASES: u8 = 2;
/// Time between two releases.
const BETWEEN_RELEASES: TimeSpan = TimeSpan::from_ms(30);

/// An output under power.
#[derive(Debug, Clone, Copy)]
struct Pulse {
    address: u16,
    second: bool,
    /// When to release it next, and how often.
    release_at: Timestamp,
    releases: u8,
}

/// The outputs of all turnouts, of which at most one is powered.
#[derive(Debug, Clone, Default)]
pub(super) struct Outputs {
    pulse: Option<Pulse>,
}

impl Outputs {
    /// Notes that an output is powered.
    pub(super) fn powered(&mut self, address: u16, second: bool, now: Timestamp) {
        self.pulse = Some(Pulse { address, second, release_at: now + PULSE, releases: RELEASES });
    }

    /// Returns when to release an output.
    pub(super) fn release_due(&self) -> Option<Timestamp> {
        self.pulse.map(|pulse| pulse.release_at)
    }

    /// Returns the request that releases an output, if it is due.
    pub(super) fn take_release(&mut self, now: Timestamp) -> Option<Request> {
        let Pulse { address, second, releases, .. } = self.pulse.filter(|pulse| now >= pulse.release_at)?;
        self.pulse = (releases > 1).then_some(Pulse {
            address,
            second,
            release_at: now + BETWEEN_RELEASES,
            releases: releases - 1,
        });
        Some(Request::SetTurnout { address, second, activate: false, queue: false })
    }
}
