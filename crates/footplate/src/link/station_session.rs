//! The session that an open line is used with: the one of its kind of station.

use footplate_core::track::Layout;
use footplate_core::{Command, DecoderSteps, SensorId, Timestamp, TrainId};
use footplate_wire::marklin_serial::Interface;
use footplate_wire::{
    BlockReports, Closing, CommandError, Session, Transmit, dcc_ex, jmri, loconet, marklin_can, z21,
};

/// A session with any station that there is.
#[derive(Debug, Clone)]
pub(crate) struct StationSession {
    station: Station,
    blocks: Option<BlockReports>,
}

impl<S: Into<Station>> From<S> for StationSession {
    fn from(station: S) -> Self {
        Self { station: station.into(), blocks: None }
    }
}

impl StationSession {
    /// The session of the station's kind.
    pub(crate) const fn station(&self) -> &Station {
        &self.station
    }

    /// What the detectors of blocks report; `None` for a layout without blocks.
    pub(crate) const fn blocks(&self) -> Option<&BlockReports> {
        self.blocks.as_ref()
    }

    /// Reports trains that come into the blocks of a layout.
    pub(crate) fn with_blocks(mut self, layout: &Layout) -> Self {
        self.blocks = BlockReports::of(layout, self.station.any_mut());
        self
    }
}

/// The session of each kind of station.
#[derive(Debug, Clone)]
pub(crate) enum Station {
    /// A Märklin 6050 or 6051.
    Marklin(Interface),
    /// A DCC-EX board.
    DccEx(dcc_ex::Client),
    /// A Z21.
    Z21(z21::Client),
    /// A station on Märklin's CAN bus.
    Can(Box<marklin_can::Client>),
    /// A command station on LocoNet.
    LocoNet(Box<loconet::Client>),
    /// JMRI.
    Jmri(Box<jmri::Client>),
}

impl From<Interface> for Station {
    fn from(session: Interface) -> Self {
        Self::Marklin(session)
    }
}

impl From<dcc_ex::Client> for Station {
    fn from(session: dcc_ex::Client) -> Self {
        Self::DccEx(session)
    }
}

impl From<z21::Client> for Station {
    fn from(session: z21::Client) -> Self {
        Self::Z21(session)
    }
}

impl From<marklin_can::Client> for Station {
    fn from(session: marklin_can::Client) -> Self {
        Self::Can(Box::new(session))
    }
}

impl From<loconet::Client> for Station {
    fn from(session: loconet::Client) -> Self {
        Self::LocoNet(Box::new(session))
    }
}

impl From<jmri::Client> for Station {
    fn from(session: jmri::Client) -> Self {
        Self::Jmri(Box::new(session))
    }
}

impl Station {
    fn any(&self) -> &dyn Session {
        match self {
            Self::Marklin(session) => session,
            Self::DccEx(session) => session,
            Self::Z21(session) => session,
            Self::Can(session) => session.as_ref(),
            Self::LocoNet(session) => session.as_ref(),
            Self::Jmri(session) => session.as_ref(),
        }
    }

    fn any_mut(&mut self) -> &mut dyn Session {
        match self {
            Self::Marklin(session) => session,
            Self::DccEx(session) => session,
            Self::Z21(session) => session,
            Self::Can(session) => session.as_mut(),
            Self::LocoNet(session) => session.as_mut(),
            Self::Jmri(session) => session.as_mut(),
        }
    }
}

impl Session for StationSession {
    fn handle_bytes(&mut self, now: Timestamp, bytes: &[u8]) {
        self.station.any_mut().handle_bytes(now, bytes);
    }
    fn handle_cts(&mut self, now: Timestamp, up: bool) {
        self.station.any_mut().handle_cts(now, up);
    }
    fn handle_reopened(&mut self, now: Timestamp) {
        self.station.any_mut().handle_reopened(now);
    }
    fn set_decoder(&mut self, train: TrainId, steps: DecoderSteps) -> Result<(), CommandError> {
        self.station.any_mut().set_decoder(train, steps)
    }
    fn set_direction(&mut self, train: TrainId, forward: bool) {
        self.station.any_mut().set_direction(train, forward);
    }
    fn handle_command(&mut self, now: Timestamp, command: Command) -> Result<(), CommandError> {
        self.station.any_mut().handle_command(now, command)
    }
    fn stop_all(&mut self) {
        self.station.any_mut().stop_all();
    }
    fn hold_line(&mut self, until: Option<Timestamp>) {
        self.station.any_mut().hold_line(until);
    }
    fn watch(&mut self, sensor: Option<SensorId>) {
        let input = |sensor| self.blocks.as_ref().map_or(sensor, |blocks| blocks.input(sensor));
        let sensor = sensor.map(input);
        self.station.any_mut().watch(sensor);
    }
    fn expect_delays(&mut self, excess: footplate_core::TimeSpan) {
        self.station.any_mut().expect_delays(excess);
    }
    fn handle_timeout(&mut self, now: Timestamp) {
        self.station.any_mut().handle_timeout(now);
    }
    fn poll_output(&mut self) -> Option<Transmit> {
        loop {
            let output = self.station.any_mut().poll_output()?;
            let Some(blocks) = &mut self.blocks else { return Some(output) };
            if let Some(output) = blocks.take(output) {
                return Some(output);
            }
        }
    }
    fn next_timeout(&self) -> Option<Timestamp> {
        self.station.any().next_timeout()
    }
    fn close(&mut self, now: Timestamp) {
        self.station.any_mut().close(now);
    }
    fn closing(&self) -> Closing {
        self.station.any().closing()
    }
}
