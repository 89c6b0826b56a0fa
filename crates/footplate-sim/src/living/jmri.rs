//! A virtual JMRI in front of a living layout: lines of its JSON in and out, and hardware behind it that takes its time.
//!
//! It answers from its own memory at once. What it passes on reaches the track later, and what sensors see reaches it later. When a
//! connection ends it stops the trains whose throttles only that client had.

mod obeying;

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use footplate_core::{SensorId, TimeSpan, Timestamp, TrainId, TurnoutId};
use footplate_wire::dcc_ex::Throttle;
use footplate_wire::jmri::{Lines, Reply, Request, System};

use crate::draws::{Draws, Purpose};
use crate::living::delivery::{Delivery, Outgoing};
use crate::living::due_queue::DueQueue;
use crate::living::s88::Edge;
use crate::living::world::LivingLayout;

/// Its version, and the name of the railway.
const VERSION: &str = "5.14 (simulated by Footplate)";
const RAILROAD: &str = "a simulated railway";
/// The system that it is connected to, and how the names of its sensors and turnouts begin.
const SYSTEM: &str = "LocoNet";
const PREFIX: &str = "L";
/// The transit time of a message through the network, with the time until JMRI reads it (s; chosen).
const NETWORK_S: std::ops::Range<f64> = 0.000_5..0.004;
/// The answer time (s; chosen).
const ANSWER_S: std::ops::Range<f64> = 0.000_5..0.006;
/// The time from an order to a throttle or a turnout until the track carries it (s; chosen: a LocoNet bus, or XpressNet's polling).
const HARDWARE_S: std::ops::Range<f64> = 0.004..0.03;
/// The time from occupancy to the report (s; chosen as of LocoNet's detectors, with JMRI on top).
const DETECTION_S: std::ops::Range<f64> = 0.003..0.06;
/// The same of hardware whose sensors JMRI polls (s; chosen: ten nodes of C/MRI at 9600 baud).
const POLLED_S: std::ops::Range<f64> = 0.01..0.15;
/// The longest step of the world: less than the shortest delay of a report.
const LOOK_EVERY: TimeSpan = TimeSpan::from_ms(2);

/// The properties of JMRI and its hardware.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct JmriSwitches {
    /// Whether it states the prefix of its system.
    pub has_prefix: bool,
    /// Whether its hardware says whether the track has power.
    pub knows_power: bool,
    /// Whether its sensors are polled.
    pub polls: bool,
    /// The number of locomotives that its hardware drives.
    pub throttles: usize,
}

impl Default for JmriSwitches {
    fn default() -> Self {
        Self { has_prefix: true, knows_power: true, polls: false, throttles: 100 }
    }
}

/// A locomotive as JMRI remembers it.
#[derive(Debug, Clone)]
struct Locomotive {
    train: TrainId,
    /// The name of the client's throttle for it, if it has one.
    name: Option<String>,
    throttle: Throttle,
    forward: bool,
    functions: u32,
}

/// An order that the hardware has not carried out yet.
#[derive(Debug, Clone, Copy)]
enum Order {
    Drive(TrainId),
    Turnout(TurnoutId, bool),
    Power(bool),
}

/// A living layout behind JMRI, on a clock of its own.
#[derive(Debug, Clone)]
pub struct VirtualJmri<'l> {
    /// The layout; an operator intervenes in it.
    pub world: LivingLayout<'l>,
    switches: JmriSwitches,
    draws: Draws,
    now: Timestamp,
    system: System,
    /// Lines from the client that have not arrived yet.
    incoming: VecDeque<(Timestamp, Vec<u8>)>,
    lines: Lines,
    answers: VecDeque<(Timestamp, Reply)>,
    orders: DueQueue<Order>,
    reports: DueQueue<(SensorId, bool)>,
    outgoing: Outgoing,
    locomotives: Vec<Locomotive>,
    /// The states of sensors as JMRI knows them.
    sensors: BTreeMap<SensorId, bool>,
    /// The sensors that the client has asked for.
    listened: BTreeSet<SensorId>,
}

/// An occurrence in JMRI or on its lines.
#[derive(Debug, Clone, Copy)]
enum Next {
    Incoming,
    Answer,
    Order,
    Report,
    Outgoing,
}

impl<'l> VirtualJmri<'l> {
    /// JMRI in front of a layout, with a client that has just connected. It has driven the trains before and knows how they face; the track
    /// has no power yet. Sensor 0 of the layout is `LS1`, turnout 1 is `LT1`.
    pub fn new(mut world: LivingLayout<'l>, seed: u64, switches: JmriSwitches) -> Self {
        let now = world.now();
        let known = |train: TrainId| Locomotive {
            train,
            name: None,
            throttle: Throttle::Speed(0),
            forward: world.runs_forward(train).unwrap_or(true),
            functions: 0,
        };
        let locomotives = world.train_ids().map(known).collect();
        world.power(false, now);
        world.s88.take_edges(now);
        let occupied = |sensor: &SensorId| (*sensor, world.s88.is_occupied(*sensor).unwrap_or(false));
        let sensors = world.s88.sensors().iter().map(occupied).collect();
        let mut jmri = Self {
            world,
            switches,
            draws: Draws::new(seed, Purpose::Line),
            now,
            system: System { name: Some(SYSTEM.to_owned()), prefix: PREFIX.to_owned() },
            incoming: VecDeque::new(),
            lines: Lines::default(),
            answers: VecDeque::new(),
            orders: DueQueue::new(),
            reports: DueQueue::new(),
            outgoing: Outgoing::new(now, Delivery::Each, TimeSpan::ZERO),
            locomotives,
            sensors,
            listened: BTreeSet::new(),
        };
        jmri.greet();
        jmri
    }

