//! A simulated station behind a network port or a pseudo-terminal, for any program that speaks to one; behind UDP for several at once.
//!
//! Between the other program and a 6051 stands what an adapter with a hand-shake would be: it keeps bytes until the
//! station's CTS has gone down and up again. The station runs at a multiple of real time, whether anybody listens or
//! not, as trains do.

use std::collections::{BTreeMap, VecDeque};
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream, UdpSocket};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::Duration;

use footplate_core::{TimeSpan, Timestamp};
use footplate_wire::marklin_serial::BYTE_TIME;
use footplate_wire::z21::LONGEST_DATAGRAM;

use super::simulated_station::{FromSimulated, SimulatedStation};
use crate::clock::Stopwatch;

/// How finely the station's time follows real time, in its own: a fifth of a byte.
const TICK_MS: f64 = 1.0;
/// No sleep is shorter than this, whatever was asked for.
const SHORTEST_TICK_S: f64 = 1e-4;
/// How long a missing edge of CTS is waited for after a byte, as the session does.
const GUARD: TimeSpan = TimeSpan::from_ms(10);

/// What comes to the server, from whichever client.
pub(crate) enum Incoming {
    /// A client has connected; bytes for it go there.
    Client(usize, Box<dyn Write + Send>),
    /// A client sends a byte.
    Byte(usize, u8),
    /// A client has disconnected.
    Gone(usize),
    /// A client sends datagrams, beside others; datagrams for it go there.
    Peer(usize, Box<dyn Write + Send>),
    /// A client sends a datagram.
    Datagram(usize, Vec<u8>),
}

/// A station and who is connected to it.
pub(crate) struct Server<'l> {
    station: SimulatedStation<'l>,
    times: f64,
    began: Timestamp,
    stopwatch: Stopwatch,
    incoming: Receiver<Incoming>,
    client: Option<(usize, Box<dyn Write + Send>)>,
    peers: BTreeMap<usize, Box<dyn Write + Send>>,
    /// Bytes that wait until the station is ready.
    waiting: VecDeque<u8>,
    /// When the last byte was passed on, and whether CTS has gone down since.
    passed: Option<(Timestamp, bool)>,
}

impl<'l> Server<'l> {
    /// A station that runs `times` as fast as real time from now on.
    pub(crate) fn new(
        station: impl Into<SimulatedStation<'l>>,
        times: f64,
        incoming: Receiver<Incoming>,
    ) -> Self {
        let station = station.into();
        let began = station.now();
        Self {
            station,
            times,
            began,
            stopwatch: Stopwatch::start(),
            incoming,
            client: None,
            peers: BTreeMap::new(),
            waiting: VecDeque::new(),
            passed: None,
        }
    }

    /// Serves until `wants_to_stop`.
    pub(crate) fn serve(&mut self, wants_to_stop: impl Fn() -> bool) {
        let tick = Duration::from_secs_f64((TICK_MS * 1e-3 / self.times).max(SHORTEST_TICK_S));
        let mut said = Vec::new();
        while !wants_to_stop() {
            if let Ok(first) = self.incoming.recv_timeout(tick) {
                self.take(first);
                while let Ok(next) = self.incoming.try_recv() {
                    self.take(next);
                }
            }
            self.catch_up(&mut said);
            // A portion is written by itself, so that it arrives as the station sent it.
            for portion in said.drain(..) {
                if let Some((_, client)) = &mut self.client
                    && client.write_all(&portion).and_then(|()| client.flush()).is_err()
                {
                    self.client = None;
                }
            }
        }
    }

    /// The station and its world.
    pub(crate) fn station(&self) -> &SimulatedStation<'l> {
        &self.station
    }

    fn take(&mut self, incoming: Incoming) {
        match incoming {
            // A newer connection replaces the older one, which may be dead without notice.
            Incoming::Client(id, client) => {
                self.waiting.clear();
                self.client = Some((id, client));
                self.station.connect();
            }
            Incoming::Byte(id, byte) if self.is_client(id) => self.waiting.push_back(byte),
            Incoming::Gone(id) if self.is_client(id) => {
                self.client = None;
                self.station.disconnect();
            }
            Incoming::Peer(id, peer) => drop(self.peers.insert(id, peer)),
            Incoming::Datagram(id, datagram) => self.station.write_of(id, &datagram),
            Incoming::Byte(..) | Incoming::Gone(_) => {}
        }
    }

    fn is_client(&self, id: usize) -> bool {
        self.client.as_ref().is_some_and(|(client, _)| *client == id)
    }

    /// Advances the station to now.
    fn catch_up(&mut self, said: &mut Vec<Vec<u8>>) {
        let now = self.began + TimeSpan::from_s(self.stopwatch.elapsed().as_secs_f64() * self.times);
        loop {
            self.pass_on();
            let until = match self.passed {
                Some((at, false)) => now.min(at + BYTE_TIME + GUARD),
                _ => now,
            };
            match self.station.advance(until) {
                Some(FromSimulated::Bytes(bytes)) => said.push(bytes.into()),
                // A datagram that cannot be sent is lost, as others are.
                Some(FromSimulated::Datagram(id, datagram)) => {
                    let _ = self.peers.get_mut(&id).map(|peer| peer.write_all(&datagram));
                }
                Some(FromSimulated::Cts(up)) => {
                    if let Some((_, lowered)) = &mut self.passed {
                        *lowered |= !up;
                    }
                }
                None if self.station.now() >= now => return,
                None => {}
            }
        }
    }

    /// Passes the next byte to the station if it is ready.
    fn pass_on(&mut self) {
        let now = self.station.now();
        let Some(cts) = self.station.cts() else {
            self.station.write(self.waiting.make_contiguous());
            return self.waiting.clear();
        };
        let ready = cts && self.passed.is_none_or(|(at, lowered)| lowered || now >= at + BYTE_TIME + GUARD);
        if ready {
            self.passed = None;
            if let Some(byte) = self.waiting.pop_front() {
                self.station.write(&[byte]);
                self.passed = Some((now, false));
            }
        }
    }
}

