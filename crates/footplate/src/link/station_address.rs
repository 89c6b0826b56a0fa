//! A station outside this process, as a person names it: where it is, and its settings.

use footplate_wire::marklin_serial::Pace;
use footplate_wire::{dcc_ex, jmri, loconet, marklin_can, z21};

use super::cable::Cable;
use super::parameters::{modules, times};
use super::station_kind::StationKind;
use super::{board_address, can_address, jmri_address, loconet_address, serial_address, z21_address};

/// A station outside this process.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct StationAddress {
    /// The line to it.
    pub(crate) cable: Cable,
    /// Its settings.
    pub(crate) settings: StationSettings,
}

/// The settings of each kind of station.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum StationSettings {
    /// A 6050 or 6051 behind a line of bytes. Without a pace, the hand-shake line sets it where there is one; without a number of
    /// modules, the layout's sensors do.
    Serial { pace: Option<Pace>, modules: Option<u8> },
    /// A DCC-EX board behind a serial port or a network.
    Board(dcc_ex::Settings),
    /// A Z21 in a network.
    Z21(z21::Settings),
    /// A station on Märklin's CAN bus, and the S88 modules behind it, as above.
    Can { settings: marklin_can::Settings, modules: Option<u8> },
    /// A LocoNet server in a network.
    LocoNet(loconet::Settings),
    /// JMRI in a network.
    Jmri(jmri::Settings),
}

impl StationAddress {
    /// Returns the station at a place; `None` if no station has this scheme.
    pub(super) fn read(scheme: &str, place: &str) -> Option<Result<Self, String>> {
        use StationSettings as Of;
        let read = match scheme {
            "marklin-serial" => {
                serial_address::read(place).map(|place| (place, Of::Serial { pace: None, modules: None }))
            }
            "dcc-ex" => board_address::read(place).map(|(place, settings)| (place, Of::Board(settings))),
            "z21" => z21_address::read(place).map(|(place, settings)| (place, Of::Z21(settings))),
            "marklin-can" => {
                can_address::read(place).map(|(place, settings)| (place, Of::Can { settings, modules: None }))
            }
            "loconet" => loconet_address::read(place).map(|(place, settings)| (place, Of::LocoNet(settings))),
            "jmri" => jmri_address::read(place).map(|(place, settings)| (place, Of::Jmri(settings))),
            _ => return None,
        };
        let has_answers = scheme != "marklin-serial";
        let cable = |place| Cable { place, speed: 1.0, has_answers };
        Some(read.map(|(place, settings)| Self { cable: cable(place), settings }))
    }

    /// Which station it is.
    pub(super) const fn kind(&self) -> StationKind {
        match self.settings {
            StationSettings::Serial { .. } => StationKind::Marklin,
            StationSettings::Board(_) => StationKind::DccEx,
            StationSettings::Z21(_) => StationKind::Z21,
            StationSettings::Can { .. } => StationKind::MarklinCan,
            StationSettings::LocoNet(_) => StationKind::LocoNet,
            StationSettings::Jmri(_) => StationKind::Jmri,
        }
    }

    /// Changes a setting of the station or its line.
    ///
    /// # Errors
    /// The station has no such setting, or not this value of it.
    pub(super) fn set(&mut self, key: &str, value: &str) -> Result<(), String> {
        let place = &mut self.cable.place;
        match (key, &mut self.settings) {
            ("speed", _) => self.cable.speed = times(value)?,
            (
                "modules",
                StationSettings::Serial { modules: count, .. } | StationSettings::Can { modules: count, .. },
            ) => {
                *count = Some(modules(value)?);
            }
            (_, StationSettings::Serial { pace, .. }) => serial_address::set(pace, place, key, value)?,
            (_, StationSettings::Board(settings)) => board_address::set(settings, key, value)?,
            (_, StationSettings::Z21(settings)) => z21_address::set(settings, key, value)?,
            (_, StationSettings::Can { settings, .. }) => can_address::set(settings, place, key, value)?,
            (_, StationSettings::LocoNet(settings)) => loconet_address::set(settings, key, value)?,
            (_, StationSettings::Jmri(settings)) => jmri_address::set(settings, key, value)?,
        }
        Ok(())
    }
}
