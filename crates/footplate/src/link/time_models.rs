//! How long the link to each kind of station takes.

use footplate_core::link::{TimeModel, UsualLine};
use footplate_wire::{dcc_ex, jmri, loconet, marklin_can, marklin_serial, z21};

use super::station_kind::StationKind;

impl StationKind {
    /// Returns the station's time model, which holds over a usual line.
    pub(crate) const fn time_model(self) -> TimeModel {
        match self {
            Self::Marklin => marklin_serial::TIME_MODEL,
            Self::DccEx => dcc_ex::TIME_MODEL,
            Self::Z21 => z21::TIME_MODEL,
            Self::MarklinCan => marklin_can::TIME_MODEL,
            Self::LocoNet => loconet::TIME_MODEL,
            Self::Jmri => jmri::TIME_MODEL,
        }
    }

    /// Returns the line for which the time model holds; `None` for a 6051, which is alone on its line and polled.
    pub(crate) const fn usual_line(self) -> Option<UsualLine> {
        match self {
            Self::Marklin => None,
            Self::DccEx => Some(dcc_ex::USUAL_LINE),
            Self::Z21 => Some(z21::USUAL_LINE),
            Self::MarklinCan => Some(marklin_can::USUAL_LINE),
            Self::LocoNet => Some(loconet::USUAL_LINE),
            Self::Jmri => Some(jmri::USUAL_LINE),
        }
    }
}
