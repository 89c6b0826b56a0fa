//! How JMRI names the layout's sensors and turnouts.

use alloc::format;
use alloc::string::String;
use core::ops::RangeInclusive;

use footplate_core::{SensorId, TimeSpan, TurnoutId};

use super::time_model::SENSOR_DELAY_LONGEST;

/// Settings of a link to JMRI.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Settings {
    /// The prefix of the system that the layout is connected to; `None` for JMRI's default system.
    pub prefix: Option<String>,
    /// The number in the name of the layout's sensor 0.
    pub first_sensor: u16,
    /// The number in the name of the layout's last sensor: others are not listened to.
    pub last_sensor: u16,
    /// The number in the name of the layout's turnout 1.
    pub first_turnout: u16,
    /// Whether a closed turnout lies straight; otherwise a thrown one does.
    pub closed_is_straight: bool,
    /// The longest time from a sensor being occupied until the program has the report.
    pub sensor_delay: TimeSpan,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            prefix: None,
            first_sensor: 1,
            last_sensor: u16::MAX,
            first_turnout: 1,
            closed_is_straight: true,
            sensor_delay: SENSOR_DELAY_LONGEST,
        }
    }
}

impl Settings {
    /// The numbers that turnouts of the layout can have.
    pub(super) const fn turnouts(&self) -> RangeInclusive<u16> {
        1..=(u16::MAX - self.first_turnout)
    }

    /// The number in the name of a turnout.
    pub(super) const fn number_of(&self, turnout: TurnoutId) -> u16 {
        turnout.0.saturating_sub(1).saturating_add(self.first_turnout)
    }

    /// The turnout with a number in its name.
    pub(super) fn turnout_of(&self, number: u16) -> Option<TurnoutId> {
        Some(TurnoutId(number.checked_sub(self.first_turnout)?.checked_add(1)?))
    }

    /// The sensor with a number in its name.
    pub(super) fn sensor_of(&self, number: u16) -> Option<SensorId> {
        let is_of_layout = number <= self.last_sensor;
        number.checked_sub(self.first_sensor).filter(|_| is_of_layout).map(SensorId)
    }
}

/// The system that the layout is connected to.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct System {
    /// Its name; `None` until JMRI has stated it.
    pub name: Option<String>,
    /// How the names of its sensors and turnouts begin.
    pub prefix: String,
}

impl System {
    /// The system name of a sensor.
    pub fn sensor(&self, number: u16) -> String {
        format!("{}S{number}", self.prefix)
    }

    /// The system name of a turnout.
    pub fn turnout(&self, number: u16) -> String {
        format!("{}T{number}", self.prefix)
    }

    /// The number in the system name of a sensor; `None` for one of another system, or without a number.
    pub fn number_of_sensor(&self, name: &str) -> Option<u16> {
        name.strip_prefix(&*self.prefix)?.strip_prefix('S')?.parse().ok()
    }

    /// The number in the system name of a turnout; `None` as for sensors.
    pub fn number_of_turnout(&self, name: &str) -> Option<u16> {
        name.strip_prefix(&*self.prefix)?.strip_prefix('T')?.parse().ok()
    }
}
