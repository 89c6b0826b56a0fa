//! A station behind UDP, with the clock of this computer.
//!
//! A thread of its own waits for datagrams, so that the program can wait for them and for the time at once.

use std::io::ErrorKind;
use std::net::{ToSocketAddrs, UdpSocket};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::time::Duration;

use footplate_core::{TimeSpan, Timestamp};
use footplate_wire::z21::LONGEST_DATAGRAM;

use super::line::PERSON_MS;
use super::z21_address::Z21Address;
use super::{Heard, Link, Lost};
use crate::clock::Stopwatch;

/// How soon a thread notices that nobody listens to it any more.
const NOTICES_EVERY: Duration = Duration::from_millis(250);

/// A station that is spoken to in datagrams.
pub(crate) struct DatagramLink {
    host: String,
    port: u16,
    /// How many times faster than real time the station's clock runs.
    speed: f64,
    line: Line,
    stopwatch: Stopwatch,
}

/// What is new when a line is opened again.
struct Line {
    socket: UdpSocket,
    arrivals: Receiver<Result<Vec<u8>, String>>,
    is_open: Arc<AtomicBool>,
}

impl Drop for Line {
    fn drop(&mut self) {
        self.is_open.store(false, Ordering::Relaxed);
    }
}

impl DatagramLink {
    pub(crate) fn open(address: &Z21Address) -> Result<Self, Lost> {
        let Z21Address { host, port, speed, .. } = address.clone();
        Ok(Self { line: open(&host, port)?, host, port, speed, stopwatch: Stopwatch::start() })
    }
}

fn open(host: &str, port: u16) -> Result<Line, Lost> {
    let failed = |error: &dyn std::fmt::Display| {
        Lost(format!("cannot reach {host}:{port}: {error}; check the station's address and the network"))
    };
    let mut addresses = (host, port).to_socket_addrs().map_err(|error| failed(&error))?;
    let address = addresses.next().ok_or_else(|| failed(&"the name has no address"))?;
    let any = if address.is_ipv4() { "0.0.0.0:0" } else { "[::]:0" };
    let socket = UdpSocket::bind(any).map_err(|error| failed(&error))?;
    socket.connect(address).map_err(|error| failed(&error))?;
    socket.set_read_timeout(Some(NOTICES_EVERY)).map_err(|error| failed(&error))?;
    let reader = socket.try_clone().map_err(|error| failed(&error))?;
    let (sender, arrivals) = channel();
    let is_open = Arc::new(AtomicBool::new(true));
    let listens = Arc::clone(&is_open);
    std::thread::spawn(move || listen(&reader, &listens, &sender));
    Ok(Line { socket, arrivals, is_open })
}

fn listen(socket: &UdpSocket, is_open: &AtomicBool, sender: &Sender<Result<Vec<u8>, String>>) {
    let mut bytes = [0; LONGEST_DATAGRAM];
    while is_open.load(Ordering::Relaxed) {
        let arrived = match socket.recv(&mut bytes) {
            Ok(count) => Ok(bytes.iter().take(count).copied().collect()),
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
        Timestamp::from_s(self.stopwatch.elapsed().as_secs_f64() * self.speed)
    }

    fn write(&mut self, bytes: &[u8]) -> Result<(), Lost> {
        match self.line.socket.send(bytes) {
            Ok(_) => Ok(()),
            Err(error) if is_passing(error.kind()) => Ok(()),
            Err(error) => Err(Lost(format!("cannot write to {}:{}: {error}", self.host, self.port))),
        }
    }

    fn wait(&mut self, until: Timestamp) -> Heard {
        let span_s = (until - self.now()).as_s() / self.speed;
        let heard = match self.line.arrivals.try_recv() {
            Ok(arrival) => Ok(arrival),
            Err(_) if span_s <= 0.0 => return Heard::Nothing,
            Err(_) => self.line.arrivals.recv_timeout(Duration::from_secs_f64(span_s)),
        };
        match heard {
            Ok(Ok(datagram)) => Heard::Datagram(datagram),
            Ok(Err(why)) => Heard::Lost(Lost(format!("{}:{} is gone: {why}", self.host, self.port))),
            Err(RecvTimeoutError::Timeout) => Heard::Nothing,
            Err(RecvTimeoutError::Disconnected) => {
                Heard::Lost(Lost(format!("{}:{} is gone", self.host, self.port)))
            }
        }
    }

    fn cts(&self) -> Option<bool> {
        None
    }

    fn patience(&self) -> TimeSpan {
        TimeSpan::from_s(PERSON_MS * 1e-3 * self.speed)
    }

    fn reopen(&mut self) -> Result<(), Lost> {
        self.line = open(&self.host, self.port)?;
        Ok(())
    }
}
