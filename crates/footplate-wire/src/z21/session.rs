//! Speaks with the station: what stops first, one command a train at a time, and everything confirmed by its own words.

mod asking;
mod closing;
mod hearing;

use alloc::collections::VecDeque;
use alloc::vec::Vec;

use footplate_core::{Command, Event, EventKind, SpeedStep, TimeSpan, Timestamp, TrainId, TurnoutId};

use super::broadcasts::Broadcasts;
use super::opening::Opening;
use super::outstanding::{AllOutstanding, Awaited, MOST_TRIES, Outstanding};
use super::request::{LOCOMOTIVES, Request};
use super::sensors::Sensors;
use super::settings::Settings;
use super::speed::{HIGHEST_STEP, Throttle};
use super::turnouts::Turnouts;
use crate::farewell::Farewell;
use crate::locomotives::Locomotives;
use crate::pacing::Pacing;
use crate::queue::{Queue, entry_of, train_of};
use crate::session::{Closing, CommandError, LinkNotice, Session, Transmit};
use crate::silence::{Checks, Silence};

/// Many quick datagrams from a computer are lost now and then; some milliseconds between them are asked for.
const PACING: Pacing = Pacing::new(TimeSpan::from_ms(20), 3, TimeSpan::from_ms(5));

/// The detectors of the CAN bus answer one after the other within this time after they were asked (chosen).
const DETECTORS_WITHIN: TimeSpan = TimeSpan::from_ms(50);

/// What a person should check.
const CHECKS: Checks = Checks {
    nothing_heard: "check its power, the network cable, that its address is right (a Z21 has 192.168.0.111 unless changed) and \
                    that this computer is in its network",
    nothing_whole: "check that the address belongs to a Z21 (UDP port 21105)",
    noise: "check that the address belongs to a Z21 (UDP port 21105)",
};

/// The program's side of the line to a Z21.
#[derive(Debug, Clone)]
pub struct Client {
    settings: Settings,
    now: Timestamp,
    opening: Opening,
    pacing: Pacing,
    silence: Silence,
    waiting: Queue,
    outstanding: AllOutstanding,
    locomotives: Locomotives,
    sensors: Sensors,
    turnouts: Turnouts,
    /// What it is to be told, and whether the station has confirmed that it will.
    wanted: Broadcasts,
    is_subscribed: bool,
    /// Whether the track is meant to have power, and whether the station has said that it has.
    power: bool,
    is_powered: bool,
    /// It was said once to have lost its power, which an old datagram may say, too.
    power_is_suspect: bool,
    asks_status: bool,
    /// Something does not fit what was commanded: perhaps the station was restarted, and has forgotten this client, too.
    asks_broadcasts: bool,
    /// Locomotives whose state has to be asked for again.
    unverified: Vec<TrainId>,
    /// What was said once of a locomotive and is not what was commanded: an old datagram, or another throttle.
    suspected: Vec<(TrainId, Throttle, bool)>,
    identity: Option<alloc::string::String>,
    serial_number: u32,
    polls: u32,
    polled: Timestamp,
    /// When the detectors of the CAN bus were asked last.
    asked_detectors: Option<Timestamp>,
    /// When the last message came, and whether none was heard before the states were asked for again.
    heard: Timestamp,
    is_blind: bool,
    /// The time of the last entry of the recording: entries stay in order.
    last_entry: Timestamp,
    farewell: Farewell,
    /// Whether all locomotives are to be stopped next, those that cannot be commanded yet among them.
    stops_all: bool,
    output: VecDeque<Transmit>,
}

/// A request that is about to be written.
#[derive(Clone, Copy)]
struct Outgoing {
    request: Request,
    awaited: Option<Awaited>,
    command: Option<Command>,
    tries: u8,
}

impl Outgoing {
    const fn of(request: Request, awaited: Option<Awaited>) -> Self {
        Self { request, awaited, command: None, tries: 1 }
    }
}

