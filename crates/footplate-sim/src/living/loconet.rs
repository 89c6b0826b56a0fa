//! A virtual command station on LocoNet behind a server (LbServer): lines in and out, at the pace of the bus.
//!
//! The bus carries one message after the other, of the host, of the station and of detectors alike. Locomotives are driven through
//! slots; a slot whose locomotive is not commanded for long is given away. It does not watch its clients: trains run on when they are
//! gone.

mod obeying;

use std::collections::VecDeque;

use footplate_core::{Ratio, SensorId, TimeSpan, Timestamp, TrainId};
use footplate_wire::loconet::{BUS_BYTE, Line, Lines, Message, SentReport, SlotData, SlotUse};

use crate::draws::{Draws, Purpose};
use crate::living::delivery::{Delivery, Outgoing};
use crate::living::s88::Edge;
use crate::living::world::LivingLayout;

/// The version of the server.
const VERSION: &str = "LbServer (simulated by Footplate)";
/// The transit time of a line through the network (s; chosen: a wired one).
const NETWORK_S: std::ops::Range<f64> = 0.000_2..0.001;
/// The silence before a message, with the additional wait by priority (s; 1.2 ms and up to 1.5 ms).
const SILENCE_S: std::ops::Range<f64> = 0.001_2..0.002_7;
/// The answer time (s; chosen).
const ANSWER_S: std::ops::Range<f64> = 0.001..0.008;
/// The time from occupancy to the report of the detector (s; chosen: a scan of its inputs).
const DETECTION_S: std::ops::Range<f64> = 0.0..0.02;
/// The time without commands after which a slot is given away.
const PURGED_AFTER: TimeSpan = TimeSpan::from_ms(200_000);
/// The interval of the search for such slots.
const PURGES_EVERY: TimeSpan = TimeSpan::from_ms(1_000);
/// The time from a reset until it receives messages.
const BOOT: TimeSpan = TimeSpan::from_ms(2_000);
/// The longest step of the world, so that no report is late.
const LOOK_EVERY: TimeSpan = TimeSpan::from_ms(1);

/// The properties of the station and its server, as observed on real ones or reported of them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LocoNetSwitches {
    /// Whether the server sends its version to a new client.
    pub has_version: bool,
    /// Whether the server repeats what a client sends, as a message that it has received.
    pub echoes: bool,
    /// How often a message of the host fails to reach the bus, which the server reports.
    pub refused: Ratio,
    /// The number of slots.
    pub slots: u8,
    /// The portions in which lines arrive.
    pub delivery: Delivery,
}

impl Default for LocoNetSwitches {
    fn default() -> Self {
        Self { has_version: true, echoes: true, refused: Ratio::ZERO, slots: 119, delivery: Delivery::Each }
    }
}

/// A locomotive in a slot.
#[derive(Debug, Clone, Copy)]
struct Slot {
    data: SlotData,
    /// The functions beyond those in its data that packets switched on in its decoder.
    higher_functions: u32,
    commanded: Timestamp,
}

/// The sender of a message on the bus.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Sender {
    Host,
    Station,
    Detector,
}

/// A message that waits for the bus.
#[derive(Debug, Clone, Copy)]
struct Waiting {
    ready: Timestamp,
    sender: Sender,
    message: Message,
}

/// A living layout behind a command station on LocoNet, on a clock of its own.
#[derive(Debug, Clone)]
pub struct VirtualLocoNet<'l> {
    /// The layout; an operator intervenes in it.
    pub world: LivingLayout<'l>,
    switches: LocoNetSwitches,
    draws: Draws,
    now: Timestamp,
    /// Lines from the host that have not arrived yet.
    incoming: VecDeque<(Timestamp, Vec<u8>)>,
    lines: Lines,
    waiting: Vec<Waiting>,
    /// The message on the bus, and when it ends.
    on_bus: Option<(Timestamp, Waiting)>,
    bus_is_free: Timestamp,
    outgoing: Outgoing,
    slots: Vec<Slot>,
    /// All locomotives were stopped, and the power was not switched since.
    is_stopped: bool,
    /// The end of a power cut or a start.
    dark_until: Option<Timestamp>,
    purges: Timestamp,
}

