//! How far the end of a session has come with a station that confirms what it is commanded.

use footplate_core::{TimeSpan, Timestamp};

/// How long the end waits for all stops to be confirmed before the power goes off all the same: several repeats.
const STOPS_WITHIN: TimeSpan = TimeSpan::from_ms(1_500);

/// How far the end has come.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) enum Farewell {
    #[default]
    NotBegun,
    /// Trains are being stopped.
    Stopping { until: Timestamp },
    /// The power is being switched off.
    SwitchingOff { is_confirmed: bool },
    /// All is confirmed.
    Over,
}

impl Farewell {
    pub(crate) fn begin(&mut self, now: Timestamp) {
        *self = Self::Stopping { until: now + STOPS_WITHIN };
    }

    pub(crate) fn has_begun(self) -> bool {
        self != Self::NotBegun
    }

    pub(crate) fn is_over(self) -> bool {
        self == Self::Over
    }

    pub(crate) const fn due(self) -> Option<Timestamp> {
        match self {
            Self::Stopping { until } => Some(until),
            _ => None,
        }
    }
}