impl Client {
    /// A session over a line that has just been opened.
    #[must_use]
    pub fn new(now: Timestamp, settings: Settings) -> Self {
        let wanted = settings.broadcasts();
        let mut client = Self {
            settings,
            now,
            opening: Opening::begin(&settings, wanted, false, true),
            pacing: PACING,
            silence: Silence::new(CHECKS),
            waiting: Queue::default(),
            outstanding: AllOutstanding::default(),
            locomotives: Locomotives::default(),
            sensors: Sensors::default(),
            turnouts: Turnouts::default(),
            wanted,
            is_subscribed: false,
            power: true,
            is_powered: false,
            power_is_suspect: false,
            asks_status: false,
            asks_broadcasts: false,
            unverified: Vec::new(),
            suspected: Vec::new(),
            identity: None,
            serial_number: 0,
            polls: 0,
            polled: now,
            asked_detectors: None,
            heard: now,
            is_blind: false,
            last_entry: now,
            farewell: Farewell::default(),
            stops_all: false,
            output: VecDeque::new(),
        };
        client.go_on(now);
        client
    }

    /// What the station, its sensors and its turnouts are taken to be like.
    #[must_use]
    pub const fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Goes on as far as the clock allows.
    fn go_on(&mut self, now: Timestamp) {
        self.now = now;
        if let Some(notice) = self.silence.watch(now) {
            self.is_blind = true;
            self.notify(notice);
        }
        while let Some(next) = self.next(now) {
            self.send(now, next);
        }
    }

    /// What is to be written next, if anything may be written now.
    fn next(&mut self, now: Timestamp) -> Option<Outgoing> {
        if self.farewell.is_over() || now < self.pacing.urgent_at() {
            return None;
        }
        if core::mem::take(&mut self.stops_all) {
            return Some(Outgoing::of(Request::StopAll, None));
        }
        let (locomotives, outstanding) = (&self.locomotives, &self.outstanding);
        let may_stop = |command: &Command| {
            train_of(command).is_none_or(|train| {
                let is_free = outstanding.blocks(train, true).is_none_or(|until| now >= until);
                locomotives.has_direction(train) && is_free
            })
        };
        if let Some(command) = self.waiting.next_urgent(may_stop) {
            return Some(self.outgoing(now, command));
        }
        if let Some(repeat) = self.next_repeat(now, true) {
            return Some(repeat);
        }
        if let Some(release) = self.turnouts.take_release(now) {
            return Some(Outgoing::of(release, None));
        }
        if let Some(train) = self.without_direction_at_end() {
            return Some(query(train));
        }
        if self.farewell.switch_off_is_due(now, &self.locomotives) {
            return Some(self.outgoing(now, Command::PowerOff));
        }
        if now < self.pacing.usual_at() {
            return None;
        }
        if self.farewell.has_begun() {
            // A train whose direction is asked for can be stopped only when that is answered.
            return self.next_repeat(now, false);
        }
        self.next_repeat(now, false).or_else(|| self.next_usual(now))
    }

    fn next_usual(&mut self, now: Timestamp) -> Option<Outgoing> {
        if let Opening::Asking(requests) = &mut self.opening {
            if self.outstanding.has_question() {
                return None;
            }
            match requests.pop_front() {
                Some(request) => return Some(Outgoing::of(request, self.awaited_of(request))),
                None => self.opened(),
            }
        }
        if core::mem::take(&mut self.asks_status) {
            return Some(Outgoing::of(Request::Status, Some(Awaited::Status)));
        }
        if core::mem::take(&mut self.asks_broadcasts) {
            return Some(Outgoing::of(Request::Broadcasts, self.awaited_of(Request::Broadcasts)));
        }
        if let Some(train) = self.unverified.pop() {
            return Some(query(train));
        }
        let (locomotives, outstanding) = (&self.locomotives, &self.outstanding);
        let is_free = |train| outstanding.blocks(train, false).is_none();
        let asks = |train: &TrainId| !locomotives.has_direction(*train) && is_free(*train);
        if let Some(train) = self.waiting.iter().filter_map(train_of).find(asks) {
            return Some(query(train));
        }
        let no_pulse = self.turnouts.is_free();
        let may_go = |command: &Command| match command {
            Command::Turnout { turnout, .. } => {
                no_pulse && !outstanding.has(Awaited::Turnout(*turnout, 0, false))
            }
            _ => train_of(command).is_none_or(|train| locomotives.has_direction(train) && is_free(train)),
        };
        if let Some(command) = self.waiting.next_usual(may_go) {
            return Some(self.outgoing(now, command));
        }
        (now >= self.poll_due()).then(|| self.poll(now))
    }