/// An occurrence in the station or on its line.
#[derive(Debug, Clone, Copy)]
enum Next {
    Incoming,
    Begins(usize),
    Ends,
    Outgoing,
    Light,
    Purges,
}

impl<'l> VirtualLocoNet<'l> {
    /// A station in front of a layout, which has been driving the trains on it: it has slots for them, which are not in use. The track has no
    /// power yet. Sensor 0 of the layout is input 1.
    pub fn new(mut world: LivingLayout<'l>, seed: u64, switches: LocoNetSwitches) -> Self {
        let now = world.now();
        let slot = |(number, train): (u8, TrainId)| {
            let forward = world.runs_forward(train).unwrap_or(true);
            let data = SlotData { address: train.0, forward, ..free_slot(number) };
            Slot { data: data.used_as(SlotUse::Common), higher_functions: 0, commanded: now }
        };
        let slots = (1..=switches.slots).zip(world.train_ids()).map(slot).collect();
        world.power(false, now);
        world.s88.take_edges(now);
        let mut station = Self {
            world,
            switches,
            draws: Draws::new(seed, Purpose::Line),
            now,
            incoming: VecDeque::new(),
            lines: Lines::default(),
            waiting: Vec::new(),
            on_bus: None,
            bus_is_free: now,
            outgoing: Outgoing::new(now, switches.delivery, TimeSpan::ZERO),
            slots,
            is_stopped: false,
            dark_until: None,
            purges: now + PURGES_EVERY,
        };
        if switches.has_version {
            station.say(&Line::Version(VERSION.to_owned()));
        }
        station
    }

    /// The time.
    pub const fn now(&self) -> Timestamp {
        self.now
    }

    /// The functions of a locomotive that are on, F0 in the lowest bit; none of one that is in no slot.
    pub fn functions(&self, train: TrainId) -> u32 {
        let slot = self.slots.iter().find(|slot| slot.data.address == train.0);
        slot.map_or(0, |slot| slot.data.functions | slot.higher_functions)
    }

    /// The command station is switched off and on: it knows no locomotive, and the track has no power. The server stays.
    pub fn restart(&mut self) {
        let now = self.now;
        self.world.power(false, now);
        self.world.forget_commands();
        self.slots.clear();
        self.waiting.retain(|waiting| waiting.sender == Sender::Host);
        self.is_stopped = false;
        self.dark_until = Some(now + BOOT);
    }

    /// The host writes bytes.
    pub fn write(&mut self, bytes: &[u8]) {
        let last = self.incoming.back().map_or(self.now, |(last, _)| *last);
        let arrives = self.now + TimeSpan::from_s(self.draws.uniform(NETWORK_S));
        self.incoming.push_back((arrives.max(last), bytes.to_vec()));
    }

    /// Advances to a time, or until something reaches the host before it: the bytes of one portion.
    pub fn advance(&mut self, until: Timestamp) -> Option<Vec<u8>> {
        loop {
            let next = self.next().filter(|(at, _)| *at <= until);
            let at = next.map_or(until, |(at, _)| at).max(self.now);
            let looks = at.min(self.now + LOOK_EVERY);
            self.world.advance(looks);
            self.now = looks;
            self.look(looks);
            match next {
                _ if looks < at => {}
                Some((_, Next::Outgoing)) => return self.outgoing.take(),
                Some((_, next)) => self.happen(next),
                // A report may have become due while the world went on.
                None if self.next().is_none_or(|(at, _)| at > until) => return None,
                None => {}
            }
        }
    }

    /// The next occurrence and its time; of simultaneous ones, the first of this list.
    fn next(&self) -> Option<(Timestamp, Next)> {
        let first = self.waiting.iter().enumerate().min_by_key(|(_, waiting)| waiting.ready);
        let begins = first.filter(|_| self.on_bus.is_none());
        let begins =
            begins.map(|(place, waiting)| (waiting.ready.max(self.bus_is_free), Next::Begins(place)));
        let coming = [
            self.incoming.front().map(|(at, _)| (*at, Next::Incoming)),
            begins,
            self.on_bus.map(|(at, _)| (at, Next::Ends)),
            self.outgoing.due().map(|at| (at, Next::Outgoing)),
            self.dark_until.map(|at| (at, Next::Light)),
            Some((self.purges, Next::Purges)),
        ];
        coming.into_iter().flatten().min_by_key(|(at, _)| *at)
    }

