//! A serial port or a network connection, with the clock of this computer.
//!
//! A thread of its own waits for bytes and for the hand-shake line, so that the program can wait for them and for the
//! time at once, to a fraction of a millisecond.

use std::io::{ErrorKind, Read, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::time::Duration;

use footplate_core::{TimeSpan, Timestamp};
use serialport::{DataBits, FlowControl, Parity, SerialPort, StopBits};

use super::address::SerialAddress;
use super::board_address::BoardAddress;
use super::line::PERSON_MS;
use super::port::Port;
use super::{Heard, Link, Lost};
use crate::clock::Stopwatch;

/// The speed of the interface's line (Märklin).
const MARKLIN_BAUD: u32 = 2400;
/// The speed of a DCC-EX board's serial port.
const DCC_EX_BAUD: u32 = 115_200;
/// The speed of a serial CAN adapter.
const ADAPTER_BAUD: u32 = 115_200;
/// How often the hand-shake line is looked at: it is down for a millisecond or so after each byte.
const CTS_EVERY: Duration = Duration::from_micros(500);
/// How long a connection over a network may take to be made.
const CONNECT_WITHIN: Duration = Duration::from_secs(2);
/// A line that can not even be written to for so long is taken for lost.
const WRITE_WITHIN: Duration = Duration::from_secs(1);

/// Where a line is and how its bytes are sent.
#[derive(Debug, Clone)]
pub(crate) struct Cable {
    port: Port,
    baud: u32,
    stop_bits: StopBits,
    /// Whether its hand-shake line is used; `None`: if it can be read.
    cts: Option<bool>,
    /// How many times faster than real time the station's clock runs.
    speed: f64,
}

impl From<&SerialAddress> for Cable {
    fn from(address: &SerialAddress) -> Self {
        let SerialAddress { port, cts, speed, .. } = address.clone();
        Self { port, baud: MARKLIN_BAUD, stop_bits: StopBits::Two, cts, speed }
    }
}

impl From<&BoardAddress> for Cable {
    fn from(address: &BoardAddress) -> Self {
        let BoardAddress { port, speed, .. } = address.clone();
        Self { port, baud: DCC_EX_BAUD, stop_bits: StopBits::One, cts: Some(false), speed }
    }
}

impl From<(&Port, f64)> for Cable {
    /// A connection, or an adapter on USB, whose port runs as fast as it can whatever is set.
    fn from((port, speed): (&Port, f64)) -> Self {
        Self { port: port.clone(), baud: ADAPTER_BAUD, stop_bits: StopBits::One, cts: Some(false), speed }
    }
}

/// A line outside this process.
pub(crate) struct StreamLink {
    cable: Cable,
    line: Line,
    stopwatch: Stopwatch,
}

/// What is new when a line is opened again.
struct Line {
    writer: Box<dyn Write + Send>,
    arrivals: Receiver<Arrival>,
    cts: Option<bool>,
}

enum Arrival {
    Byte(u8),
    Cts(bool),
    Lost(String),
}

impl StreamLink {
    pub(crate) fn open(cable: impl Into<Cable>) -> Result<Self, Lost> {
        let cable = cable.into();
        Ok(Self { line: open(&cable)?, cable, stopwatch: Stopwatch::start() })
    }
}

fn open(cable: &Cable) -> Result<Line, Lost> {
    match &cable.port {
        Port::Tcp { host, port } => connect(host, *port),
        Port::Device(path) => open_device(path, cable),
    }
}

fn connect(host: &str, port: u16) -> Result<Line, Lost> {
    let failed = |error: &dyn std::fmt::Display| {
        Lost(format!("cannot connect to {host}:{port}: {error}; check that the station's server runs there"))
    };
    let mut addresses = (host, port).to_socket_addrs().map_err(|error| failed(&error))?;
    let address = addresses.next().ok_or_else(|| failed(&"the name has no address"))?;
    let stream = TcpStream::connect_timeout(&address, CONNECT_WITHIN).map_err(|error| failed(&error))?;
    // A byte waits for nobody.
    stream.set_nodelay(true).map_err(|error| failed(&error))?;
    stream.set_write_timeout(Some(WRITE_WITHIN)).map_err(|error| failed(&error))?;
    let mut reader = stream.try_clone().map_err(|error| failed(&error))?;
    let (sender, arrivals) = channel();
    std::thread::spawn(move || {
        let mut bytes = [0; 64];
        loop {
            match reader.read(&mut bytes) {
                Ok(0) => {
                    return drop(sender.send(Arrival::Lost("the connection was closed".into())));
                }
                Ok(count) => {
                    let all = bytes.iter().take(count).try_for_each(|b| sender.send(Arrival::Byte(*b)));
                    if all.is_err() {
                        return;
                    }
                }
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) => return drop(sender.send(Arrival::Lost(error.to_string()))),
            }
        }
    });
    Ok(Line { writer: Box::new(stream), arrivals, cts: None })
}

