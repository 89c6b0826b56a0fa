//! The virtual Z21: a living layout behind the datagrams that such a station exchanges with up to twenty clients.
//!
//! The codec is that of the program; the times are the simulation's own. Of a
//! real station's times, only the cycle of its feedback bus is known and simulated. It forgets
//! silent clients after a minute and does not watch them otherwise: trains run on when they are gone.

mod obeying;

use std::collections::VecDeque;

use footplate_core::track::Leg;
use footplate_core::{DecoderSteps, Ratio, SensorId, TimeSpan, Timestamp, TrainId};
use footplate_wire::z21::{
    Broadcasts, CanDetection, CentralState, Feedback, GROUP_INPUTS, GROUP_MODULES, LocoNetDetection, RailCom,
    Reply, Throttle, TurnoutPosition,
};

use crate::draws::{Draws, Purpose};
use crate::living::due_queue::DueQueue;
use crate::living::network::{Disturbances, Network};
use crate::living::s88::Edge;
use crate::living::speed_reports::{Decoders, SpeedReports};
use crate::living::world::LivingLayout;

/// All modules of the feedback bus are asked once in this time (the RS-bus: 130 pulses of 0.2 ms and a pause of 7 ms).
const BUS_CYCLE: TimeSpan = TimeSpan::from_ms(33);
/// The time from there until the datagram leaves (s; chosen).
const HANDS_ON_S: std::ops::Range<f64> = 0.000_5..0.003;
/// The filter time of detectors that report by themselves (s; chosen).
const DETECTOR_S: std::ops::Range<f64> = 0.003..0.025;
/// The answer time (s; chosen).
const ANSWER_S: std::ops::Range<f64> = 0.000_5..0.004;
/// The longest step of the world, so that no report is late.
const LOOK_EVERY: TimeSpan = TimeSpan::from_ms(2);
/// Inputs of a feedback module.
const MODULE_INPUTS: u16 = 8;
/// The most clients at a time.
const MOST_CLIENTS: usize = 20;
/// The time after which a silent client is forgotten.
const FORGOTTEN_AFTER: TimeSpan = TimeSpan::from_ms(60_000);
/// Locomotives that a client may subscribe to.
const MOST_SUBSCRIBED: usize = 16;
/// The time from power on to the first answer.
const BOOT: TimeSpan = TimeSpan::from_ms(4_000);
/// The interval of RailCom reports.
const RAIL_COM_EVERY: TimeSpan = TimeSpan::from_ms(500);

/// The properties of the station and its network.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Z21Switches {
    /// How often a datagram is lost, in either direction.
    pub lost: Ratio,
    /// How often one is duplicated.
    pub duplicated: Ratio,
    /// How often one is overtaken by those that follow it.
    pub overtaken: Ratio,
    /// Whether datagrams take up to 60 ms, as in a busy wireless network.
    pub is_slow: bool,
    /// Whether the first request for broadcasts is lost, which left programs without any feedback.
    pub loses_first_subscription: bool,
    /// Whether it rejects a wrong XOR byte; most do not check it.
    pub strict_xor: bool,
    /// Whether its own XOR bytes are wrong, as those of one server program are.
    pub wrong_xor: bool,
    /// Whether the state of a locomotive ends with F28, as with firmware before 1.42.
    pub short_states: bool,
    /// Whether it reads only the first dataset of a datagram, as small clones do.
    pub first_only: bool,
    /// Whether it is a z21start without its unlock code: it ignores commands to locomotives and turnouts.
    pub is_locked: bool,
    /// The bus of its sensors.
    pub feedback: Feedback,
    /// Whether its decoders report by RailCom.
    pub rail_com: bool,
    /// What they report of their speed.
    pub speeds: SpeedReports,
}

impl Default for Z21Switches {
    fn default() -> Self {
        Self {
            lost: Ratio::ZERO,
            duplicated: Ratio::ZERO,
            overtaken: Ratio::ZERO,
            is_slow: false,
            loses_first_subscription: false,
            strict_xor: false,
            wrong_xor: false,
            short_states: false,
            first_only: false,
            is_locked: false,
            feedback: Feedback::RBus,
            rail_com: true,
            speeds: SpeedReports::None,
        }
    }
}

/// A client, by the number that the network knows it by.
#[derive(Debug, Clone)]
struct Connected {
    id: usize,
    broadcasts: Broadcasts,
    subscribed: VecDeque<u16>,
    heard: Timestamp,
}

/// A locomotive that the station drives.
#[derive(Debug, Clone, Copy)]
struct Slot {
    address: u16,
    steps: DecoderSteps,
    throttle: Throttle,
    forward: bool,
    functions: u32,
    received: u32,
}

