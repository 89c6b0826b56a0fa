//! The session that an open line is used with: the one of its kind of station.

use footplate_core::{Command, DecoderSteps, SensorId, Timestamp, TrainId};
use footplate_wire::marklin_serial::Interface;
use footplate_wire::{Closing, CommandError, Session, Transmit, dcc_ex, loconet, marklin_can, z21};

/// A session with any station that there is.
#[derive(Debug, Clone)]
pub(crate) enum StationSession {
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
}

impl From<Interface> for StationSession {
    fn from(session: Interface) -> Self {
        Self::Marklin(session)
    }
}

impl From<dcc_ex::Client> for StationSession {
    fn from(session: dcc_ex::Client) -> Self {
        Self::DccEx(session)
    }
}

impl From<z21::Client> for StationSession {
    fn from(session: z21::Client) -> Self {
        Self::Z21(session)
    }
}

impl From<marklin_can::Client> for StationSession {
    fn from(session: marklin_can::Client) -> Self {
        Self::Can(Box::new(session))
    }
}

impl From<loconet::Client> for StationSession {
    fn from(session: loconet::Client) -> Self {
        Self::LocoNet(Box::new(session))
    }
}

impl StationSession {
    fn any(&self) -> &dyn Session {
        match self {
            Self::Marklin(session) => session,
            Self::DccEx(session) => session,
            Self::Z21(session) => session,
            Self::Can(session) => session.as_ref(),
            Self::LocoNet(session) => session.as_ref(),
        }
    }

    fn any_mut(&mut self) -> &mut dyn Session {
        match self {
            Self::Marklin(session) => session,
            Self::DccEx(session) => session,
            Self::Z21(session) => session,
            Self::Can(session) => session.as_mut(),
            Self::LocoNet(session) => session.as_mut(),
        }
    }
}

impl Session for StationSession {
    fn handle_bytes(&mut self, now: Timestamp, bytes: &[u8]) {
        self.any_mut().handle_bytes(now, bytes);
    }
    fn handle_cts(&mut self, now: Timestamp, up: bool) {
        self.any_mut().handle_cts(now, up);
    }
    fn handle_reopened(&mut self, now: Timestamp) {
        self.any_mut().handle_reopened(now);
    }
    fn set_decoder(&mut self, train: TrainId, steps: DecoderSteps) -> Result<(), CommandError> {
        self.any_mut().set_decoder(train, steps)
    }
    fn handle_command(&mut self, now: Timestamp, command: Command) -> Result<(), CommandError> {
        self.any_mut().handle_command(now, command)
    }
    fn hold_line(&mut self, until: Option<Timestamp>) {
        self.any_mut().hold_line(until);
    }
    fn watch(&mut self, sensor: Option<SensorId>) {
        self.any_mut().watch(sensor);
    }
    fn expect_delays(&mut self, excess: footplate_core::TimeSpan) {
        self.any_mut().expect_delays(excess);
    }
    fn handle_timeout(&mut self, now: Timestamp) {
        self.any_mut().handle_timeout(now);
    }
    fn poll_output(&mut self) -> Option<Transmit> {
        self.any_mut().poll_output()
    }
    fn next_timeout(&self) -> Option<Timestamp> {
        self.any().next_timeout()
    }
    fn close(&mut self, now: Timestamp) {
        self.any_mut().close(now);
    }
    fn closing(&self) -> Closing {
        self.any().closing()
    }
}