/// Lets clients connect to a port, on a thread of its own; returns the port, which the system chooses if none was asked
/// for, and what comes from them.
///
/// # Errors
/// When the port cannot be had.
pub(crate) fn listen_on(address: &str) -> std::io::Result<(u16, Receiver<Incoming>)> {
    let listener = TcpListener::bind(address)?;
    let port = listener.local_addr()?.port();
    let (sender, incoming) = channel();
    std::thread::spawn(move || {
        for (id, client) in listener.incoming().enumerate() {
            let Ok(client) = client else { continue };
            if welcome(id, client, &sender).is_none() {
                return;
            }
        }
    });
    Ok((port, incoming))
}

/// `None` when the server has gone.
fn welcome(id: usize, client: TcpStream, sender: &Sender<Incoming>) -> Option<()> {
    let (Ok(()), Ok(writer)) = (client.set_nodelay(true), client.try_clone()) else { return Some(()) };
    sender.send(Incoming::Client(id, Box::new(writer))).ok()?;
    listen_to(id, client, sender.clone());
    Some(())
}

/// Passes on what a client says, on a thread of its own.
pub(crate) fn listen_to(id: usize, mut client: impl Read + Send + 'static, sender: Sender<Incoming>) {
    std::thread::spawn(move || {
        let mut bytes = [0; 64];
        while let Ok(count @ 1..) = client.read(&mut bytes) {
            if bytes.iter().take(count).any(|byte| sender.send(Incoming::Byte(id, *byte)).is_err()) {
                return;
            }
        }
        let _ = sender.send(Incoming::Gone(id));
    });
}

/// Clients that are distinguished by where their datagrams come from: more than a station knows. One more takes the place of the first.
const MOST_PEERS: usize = 64;

/// Lets clients send datagrams to a port, on a thread of its own; returns the port, which the system chooses if none was asked for,
/// and what comes from them.
///
/// # Errors
/// When the port cannot be had.
pub(crate) fn listen_for_datagrams(address: &str) -> std::io::Result<(u16, Receiver<Incoming>)> {
    let socket = UdpSocket::bind(address)?;
    let port = socket.local_addr()?.port();
    let (sender, incoming) = channel();
    std::thread::spawn(move || {
        let mut bytes = [0; LONGEST_DATAGRAM];
        let mut known: VecDeque<(usize, SocketAddr)> = VecDeque::new();
        let mut count = 0;
        loop {
            // The answer to a client that is gone comes back as an error.
            let Ok((length, from)) = socket.recv_from(&mut bytes) else { continue };
            let id = match known.iter().find(|(_, address)| *address == from) {
                Some((id, _)) => *id,
                None => {
                    let Ok(socket) = socket.try_clone() else { continue };
                    if known.len() >= MOST_PEERS {
                        known.pop_front();
                    }
                    let id = count % MOST_PEERS;
                    count += 1;
                    known.push_back((id, from));
                    if sender.send(Incoming::Peer(id, Box::new(Peer { socket, address: from }))).is_err() {
                        return;
                    }
                    id
                }
            };
            let datagram = bytes.iter().take(length).copied().collect();
            if sender.send(Incoming::Datagram(id, datagram)).is_err() {
                return;
            }
        }
    });
    Ok((port, incoming))
}

/// Where datagrams to a client go.
struct Peer {
    socket: UdpSocket,
    address: SocketAddr,
}

impl Write for Peer {
    fn write(&mut self, datagram: &[u8]) -> std::io::Result<usize> {
        self.socket.send_to(datagram, self.address)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

/// Opens a pseudo-terminal for a client; returns its path and what comes from there.
///
/// # Errors
/// When the system has none to give.
#[cfg(unix)]
pub(crate) fn open_pseudo_terminal() -> std::io::Result<(String, Receiver<Incoming>)> {
    use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
    use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};
    let master = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY)?;
    grantpt(&master)?;
    unlockpt(&master)?;
    let path = ptsname(&master, Vec::new())?.to_string_lossy().into_owned();
    // Bytes, not lines of text.
    let mut modes = tcgetattr(&master)?;
    modes.make_raw();
    tcsetattr(&master, OptionalActions::Now, &modes)?;
    // Held open, so that reading does not fail while no client is connected.
    let held = std::fs::OpenOptions::new().read(true).write(true).open(&path)?;
    let master = std::fs::File::from(master);
    let (sender, incoming) = channel();
    let _ =
        sender.send(Incoming::Client(0, Box::new(HoldsOpen { master: master.try_clone()?, _held: held })));
    listen_to(0, master, sender);
    Ok((path, incoming))
}

/// # Errors
/// Always: other systems have none.
#[cfg(not(unix))]
pub(crate) fn open_pseudo_terminal() -> std::io::Result<(String, Receiver<Incoming>)> {
    Err(std::io::Error::other("this system has no pseudo-terminals; use tcp:127.0.0.1:0"))
}

/// The station's end of a pseudo-terminal, and the other end with it.
#[cfg(unix)]
struct HoldsOpen {
    master: std::fs::File,
    _held: std::fs::File,
}

#[cfg(unix)]
impl Write for HoldsOpen {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.master.write(bytes)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        self.master.flush()
    }
}
