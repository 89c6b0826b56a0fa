//! Settings of a station, its sensors and its turnouts.

use alloc::vec::Vec;
use core::ops::RangeInclusive;

use footplate_core::{DecoderSteps, TimeSpan, TurnoutId};

use super::broadcasts::Broadcasts;
use super::detectors::{Feedback, GROUP_INPUTS, GROUPS};
use super::request::{Request, TURNOUTS};
use super::time_model::SENSOR_DELAY_LONGEST;

/// Settings of a station.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Settings {
    /// In which steps trains of 14 steps are commanded; others are commanded in their own.
    pub steps: DecoderSteps,
    /// What sensors are connected to.
    pub feedback: Feedback,
    /// The station's number of the layout's sensor 0: 1 for input 1 of module 1.
    pub first_sensor: u16,
    /// The highest number of a sensor there, so that no group of modules is asked for that is not there.
    pub last_sensor: u16,
    /// The station's number of the layout's turnout 1, counted from 0: other programs and some stations are off by 4.
    pub first_turnout: u16,
    /// Which of a turnout's outputs lays it straight: the second (P = 1, RCN-213), or the first.
    pub second_is_straight: bool,
    /// The longest time from a sensor being occupied until the program has the report.
    pub sensor_delay: TimeSpan,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            steps: DecoderSteps::All,
            feedback: Feedback::default(),
            first_sensor: 1,
            last_sensor: GROUP_INPUTS,
            first_turnout: 0,
            second_is_straight: true,
            sensor_delay: SENSOR_DELAY_LONGEST,
        }
    }
}

impl Settings {
    /// Returns the subscription of this client.
    pub(super) fn broadcasts(&self) -> Broadcasts {
        Broadcasts::STATES | Broadcasts::RAIL_COM | Broadcasts::SYSTEM_STATE | self.feedback.broadcasts()
    }

    /// What the station is asked before trains are driven: what it is, what it tells this client, where trains are, and the power.
    ///
    /// `is_subscribed`: whether this client has already subscribed. Then it only asks, so that a station that was
    /// restarted is recognised by what it has forgotten. Whether power is switched on or off is decided when it is written.
    pub(super) fn questions(&self, wanted: Broadcasts, is_subscribed: bool) -> Vec<Request> {
        let broadcasts = if is_subscribed { Request::Broadcasts } else { Request::SetBroadcasts(wanted) };
        let first = [Request::SerialNumber, Request::Hardware, Request::LockCode, broadcasts];
        let groups = self.groups().map(|group| Request::Feedback { group });
        let detectors = match self.feedback {
            Feedback::RBus => None,
            Feedback::Can => Some(Request::ALL_CAN),
            Feedback::LocoNet => Some(Request::ALL_LOCO_NET),
        };
        let groups = groups.filter(|_| detectors.is_none());
        let last = [Request::Power { on: true }, Request::Status];
        first.into_iter().chain(groups).chain(detectors).chain(last).collect()
    }

    /// The groups of the R-BUS that have to be asked for.
    pub(super) fn groups(&self) -> RangeInclusive<u8> {
        let last = self.last_sensor.saturating_sub(1) / GROUP_INPUTS;
        0..=u8::try_from(last).unwrap_or(u8::MAX).min(GROUPS - 1)
    }

    /// The numbers that turnouts of the layout can have.
    pub(super) fn turnouts(&self) -> RangeInclusive<u16> {
        1..=(TURNOUTS.end() + 1).saturating_sub(self.first_turnout)
    }

    /// The station's number of a turnout.
    pub(super) fn address_of(&self, turnout: TurnoutId) -> u16 {
        turnout.0.saturating_sub(1).saturating_add(self.first_turnout)
    }

    /// The turnout of a station's number.
    pub(super) fn turnout_at(&self, address: u16) -> Option<TurnoutId> {
        Some(TurnoutId(address.checked_sub(self.first_turnout)?.checked_add(1)?))
    }
}
