//! A station behind UDP, with the clock of this computer.
//!
//! A thread of its own waits for datagrams, so that the program can wait for them and for the time at once.

use std::io::ErrorKind;
use std::net::{SocketAddr, ToSocketAddrs, UdpSocket};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::time::Duration;

use footplate_core::{TimeSpan, Timestamp};
use footplate_wire::z21::LONGEST_DATAGRAM;

use super::can_address::{CanAddress, CanPlace};
use super::line::PERSON_MS;
use super::z21_address::Z21Address;
use super::{Heard, Link, Lost};
use crate::clock::Stopwatch;

/// How soon a thread notices that nobody listens to it any more.
const NOTICES_EVERY: Duration = Duration::from_millis(250);

/// Where a station is, and where it answers to.
#[derive(Debug, Clone)]
pub(crate) struct Correspondent {
    host: String,
    port: u16,
    /// The port that it sends to, from whichever of its own; `None`: it answers to where it was written from.
    receive_at: Option<u16>,
    /// How many times faster than real time the station's clock runs.
    speed: f64,
}

impl From<&Z21Address> for Correspondent {
    fn from(address: &Z21Address) -> Self {
        let Z21Address { host, port, speed, .. } = address.clone();
        Self { host, port, receive_at: None, speed }
    }
}

impl From<&CanAddress> for Correspondent {
    fn from(address: &CanAddress) -> Self {
        let (host, port, receive_at) = match address.place.clone() {
            CanPlace::Datagrams { host, port, receive_at } => (host, port, receive_at),
            CanPlace::Line(port) => (port.to_string(), 0, 0),
        };
        Self { host, port, receive_at: Some(receive_at), speed: address.speed }
    }
}

/// A station that is spoken to in datagrams.
pub(crate) struct DatagramLink {
    place: Correspondent,
    line: Line,
    stopwatch: Stopwatch,
}

/// What is new when a line is opened again.
struct Line {
    socket: UdpSocket,
    station: SocketAddr,
    arrivals: Receiver<Result<Vec<u8>, String>>,
    is_open: Arc<AtomicBool>,
}

impl Drop for Line {
    fn drop(&mut self) {
        self.is_open.store(false, Ordering::Relaxed);
    }
}

impl DatagramLink {
    pub(crate) fn open(place: impl Into<Correspondent>) -> Result<Self, Lost> {
        let place = place.into();
        Ok(Self { line: open(&place)?, place, stopwatch: Stopwatch::start() })
    }
}

fn open(place: &Correspondent) -> Result<Line, Lost> {
    let Correspondent { host, port, receive_at, .. } = place;
    let failed = |error: &dyn std::fmt::Display| {
        Lost(format!("cannot reach {host}:{port}: {error}; check the station's address and the network"))
    };
    let mut addresses = (host.as_str(), *port).to_socket_addrs().map_err(|error| failed(&error))?;
    let station = addresses.next().ok_or_else(|| failed(&"the name has no address"))?;
    let any = if station.is_ipv4() { "0.0.0.0" } else { "::" };
    let own = receive_at.unwrap_or_default();
    let socket = UdpSocket::bind((any, own)).map_err(|error| {
        Lost(format!("cannot receive at port {own}: {error}; close the program that uses it, or connect by tcp://{host}:{port}"))
    })?;
    if receive_at.is_none() {
        socket.connect(station).map_err(|error| failed(&error))?;
    }
    socket.set_read_timeout(Some(NOTICES_EVERY)).map_err(|error| failed(&error))?;
    let reader = socket.try_clone().map_err(|error| failed(&error))?;
    let (sender, arrivals) = channel();
    let is_open = Arc::new(AtomicBool::new(true));
    let listens = Arc::clone(&is_open);
    std::thread::spawn(move || listen(&reader, station, &listens, &sender));
    Ok(Line { socket, station, arrivals, is_open })
}

fn listen(
    socket: &UdpSocket,
    station: SocketAddr,
    is_open: &AtomicBool,
    sender: &Sender<Result<Vec<u8>, String>>,
) {
    let mut bytes = [0; LONGEST_DATAGRAM];
    while is_open.load(Ordering::Relaxed) {
        let arrived = match socket.recv_from(&mut bytes) {
            // What others send to this port is not the station's.
            Ok((_, from)) if from.ip() != station.ip() => continue,
            Ok((count, _)) => Ok(bytes.iter().take(count).copied().collect()),
            Err(error) if is_passing(error.kind()) => continue,
            Err(error) => Err(error.to_string()),
        };
        let is_over = arrived.is_err();
        if sender.send(arrived).is_err() || is_over {
            return;
        }
    }
}

/// Nobody listens at the other end yet, or any more: a station that starts. The session notices that it is silent.
const fn is_passing(kind: ErrorKind) -> bool {
    matches!(
        kind,
        ErrorKind::WouldBlock
            | ErrorKind::TimedOut
            | ErrorKind::Interrupted
            | ErrorKind::ConnectionRefused
            | ErrorKind::ConnectionReset
    )
}

impl Link for DatagramLink {
    fn now(&self) -> Timestamp {
        Timestamp::from_s(self.stopwatch.elapsed().as_secs_f64() * self.place.speed)
    }

    fn write(&mut self, bytes: &[u8]) -> Result<(), Lost> {
        let sent = match self.place.receive_at {
            None => self.line.socket.send(bytes),
            Some(_) => self.line.socket.send_to(bytes, self.line.station),
        };
        match sent {
            Ok(_) => Ok(()),
            Err(error) if is_passing(error.kind()) => Ok(()),
            Err(error) => {
                Err(Lost(format!("cannot write to {}:{}: {error}", self.place.host, self.place.port)))
            }
        }
    }

    fn wait(&mut self, until: Timestamp) -> Heard {
        let span_s = (until - self.now()).as_s() / self.place.speed;
        let heard = match self.line.arrivals.try_recv() {
            Ok(arrival) => Ok(arrival),
            Err(_) if span_s <= 0.0 => return Heard::Nothing,
            Err(_) => self.line.arrivals.recv_timeout(Duration::from_secs_f64(span_s)),
        };
        match heard {
            Ok(Ok(datagram)) => Heard::Datagram(datagram),
            Ok(Err(why)) => {
                Heard::Lost(Lost(format!("{}:{} is gone: {why}", self.place.host, self.place.port)))
            }
            Err(RecvTimeoutError::Timeout) => Heard::Nothing,
            Err(RecvTimeoutError::Disconnected) => {
                Heard::Lost(Lost(format!("{}:{} is gone", self.place.host, self.place.port)))
            }
        }
    }

    fn cts(&self) -> Option<bool> {
        None
    }

    fn patience(&self) -> TimeSpan {
        TimeSpan::from_s(PERSON_MS * 1e-3 * self.place.speed)
    }

    fn reopen(&mut self) -> Result<(), Lost> {
        self.line = open(&self.place)?;
        Ok(())
    }
}
