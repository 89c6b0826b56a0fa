//! A session with a Z21, a station that answers what it is asked, and the network between them.

use std::collections::BTreeMap;

use footplate_core::{Command, Event, EventKind, Report, TimeSpan, Timestamp};
use footplate_wire::z21::{
    Broadcasts, CentralState, Client, Datasets, Firmware, Lock, LocomotiveState, Reply, Request, Settings,
    Steps, Throttle, TurnoutPosition,
};
use footplate_wire::{LinkNotice, Session, Transmit};

pub(crate) fn ms(ms: i64) -> Timestamp {
    Timestamp::ZERO + TimeSpan::from_ms(ms)
}

/// As the station says how a locomotive is driven.
pub(crate) fn state(address: u16, throttle: Throttle, forward: bool) -> LocomotiveState {
    LocomotiveState { address, busy: false, steps: Steps::All, throttle, forward, functions: 0 }
}

/// From a request to the answer.
const ANSWER: TimeSpan = TimeSpan::from_ms(3);

/// A station that answers what it is asked, and tells by itself only what a test makes it tell.
pub(crate) struct Station {
    pub(crate) locomotives: BTreeMap<u16, LocomotiveState>,
    pub(crate) turnouts: BTreeMap<u16, bool>,
    pub(crate) inputs: [u8; 10],
    pub(crate) told: Broadcasts,
    /// What it can tell.
    pub(crate) tells: Broadcasts,
    pub(crate) power: bool,
    pub(crate) lock: Lock,
    /// Whether it answers at all, and which datagrams, by their count, are lost on their way to it.
    pub(crate) answers: bool,
    pub(crate) loses: fn(usize) -> bool,
    pub(crate) count: usize,
}

impl Station {
    fn answer(&mut self, datagram: &[u8]) -> Vec<Vec<u8>> {
        self.count += 1;
        if !self.answers || (self.loses)(self.count) {
            return Vec::new();
        }
        let replies = Datasets::of(datagram).filter_map(|dataset| self.obey(Request::read(&dataset)?));
        replies.map(bytes).collect()
    }

    fn obey(&mut self, request: Request) -> Option<Reply> {
        Some(match request {
            Request::SerialNumber => Reply::SerialNumber(82_850),
            Request::Hardware => {
                Reply::Hardware { kind: 0x203, firmware: Firmware { major: 1, minor: 0x42 } }
            }
            Request::LockCode => Reply::LockCode(self.lock),
            Request::SetBroadcasts(wanted) => {
                self.told = Broadcasts(wanted.0 & self.tells.0);
                return None;
            }
            Request::Broadcasts => Reply::Broadcasts(self.told),
            Request::Status => Reply::Status(CentralState(if self.power { 0 } else { 2 })),
            Request::Power { on } => {
                self.power = on;
                Reply::Power { on }
            }
            Request::StopAll => Reply::Stopped,
            Request::Feedback { group } => Reply::Feedback { group, inputs: self.inputs },
            Request::Locomotive { address } => Reply::Locomotive(self.locomotive(address)),
            Request::Drive { address, throttle, forward, .. } => {
                self.locomotives.insert(address, state(address, throttle, forward));
                return None;
            }
            Request::SetTurnout { address, second, activate: true, .. } => {
                self.turnouts.insert(address, second);
                return None;
            }
            Request::Turnout { address } => {
                let second = *self.turnouts.get(&address)?;
                Reply::Turnout { address, position: TurnoutPosition::Output { second } }
            }
            _ => return None,
        })
    }

    pub(crate) fn locomotive(&self, address: u16) -> LocomotiveState {
        self.locomotives.get(&address).copied().unwrap_or_else(|| state(address, Throttle::Stop, true))
    }
}

fn bytes(reply: Reply) -> Vec<u8> {
    let mut bytes = Vec::new();
    reply.write(&mut bytes);
    bytes
}