    /// A request that was not answered in time, unless something newer waits or it was repeated often enough.
    fn next_repeat(&mut self, now: Timestamp, only_urgent: bool) -> Option<Outgoing> {
        while let Some(due) = self.outstanding.take_due(now, only_urgent) {
            let Outstanding { request, awaited, command, tries, .. } = due;
            if command.is_some_and(|command| self.waiting.outdates(command)) {
                continue;
            }
            if tries >= MOST_TRIES && due.may_be_given_up() {
                if let Some(command) = command {
                    self.notify(LinkNotice::Unconfirmed { command });
                }
                continue;
            }
            if matches!(request, Request::Feedback { .. }) && self.opening.is_open() {
                // It is asked again anyway.
                continue;
            }
            // Once is no news on a network that loses datagrams.
            if let Some(command) = command.filter(|_| tries > 1) {
                self.notify(LinkNotice::Repeated { command });
            }
            return Some(Outgoing {
                request,
                awaited: Some(awaited),
                command,
                tries: tries.saturating_add(1),
            });
        }
        None
    }

    /// The request of a command, and what was commanded by it.
    fn outgoing(&mut self, now: Timestamp, command: Command) -> Outgoing {
        let (request, awaited) = match command {
            Command::Speed { train, step } => self.drive(train, step, false),
            Command::Reverse { train } => self.drive(train, SpeedStep::STAND, true),
            Command::Turnout { turnout, curved } => self.throw(now, turnout, curved),
            Command::PowerOff | Command::PowerOn => {
                let on = command == Command::PowerOn;
                self.power = on;
                (Request::Power { on }, Awaited::Power(on))
            }
        };
        Outgoing { request, awaited: Some(awaited), command: Some(command), tries: 1 }
    }

    fn drive(&mut self, train: TrainId, step: SpeedStep, reverses: bool) -> (Request, Awaited) {
        self.locomotives.know(train);
        self.suspected.retain(|(other, ..)| *other != train);
        let mut forward = true;
        if let Some(locomotive) = self.locomotives.get_mut(train) {
            forward = locomotive.forward.unwrap_or(true) != reverses;
            locomotive.forward = Some(forward);
            locomotive.step = step;
            locomotive.is_driven = true;
            locomotive.is_stopped = false;
        }
        let steps = self.settings.steps;
        let throttle = steps.throttle_of(step).unwrap_or(Throttle::Stop);
        let request = Request::Drive { address: train.0, steps, throttle, forward };
        (request, Awaited::Driven(train, steps, throttle, forward))
    }

    fn throw(&mut self, now: Timestamp, turnout: TurnoutId, curved: bool) -> (Request, Awaited) {
        let address = self.settings.address_of(turnout);
        let second = curved != self.settings.second_is_straight;
        self.turnouts.powered(address, second, now);
        let request = Request::SetTurnout { address, second, activate: true, queue: false };
        (request, Awaited::Turnout(turnout, address, second))
    }

    fn send(&mut self, now: Timestamp, outgoing: Outgoing) {
        let Outgoing { request, awaited, command, tries } = outgoing;
        self.pacing.sent(now);
        if request == Request::ALL_CAN {
            self.asked_detectors = Some(now);
        }
        let mut bytes = Vec::new();
        request.write(&mut bytes);
        if let Some(question) = question_with(request) {
            // Some clones read only the first dataset of a datagram: what is repeated goes in two.
            if tries > 1 {
                self.output.push_back(Transmit::Message(core::mem::take(&mut bytes)));
            }
            question.write(&mut bytes);
        }
        self.output.push_back(Transmit::Message(bytes));
        if let Some(awaited) = awaited {
            self.outstanding.push(Outstanding { request, awaited, command, sent: now, tries });
            self.silence.asked(now);
        }
        let Some(kind) = command.and_then(|command| entry_of(&command, tries)) else { return };
        if tries > 1
            && let Request::SetTurnout { address, second, .. } = request
        {
            self.turnouts.powered(address, second, now);
        }
        self.enter(now, kind);
    }

    /// An entry of the recording.
    fn enter(&mut self, time: Timestamp, kind: EventKind) {
        self.last_entry = self.last_entry.max(time);
        self.output.push_back(Transmit::Event(Event { time, kind }));
    }

    fn notify(&mut self, notice: LinkNotice) {
        self.output.push_back(Transmit::Notice(notice));
    }