/// A living layout behind a Z21, on a clock of its own.
#[derive(Debug, Clone)]
pub struct VirtualZ21<'l> {
    /// The layout; an operator intervenes in it.
    pub world: LivingLayout<'l>,
    switches: Z21Switches,
    draws: Draws,
    network: Network,
    now: Timestamp,
    clients: Vec<Connected>,
    slots: Vec<Slot>,
    turnouts: Vec<(u16, TurnoutPosition)>,
    /// Occupied sensors as the station knows them, and changes that it will know later.
    occupied: Vec<SensorId>,
    changes: DueQueue<(SensorId, bool)>,
    /// When each module is asked within the cycle of the bus.
    phases: Vec<TimeSpan>,
    central: CentralState,
    rail_com_due: Timestamp,
    decoders: Decoders,
    loses_next_subscription: bool,
    /// The end of its start.
    dark_until: Option<Timestamp>,
}

/// An occurrence in the station or on its line.
#[derive(Debug, Clone, Copy)]
enum Next {
    Incoming,
    Change,
    Outgoing,
    RailCom,
    Light,
}

impl<'l> VirtualZ21<'l> {
    /// A station in front of a layout, which has been driving the trains on it: it knows which end of each leads. The track has no
    /// power yet. The layout's sensor 0 is input 1 of module 1, its turnout 1 is the first.
    pub fn new(mut world: LivingLayout<'l>, seed: u64, switches: Z21Switches) -> Self {
        let now = world.now();
        let known = |train: TrainId| {
            let forward = world.runs_forward(train).unwrap_or(true);
            let (steps, throttle) = (DecoderSteps::All, Throttle::Stop);
            Slot { address: train.0, steps, throttle, forward, functions: 0, received: 0 }
        };
        let slots = world.train_ids().map(known).collect();
        world.power(false, now);
        world.s88.take_edges(now);
        let mut draws = Draws::new(seed, Purpose::Line);
        let Z21Switches { lost, duplicated, overtaken, .. } = switches;
        let is_slow = switches.is_slow;
        let network = Network::new(draws.split(), Disturbances { lost, duplicated, overtaken, is_slow });
        let sensors = world.s88.sensors();
        let occupied = sensors.iter().copied().filter(|sensor| world.s88.is_occupied(*sensor) == Some(true));
        let modules = sensors.iter().map(|sensor| sensor.0 / MODULE_INPUTS + 1).max().unwrap_or_default();
        let phase = |_| TimeSpan::from_s(draws.uniform(0.0..BUS_CYCLE.as_s()));
        let phases = (0..modules).map(phase).collect();
        Self {
            occupied: occupied.collect(),
            world,
            switches,
            draws,
            network,
            now,
            clients: Vec::new(),
            slots,
            turnouts: Vec::new(),
            changes: DueQueue::new(),
            phases,
            central: CentralState(CentralState::POWER_OFF),
            rail_com_due: now + RAIL_COM_EVERY,
            decoders: Decoders::new(switches.speeds, seed),
            loses_next_subscription: switches.loses_first_subscription,
            dark_until: None,
        }
    }

    /// The time.
    pub const fn now(&self) -> Timestamp {
        self.now
    }

    /// It is switched off and on: it forgets its clients and its locomotives, and after some seconds gives power to the track.
    pub fn restart(&mut self) {
        let now = self.now;
        self.world.power(false, now);
        self.world.forget_commands();
        self.clients.clear();
        self.slots.clear();
        self.turnouts.clear();
        self.network.clear();
        self.central = CentralState(CentralState::POWER_OFF);
        self.dark_until = Some(now + BOOT);
    }

    /// A client puts a datagram on the network.
    pub fn write(&mut self, client: usize, datagram: &[u8]) {
        self.network.send_to_station(self.now, client, datagram);
    }

    /// Advances to a time, or until a datagram reaches a client before it.
    pub fn advance(&mut self, until: Timestamp) -> Option<(usize, Vec<u8>)> {
        loop {
            let next = self.next().filter(|(at, _)| *at <= until);
            let at = next.map_or(until, |(at, _)| at).max(self.now);
            let looks = at.min(self.now + LOOK_EVERY);
            self.world.advance(looks);
            self.now = looks;
            self.look(looks);
            match next {
                _ if looks < at => {}
                Some((_, Next::Outgoing)) => return self.network.take_to_client(),
                Some((_, next)) => self.happen(next),
                // A change may have become due while the world went on.
                None if self.next().is_none_or(|(at, _)| at > until) => return None,
                None => {}
            }
        }
    }

    /// The next occurrence and its time; of simultaneous ones, the first of this list.
    fn next(&self) -> Option<(Timestamp, Next)> {
        let rail_com = self.switches.rail_com.then_some(self.rail_com_due);
        let coming = [
            (self.network.next_to_station(), Next::Incoming),
            (self.changes.due(), Next::Change),
            (self.network.next_to_client(), Next::Outgoing),
            (rail_com, Next::RailCom),
            (self.dark_until, Next::Light),
        ];
        coming.into_iter().filter_map(|(at, next)| Some((at?, next))).min_by_key(|(at, _)| *at)
    }

