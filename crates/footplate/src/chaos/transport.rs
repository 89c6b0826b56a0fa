//! How the bytes of a station travel, which decides what a failure of the line does to them.

use crate::link::{Address, Cable, StationKind};

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Transport {
    /// Each byte arrives, perhaps garbled, or is lost; a cut is noticed.
    Serial,
    /// Each datagram arrives whole or not at all; a cut is not noticed.
    Datagrams,
    /// TCP: everything arrives as it was sent, perhaps late; a cut ends the connection.
    Connection,
}

impl Transport {
    pub(super) const fn of(cable: &Cable) -> Self {
        match cable {
            _ if cable.has_datagrams() => Self::Datagrams,
            _ if cable.is_connection() => Self::Connection,
            _ => Self::Serial,
        }
    }
}

/// The cable that a guardian would be given for a station of a kind; it is never opened.
///
/// # Errors
/// Never: the addresses are those of the guides.
pub(super) fn cable_to(station: StationKind) -> anyhow::Result<Cable> {
    let address = match station {
        StationKind::Marklin => "marklin-serial:/dev/ttyUSB0",
        StationKind::DccEx => "dcc-ex:/dev/ttyACM0",
        StationKind::Z21 => "z21:192.168.0.111",
        StationKind::MarklinCan => "marklin-can:192.168.0.5",
        StationKind::LocoNet => "loconet:192.168.0.20",
        StationKind::Jmri => "jmri:192.168.0.20",
    };
    let address: Address = address.parse().map_err(anyhow::Error::msg)?;
    anyhow::Context::context(address.cable(), "a station has a cable")
}
