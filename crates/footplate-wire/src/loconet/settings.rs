//! What the bus, its detectors and its turnouts are like.

use core::ops::RangeInclusive;

use footplate_core::{TimeSpan, TurnoutId};

use super::request::TURNOUTS;
use super::time_model::SENSOR_DELAY_LONGEST;

/// What is on the bus.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Settings {
    /// The detector's address of the layout's sensor 0.
    pub first_sensor: u16,
    /// The address of the layout's turnout 1.
    pub first_turnout: u16,
    /// Whether the closed output lays a turnout straight; otherwise the thrown one.
    pub closed_is_straight: bool,
    /// The longest time from a sensor being occupied until the program hears of it.
    pub sensor_delay: TimeSpan,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            first_sensor: 1,
            first_turnout: 1,
            closed_is_straight: true,
            sensor_delay: SENSOR_DELAY_LONGEST,
        }
    }
}

impl Settings {
    /// The numbers that turnouts of the layout can have.
    pub(super) fn turnouts(&self) -> RangeInclusive<u16> {
        1..=(TURNOUTS.end() + 1).saturating_sub(self.first_turnout)
    }

    /// The address of a turnout.
    pub(super) fn address_of(&self, turnout: TurnoutId) -> u16 {
        turnout.0.saturating_sub(1).saturating_add(self.first_turnout)
    }

    /// The turnout of an address.
    pub(super) fn turnout_at(&self, address: u16) -> Option<TurnoutId> {
        Some(TurnoutId(address.checked_sub(self.first_turnout)?.checked_add(1)?))
    }
}
