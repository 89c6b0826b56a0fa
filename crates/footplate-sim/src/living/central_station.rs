//! The virtual Central Station: a living layout behind the frames of Märklin's CAN bus, over datagrams, a stream or a serial adapter.
//!
//! The codec is that of the program; the times are the simulation's own. All inputs are
//! loaded into the S88 bus at once, a cycle apart, and remembered until then; one after the other is shifted out and reported.
//! Directions are absolute, the decoders know 14 speed steps. It does not watch its clients: trains run on when they are gone.

mod adapter;
mod obeying;
mod scanning;

use std::collections::VecDeque;

use footplate_core::track::Leg;
use footplate_core::{Ratio, TimeSpan, Timestamp, TrainId, TurnoutId};
use footplate_wire::marklin_can::{
    AccessoryProtocol, Frame, Framing, LocomotiveProtocol, Message, Transport, Uid,
};

use self::adapter::Adapter;
use self::scanning::Scanning;
use crate::draws::{Draws, Purpose};
use crate::living::network::{Disturbances, Network};
use crate::living::world::LivingLayout;

/// A frame with eight bytes on the bus: about 130 bits at 250 kbit/s.
const FRAME_TIME: TimeSpan = TimeSpan::from_us(520);
/// The answer time (s; chosen: stations answer within some milliseconds).
const ANSWER_S: std::ops::Range<f64> = 0.001..0.006;
/// The transit time of bytes in a stream or an adapter (s; chosen).
const LINE_S: std::ops::Range<f64> = 0.000_2..0.001_5;
/// The delay of the second part of a split frame (s; chosen).
const SPLIT_S: std::ops::Range<f64> = 0.000_5..0.005;
/// The interval of pings.
const PING_EVERY: TimeSpan = TimeSpan::from_ms(10_000);
/// The time from power on to the first answer (chosen: a box, not the half minute of a screen).
const BOOT: TimeSpan = TimeSpan::from_ms(4_000);
/// The hash of its frames, seen on a real track box; the published formula does not yield it.
const HASH: u16 = 0x9346;
/// The most clients; more than any layout has.
const MOST_CLIENTS: usize = 64;

/// The transport of frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum CanTransport {
    /// Each in a datagram, to every client.
    #[default]
    Datagrams,
    /// One behind the other in a stream.
    Stream,
    /// As lines of text, through a serial CAN adapter that its user has to open.
    Adapter,
}

/// The properties of the station and its line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CanSwitches {
    /// The transport of frames.
    pub transport: CanTransport,
    /// How often a datagram is lost, in either direction.
    pub lost: Ratio,
    /// How often one is duplicated.
    pub duplicated: Ratio,
    /// How often one is overtaken by those that follow it.
    pub overtaken: Ratio,
    /// Whether a stream arrives in random parts.
    pub is_split: bool,
    /// Whether it does what is commanded without confirming it, as one server program does.
    pub is_mute: bool,
    /// Whether reports of sensors include how long the previous state lasted.
    pub has_times: bool,
    /// Whether it answers polls of its modules.
    pub answers_polls: bool,
    /// Whether it sends a list of its locomotives.
    pub has_list: bool,
    /// The protocol of its locomotives.
    pub locomotives: LocomotiveProtocol,
    /// How often it reads its sensors; 100 ms unless its owner has set it (Link S88).
    pub scan: TimeSpan,
}

impl Default for CanSwitches {
    fn default() -> Self {
        Self {
            transport: CanTransport::default(),
            lost: Ratio::ZERO,
            duplicated: Ratio::ZERO,
            overtaken: Ratio::ZERO,
            is_split: false,
            is_mute: false,
            has_times: true,
            answers_polls: true,
            has_list: true,
            locomotives: LocomotiveProtocol::Mfx,
            scan: TimeSpan::from_ms(100),
        }
    }
}

/// A locomotive that was in any message.
#[derive(Debug, Clone, Copy)]
struct Slot {
    uid: Uid,
    speed: u16,
    forward: bool,
    functions: u32,
}

