//! The line to a station outside this process: a serial port, a connection or datagrams, with the clock of this computer.
//!
//! A thread of its own waits for what arrives, so that the program can wait for that and for the time at once, to a
//! fraction of a millisecond.

use std::fmt::{Display, Formatter, Result as FmtResult};
use std::io::Write;
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::Duration;

use footplate_core::{TimeSpan, Timestamp};

use super::cable_end::{Arrival, CableEnd};
use super::datagrams::exchange_datagrams;
use super::line::PERSON_MS;
use super::place::Place;
use super::stream::{connect, open_device};
use super::web_socket::connect_socket;
use super::{Heard, Link, Lost};
use crate::clock::Stopwatch;

/// Where a line is and how its bytes are sent.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Cable {
    pub(super) place: Place,
    /// How many times faster than real time the station's clock runs; 1 for a real station.
    pub(super) speed: f64,
    /// Whether the station answers each command: all but a 6050 or 6051 do.
    pub(super) has_answers: bool,
}

impl Cable {
    /// How many times faster than real time the station's clock runs.
    pub(crate) const fn speed(&self) -> f64 {
        self.speed
    }

    /// Whether bytes are exchanged in datagrams, which may be lost without notice.
    pub(crate) const fn has_datagrams(&self) -> bool {
        matches!(self.place, Place::Datagrams(_))
    }

    /// Whether bytes go over a connection, whose other end may be gone without notice.
    pub(crate) const fn is_connection(&self) -> bool {
        matches!(self.place, Place::Tcp { .. } | Place::WebSocket { .. })
    }

    /// Whether the station answers each command.
    pub(crate) const fn has_answers(&self) -> bool {
        self.has_answers
    }

    /// Opens it. What arrives is given to `deliver` on a thread of its own, until that answers `false`.
    ///
    /// # Errors
    /// When the port cannot be opened.
    pub(crate) fn open(
        &self,
        deliver: impl FnMut(Arrival<'_>) -> bool + Send + 'static,
    ) -> Result<CableEnd, Lost> {
        match &self.place {
            Place::Tcp { host, port } => connect(host, *port, deliver),
            Place::Device(path, format) => open_device(path, format, deliver),
            Place::Datagrams(correspondent) => exchange_datagrams(correspondent, deliver),
            Place::WebSocket { host, port } => connect_socket(host, *port, deliver),
        }
    }
}

impl Display for Cable {
    fn fmt(&self, f: &mut Formatter<'_>) -> FmtResult {
        self.place.fmt(f)
    }
}

/// A line that this process holds itself.
pub(crate) struct CableLink {
    cable: Cable,
    /// `None` while it is opened again: two ends cannot hold one port.
    line: Option<Line>,
    stopwatch: Stopwatch,
}

/// What is new when a line is opened again.
struct Line {
    end: CableEnd,
    arrivals: Receiver<Heard>,
}

impl CableLink {
    /// Opens a line.
    ///
    /// # Errors
    /// When the port cannot be opened.
    pub(crate) fn open(cable: Cable) -> Result<Self, Lost> {
        Ok(Self { line: Some(open(&cable)?), cable, stopwatch: Stopwatch::start() })
    }

    fn is_gone(&self) -> Lost {
        Lost(format!("`{}` is gone", self.cable))
    }
}

fn open(cable: &Cable) -> Result<Line, Lost> {
    let (sender, arrivals) = channel();
    let (name, has_datagrams) = (cable.to_string(), cable.has_datagrams());
    let end = cable.open(move |arrival| {
        let sent = match arrival {
            Arrival::Bytes(bytes) if has_datagrams => sender.send(Heard::Datagram(bytes.to_vec())),
            Arrival::Bytes(bytes) => bytes.iter().try_for_each(|byte| sender.send(Heard::Byte(*byte))),
            Arrival::Cts(up) => sender.send(Heard::Cts(up)),
            Arrival::Lost(why) => sender.send(Heard::Lost(Lost(format!("`{name}` is gone: {why}")))),
        };
        sent.is_ok()
    })?;
    Ok(Line { end, arrivals })
}

impl Link for CableLink {
    fn now(&self) -> Timestamp {
        Timestamp::from_s(self.stopwatch.elapsed().as_secs_f64() * self.cable.speed)
    }

    fn write(&mut self, bytes: &[u8]) -> Result<(), Lost> {
        let Some(line) = &mut self.line else { return Err(self.is_gone()) };
        let written = line.end.writer.write_all(bytes).and_then(|()| line.end.writer.flush());
        written.map_err(|error| Lost(format!("cannot write to `{}`: {error}", self.cable)))
    }

    fn wait(&mut self, until: Timestamp) -> Heard {
        let span_s = (until - self.now()).as_s() / self.cable.speed;
        let Some(line) = &mut self.line else { return Heard::Lost(self.is_gone()) };
        let heard = match line.arrivals.try_recv() {
            Ok(arrival) => Ok(arrival),
            Err(_) if span_s <= 0.0 => return Heard::Nothing,
            Err(_) => line.arrivals.recv_timeout(Duration::from_secs_f64(span_s)),
        };
        match heard {
            Ok(heard) => {
                if let Heard::Cts(up) = heard {
                    line.end.cts = Some(up);
                }
                heard
            }
            Err(RecvTimeoutError::Timeout) => Heard::Nothing,
            Err(RecvTimeoutError::Disconnected) => Heard::Lost(self.is_gone()),
        }
    }

    fn cts(&self) -> Option<bool> {
        self.line.as_ref().and_then(|line| line.end.cts)
    }

    fn patience(&self) -> TimeSpan {
        TimeSpan::from_s(PERSON_MS * 1e-3 * self.cable.speed)
    }

    fn real_time(&self) -> Duration {
        self.stopwatch.elapsed()
    }

    fn reopen(&mut self) -> Result<(), Lost> {
        self.line = None;
        self.line = Some(open(&self.cable)?);
        Ok(())
    }

    fn may_be_half_open(&self) -> bool {
        self.cable.is_connection()
    }
}