fn open_device(path: &str, cable: &Cable) -> Result<Line, Lost> {
    let failed = |error: &serialport::Error| {
        Lost(format!(
            "cannot open `{path}`: {error}; check the cable, the name of the port and that you may use it"
        ))
    };
    let port = serialport::new(path, cable.baud)
        .data_bits(DataBits::Eight)
        .parity(Parity::None)
        .stop_bits(cable.stop_bits)
        // The hand-shake is kept byte by byte above; the driver's own lets buffered bytes slip through.
        .flow_control(FlowControl::None)
        .timeout(CTS_EVERY)
        .open();
    let mut port = port.map_err(|error| failed(&error))?;
    let cts = if cable.cts == Some(false) { None } else { port.read_clear_to_send().ok() };
    if cable.cts == Some(true) && cts.is_none() {
        return Err(Lost(format!(
            "`{path}` has no CTS line that can be read, as a pseudo-terminal has none; leave out `cts=yes`"
        )));
    }
    let reader = port.try_clone().map_err(|error| failed(&error))?;
    let (sender, arrivals) = channel();
    std::thread::spawn(move || listen(reader, cts, &sender));
    Ok(Line { writer: Box::new(port), arrivals, cts })
}

fn listen(mut port: Box<dyn SerialPort>, mut cts: Option<bool>, sender: &Sender<Arrival>) {
    let mut bytes = [0; 64];
    loop {
        let mut arrived = Ok(());
        match port.read(&mut bytes) {
            // A pseudo-terminal whose other end is gone reads nothing, at once and for ever.
            Ok(0) => arrived = sender.send(Arrival::Lost("the other end has gone".into())),
            Ok(count) => {
                arrived = bytes.iter().take(count).try_for_each(|byte| sender.send(Arrival::Byte(*byte)));
            }
            Err(error) if matches!(error.kind(), ErrorKind::TimedOut | ErrorKind::Interrupted) => {}
            Err(error) => {
                return drop(sender.send(Arrival::Lost(error.to_string())));
            }
        }
        if cts.is_some() {
            match port.read_clear_to_send() {
                Ok(up) if cts != Some(up) => {
                    cts = Some(up);
                    arrived = arrived.and(sender.send(Arrival::Cts(up)));
                }
                Ok(_) => {}
                Err(error) => return drop(sender.send(Arrival::Lost(error.to_string()))),
            }
        }
        if arrived.is_err() {
            return;
        }
    }
}

impl Link for StreamLink {
    fn now(&self) -> Timestamp {
        Timestamp::from_s(self.stopwatch.elapsed().as_secs_f64() * self.cable.speed)
    }

    fn write(&mut self, bytes: &[u8]) -> Result<(), Lost> {
        let written = self.line.writer.write_all(bytes).and_then(|()| self.line.writer.flush());
        written.map_err(|error| Lost(format!("cannot write to `{}`: {error}", self.cable.port)))
    }

    fn wait(&mut self, until: Timestamp) -> Heard {
        let span_s = (until - self.now()).as_s() / self.cable.speed;
        let heard = match self.line.arrivals.try_recv() {
            Ok(arrival) => Ok(arrival),
            Err(_) if span_s <= 0.0 => return Heard::Nothing,
            Err(_) => self.line.arrivals.recv_timeout(Duration::from_secs_f64(span_s)),
        };
        match heard {
            Ok(Arrival::Byte(byte)) => Heard::Byte(byte),
            Ok(Arrival::Cts(up)) => {
                self.line.cts = Some(up);
                Heard::Cts(up)
            }
            Ok(Arrival::Lost(why)) => Heard::Lost(Lost(format!("`{}` is gone: {why}", self.cable.port))),
            Err(RecvTimeoutError::Timeout) => Heard::Nothing,
            Err(RecvTimeoutError::Disconnected) => {
                Heard::Lost(Lost(format!("`{}` is gone", self.cable.port)))
            }
        }
    }

    fn cts(&self) -> Option<bool> {
        self.line.cts
    }

    fn patience(&self) -> TimeSpan {
        TimeSpan::from_s(PERSON_MS * 1e-3 * self.cable.speed)
    }

    fn reopen(&mut self) -> Result<(), Lost> {
        self.line = open(&self.cable)?;
        Ok(())
    }
}