/// A living layout behind a Central Station, on a clock of its own.
#[derive(Debug, Clone)]
pub struct VirtualCentralStation<'l> {
    /// The layout; an operator intervenes in it.
    pub world: LivingLayout<'l>,
    switches: CanSwitches,
    draws: Draws,
    now: Timestamp,
    network: Network,
    clients: Vec<usize>,
    adapter: Adapter,
    framing: Framing,
    /// Frames that the bytes of a stream or an adapter made, and when the station reads each.
    incoming: VecDeque<(Timestamp, Frame)>,
    /// Bytes that the host of a stream or an adapter will receive.
    outgoing: VecDeque<(Timestamp, Vec<u8>)>,
    bus_is_free: Timestamp,
    slots: Vec<Slot>,
    scanning: Scanning,
    ping_due: Timestamp,
    /// The end of its start.
    dark_until: Option<Timestamp>,
}

/// An occurrence in the station or on its line.
#[derive(Debug, Clone, Copy)]
enum Next {
    Datagram,
    Frame,
    Scan,
    Report,
    ToClient,
    ToHost,
    Ping,
    Light,
}

impl<'l> VirtualCentralStation<'l> {
    /// A station in front of a layout, which has been driving the trains on it: it knows which end of each leads. The track has no
    /// power yet. The layout's sensor 0 is input 1, its turnout 1 is the first.
    pub fn new(mut world: LivingLayout<'l>, seed: u64, switches: CanSwitches) -> Self {
        let now = world.now();
        let slot = |train: TrainId| {
            let forward = world.runs_forward(train).unwrap_or(true);
            Slot { uid: switches.locomotives.uid(train.0), speed: 0, forward, functions: 0 }
        };
        let slots = world.train_ids().map(slot).collect();
        world.power(false, now);
        let mut draws = Draws::new(seed, Purpose::Line);
        let CanSwitches { lost, duplicated, overtaken, .. } = switches;
        let network =
            Network::new(draws.split(), Disturbances { lost, duplicated, overtaken, is_slow: false });
        let scanning = Scanning::begin(&mut world, now, switches.scan, &mut draws);
        Self {
            world,
            switches,
            draws,
            now,
            network,
            clients: Vec::new(),
            adapter: Adapter::default(),
            framing: Framing::new(Transport::Network),
            incoming: VecDeque::new(),
            outgoing: VecDeque::new(),
            bus_is_free: now,
            slots,
            scanning,
            ping_due: now + PING_EVERY,
            dark_until: None,
        }
    }

    /// The time.
    pub const fn now(&self) -> Timestamp {
        self.now
    }

    /// How frames travel.
    pub const fn transport(&self) -> CanTransport {
        self.switches.transport
    }

    /// It is switched off and on: the track loses power, and it reads nothing for some seconds. Then all speeds are 0.
    pub fn restart(&mut self) {
        let now = self.now;
        self.world.power(false, now);
        self.world.forget_commands();
        self.slots.iter_mut().for_each(|slot| slot.speed = 0);
        self.network.clear();
        self.incoming.clear();
        self.outgoing.clear();
        self.adapter = Adapter::default();
        self.dark_until = Some(now + BOOT);
    }

    /// A client sends a datagram, or more of its stream.
    pub fn write(&mut self, client: usize, bytes: &[u8]) {
        match self.switches.transport {
            CanTransport::Datagrams => {
                if !self.clients.contains(&client) && self.clients.len() < MOST_CLIENTS {
                    self.clients.push(client);
                }
                self.network.send_to_station(self.now, client, bytes);
            }
            CanTransport::Stream => {
                for byte in bytes {
                    if let Some(frame) = self.framing.push(*byte) {
                        self.take_in(frame);
                    }
                }
            }
            CanTransport::Adapter => {
                for byte in bytes {
                    let (answer, frame) = self.adapter.push(*byte);
                    if let Some(answer) = answer {
                        self.put_out(self.now, answer.as_bytes().to_vec());
                    }
                    if let Some(frame) = frame {
                        self.take_in(frame);
                    }
                }
            }
        }
    }

    /// Advances to a time, or until bytes reach a client before it.
    pub fn advance(&mut self, until: Timestamp) -> Option<(usize, Vec<u8>)> {
        loop {
            let next = self.next().filter(|(at, _)| *at <= until);
            self.now = next.map_or(until, |(at, _)| at).max(self.now);
            self.world.advance(self.now);
            match next {
                Some((_, Next::ToClient)) => return self.network.take_to_client(),
                Some((_, Next::ToHost)) => return self.outgoing.pop_front().map(|(_, bytes)| (0, bytes)),
                Some((_, next)) => self.happen(next),
                None => return None,
            }
        }
    }

