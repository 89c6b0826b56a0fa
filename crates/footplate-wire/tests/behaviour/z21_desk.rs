//! A session with a Z21, a station that answers what it is asked, and the network between them.

use std::collections::BTreeMap;

use footplate_core::{DecoderSteps, TimeSpan};
use footplate_wire::z21::{
    Broadcasts, CentralState, Client, Datasets, Firmware, FunctionSwitch, Lock, LocomotiveState, Reply,
    Request, Settings, Throttle, TurnoutPosition,
};
use footplate_wire::{LinkNotice, Session};

use crate::desk::ms;

/// As the station says how a locomotive is driven.
pub(crate) fn state(address: u16, throttle: Throttle, forward: bool) -> LocomotiveState {
    LocomotiveState { address, busy: false, steps: DecoderSteps::All, throttle, forward, functions: 0 }
}

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
    /// Requests that it does not hear.
    pub(crate) is_deaf_to: fn(&Request) -> bool,
}

impl Station {
    fn answer(&mut self, datagram: &[u8]) -> Vec<Vec<u8>> {
        self.count += 1;
        if !self.answers || (self.loses)(self.count) {
            return Vec::new();
        }
        let heard = Datasets::of(datagram).filter_map(|dataset| Request::read(&dataset));
        let is_deaf_to = self.is_deaf_to;
        let replies = heard.filter(|request| !is_deaf_to(request)).filter_map(|request| self.obey(request));
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
                let functions = self.locomotive(address).functions;
                let driven = LocomotiveState { functions, ..state(address, throttle, forward) };
                self.locomotives.insert(address, driven);
                return None;
            }
            Request::Function { address, function, switch } => {
                let mut switched = self.locomotive(address);
                match switch {
                    FunctionSwitch::On => switched.functions |= 1 << function,
                    FunctionSwitch::Off => switched.functions &= !(1 << function),
                    FunctionSwitch::Toggle => switched.functions ^= 1 << function,
                }
                self.locomotives.insert(address, switched);
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

impl crate::desk::Station for Station {
    type Written = Request;
    const ANSWER: TimeSpan = TimeSpan::from_ms(3);

    fn hear(&mut self, datagram: Vec<u8>) -> (Vec<Request>, Vec<Vec<u8>>) {
        let read = Datasets::of(&datagram).map(|dataset| Request::read(&dataset).expect("a request"));
        (read.collect(), self.answer(&datagram))
    }
}

pub(crate) type Desk = crate::desk::Desk<Client, Station>;

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
            is_deaf_to: |_| false,
        };
        Self::with(Client::new(ms(0), settings), station)
    }

    pub(crate) fn opened() -> Self {
        let mut desk = Self::new(Settings::default());
        desk.run_until(ms(1_000));
        assert_eq!(desk.notices.last(), Some(&LinkNotice::Answers), "{:?}", desk.written);
        desk.written.clear();
        desk.notices.clear();
        desk
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
}
