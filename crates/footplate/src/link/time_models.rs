//! How long the link to each kind of station takes.

use footplate_core::link::TimeModel;
use footplate_wire::{dcc_ex, loconet, marklin_can, marklin_serial, z21};

use super::address::{Address, StationKind};

impl Address {
    /// The times of the link behind it, as its station's session has them.
    pub(crate) const fn time_model(&self) -> TimeModel {
        match self {
            Self::Simulated(simulated) => simulated.station.time_model(),
            Self::Serial(_) => StationKind::Marklin.time_model(),
            Self::Board(_) => StationKind::DccEx.time_model(),
            Self::Z21(_) => StationKind::Z21.time_model(),
            Self::Can(_) => StationKind::MarklinCan.time_model(),
            Self::LocoNet(_) => StationKind::LocoNet.time_model(),
        }
    }
}

impl StationKind {
    const fn time_model(self) -> TimeModel {
        match self {
            Self::Marklin => marklin_serial::TIME_MODEL,
            Self::DccEx => dcc_ex::TIME_MODEL,
            Self::Z21 => z21::TIME_MODEL,
            Self::MarklinCan => marklin_can::TIME_MODEL,
            Self::LocoNet => loconet::TIME_MODEL,
        }
    }
}