    /// When something of what waits may go.
    fn waiting_due(&self) -> Option<Timestamp> {
        let of_command = |command: &Command| {
            let stops = matches!(command, Command::PowerOff | Command::Speed { step: SpeedStep::STAND, .. });
            let paced = if stops { self.pacing.urgent_at() } else { self.pacing.usual_at() };
            let free = train_of(command).and_then(|train| self.outstanding.blocks(train, stops));
            free.map_or(paced, |free| free.max(paced))
        };
        let waits = self.waiting.iter().map(of_command).min();
        let asks = !self.unverified.is_empty() || self.asks_status || self.asks_broadcasts;
        [waits, asks.then(|| self.pacing.usual_at())].into_iter().flatten().min()
    }
}

/// The question that goes with a request, so that its answer confirms it, whatever the station tells by itself.
const fn question_with(request: Request) -> Option<Request> {
    match request {
        Request::Drive { address, .. } => Some(Request::Locomotive { address }),
        Request::SetTurnout { address, activate: true, .. } => Some(Request::Turnout { address }),
        Request::SetBroadcasts(_) => Some(Request::Broadcasts),
        _ => None,
    }
}

const fn query(train: TrainId) -> Outgoing {
    Outgoing::of(Request::Locomotive { address: train.0 }, Some(Awaited::Locomotive(train)))
}

impl Session for Client {
    fn handle_bytes(&mut self, now: Timestamp, bytes: &[u8]) {
        self.now = now;
        if self.farewell.is_over() {
            return;
        }
        self.hear(now, bytes);
        self.go_on(now);
    }

    fn handle_reopened(&mut self, now: Timestamp) {
        self.silence = Silence::new(CHECKS);
        self.is_blind = true;
        self.outstanding.clear();
        self.verify();
        if self.farewell.has_begun() {
            self.stop_driven();
        }
        self.go_on(now);
    }

    fn handle_command(&mut self, now: Timestamp, command: Command) -> Result<(), CommandError> {
        if self.farewell.has_begun() {
            return Err(CommandError::Closed);
        }
        match command {
            Command::Speed { step, .. } if self.settings.steps.throttle_of(step).is_none() => {
                return Err(CommandError::Step { step, highest: HIGHEST_STEP });
            }
            Command::Speed { train, .. } | Command::Reverse { train } if !LOCOMOTIVES.contains(&train.0) => {
                let addresses = (*LOCOMOTIVES.start(), *LOCOMOTIVES.end());
                return Err(CommandError::Train { train, addresses });
            }
            Command::Turnout { turnout, .. } if !self.settings.turnouts().contains(&turnout.0) => {
                let numbers = self.settings.turnouts();
                return Err(CommandError::Turnout { turnout, addresses: (*numbers.start(), *numbers.end()) });
            }
            _ => {}
        }
        self.waiting.push(command).map_err(CommandError::TooManyWaiting)?;
        self.go_on(now);
        Ok(())
    }

    fn handle_timeout(&mut self, now: Timestamp) {
        self.go_on(now);
    }

    fn poll_output(&mut self) -> Option<Transmit> {
        self.output.pop_front()
    }

    fn next_timeout(&self) -> Option<Timestamp> {
        if self.farewell.is_over() {
            return None;
        }
        let usual = match &self.opening {
            _ if self.farewell.has_begun() => Some(self.pacing.urgent_at()),
            Opening::Asking(_) if self.outstanding.has_question() => None,
            Opening::Asking(_) => Some(self.pacing.usual_at()),
            Opening::Open => Some(self.poll_due().max(self.pacing.usual_at())),
        };
        let due = self.outstanding.due();
        let repeat = due.map(|due| due.max(self.pacing.urgent_at()));
        let paced = due.map(|due| due.max(self.pacing.usual_at()));
        let release = self.turnouts.release_due().map(|due| due.max(self.pacing.urgent_at()));
        let times =
            [usual, repeat, paced, release, self.silence.due(), self.waiting_due(), self.farewell.due()];
        times.into_iter().flatten().filter(|at| *at > self.now).min()
    }

    fn close(&mut self, now: Timestamp) {
        if !self.farewell.has_begun() {
            self.farewell.begin(now);
            self.keep_stops();
            self.waiting.clear();
            self.outstanding.clear();
            self.stop_driven();
        }
        self.go_on(now);
    }

    fn closing(&self) -> Closing {
        self.farewell.statement(&self.locomotives)
    }
}
