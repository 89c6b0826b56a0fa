//! A 6051 on a bench: what reaches it and when, what it answers, and what a bad cable makes of both.
//!
//! It shares the codec with the session and nothing else: it keeps its own books of time.

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use footplate_core::{Event, EventKind, SensorId, SpeedStep, TimeSpan, Timestamp, TrainId, TurnoutId};
use footplate_wire::marklin_serial::{
    BYTE_TIME, Interface, Message, ModuleState, REPLY_BYTE_SPACING, Settings,
};
use footplate_wire::{LinkNotice, Session, Transmit};

pub(crate) fn ms(ms: i64) -> Timestamp {
    Timestamp::ZERO + TimeSpan::from_ms(ms)
}

/// What the cable does to bytes, counted from the next one.
#[derive(Default)]
pub(crate) struct Cable {
    /// Bytes to the station that are lost: by their place from now on.
    pub(crate) lost_to_station: BTreeSet<usize>,
    /// Bytes to the host that are lost.
    pub(crate) lost_to_host: BTreeSet<usize>,
    pub(crate) cut: bool,
    to_station: usize,
    to_host: usize,
}

/// How the station shows that it is busy with a byte.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum HandShake {
    /// CTS falls a moment after the byte has come and rises again when it is done.
    Edges,
    /// It is done before anybody has seen an edge.
    TooShort,
}

#[derive(Clone, Copy)]
enum Due {
    Arrives(u8),
    Cts(bool),
    Says(u8),
}

pub(crate) struct Station {
    pub(crate) hand_shake: HandShake,
    pub(crate) cable: Cable,
    /// Whether reads of one module are answered; otherwise they are ignored.
    pub(crate) answers_single: bool,
    /// From the last bit of a request until the first byte of its reply begins.
    pub(crate) turnaround: TimeSpan,
    /// Bytes that wait for the rest of their message.
    pub(crate) heard: Vec<u8>,
    pub(crate) power: bool,
    pub(crate) steps: BTreeMap<TrainId, u8>,
    pub(crate) turned: BTreeMap<TrainId, u32>,
    /// Turnouts as they were thrown, powered from when until when.
    pub(crate) coils: Vec<(TurnoutId, Timestamp, Option<Timestamp>)>,
    pub(crate) messages: Vec<(Timestamp, Message)>,
    /// Inputs that are closed, and those that were since they were read.
    closed: BTreeSet<SensorId>,
    memory: BTreeSet<SensorId>,
    cts: bool,
    answers_until: Timestamp,
    /// Bytes that were written while the station was busy or was answering.
    pub(crate) violations: Vec<Timestamp>,
    due: VecDeque<(Timestamp, Due)>,
}

impl Station {
    pub(crate) fn new() -> Self {
        Self {
            hand_shake: HandShake::Edges,
            cable: Cable::default(),
            answers_single: true,
            turnaround: TimeSpan::from_ms(2),
            heard: Vec::new(),
            power: false,
            steps: BTreeMap::new(),
            turned: BTreeMap::new(),
            coils: Vec::new(),
            messages: Vec::new(),
            closed: BTreeSet::new(),
            memory: BTreeSet::new(),
            cts: true,
            answers_until: Timestamp::ZERO,
            violations: Vec::new(),
            due: VecDeque::new(),
        }
    }

    pub(crate) fn input(&mut self, sensor: u16, closed: bool) {
        let sensor = SensorId(sensor);
        if closed {
            self.closed.insert(sensor);
            self.memory.insert(sensor);
        } else {
            self.closed.remove(&sensor);
        }
    }

    fn plan(&mut self, at: Timestamp, due: Due) {
        let place = self.due.iter().position(|(other, _)| *other > at).unwrap_or(self.due.len());
        self.due.insert(place, (at, due));
    }

    /// Noise on the line, a byte every 4.87 ms.
    pub(crate) fn babble(&mut self, from: Timestamp, bytes: &[u8]) {
        let mut at = from;
        for byte in bytes {
            self.plan(at, Due::Says(*byte));
            at += REPLY_BYTE_SPACING;
        }
    }

    fn write(&mut self, now: Timestamp, byte: u8) {
        if !self.cts || now < self.answers_until {
            self.violations.push(now);
        }
        let lost = self.cable.cut || self.cable.lost_to_station.contains(&self.cable.to_station);
        self.cable.to_station += 1;
        if !lost {
            self.plan(now + BYTE_TIME, Due::Arrives(byte));
        }
    }

    fn arrive(&mut self, now: Timestamp, byte: u8) {
        if self.hand_shake == HandShake::Edges {
            self.plan(now + TimeSpan::from_us(300), Due::Cts(false));
            self.plan(now + TimeSpan::from_us(1_700), Due::Cts(true));
        }
        self.heard.push(byte);
        if let Some((message, _)) = Message::decode(&self.heard) {
            self.heard.clear();
            self.messages.push((now, message));
            self.act(now, message);
        }
    }

