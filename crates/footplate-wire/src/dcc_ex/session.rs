//! Speaks with the board: what stops first, one command a train at a time, and everything confirmed.

mod closing;
mod hearing;

use alloc::collections::VecDeque;
use alloc::string::ToString;
use alloc::vec::Vec;

use footplate_core::{Command, Event, EventKind, SpeedStep, TimeSpan, Timestamp, TrainId, TurnoutId};

use super::framing::Framing;
use super::opening::Opening;
use super::outstanding::{AllOutstanding, Awaited, MOST_TRIES, Outstanding};
use super::request::{CABS, HIGHEST_STEP, Power, Request, Throttle, speed_of};
use super::sensors::Sensors;
use super::settings::{Settings, TurnoutRequests};
use crate::farewell::Farewell;
use crate::locomotives::Locomotives;
use crate::pacing::Pacing;
use crate::queue::{Queue, entry_of, train_of};
use crate::session::{Closing, CommandError, LinkNotice, Session, Transmit};
use crate::silence::{Checks, Silence};

/// A sign of life is asked for when nothing has come for so long.
const KEEP_ALIVE: TimeSpan = TimeSpan::from_ms(500);

/// About 20 requests a second are safe (the project's own client library asks for the same). Three of the longest,
/// `<t 10239 126 1>`, fill 45 of the board's 64 bytes. The board has read a request after 10 ms, as its longest answer took
/// 9.1 ms.
const PACING: Pacing = Pacing::new(TimeSpan::from_ms(50), 3, TimeSpan::from_ms(10));

/// What a person should check.
const CHECKS: Checks = Checks {
    nothing_heard: "check its power, the cable and the port",
    nothing_whole: "check the line's speed (115200 baud) and that the port belongs to a DCC-EX board",
    noise: "check the line's speed (115200 baud), the cable, and that no other program writes to the port",
};

/// The program's side of the line to a DCC-EX board.
#[derive(Debug, Clone)]
pub struct Client {
    settings: Settings,
    now: Timestamp,
    framing: Framing,
    opening: Opening,
    pacing: Pacing,
    silence: Silence,
    waiting: Queue,
    outstanding: AllOutstanding,
    locomotives: Locomotives,
    sensors: Sensors,
    /// How defined turnouts lie, by the board's own words.
    turnouts: Vec<(TurnoutId, bool)>,
    /// Whether the track is meant to have power, and whether the board has said that it has.
    power: bool,
    is_powered: bool,
    /// Locomotives whose state has to be asked for again.
    unverified: Vec<TrainId>,
    /// When the last message came, and since when none was heard before the states were asked for again.
    heard: Timestamp,
    blind_since: Option<Timestamp>,
    /// The time of the last entry of the recording: entries stay in order.
    last_entry: Timestamp,
    farewell: Farewell,
    /// Whether all locomotives of the board are to be stopped next, those that cannot be commanded yet among them.
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
    const fn asks(request: Request, awaited: Awaited) -> Self {
        Self { request, awaited: Some(awaited), command: None, tries: 1 }
    }
}

impl Client {
    /// A session over a line that has just been opened.
    #[must_use]
    pub fn new(now: Timestamp, settings: Settings) -> Self {
        let mut client = Self {
            settings,
            now,
            framing: Framing::default(),
            opening: Opening::begin(now, &settings),
            pacing: PACING,
            silence: Silence::new(CHECKS),
            waiting: Queue::default(),
            outstanding: AllOutstanding::default(),
            locomotives: Locomotives::default(),
            sensors: Sensors::default(),
            turnouts: Vec::new(),
            power: true,
            is_powered: false,
            unverified: Vec::new(),
            heard: now,
            blind_since: None,
            last_entry: now,
            farewell: Farewell::default(),
            stops_all: false,
            output: VecDeque::new(),
        };
        client.go_on(now);
        client
    }

