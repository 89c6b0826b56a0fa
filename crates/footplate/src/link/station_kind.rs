//! The kinds of command stations: which addresses and decoders each commands.

use std::ops::RangeInclusive;

use footplate_core::link::{TimeModel, UsualLine};
use footplate_core::{DecoderSteps, TrainId};
use footplate_wire::marklin_can::LocomotiveProtocol;
use footplate_wire::{dcc_ex, jmri, loconet, marklin_can, marklin_serial, z21};

/// Which station a simulated layout is behind.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) enum StationKind {
    /// A 6051.
    #[default]
    Marklin,
    /// A DCC-EX board.
    DccEx,
    /// A Z21.
    Z21,
    /// A Central Station on Märklin's CAN bus.
    MarklinCan,
    /// A command station on LocoNet, behind a server.
    LocoNet,
    /// JMRI.
    Jmri,
}

impl StationKind {
    /// Whether the station has the address of a train, and commands decoders like its own.
    ///
    /// # Errors
    /// What it does not have, for people.
    pub(crate) fn check(self, train: TrainId, decoder: DecoderSteps) -> Result<(), String> {
        let name = match self {
            Self::Marklin => "a 6051",
            Self::DccEx => "a DCC-EX board",
            Self::Z21 => "a Z21",
            Self::MarklinCan => "a Central Station",
            Self::LocoNet => "LocoNet",
            Self::Jmri => "JMRI",
        };
        let addresses = self.addresses();
        if !addresses.contains(&train.0) {
            let (first, last) = (addresses.start(), addresses.end());
            return Err(format!("train {train} has no address on {name}; addresses are {first} to {last}"));
        }
        if self == Self::Marklin && decoder != DecoderSteps::Fourteen {
            return Err(format!(
                "train {train} has {decoder} speed steps, and {name} commands 14: choose another station, such as \
                 station=dcc-ex or --protocol dcc-ex for a simulated layout"
            ));
        }
        Ok(())
    }

    /// The addresses of trains that the station has.
    pub(crate) const fn addresses(self) -> RangeInclusive<u16> {
        match self {
            Self::Marklin => marklin_serial::TRAINS,
            Self::DccEx => dcc_ex::CABS,
            Self::Z21 => z21::LOCOMOTIVES,
            Self::MarklinCan => LocomotiveProtocol::Mfx.addresses(),
            Self::LocoNet => loconet::LOCOMOTIVES,
            Self::Jmri => jmri::LOCOMOTIVES,
        }
    }

    /// Returns the station with this name.
    ///
    /// # Errors
    /// The names that exist, if there is no such name.
    pub(crate) fn named(value: &str) -> Result<Self, String> {
        let all = [Self::Marklin, Self::DccEx, Self::Z21, Self::MarklinCan, Self::LocoNet, Self::Jmri];
        all.into_iter().find(|kind| kind.key() == value).ok_or_else(|| {
            format!(
                "there is no simulated station `{value}`; there are marklin, dcc-ex, z21, marklin-can, loconet and jmri"
            )
        })
    }

    /// Its name in the address of a simulated layout.
    pub(crate) const fn key(self) -> &'static str {
        match self {
            Self::Marklin => "marklin",
            Self::DccEx => "dcc-ex",
            Self::Z21 => "z21",
            Self::MarklinCan => "marklin-can",
            Self::LocoNet => "loconet",
            Self::Jmri => "jmri",
        }
    }
}

impl StationKind {
    /// How the address of a station of this kind begins.
    pub(super) const fn scheme(self) -> &'static str {
        match self {
            Self::Marklin => "marklin-serial",
            other => other.key(),
        }
    }

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
