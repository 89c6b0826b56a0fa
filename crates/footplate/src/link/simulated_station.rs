//! A simulated layout behind any kind of station.

use std::collections::VecDeque;

use footplate_core::Timestamp;
use footplate_sim::living::{
    CanTransport, CoilAlarm, FromStation, LivingLayout, StationSwitches, VirtualBoard, VirtualCentralStation,
    VirtualJmri, VirtualLocoNet, VirtualStation, VirtualZ21,
};

use super::{Quirks, StationKind};

/// A simulated station and the world behind it.
#[derive(Debug, Clone)]
pub(crate) enum SimulatedStation<'l> {
    /// A 6051.
    Marklin(Box<VirtualStation<'l>>),
    /// A DCC-EX board.
    DccEx(Box<VirtualBoard<'l>>),
    /// A Z21.
    Z21(Box<VirtualZ21<'l>>),
    /// A Central Station.
    Can(Box<VirtualCentralStation<'l>>),
    /// A command station on LocoNet.
    LocoNet(Box<VirtualLocoNet<'l>>),
    /// JMRI.
    Jmri(Box<VirtualJmri<'l>>),
}

impl<'l> From<VirtualStation<'l>> for SimulatedStation<'l> {
    fn from(station: VirtualStation<'l>) -> Self {
        Self::Marklin(Box::new(station))
    }
}

/// What reaches the host from any.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum FromSimulated {
    /// Bytes in one portion.
    Bytes(VecDeque<u8>),
    /// A datagram to one of several clients.
    Datagram(usize, Vec<u8>),
    /// The hand-shake line is up or down.
    Cts(bool),
}

impl<'l> SimulatedStation<'l> {
    /// A station of a kind in front of a world; `marklin` is how a 6051 behaves, `quirks` how the others do.
    pub(crate) fn new(
        kind: StationKind,
        world: LivingLayout<'l>,
        seed: u64,
        marklin: StationSwitches,
        quirks: Quirks,
    ) -> Self {
        let Quirks { board, z21, can, loconet, jmri } = quirks;
        match kind {
            StationKind::Marklin => VirtualStation::new(world, seed, marklin).into(),
            StationKind::DccEx => Self::DccEx(Box::new(VirtualBoard::new(world, seed, board))),
            StationKind::Z21 => Self::Z21(Box::new(VirtualZ21::new(world, seed, z21))),
            StationKind::MarklinCan => Self::Can(Box::new(VirtualCentralStation::new(world, seed, can))),
            StationKind::LocoNet => Self::LocoNet(Box::new(VirtualLocoNet::new(world, seed, loconet))),
            StationKind::Jmri => Self::Jmri(Box::new(VirtualJmri::new(world, seed, jmri))),
        }
    }

    /// The station's time.
    pub(crate) const fn now(&self) -> Timestamp {
        match self {
            Self::Marklin(station) => station.now(),
            Self::DccEx(board) => board.now(),
            Self::Z21(station) => station.now(),
            Self::Can(station) => station.now(),
            Self::LocoNet(station) => station.now(),
            Self::Jmri(jmri) => jmri.now(),
        }
    }

    /// Advances until a time, or until something reaches the host before it.
    pub(crate) fn advance(&mut self, until: Timestamp) -> Option<FromSimulated> {
        match self {
            Self::Marklin(station) => station.advance(until).map(|heard| match heard {
                FromStation::Byte(byte) => FromSimulated::Bytes(VecDeque::from([byte])),
                FromStation::Cts(up) => FromSimulated::Cts(up),
            }),
            Self::DccEx(board) => board.advance(until).map(|bytes| FromSimulated::Bytes(bytes.into())),
            Self::Z21(station) => {
                station.advance(until).map(|(client, datagram)| FromSimulated::Datagram(client, datagram))
            }
            Self::LocoNet(station) => station.advance(until).map(|bytes| FromSimulated::Bytes(bytes.into())),
            Self::Jmri(jmri) => jmri.advance(until).map(|bytes| FromSimulated::Bytes(bytes.into())),
            Self::Can(station) => station.advance(until).map(|(client, bytes)| match station.transport() {
                CanTransport::Datagrams => FromSimulated::Datagram(client, bytes),
                CanTransport::Stream | CanTransport::Adapter => FromSimulated::Bytes(bytes.into()),
            }),
        }
    }

    /// Puts the host's bytes on the line.
    pub(crate) fn write(&mut self, bytes: &[u8]) {
        self.write_of(0, bytes);
    }

    /// Puts a client's bytes on its line; a station that knows one client only has one line.
    pub(crate) fn write_of(&mut self, client: usize, bytes: &[u8]) {
        match self {
            Self::Marklin(station) => bytes.iter().for_each(|byte| station.write(*byte)),
            Self::DccEx(board) => board.write(bytes),
            Self::Z21(station) => station.write(client, bytes),
            Self::Can(station) => station.write(client, bytes),
            Self::LocoNet(station) => station.write(bytes),
            Self::Jmri(jmri) => jmri.write(bytes),
        }
    }

    /// A client has connected in the place of the one before. Only JMRI watches its clients.
    pub(crate) fn connect(&mut self) {
        if let Self::Jmri(jmri) = self {
            jmri.connect();
        }
    }

    /// The client has gone.
    pub(crate) fn disconnect(&mut self) {
        if let Self::Jmri(jmri) = self {
            jmri.disconnect();
        }
    }

    /// Whether the station is ready for a byte; `None` without a hand-shake line.
    pub(crate) const fn cts(&self) -> Option<bool> {
        match self {
            Self::Marklin(station) => Some(station.cts()),
            _ => None,
        }
    }

    /// The world behind it.
    pub(crate) const fn world(&self) -> &LivingLayout<'l> {
        match self {
            Self::Marklin(station) => &station.world,
            Self::DccEx(board) => &board.world,
            Self::Z21(station) => &station.world,
            Self::Can(station) => &station.world,
            Self::LocoNet(station) => &station.world,
            Self::Jmri(jmri) => &jmri.world,
        }
    }

    /// The same, to change it with.
    pub(crate) const fn world_mut(&mut self) -> &mut LivingLayout<'l> {
        match self {
            Self::Marklin(station) => &mut station.world,
            Self::DccEx(board) => &mut board.world,
            Self::Z21(station) => &mut station.world,
            Self::Can(station) => &mut station.world,
            Self::LocoNet(station) => &mut station.world,
            Self::Jmri(jmri) => &mut jmri.world,
        }
    }

    /// Solenoids that were powered for too long; with other stations the decoders of turnouts prevent that.
    pub(crate) fn alarms(&self) -> &[CoilAlarm] {
        match self {
            Self::Marklin(station) => station.alarms(),
            _ => &[],
        }
    }
}
