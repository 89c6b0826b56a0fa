//! The opening: what is asked of the board before trains may run.

use alloc::collections::VecDeque;

use footplate_core::{TimeSpan, Timestamp};

use super::request::{Power, Request};
use super::settings::{Settings, TurnoutRequests};

/// How long the banner of a board is awaited that is reset by opening its port: it takes 2 to 6 s. A board that is not reset
/// by that, or has already started, is asked afterwards.
const BANNER_WITHIN: TimeSpan = TimeSpan::from_ms(6_000);

/// An identity that comes so soon after the opening answers a request that was repeated; a later one follows a reset.
const LATE_ANSWERS: TimeSpan = TimeSpan::from_ms(2_000);

/// The state of the opening.
#[derive(Debug, Clone)]
pub(super) enum Opening {
    /// Nothing may be written: the board starts.
    Banner {
        until: Timestamp,
    },
    /// It is asked what it is.
    Identity,
    /// States are asked for; these requests are still to be written.
    States(VecDeque<Request>),
    Open {
        since: Timestamp,
    },
}

impl Opening {
    /// The line has been opened.
    pub(super) fn begin(now: Timestamp, settings: &Settings) -> Self {
        if settings.resets_on_open { Self::Banner { until: now + BANNER_WITHIN } } else { Self::Identity }
    }

    /// The board is there: sensors, turnouts, power, and a request that is always answered, after which all else has been. Whether power
    /// is switched on or off is decided when it is written.
    pub(super) fn ask_states(settings: &Settings) -> Self {
        let turnouts = (settings.turnouts == TurnoutRequests::Defined).then_some(Request::Turnouts);
        let power = Request::Power { on: true, tracks: Power::Main };
        Self::States(
            [Request::SensorStates].into_iter().chain(turnouts).chain([power, Request::Slots]).collect(),
        )
    }

    pub(super) const fn is_open(&self) -> bool {
        matches!(self, Self::Open { .. })
    }

    pub(super) const fn is_listing(&self) -> bool {
        matches!(self, Self::States(_))
    }

    pub(super) const fn awaits_banner(&self) -> bool {
        matches!(self, Self::Banner { .. })
    }

    /// Whether an identity that was not asked for means that the board was reset.
    pub(super) fn is_reset_by_identity(&self, now: Timestamp) -> bool {
        matches!(self, Self::Open { since } if now - *since > LATE_ANSWERS)
    }
}