    /// The time.
    pub const fn now(&self) -> Timestamp {
        self.now
    }

    /// The functions of a locomotive that are on, F0 in the lowest bit.
    pub fn functions(&self, train: TrainId) -> u32 {
        self.locomotives.iter().find(|known| known.train == train).map_or(0, |known| known.functions)
    }

    /// A client connects in the place of the one before, whose trains are stopped.
    pub fn connect(&mut self) {
        self.disconnect();
        self.greet();
    }

    /// The client has gone: JMRI stops its trains and forgets what it asked for.
    pub fn disconnect(&mut self) {
        self.incoming.clear();
        self.answers.clear();
        self.outgoing.clear();
        self.lines = Lines::default();
        self.listened.clear();
        for at in 0..self.locomotives.len() {
            if self.locomotives[at].name.take().is_some() {
                self.locomotives[at].throttle = Throttle::Speed(0);
                self.order(Order::Drive(self.locomotives[at].train));
            }
        }
    }

    /// JMRI is started again, and a client connects: it knows no locomotive, and takes all of them to face forward. Its hardware drives on
    /// what it was commanded.
    pub fn restart(&mut self) {
        self.disconnect();
        self.locomotives.clear();
        self.greet();
    }

    /// The client writes bytes.
    pub fn write(&mut self, bytes: &[u8]) {
        let last = self.incoming.back().map_or(self.now, |(last, _)| *last);
        let arrives = self.now + TimeSpan::from_s(self.draws.uniform(NETWORK_S));
        self.incoming.push_back((arrives.max(last), bytes.to_vec()));
    }

    /// Advances to a time, or until something reaches the client before it: the bytes of one portion.
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
        let coming = [
            (self.incoming.front().map(|(at, _)| *at), Next::Incoming),
            (self.answers.front().map(|(at, _)| *at), Next::Answer),
            (self.orders.due(), Next::Order),
            (self.reports.due(), Next::Report),
            (self.outgoing.due(), Next::Outgoing),
        ];
        coming.into_iter().filter_map(|(at, next)| Some((at?, next))).min_by_key(|(at, _)| *at)
    }

    fn happen(&mut self, next: Next) {
        match next {
            Next::Incoming => {
                let Some((_, bytes)) = self.incoming.pop_front() else { return };
                for byte in bytes {
                    match self.lines.push(byte).map(Request::read) {
                        Some(Ok(Some(request))) => self.obey(request),
                        Some(Ok(None)) => self.refuse(404, "Unknown object type."),
                        Some(Err(_)) => self.refuse(500, "Unable to process JSON message."),
                        None => {}
                    }
                }
            }
            Next::Answer => {
                if let Some((_, reply)) = self.answers.pop_front() {
                    self.say(&reply);
                }
            }
            Next::Order => {
                if let Some(order) = self.orders.take() {
                    self.carry_out(order);
                }
            }
            Next::Report => {
                if let Some((sensor, active)) = self.reports.take() {
                    self.sensors.insert(sensor, active);
                    if self.listened.contains(&sensor) {
                        let reply = self.state_of(sensor);
                        self.say(&reply);
                    }
                }
            }
            Next::Outgoing => {}
        }
    }

    /// Finds the sensors that have changed, and when JMRI will know it.
    fn look(&mut self, by: Timestamp) {
        let delays = if self.switches.polls { POLLED_S } else { DETECTION_S };
        for Edge { at, sensor, is_occupied } in self.world.s88.take_edges(by) {
            let due = (at + TimeSpan::from_s(self.draws.uniform(delays.clone()))).max(self.now);
            self.reports.add_report(due, (sensor, is_occupied), |(other, _)| *other == sensor);
        }
    }

    fn greet(&mut self) {
        self.say(&Reply::Hello { version: VERSION.to_owned(), railroad: RAILROAD.to_owned() });
    }

    /// JMRI answers, after the answers before.
    fn answer(&mut self, reply: Reply) {
        let due = self.now + TimeSpan::from_s(self.draws.uniform(ANSWER_S));
        let last = self.answers.back().map_or(due, |(last, _)| *last);
        self.answers.push_back((due.max(last), reply));
    }

    fn refuse(&mut self, code: u16, message: &str) {
        self.answer(Reply::Error { code, message: message.to_owned() });
    }

    /// The hardware is given an order, behind those before.
    fn order(&mut self, order: Order) {
        let due = self.now + TimeSpan::from_s(self.draws.uniform(HARDWARE_S));
        self.orders.add_report(due, order, |_| true);
    }

    fn say(&mut self, reply: &Reply) {
        self.outgoing.post(self.now, reply.text().as_bytes(), &mut self.draws);
    }
}
