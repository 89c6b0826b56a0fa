//! Connects a machine with a simulated station through its bytes, on the clock of the simulation.

use footplate_core::control::{Machine, Output};
use footplate_core::{Command, Timestamp};
use footplate_sim::{FromStation, VirtualStation};
use footplate_wire::marklin_serial::{EncodeError, Interface, Settings};
use footplate_wire::{BlockReports, LinkNotice, Session, Transmit};

/// S88 modules that the session polls: the five of the course layouts.
const MODULES: u8 = 5;

/// A simulated station and the session at the other end of the link. A clone is a copy of the world.
#[derive(Clone)]
pub struct VirtualLine<'l> {
    /// The station, with the world behind it.
    pub station: VirtualStation<'l>,
    interface: Interface,
    blocks: Option<BlockReports>,
}

impl<'l> VirtualLine<'l> {
    /// Opens the link.
    pub fn open(station: VirtualStation<'l>) -> Result<Self, EncodeError> {
        let now = station.now();
        let mut interface = Interface::new(now, Settings::with_cts(MODULES))?;
        interface.handle_cts(now, station.cts());
        let blocks = BlockReports::of(station.world.layout(), &mut interface);
        Ok(Self { station, interface, blocks })
    }

    /// The time of the station.
    pub const fn now(&self) -> Timestamp {
        self.station.now()
    }

    /// Drives until the machine has a notice or a time is reached.
    pub fn drive<M: Machine>(&mut self, machine: &mut M, until: Timestamp) -> Option<M::Notice> {
        self.drive_hearing(machine, until, |_, _, _| {})
    }

    /// The same; `hear` receives the notices of the link.
    pub fn drive_hearing<M: Machine>(
        &mut self,
        machine: &mut M,
        until: Timestamp,
        hear: impl Fn(&mut M, Timestamp, &LinkNotice),
    ) -> Option<M::Notice> {
        loop {
            let now = self.now();
            if let Some(notice) = self.settle(machine, now, &hear) {
                return Some(notice);
            }
            if now >= until {
                return None;
            }
            let timeouts = [machine.next_timeout(), self.interface.next_timeout()];
            let wake = timeouts.into_iter().flatten().fold(until, Timestamp::min).max(now);
            match self.station.advance(wake) {
                Some(FromStation::Byte(byte)) => self.interface.handle_bytes(self.station.now(), &[byte]),
                Some(FromStation::Cts(up)) => self.interface.handle_cts(self.station.now(), up),
                None => {
                    self.interface.handle_timeout(self.station.now());
                    if machine.next_timeout().is_some_and(|due| due <= self.station.now()) {
                        machine.handle_timeout(self.station.now());
                    }
                }
            }
        }
    }

    /// Exchanges all pending outputs between machine and session.
    fn settle<M: Machine>(
        &mut self,
        machine: &mut M,
        now: Timestamp,
        hear: impl Fn(&mut M, Timestamp, &LinkNotice),
    ) -> Option<M::Notice> {
        loop {
            while let Some(transmit) = self.interface.poll_output() {
                let Some(transmit) = (match &mut self.blocks {
                    Some(blocks) => blocks.take(transmit),
                    None => Some(transmit),
                }) else {
                    continue;
                };
                match transmit {
                    Transmit::Byte(byte) => self.station.write(byte),
                    Transmit::Message(bytes) => bytes.iter().for_each(|byte| self.station.write(*byte)),
                    Transmit::Event(event) => machine.handle_event(now, &event),
                    Transmit::Notice(notice) => hear(machine, now, &notice),
                    Transmit::Functions(..) | Transmit::Direction(..) | Transmit::ReportedSpeed(..) => {}
                }
            }
            match machine.poll_output()? {
                Output::Command(command) => self.command(command),
                Output::HoldLine(until) => self.interface.hold_line(until),
                Output::Watch(sensor) => {
                    let layout = self.station.world.layout();
                    self.interface.watch(sensor.map(|sensor| layout.input(sensor)));
                }
                Output::Notice(notice) => return Some(notice),
            }
        }
    }

    fn command(&mut self, command: Command) {
        // Machines send only commands that the decoder supports: none is refused.
        let _ = self.interface.handle_command(self.now(), command);
    }
}
