//! Settings of a station and the line to it.

use footplate_core::{TimeSpan, TurnoutId};

use super::time_model::SCAN_EVERY;
use super::uid::{AccessoryProtocol, LocomotiveProtocol, Uid};

/// How frames travel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Transport {
    /// 13 bytes each, in datagrams or one behind the other.
    #[default]
    Network,
    /// As lines of text, through a serial CAN adapter that has to be opened first.
    Adapter,
}

/// Settings of a station.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Settings {
    /// How frames travel.
    pub transport: Transport,
    /// This program's number on the bus.
    pub uid: Uid,
    /// The protocol of locomotives that the station's list does not have.
    pub locomotives: LocomotiveProtocol,
    /// The protocol of turnouts.
    pub turnouts: AccessoryProtocol,
    /// The input that is the layout's sensor 0.
    pub first_input: u16,
    /// The device that the inputs are behind; `None`: any.
    pub device: Option<u16>,
    /// S88 modules behind it.
    pub modules: u8,
    /// How often the station reads its inputs.
    pub scan: TimeSpan,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            transport: Transport::default(),
            // Any number may be taken that no device has; the program draws its own.
            uid: Uid(0x4650_4C54),
            locomotives: LocomotiveProtocol::default(),
            turnouts: AccessoryProtocol::default(),
            first_input: 1,
            device: None,
            modules: 1,
            scan: SCAN_EVERY,
        }
    }
}

impl Settings {
    /// The number of a turnout on the bus.
    pub(super) const fn turnout(&self, turnout: TurnoutId) -> Uid {
        self.turnouts.uid(turnout.0)
    }
}
