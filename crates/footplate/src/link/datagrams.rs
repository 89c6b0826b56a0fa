//! Exchanges datagrams with a station; a thread of its own waits for those that arrive.

use std::fmt::{Display, Formatter, Result as FmtResult};
use std::io::{ErrorKind, Result as IoResult, Write};
use std::net::{SocketAddr, ToSocketAddrs, UdpSocket};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

use footplate_wire::z21::LONGEST_DATAGRAM;

use super::Lost;
use super::cable_end::{Arrival, CableEnd};

/// How soon the reading thread notices that its line is closed; so long at most a port is not free yet.
const NOTICES_EVERY: Duration = Duration::from_millis(50);

/// Where a station is, and where it answers to.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Correspondent {
    pub(super) host: String,
    pub(super) port: u16,
    /// The port that it sends to, from whichever of its own; `None`: it answers to where it was written from.
    pub(super) receive_at: Option<u16>,
}

impl Display for Correspondent {
    fn fmt(&self, f: &mut Formatter<'_>) -> FmtResult {
        write!(f, "{}:{}", self.host, self.port)
    }
}

/// Sends one datagram per call.
struct Sender {
    socket: UdpSocket,
    /// The station, where the socket is not connected to it.
    station: Option<SocketAddr>,
    is_open: Arc<AtomicBool>,
    reader: Option<JoinHandle<()>>,
}

impl Write for Sender {
    fn write(&mut self, bytes: &[u8]) -> IoResult<usize> {
        let sent = match self.station {
            None => self.socket.send(bytes),
            Some(station) => self.socket.send_to(bytes, station),
        };
        match sent {
            Err(error) if is_passing(error.kind()) => Ok(bytes.len()),
            sent => sent,
        }
    }

    fn flush(&mut self) -> IoResult<()> {
        Ok(())
    }
}

impl Drop for Sender {
    /// The port is free afterwards.
    fn drop(&mut self) {
        self.is_open.store(false, Ordering::Relaxed);
        // A reader that panicked has closed its socket, too.
        let _ = self.reader.take().map(JoinHandle::join);
    }
}

/// Opens a socket to a station.
///
/// # Errors
/// When its name has no address, or another program receives at the port.
pub(super) fn exchange_datagrams(
    correspondent: &Correspondent,
    deliver: impl FnMut(Arrival<'_>) -> bool + Send + 'static,
) -> Result<CableEnd, Lost> {
    let Correspondent { host, port, receive_at } = correspondent;
    let failed = |error: &dyn Display| {
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
    let is_open = Arc::new(AtomicBool::new(true));
    let listens = Arc::clone(&is_open);
    let reader = std::thread::spawn(move || listen(&reader, station, &listens, deliver));
    let station = receive_at.map(|_| station);
    Ok(CableEnd { writer: Box::new(Sender { socket, station, is_open, reader: Some(reader) }), cts: None })
}

fn listen(
    socket: &UdpSocket,
    station: SocketAddr,
    is_open: &AtomicBool,
    mut deliver: impl FnMut(Arrival<'_>) -> bool,
) {
    let mut bytes = [0; LONGEST_DATAGRAM];
    while is_open.load(Ordering::Relaxed) {
        let goes_on = match socket.recv_from(&mut bytes) {
            // What others send to this port is not the station's.
            Ok((_, from)) if from.ip() != station.ip() => continue,
            Ok((count, _)) => deliver(Arrival::Bytes(bytes.get(..count).unwrap_or_default())),
            Err(error) if is_passing(error.kind()) => continue,
            Err(error) => {
                let _ = deliver(Arrival::Lost(&error.to_string()));
                return;
            }
        };
        if !goes_on {
            return;
        }
    }
}

/// Whether an error passes by itself: no program receives at the other end yet, or any more, as at a station that starts. The
/// session notices that it is silent.
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