    /// Goes on as far as the clock allows.
    fn go_on(&mut self, now: Timestamp) {
        self.now = now;
        if let Some(notice) = self.silence.watch(now) {
            self.blind_since.get_or_insert(self.heard);
            self.notify(notice);
        }
        if matches!(self.opening, Opening::Banner { until } if now >= until) {
            self.opening = Opening::Identity;
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
        if self.opening.awaits_banner() && !self.farewell.has_begun() {
            return None;
        }
        if core::mem::take(&mut self.stops_all) {
            return Some(Outgoing { request: Request::StopAll, awaited: None, command: None, tries: 1 });
        }
        let (locomotives, outstanding) = (&self.locomotives, &self.outstanding);
        let may_stop = |command: &Command| {
            train_of(command).is_none_or(|train| {
                let is_free = outstanding.blocks(train, true).is_none_or(|until| now >= until);
                locomotives.has_direction(train) && is_free
            })
        };
        if let Some(command) = self.waiting.next_urgent(may_stop) {
            return Some(self.outgoing(command));
        }
        if let Some(repeat) = self.next_repeat(now, true) {
            return Some(repeat);
        }
        if let Some(train) = self.without_direction_at_end() {
            return Some(query(train));
        }
        if self.farewell.switch_off_is_due(now, &self.locomotives) {
            return Some(self.outgoing(Command::PowerOff));
        }
        if now < self.pacing.usual_at() || self.farewell.has_begun() {
            return None;
        }
        self.next_repeat(now, false).or_else(|| self.next_usual(now))
    }

    fn next_usual(&mut self, now: Timestamp) -> Option<Outgoing> {
        match &mut self.opening {
            Opening::Banner { .. } => return None,
            Opening::Identity if self.outstanding.has(Awaited::Identity) => return None,
            Opening::Identity => return Some(Outgoing::asks(Request::Status, Awaited::Identity)),
            Opening::States(requests) => {
                let request = requests.pop_front()?;
                let awaited = match request {
                    Request::Slots => Some(Awaited::Slots),
                    Request::Power { on, .. } => Some(Awaited::Power(on)),
                    _ => None,
                };
                return Some(Outgoing { request, awaited, command: None, tries: 1 });
            }
            Opening::Open { .. } => {}
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
        let may_go = |command: &Command| match command {
            Command::Turnout { turnout, .. } => !outstanding.has(Awaited::Turnout(*turnout, false)),
            _ => train_of(command).is_none_or(|train| locomotives.has_direction(train) && is_free(train)),
        };
        if let Some(command) = self.waiting.next_usual(may_go) {
            return Some(self.outgoing(command));
        }
        let lives = now - self.heard < KEEP_ALIVE || self.outstanding.has(Awaited::Slots);
        (!lives).then_some(Outgoing::asks(Request::Slots, Awaited::Slots))
    }

    /// A request that was not answered in time, unless something newer waits or it was repeated often enough.
    fn next_repeat(&mut self, now: Timestamp, only_urgent: bool) -> Option<Outgoing> {
        while let Some(due) = self.outstanding.take_due(now, only_urgent) {
            let Outstanding { request, awaited, command, tries, .. } = due;
            if command.is_some_and(|command| self.waiting.outdates(command)) {
                continue;
            }
            if tries >= MOST_TRIES
                && !due.is_urgent()
                && let Some(command) = command
            {
                self.notify(LinkNotice::Unconfirmed { command });
                continue;
            }
            if let Some(command) = command {
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
    fn outgoing(&mut self, command: Command) -> Outgoing {
        let (request, awaited) = match command {
            Command::Speed { train, step } => self.drive(train, step, false),
            Command::Reverse { train } => self.drive(train, SpeedStep::STAND, true),
            Command::Turnout { turnout, curved } => self.throw(turnout, curved),
            Command::PowerOff | Command::PowerOn => {
                let on = command == Command::PowerOn;
                self.power = on;
                let tracks = if on { Power::Main } else { Power::All };
                (Request::Power { on, tracks }, Some(Awaited::Power(on)))
            }
        };
        Outgoing { request, awaited, command: Some(command), tries: 1 }
    }

    fn drive(&mut self, train: TrainId, step: SpeedStep, reverses: bool) -> (Request, Option<Awaited>) {
        self.locomotives.know(train);
        let mut forward = true;
        if let Some(locomotive) = self.locomotives.get_mut(train) {
            forward = locomotive.forward.unwrap_or(true) != reverses;
            locomotive.forward = Some(forward);
            locomotive.step = step;
            locomotive.is_driven = true;
            locomotive.is_stopped = false;
        }
        let throttle = Throttle::Speed(speed_of(step).unwrap_or_default());
        (Request::Drive { cab: train.0, throttle, forward }, Some(Awaited::Driven(train, throttle, forward)))
    }

    fn throw(&mut self, turnout: TurnoutId, curved: bool) -> (Request, Option<Awaited>) {
        match self.settings.turnouts {
            TurnoutRequests::Accessory => (Request::Accessory { address: turnout.0, on: curved }, None),
            TurnoutRequests::Defined => {
                // The board answers only when the state changes.
                let lies_so = self.turnouts.contains(&(turnout, curved));
                let awaited = (!lies_so).then_some(Awaited::Turnout(turnout, curved));
                (Request::Turnout { id: turnout.0, thrown: curved }, awaited)
            }
        }
    }

    fn send(&mut self, now: Timestamp, outgoing: Outgoing) {
        let Outgoing { request, awaited, command, tries } = outgoing;
        self.pacing.sent(now);
        self.output.push_back(Transmit::Message(request.to_string().into_bytes()));
        if let Some(awaited) = awaited {
            self.outstanding.push(Outstanding { request, awaited, command, sent: now, tries });
            self.silence.asked(now);
        }
        let Some(kind) = command.and_then(|command| entry_of(&command, tries)) else { return };
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
        let verifies = (!self.unverified.is_empty()).then(|| self.pacing.usual_at());
        [waits, verifies].into_iter().flatten().min()
    }
}

const fn query(train: TrainId) -> Outgoing {
    Outgoing::asks(Request::Locomotive { cab: train.0 }, Awaited::Locomotive(train))
}

impl Session for Client {
    fn handle_bytes(&mut self, now: Timestamp, bytes: &[u8]) {
        self.now = now;
        if self.farewell.is_over() {
            return;
        }
        for byte in bytes {
            self.hear(now, *byte);
        }
        self.go_on(now);
    }

    fn handle_reopened(&mut self, now: Timestamp) {
        self.framing = Framing::default();
        self.silence = Silence::new(CHECKS);
        self.blind_since.get_or_insert(self.heard);
        self.outstanding.clear();
        self.opening = Opening::begin(now, &self.settings);
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
            Command::Speed { step, .. } if speed_of(step).is_none() => {
                return Err(CommandError::Step { step, highest: HIGHEST_STEP });
            }
            Command::Speed { train, .. } | Command::Reverse { train } if !CABS.contains(&train.0) => {
                return Err(CommandError::Train { train, addresses: (*CABS.start(), *CABS.end()) });
            }
            Command::Turnout { turnout, .. } => {
                let numbers = self.settings.turnouts.numbers();
                if !numbers.contains(&turnout.0) {
                    let addresses = (*numbers.start(), *numbers.end());
                    return Err(CommandError::Turnout { turnout, addresses });
                }
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
        let opening = match &self.opening {
            Opening::Banner { until } => Some(*until),
            Opening::Identity => Some(self.pacing.usual_at()),
            Opening::States(requests) => (!requests.is_empty()).then(|| self.pacing.usual_at()),
            Opening::Open { .. } => Some((self.heard + KEEP_ALIVE).max(self.pacing.usual_at())),
        };
        let repeat = self.outstanding.due().map(|due| due.max(self.pacing.urgent_at()));
        let paced = self.outstanding.due().map(|due| due.max(self.pacing.usual_at()));
        let times = [opening, repeat, paced, self.silence.due(), self.waiting_due(), self.farewell.due()];
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
