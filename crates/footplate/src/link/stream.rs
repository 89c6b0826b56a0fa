//! A serial port or a network connection, with the clock of this computer.
//!
//! A thread of its own waits for bytes and for the hand-shake line, so that the program can wait for them and for the
//! time at once, to a fraction of a millisecond.

use std::fmt::{Display, Formatter, Result as FmtResult};
use std::io::{ErrorKind, Read, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
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
    end: CableEnd,
    arrivals: Receiver<Heard>,
}

/// This computer's end of an open cable.
pub(crate) struct CableEnd {
    /// Where bytes are put on the line.
    pub(crate) writer: Box<dyn Write + Send>,
    /// Whether the station's hand-shake line is up; `None` where there is none that could be read.
    pub(crate) cts: Option<bool>,
}

/// What a cable's listener hears.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Arrival<'a> {
    /// Bytes from the station.
    Bytes(&'a [u8]),
    /// The hand-shake line is up or down now.
    Cts(bool),
    /// The line is gone; why.
    Lost(&'a str),
}

impl Cable {
    /// How many times faster than real time the station's clock runs.
    pub(crate) const fn speed(&self) -> f64 {
        self.speed
    }

    /// Opens it. What arrives is given to `deliver` on a thread of its own, until that answers `false`.
    ///
    /// # Errors
    /// When the port cannot be opened.
    pub(crate) fn open(
        &self,
        deliver: impl FnMut(Arrival<'_>) -> bool + Send + 'static,
    ) -> Result<CableEnd, Lost> {
        match &self.port {
            Port::Tcp { host, port } => connect(host, *port, deliver),
            Port::Device(path) => open_device(path, self, deliver),
        }
    }
}

impl Display for Cable {
    fn fmt(&self, f: &mut Formatter<'_>) -> FmtResult {
        self.port.fmt(f)
    }
}

impl StreamLink {
    pub(crate) fn open(cable: impl Into<Cable>) -> Result<Self, Lost> {
        let cable = cable.into();
        Ok(Self { line: open(&cable)?, cable, stopwatch: Stopwatch::start() })
    }
}

fn open(cable: &Cable) -> Result<Line, Lost> {
    let (sender, arrivals) = channel();
    let port = cable.port.clone();
    let end = cable.open(move |arrival| {
        let sent = match arrival {
            Arrival::Bytes(bytes) => bytes.iter().try_for_each(|byte| sender.send(Heard::Byte(*byte))),
            Arrival::Cts(up) => sender.send(Heard::Cts(up)),
            Arrival::Lost(why) => sender.send(Heard::Lost(Lost(format!("`{port}` is gone: {why}")))),
        };
        sent.is_ok()
    })?;
    Ok(Line { end, arrivals })
}

fn connect(
    host: &str,
    port: u16,
    mut deliver: impl FnMut(Arrival<'_>) -> bool + Send + 'static,
) -> Result<CableEnd, Lost> {
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
    std::thread::spawn(move || {
        let mut bytes = [0; 64];
        loop {
            match reader.read(&mut bytes) {
                Ok(0) => {
                    let _ = deliver(Arrival::Lost("the connection was closed"));
                    return;
                }
                Ok(count) => {
                    if !deliver(Arrival::Bytes(bytes.get(..count).unwrap_or_default())) {
                        return;
                    }
                }
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) => {
                    let _ = deliver(Arrival::Lost(&error.to_string()));
                    return;
                }
            }
        }
    });
    Ok(CableEnd { writer: Box::new(stream), cts: None })
}

fn open_device(
    path: &str,
    cable: &Cable,
    deliver: impl FnMut(Arrival<'_>) -> bool + Send + 'static,
) -> Result<CableEnd, Lost> {
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
    std::thread::spawn(move || listen(reader, cts, deliver));
    Ok(CableEnd { writer: Box::new(port), cts })
}

fn listen(
    mut port: Box<dyn SerialPort>,
    mut cts: Option<bool>,
    mut deliver: impl FnMut(Arrival<'_>) -> bool,
) {
    let mut bytes = [0; 64];
    loop {
        let mut goes_on = true;
        match port.read(&mut bytes) {
            // A pseudo-terminal whose other end is gone reads nothing, at once and for ever.
            Ok(0) => {
                let _ = deliver(Arrival::Lost("the other end has gone"));
                return;
            }
            Ok(count) => goes_on = deliver(Arrival::Bytes(bytes.get(..count).unwrap_or_default())),
            Err(error) if matches!(error.kind(), ErrorKind::TimedOut | ErrorKind::Interrupted) => {}
            Err(error) => {
                let _ = deliver(Arrival::Lost(&error.to_string()));
                return;
            }
        }
        if cts.is_some() {
            match port.read_clear_to_send() {
                Ok(up) if cts != Some(up) => {
                    cts = Some(up);
                    goes_on &= deliver(Arrival::Cts(up));
                }
                Ok(_) => {}
                Err(error) => {
                    let _ = deliver(Arrival::Lost(&error.to_string()));
                    return;
                }
            }
        }
        if !goes_on {
            return;
        }
    }
}

impl Link for StreamLink {
    fn now(&self) -> Timestamp {
        Timestamp::from_s(self.stopwatch.elapsed().as_secs_f64() * self.cable.speed)
    }

    fn write(&mut self, bytes: &[u8]) -> Result<(), Lost> {
        let written = self.line.end.writer.write_all(bytes).and_then(|()| self.line.end.writer.flush());
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
            Ok(heard) => {
                if let Heard::Cts(up) = heard {
                    self.line.end.cts = Some(up);
                }
                heard
            }
            Err(RecvTimeoutError::Timeout) => Heard::Nothing,
            Err(RecvTimeoutError::Disconnected) => {
                Heard::Lost(Lost(format!("`{}` is gone", self.cable.port)))
            }
        }
    }

    fn cts(&self) -> Option<bool> {
        self.line.end.cts
    }

    fn patience(&self) -> TimeSpan {
        TimeSpan::from_s(PERSON_MS * 1e-3 * self.cable.speed)
    }

    fn reopen(&mut self) -> Result<(), Lost> {
        self.line = open(&self.cable)?;
        Ok(())
    }
}