    fn happen(&mut self, next: Next) {
        match next {
            Next::Incoming => {
                if let Some((client, datagram)) = self.network.take_to_station()
                    && self.dark_until.is_none()
                {
                    self.read(client, &datagram);
                }
            }
            Next::Change => {
                if let Some((sensor, is_occupied)) = self.changes.take() {
                    self.change(sensor, is_occupied);
                }
            }
            Next::RailCom => {
                self.rail_com_due += RAIL_COM_EVERY;
                self.pass_on_rail_com();
            }
            Next::Light => {
                self.dark_until = None;
                self.power(true, self.now);
            }
            Next::Outgoing => {}
        }
    }

    /// Finds the sensors that have changed, and when the station will know it.
    fn look(&mut self, by: Timestamp) {
        for Edge { at, sensor, is_occupied } in self.world.s88.take_edges(by) {
            let due = match self.switches.feedback {
                Feedback::RBus => {
                    let phase = self.phases.get(usize::from(sensor.0 / MODULE_INPUTS));
                    let since = (at - Timestamp::ZERO).as_ns() - phase.copied().unwrap_or_default().as_ns();
                    let waits = BUS_CYCLE.as_ns() - since.rem_euclid(BUS_CYCLE.as_ns());
                    at + TimeSpan::from_ns(waits) + TimeSpan::from_s(self.draws.uniform(HANDS_ON_S))
                }
                Feedback::Can | Feedback::LocoNet => at + TimeSpan::from_s(self.draws.uniform(DETECTOR_S)),
            };
            let change = (sensor, is_occupied);
            self.changes.add_report(due.max(self.now), change, |(other, _)| *other == sensor);
        }
    }

    fn change(&mut self, sensor: SensorId, is_occupied: bool) {
        self.occupied.retain(|other| *other != sensor);
        if is_occupied {
            self.occupied.push(sensor);
        }
        let reply = match self.switches.feedback {
            Feedback::RBus => self.group(sensor.0 / GROUP_INPUTS),
            Feedback::Can => Reply::Can(self.can_detection(sensor)),
            Feedback::LocoNet => {
                Reply::LocoNet(LocoNetDetection { kind: 1, address: sensor.0 + 1, info: is_occupied.into() })
            }
        };
        self.broadcast(self.switches.feedback.broadcasts(), &reply);
    }

    /// The inputs of ten feedback modules.
    fn group(&self, group: u16) -> Reply {
        let mut inputs = [0; GROUP_MODULES];
        for sensor in self.occupied.iter().filter(|sensor| sensor.0 / GROUP_INPUTS == group) {
            let input = sensor.0 % GROUP_INPUTS;
            inputs[usize::from(input / MODULE_INPUTS)] |= 1 << (input % MODULE_INPUTS);
        }
        Reply::Feedback { group: group as u8, inputs }
    }

    fn can_detection(&self, sensor: SensorId) -> CanDetection {
        let address = sensor.0 / MODULE_INPUTS + 1;
        let value = if self.occupied.contains(&sensor) { 0x1100 } else { 0x0100 };
        let port = (sensor.0 % MODULE_INPUTS) as u8;
        CanDetection { network: 0xd000 | address, address, port, kind: 1, value, more: 0 }
    }

    /// Decoders report the speed of their locomotives.
    fn pass_on_rail_com(&mut self) {
        if !self.central.is_powered() {
            return;
        }
        for at in 0..self.slots.len() {
            self.slots[at].received += 1;
            let slot = self.slots[at];
            let rail_com = Reply::RailCom(self.rail_com(&slot));
            let wants = |client: &Connected| {
                client.broadcasts.has(Broadcasts::ALL_RAIL_COM)
                    || client.broadcasts.has(Broadcasts::RAIL_COM)
                        && client.subscribed.contains(&slot.address)
            };
            let ids: Vec<usize> =
                self.clients.iter().filter(|client| wants(client)).map(|client| client.id).collect();
            ids.into_iter().for_each(|id| self.say(id, &rail_com));
        }
    }

    fn rail_com(&mut self, slot: &Slot) -> RailCom {
        let train = self.world.trains.iter().find(|train| train.id.0 == slot.address);
        let speed = train.map_or(0.0, |train| train.speed);
        RailCom {
            address: slot.address,
            received: slot.received,
            errors: 0,
            options: self.decoders.report_speeds().into(),
            speed: self.decoders.next(TrainId(slot.address), speed),
            quality: 0,
        }
    }

    /// How a turnout was commanded last.
    fn position(&self, address: u16) -> TurnoutPosition {
        let known = self.turnouts.iter().find(|(known, _)| *known == address);
        known.map_or(TurnoutPosition::Unknown, |(_, position)| *position)
    }

    /// The second output lays a turnout straight.
    fn lay(&mut self, at: Timestamp, address: u16, second: bool) {
        if self.central.0 & CentralState::POWER_OFF == 0 {
            let turnout = footplate_core::TurnoutId(address.saturating_add(1));
            self.world.points.power(turnout, Leg::from_curved(!second), at);
        }
    }
}