    fn act(&mut self, now: Timestamp, message: Message) {
        match message {
            Message::Drive { train, step, .. } => {
                self.steps.insert(train, step.get());
            }
            Message::Reverse { train, .. } => {
                self.steps.insert(train, 0);
                *self.turned.entry(train).or_default() += 1;
            }
            Message::Turnout { turnout, .. } => {
                self.release(now);
                self.coils.push((turnout, now, None));
            }
            Message::SolenoidOff => self.release(now),
            Message::Go => self.power = true,
            Message::Stop => self.power = false,
            _ => {}
        }
        if matches!(message, Message::ReadModule { .. }) && !self.answers_single {
            return;
        }
        let mut at = now + self.turnaround;
        for module in message.modules_read() {
            let state = ModuleState::with_closed(module, self.memory.iter().copied());
            for closed in state.closed() {
                self.memory.remove(&closed);
            }
            for byte in state.encode() {
                at += REPLY_BYTE_SPACING;
                self.answers_until = at;
                self.plan(at, Due::Says(byte));
            }
        }
        self.memory.extend(&self.closed);
    }

    fn release(&mut self, now: Timestamp) {
        if let Some((_, _, until @ None)) = self.coils.last_mut() {
            *until = Some(now);
        }
    }
}

/// The session, the station and the time.
pub(crate) struct Bench {
    pub(crate) now: Timestamp,
    pub(crate) session: Interface,
    pub(crate) station: Station,
    pub(crate) events: Vec<Event>,
    pub(crate) notices: Vec<LinkNotice>,
    /// What the session wrote, and when.
    pub(crate) written: Vec<(Timestamp, u8)>,
}

impl Bench {
    pub(crate) fn new(settings: Settings) -> Self {
        let session = Interface::new(Timestamp::ZERO, settings).unwrap();
        let mut bench = Self {
            now: Timestamp::ZERO,
            session,
            station: Station::new(),
            events: Vec::new(),
            notices: Vec::new(),
            written: Vec::new(),
        };
        bench.session.handle_cts(bench.now, true);
        bench
    }

    /// Five modules and CTS, as the course has them.
    pub(crate) fn with_cts() -> Self {
        Self::new(Settings::with_cts(5))
    }

    pub(crate) fn say(&mut self, command: footplate_core::Command) {
        self.session.handle_command(self.now, command).unwrap();
        self.take();
    }

    fn take(&mut self) {
        while let Some(output) = self.session.poll_output() {
            match output {
                Transmit::Message(_)
                | Transmit::Functions(..)
                | Transmit::Direction(..)
                | Transmit::ReportedSpeed(..) => {
                    unreachable!("a 6051: {output:?}")
                }
                Transmit::Byte(byte) => {
                    self.written.push((self.now, byte));
                    self.station.write(self.now, byte);
                }
                Transmit::Event(event) => self.events.push(event),
                Transmit::Notice(notice) => self.notices.push(notice),
            }
        }
    }

    /// Lets time pass.
    pub(crate) fn run_until(&mut self, end: Timestamp) {
        loop {
            self.take();
            let timeout = self.session.next_timeout();
            let station = self.station.due.front().map(|(at, _)| *at);
            let next = timeout.into_iter().chain(station).min().filter(|next| *next <= end);
            let Some(next) = next else {
                self.now = self.now.max(end);
                break;
            };
            self.now = self.now.max(next);
            let next = self.now;
            if station == Some(next)
                && let Some((_, due)) = self.station.due.pop_front()
            {
                self.come(due);
            } else {
                self.session.handle_timeout(next);
                assert!(
                    self.session.next_timeout().is_none_or(|at| at > next),
                    "a session that is never done"
                );
            }
        }
    }

    fn come(&mut self, due: Due) {
        match due {
            Due::Arrives(byte) => self.station.arrive(self.now, byte),
            Due::Cts(up) => {
                self.station.cts = up;
                self.session.handle_cts(self.now, up);
            }
            Due::Says(byte) => {
                let cable = &mut self.station.cable;
                let lost = cable.cut || cable.lost_to_host.contains(&cable.to_host);
                cable.to_host += 1;
                if !lost {
                    self.session.handle_bytes(self.now, &[byte]);
                }
            }
        }
    }

    pub(crate) fn run_for(&mut self, span: i64) {
        self.run_until(self.now + TimeSpan::from_ms(span));
    }

    /// From now on, these of the bytes to the station are lost.
    pub(crate) fn lose_to_station(&mut self, places: &[usize]) {
        let cable = &mut self.station.cable;
        cable.lost_to_station = places.iter().map(|place| cable.to_station + place).collect();
    }

    /// From now on, these of the bytes to the host are lost.
    pub(crate) fn lose_to_host(&mut self, places: &[usize]) {
        let cable = &mut self.station.cable;
        cable.lost_to_host = places.iter().map(|place| cable.to_host + place).collect();
    }

    /// The reports of one input: when, and how long before it at most.
    pub(crate) fn reports(&self, sensor: u16) -> Vec<(Timestamp, TimeSpan)> {
        let of = |event: &Event| match event.kind {
            EventKind::Sensor(report) if report.sensor == SensorId(sensor) => {
                Some((event.time, report.poll_interval.unwrap()))
            }
            _ => None,
        };
        self.events.iter().filter_map(of).collect()
    }

    pub(crate) fn said(&self) -> Vec<String> {
        self.station.messages.iter().map(|(_, message)| message.to_string()).collect()
    }
}

pub(crate) fn speed(train: u16, step: u8) -> footplate_core::Command {
    footplate_core::Command::Speed { train: TrainId(train), step: SpeedStep::new(step).unwrap() }
}

pub(crate) fn reverse(train: u16) -> footplate_core::Command {
    footplate_core::Command::Reverse { train: TrainId(train) }
}

pub(crate) fn turnout(number: u16) -> footplate_core::Command {
    footplate_core::Command::Turnout { turnout: TurnoutId(number), curved: true }
}
