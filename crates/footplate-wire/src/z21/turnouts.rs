//! The one output of a turnout that is powered.
//!
//! Without the queue of later firmware a client has to let go of an output itself, and outputs of two turnouts must not be powered
//! at once. So it is done here for every station: one turnout after the other.

use footplate_core::{TimeSpan, Timestamp};

use super::request::Request;

/// How long an output is powered: 100 ms at least, and 150 ms are usual.
const PULSE: TimeSpan = TimeSpan::from_ms(150);
/// How often its release is written: a datagram may be lost, and nothing confirms a release.
const RELEASES: u8 = 2;
/// From one to the next.
const BETWEEN_RELEASES: TimeSpan = TimeSpan::from_ms(30);

/// An output under power.
#[derive(Debug, Clone, Copy)]
struct Pulse {
    address: u16,
    second: bool,
    /// When it is let go next, and how often still.
    release_at: Timestamp,
    releases: u8,
}

/// The outputs of all turnouts, of which at most one is powered.
#[derive(Debug, Clone, Default)]
pub(super) struct Outputs {
    pulse: Option<Pulse>,
}

impl Outputs {
    /// An output is powered.
    pub(super) fn powered(&mut self, address: u16, second: bool, now: Timestamp) {
        self.pulse = Some(Pulse { address, second, release_at: now + PULSE, releases: RELEASES });
    }

    /// Whether no output is powered.
    pub(super) const fn are_free(&self) -> bool {
        self.pulse.is_none()
    }

    /// When an output has to be let go.
    pub(super) fn release_due(&self) -> Option<Timestamp> {
        self.pulse.map(|pulse| pulse.release_at)
    }

    /// What lets go of an output, when it is time or at once.
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
