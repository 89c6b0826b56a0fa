//! How the bytes of a station travel, which decides what a failure of the line does to them.

use crate::link::SimulatedStation;

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
    pub(super) const fn of(station: &SimulatedStation<'_>) -> Self {
        match station {
            SimulatedStation::Marklin(_) | SimulatedStation::DccEx(_) => Self::Serial,
            SimulatedStation::Z21(_) | SimulatedStation::Can(_) => Self::Datagrams,
            SimulatedStation::LocoNet(_) | SimulatedStation::Jmri(_) => Self::Connection,
        }
    }
}
