//! The end of a session with a confirming station: stop all trains, then switch the power off.

use footplate_core::{TimeSpan, Timestamp};

use crate::locomotives::Locomotives;
use crate::session::{Closing, Confirmation};

/// The power goes off after this time even if stops are unconfirmed: a line may garble every repeat of them, and all trains have to be
/// stopped within a second (a requirement).
const STOPS_WITHIN: TimeSpan = TimeSpan::from_ms(1_000);

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

    /// Stops the trains again before the power goes off.
    pub(crate) fn begin_again(&mut self, now: Timestamp) {
        if let Self::SwitchingOff { .. } = self {
            self.begin(now);
        }
    }

    /// Whether it is time to switch the power off; true once.
    pub(crate) fn switch_off_is_due(&mut self, now: Timestamp, locomotives: &Locomotives) -> bool {
        let Self::Stopping { until } = *self else { return false };
        let is_due = now >= until || locomotives.driven(false).is_empty();
        if is_due {
            *self = Self::SwitchingOff { is_confirmed: false };
        }
        is_due
    }

    /// Notes that the station reported the track without power.
    pub(crate) fn power_went_off(&mut self) {
        if let Self::SwitchingOff { is_confirmed } = self {
            *is_confirmed = true;
        }
    }

    /// Ends the session when everything is confirmed; then returns how it ended, once.
    pub(crate) fn end_if_confirmed(&mut self, locomotives: &Locomotives) -> Option<Closing> {
        let is_off = *self == Self::SwitchingOff { is_confirmed: true };
        (is_off && locomotives.driven(false).is_empty()).then(|| {
            *self = Self::Over;
            self.statement(locomotives)
        })
    }

    /// How far the end has come. No solenoid is held by a track without power.
    pub(crate) fn statement(self, locomotives: &Locomotives) -> Closing {
        Closing {
            commanded_to_stop: locomotives.driven(true),
            not_commanded: locomotives.driven(false),
            solenoids_released: None,
            power_off: matches!(self, Self::Over | Self::SwitchingOff { is_confirmed: true }),
            confirmation: Confirmation::Replies,
        }
    }
}