/// A session, the station, and the network between them.
pub(crate) struct Desk {
    pub(crate) client: Client,
    pub(crate) now: Timestamp,
    pub(crate) station: Station,
    pub(crate) coming: Vec<(Timestamp, Vec<u8>)>,
    /// What was written, and when (ms).
    pub(crate) written: Vec<(i64, Request)>,
    pub(crate) events: Vec<Event>,
    pub(crate) notices: Vec<LinkNotice>,
}

impl Desk {
    pub(crate) fn new(settings: Settings) -> Self {
        let station = Station {
            locomotives: BTreeMap::from([(24, state(24, Throttle::Stop, false))]),
            turnouts: BTreeMap::new(),
            inputs: [0; 10],
            told: Broadcasts::NONE,
            tells: Broadcasts(u32::MAX),
            power: false,
            lock: Lock::None,
            answers: true,
            loses: |_| false,
            count: 0,
        };
        let client = Client::new(ms(0), settings);
        let (coming, written, events, notices) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        Self { client, now: ms(0), station, coming, written, events, notices }
    }

    pub(crate) fn opened() -> Self {
        let mut desk = Self::new(Settings::default());
        desk.run_until(ms(1_000));
        assert_eq!(desk.notices.last(), Some(&LinkNotice::Answers), "{:?}", desk.written);
        desk.written.clear();
        desk.notices.clear();
        desk
    }

    pub(crate) fn run_until(&mut self, end: Timestamp) {
        loop {
            while let Some(output) = self.client.poll_output() {
                match output {
                    Transmit::Message(datagram) => {
                        let requests = Datasets::of(&datagram)
                            .map(|dataset| Request::read(&dataset).expect("a request"));
                        let at = (self.now - ms(0)).as_ns() / 1_000_000;
                        self.written.extend(requests.map(|request| (at, request)));
                        let due = self.now + ANSWER;
                        self.coming
                            .extend(self.station.answer(&datagram).into_iter().map(|bytes| (due, bytes)));
                    }
                    Transmit::Event(event) => self.events.push(event),
                    Transmit::Notice(notice) => self.notices.push(notice),
                    Transmit::Byte(byte) => unreachable!("a lone byte {byte}"),
                }
            }
            self.coming.sort_by_key(|(at, _)| *at);
            let next = [self.coming.first().map(|(at, _)| *at), self.client.next_timeout()];
            let Some(at) = next.into_iter().flatten().min().filter(|at| *at <= end) else { break };
            self.now = self.now.max(at);
            if self.coming.first().is_some_and(|(due, _)| *due <= at) {
                let (_, datagram) = self.coming.remove(0);
                self.client.handle_bytes(self.now, &datagram);
            } else {
                self.client.handle_timeout(at);
                let next = self.client.next_timeout();
                assert!(next.is_none_or(|next| next > at), "a session that is never done");
            }
        }
        self.now = end;
    }

    pub(crate) fn run_for(&mut self, span_ms: i64) {
        self.run_until(self.now + TimeSpan::from_ms(span_ms));
    }

    pub(crate) fn command(&mut self, command: Command) {
        self.client.handle_command(self.now, command).unwrap();
    }

    pub(crate) fn hear(&mut self, reply: Reply) {
        self.client.handle_bytes(self.now, &bytes(reply));
    }

    /// What was written but for the questions that are asked all the time.
    pub(crate) fn commands(&self) -> Vec<Request> {
        let is_command = |request: &Request| {
            matches!(
                request,
                Request::Drive { .. } | Request::SetTurnout { .. } | Request::Power { .. } | Request::StopAll
            )
        };
        self.written.iter().map(|(_, request)| *request).filter(is_command).collect()
    }

    pub(crate) fn reports(&self) -> Vec<(i64, u16, i64)> {
        let report = |event: &Event| match event.kind {
            EventKind::Sensor(Report { sensor, poll_interval }) => {
                let at = (event.time - ms(0)).as_ns() / 1_000_000;
                Some((at, sensor.0, poll_interval.unwrap().as_ns() / 1_000_000))
            }
            _ => None,
        };
        self.events.iter().filter_map(report).collect()
    }
}