    fn happen(&mut self, next: Next) {
        match next {
            Next::Incoming => {
                let Some((_, bytes)) = self.incoming.pop_front() else { return };
                for byte in bytes {
                    let line = self.lines.push(byte).map(Line::read);
                    match line {
                        Some(Ok(Line::Send(message))) => self.queue(Sender::Host, message, 0.0),
                        Some(_) => self.say(&Line::Sent(SentReport::Error)),
                        None => {}
                    }
                }
            }
            Next::Begins(place) => {
                let waiting = self.waiting.remove(place);
                let length = waiting.message.encode().len() as i64;
                let takes = TimeSpan::from_ns(length * BUS_BYTE.as_ns());
                let silence = TimeSpan::from_s(self.draws.uniform(SILENCE_S));
                self.on_bus = Some((self.now + silence + takes, waiting));
            }
            Next::Ends => {
                let Some((_, Waiting { sender, message, .. })) = self.on_bus.take() else { return };
                self.bus_is_free = self.now;
                self.passed(sender, message);
            }
            Next::Light => self.dark_until = None,
            Next::Purges => {
                self.purges = self.now + PURGES_EVERY;
                let now = self.now;
                for slot in self.slots.iter_mut().filter(|slot| now - slot.commanded > PURGED_AFTER) {
                    slot.data = slot.data.used_as(SlotUse::Common);
                }
            }
            Next::Outgoing => {}
        }
    }

    /// A message has passed on the bus: the server reports it, and the station executes it.
    fn passed(&mut self, sender: Sender, message: Message) {
        let is_host = sender == Sender::Host;
        let refused = self.switches.refused;
        if is_host && refused > Ratio::ZERO && self.draws.chance(refused.as_parts()) {
            return self.say(&Line::Sent(SentReport::Error));
        }
        if !is_host || self.switches.echoes {
            self.say(&Line::Receive(message));
        }
        if is_host {
            self.say(&Line::Sent(SentReport::Ok));
            if self.dark_until.is_none() {
                self.obey(message);
            }
        }
    }

    /// Finds the sensors that have changed, and when their detectors report it.
    fn look(&mut self, by: Timestamp) {
        for Edge { at, sensor, is_occupied } in self.world.s88.take_edges(by) {
            if self.dark_until.is_some() {
                continue;
            }
            let message = Message::Input { number: number_of(sensor), is_occupied };
            let delay = self.draws.uniform(DETECTION_S);
            let ready = at + TimeSpan::from_s(delay);
            // What is said of one sensor stays in order.
            let is_same = |waiting: &&Waiting| matches!(waiting.message, Message::Input { number, .. } if number == number_of(sensor));
            let last = self.waiting.iter().filter(is_same).map(|waiting| waiting.ready).max();
            let ready = last.map_or(ready, |last| ready.max(last + TimeSpan::from_us(100)));
            self.waiting.push(Waiting { ready, sender: Sender::Detector, message });
        }
    }

    /// A message waits for the bus from some time on.
    fn queue(&mut self, sender: Sender, message: Message, after_s: f64) {
        self.waiting.push(Waiting { ready: self.now + TimeSpan::from_s(after_s), sender, message });
    }

    fn answer(&mut self, message: Message) {
        let after_s = self.draws.uniform(ANSWER_S);
        self.queue(Sender::Station, message, after_s);
    }

    fn say(&mut self, line: &Line) {
        self.outgoing.post(self.now, line.text().as_bytes(), &mut self.draws);
    }
}

/// The address of a sensor's input.
const fn number_of(sensor: SensorId) -> u16 {
    sensor.0 + 1
}

/// A slot that is not in use, with a decoder of 128 steps.
const fn free_slot(slot: u8) -> SlotData {
    SlotData { slot, status: 3, address: 0, speed: 0, forward: true, functions: 0, track: 0, rest: [0; 3] }
}