    /// The next occurrence and its time; of simultaneous ones, the first of this list.
    fn next(&self) -> Option<(Timestamp, Next)> {
        let coming = [
            (self.network.next_to_station(), Next::Datagram),
            (self.incoming.front().map(|(at, _)| *at), Next::Frame),
            (Some(self.scanning.due()), Next::Scan),
            (self.scanning.next_report(), Next::Report),
            (self.network.next_to_client(), Next::ToClient),
            (self.outgoing.front().map(|(at, _)| *at), Next::ToHost),
            (Some(self.ping_due), Next::Ping),
            (self.dark_until, Next::Light),
        ];
        coming.into_iter().filter_map(|(at, next)| Some((at?, next))).min_by_key(|(at, _)| *at)
    }

    fn happen(&mut self, next: Next) {
        let is_dark = self.dark_until.is_some();
        match next {
            Next::Datagram => {
                let datagram = self.network.take_to_station().map(|(_, datagram)| datagram);
                let frame = datagram.and_then(|bytes| bytes.try_into().ok()).and_then(Frame::decode);
                if let Some(frame) = frame.filter(|_| !is_dark) {
                    self.obey(&frame);
                }
            }
            Next::Frame => {
                if let Some((_, frame)) = self.incoming.pop_front()
                    && !is_dark
                {
                    self.obey(&frame);
                }
            }
            Next::Scan => self.scanning.scan(&mut self.world, self.switches.has_times, &mut self.draws),
            Next::Report => {
                if let Some(report) = self.scanning.take_report()
                    && !is_dark
                {
                    self.post(self.now, report, true);
                }
            }
            Next::Ping => {
                self.ping_due += PING_EVERY;
                if !is_dark {
                    self.post(self.now, Message::Ping, false);
                }
            }
            Next::Light => self.dark_until = None,
            Next::ToClient | Next::ToHost => {}
        }
    }

    /// A frame from the host of a stream or an adapter is complete.
    fn take_in(&mut self, frame: Frame) {
        let due = self.now + TimeSpan::from_s(self.draws.uniform(LINE_S));
        let due = self.incoming.back().map_or(due, |(last, _)| due.max(*last));
        self.incoming.push_back((due, frame));
    }

    /// Sends a message after the answer time.
    fn say(&mut self, message: Message) {
        let due = self.now + TimeSpan::from_s(self.draws.uniform(ANSWER_S));
        self.post(due, message, true);
    }

    /// Sends a frame on the bus, after those before it.
    fn post(&mut self, due: Timestamp, message: Message, is_response: bool) {
        let leaves = self.bus_is_free.max(due) + FRAME_TIME;
        self.bus_is_free = leaves;
        let frame = message.frame(is_response, HASH);
        match self.switches.transport {
            CanTransport::Datagrams => {
                for client in self.clients.clone() {
                    self.network.send_to_client(leaves, client, &frame.encode());
                }
            }
            CanTransport::Stream => self.put_out(leaves, frame.encode().to_vec()),
            CanTransport::Adapter if self.adapter.is_open() => {
                self.put_out(leaves, (frame.to_text() + "\r").into_bytes());
            }
            CanTransport::Adapter => {}
        }
    }

    /// Sends bytes to the host of a stream or an adapter, in order.
    fn put_out(&mut self, leaves: Timestamp, mut bytes: Vec<u8>) {
        let due = leaves + TimeSpan::from_s(self.draws.uniform(LINE_S));
        let mut due = self.outgoing.back().map_or(due, |(last, _)| due.max(*last));
        if self.switches.is_split {
            let second = bytes.split_off(self.draws.below(bytes.len() + 1));
            self.outgoing.push_back((due, bytes));
            due += TimeSpan::from_s(self.draws.uniform(SPLIT_S));
            bytes = second;
        }
        self.outgoing.push_back((due, bytes));
    }

    /// The decoder of a turnout powers its coil for long enough and lets go by itself.
    fn lay(&mut self, uid: Uid, curved: bool) {
        let protocols = [AccessoryProtocol::Motorola, AccessoryProtocol::Dcc];
        let address = protocols.into_iter().find_map(|protocol| protocol.address(uid));
        if let Some(turnout) = address.filter(|_| self.world.is_powered()).map(TurnoutId) {
            self.world.points.power(turnout, Leg::from_curved(curved), self.now);
        }
    }
}
