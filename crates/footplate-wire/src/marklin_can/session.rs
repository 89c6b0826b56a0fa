//! Speaks with the station: what stops first, one command a train at a time, and everything confirmed.

mod closing;
mod commanding;
mod hearing;

use alloc::collections::VecDeque;
use alloc::vec::Vec;

use footplate_core::{Command, Event, EventKind, SpeedStep, TimeSpan, Timestamp, TrainId, TurnoutId};

use super::contacts::Contacts;
use super::frame::hash_of;
use super::framing::Framing;
use super::message::Message;
use super::opening::{Opening, Question};
use super::outstanding::{AllOutstanding, Awaited};
use super::roster::{ListedLocomotive, Roster};
use super::settings::{Settings, Transport};
use super::solenoid::Solenoid;
use super::speed::{HIGHEST_STEP, speed_of};
use super::uid::Uid;
use crate::farewell::Farewell;
use crate::locomotives::Locomotives;
use crate::pacing::Pacing;
use crate::queue::{Queue, train_of};
use crate::session::{Closing, CommandError, LinkNotice, Session, Transmit};
use crate::silence::{Checks, Silence};

/// A frame needs half a millisecond on the bus, and quick datagrams are lost now and then: 100 a second, four at once, and what stops
/// something 2 ms after the frame before.
const PACING: Pacing = Pacing::new(TimeSpan::from_ms(10), 4, TimeSpan::from_ms(2));

/// How often all contacts are asked for: what changed in a report that was lost is known after that. It is a sign of life, too.
const POLL_EVERY: TimeSpan = TimeSpan::from_ms(1_000);

/// The rest of a frame comes within this time: it is on its way already.
const FRAME_WITHIN: TimeSpan = TimeSpan::from_ms(200);

/// What an adapter is written before anything else: end what a line may hold, close, 250 kbit/s, open.
const OPEN_ADAPTER: &[u8] = b"\r\rC\rS5\rO\r";

/// What a person should check on a network.
const NETWORK_CHECKS: Checks = Checks {
    nothing_heard: "check its power and network cable, that CAN is switched on in the station's settings, and that a CS2 sends to this \
                    computer's address",
    nothing_whole: "check that the address belongs to a CS2 or CS3 (port 15731)",
    noise: "check that the address belongs to a CS2 or CS3 (port 15731)",
};

/// The same behind an adapter.
const ADAPTER_CHECKS: Checks = Checks {
    nothing_heard: "check the power of the track box, the CAN cable and the port",
    nothing_whole: "check that the port belongs to a CAN adapter that understands slcan (Lawicel)",
    noise: "check that the port belongs to a CAN adapter that understands slcan (Lawicel), and that no other program uses it",
};

/// The program's side of the line to a station.
#[derive(Debug, Clone)]
pub struct Client {
    settings: Settings,
    hash: u16,
    now: Timestamp,
    framing: Framing,
    opening: Opening,
    pacing: Pacing,
    silence: Silence,
    waiting: Queue,
    outstanding: AllOutstanding,
    locomotives: Locomotives,
    roster: Roster,
    contacts: Contacts,
    /// Participants that have named themselves.
    participants: Vec<Uid>,
    /// How turnouts lie, by what the station has said of them.
    turnouts: Vec<(TurnoutId, bool)>,
    solenoid: Option<Solenoid>,
    /// Whether the track is meant to have power, and whether the station has said that it has.
    power: bool,
    is_powered: bool,
    /// Locomotives whose state has to be asked for, and those of which something else was said than was commanded.
    unverified: Vec<(TrainId, Query)>,
    suspected: Vec<TrainId>,
    /// Whether the station answers when it is asked for its modules, and when it was asked last.
    has_modules: bool,
    polled: Timestamp,
    /// When the last byte and the last frame came, and since when none was heard before the states were asked for again.
    arrived: Timestamp,
    heard: Timestamp,
    is_blind: bool,
    /// The time of the last entry of the recording: entries stay in order.
    last_entry: Timestamp,
    farewell: Farewell,
    output: VecDeque<Transmit>,
}

/// What is asked of a locomotive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Query {
    Speed,
    Direction,
}

/// A request that is about to be written.
#[derive(Clone, Copy)]
struct Outgoing {
    message: Message,
    awaited: Option<Awaited>,
    command: Option<Command>,
    tries: u8,
}

impl Outgoing {
    const fn asks(message: Message, awaited: Awaited) -> Self {
        Self { message, awaited: Some(awaited), command: None, tries: 1 }
    }
}

impl Client {
    /// A session over a line that has just been opened.
    #[must_use]
    pub fn new(now: Timestamp, settings: Settings) -> Self {
        let mut client = Self {
            settings,
            hash: hash_of(settings.uid.0),
            now,
            framing: Framing::new(settings.transport),
            opening: Opening::begin(),
            pacing: PACING,
            silence: silence(settings.transport),
            waiting: Queue::default(),
            outstanding: AllOutstanding::default(),
            locomotives: Locomotives::default(),
            roster: Roster::default(),
            contacts: Contacts::default(),
            participants: Vec::new(),
            turnouts: Vec::new(),
            solenoid: None,
            power: true,
            is_powered: false,
            unverified: Vec::new(),
            suspected: Vec::new(),
            has_modules: true,
            polled: now,
            arrived: now,
            heard: now,
            is_blind: false,
            last_entry: now,
            farewell: Farewell::default(),
            output: VecDeque::new(),
        };
        client.open_adapter();
        client.go_on(now);
        client
    }

    /// What it was opened with.
    #[must_use]
    pub const fn settings(&self) -> &Settings {
        &self.settings
    }

    /// The locomotives that the station has listed.
    #[must_use]
    pub fn listed_locomotives(&self) -> &[ListedLocomotive] {
        self.roster.list()
    }

    /// An adapter is closed until it is opened, and a track box behind it may wait in its loader.
    fn open_adapter(&mut self) {
        if self.settings.transport == Transport::Adapter {
            self.output.push_back(Transmit::Message(OPEN_ADAPTER.to_vec()));
            self.write(Message::Start(Uid::ALL), false);
        }
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
        let outstanding = &self.outstanding;
        let may_stop = |command: &Command| {
            train_of(command)
                .is_none_or(|train| outstanding.blocks(train, true).is_none_or(|until| now >= until))
        };
        if let Some(command) = self.waiting.next_urgent(may_stop) {
            return Some(self.outgoing(now, command));
        }
        if let Some(repeat) = self.next_repeat(now, true) {
            return Some(repeat);
        }
        if let Some(release) = self.next_release(now) {
            return Some(release);
        }
        if self.farewell.switch_off_is_due(now, &self.locomotives) {
            return Some(self.outgoing(now, Command::PowerOff));
        }
        if now < self.pacing.usual_at() || self.farewell.has_begun() {
            return None;
        }
        self.next_repeat(now, false).or_else(|| self.next_usual(now))
    }

    fn next_usual(&mut self, now: Timestamp) -> Option<Outgoing> {
        if let Opening::Asking(questions) = &mut self.opening {
            if self.outstanding.has_question() {
                return None;
            }
            match questions.pop_front() {
                Some(question) => return Some(self.asking(now, question)),
                None => self.opened(),
            }
        }
        if let Some((train, query)) = self.unverified.pop() {
            return Some(self.query(train, query));
        }
        let (locomotives, outstanding) = (&self.locomotives, &self.outstanding);
        let asks = |train: &TrainId| {
            !locomotives.has_direction(*train) && !outstanding.has(Awaited::AnyDirection(*train, Uid::ALL))
        };
        if let Some(train) = self.waiting.iter().filter_map(train_of).find(asks) {
            return Some(self.query(train, Query::Direction));
        }
        let has_no_pulse = self.solenoid.is_none();
        let may_go = |command: &Command| match command {
            Command::Turnout { turnout, .. } => {
                has_no_pulse && !outstanding.has(Awaited::Accessory(*turnout, Uid::ALL, 0, 0))
            }
            _ => train_of(command).is_none_or(|train| {
                locomotives.has_direction(train) && outstanding.blocks(train, false).is_none()
            }),
        };
        if let Some(command) = self.waiting.next_usual(may_go) {
            return Some(self.outgoing(now, command));
        }
        let question = if self.has_modules { Question::Modules } else { Question::Ping };
        (now >= self.poll_due() && !self.outstanding.has_question()).then(|| self.asking(now, question))
    }

    fn poll_due(&self) -> Timestamp {
        self.polled + POLL_EVERY
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

fn silence(transport: Transport) -> Silence {
    Silence::new(match transport {
        Transport::Network => NETWORK_CHECKS,
        Transport::Adapter => ADAPTER_CHECKS,
    })
}

/// The position of a turnout on the bus: 0 is round, 1 is straight.
const fn position_of(curved: bool) -> u8 {
    if curved { 0 } else { 1 }
}

impl Session for Client {
    fn handle_bytes(&mut self, now: Timestamp, bytes: &[u8]) {
        self.now = now;
        if self.farewell.is_over() {
            return;
        }
        if now - self.arrived > FRAME_WITHIN {
            self.framing.give_up();
        }
        self.arrived = now;
        for byte in bytes {
            self.hear(now, *byte);
        }
        self.go_on(now);
    }

    fn handle_reopened(&mut self, now: Timestamp) {
        self.framing = Framing::new(self.settings.transport);
        self.silence = silence(self.settings.transport);
        self.is_blind = true;
        self.outstanding.clear();
        self.open_adapter();
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
        let trains = self.settings.locomotives.addresses();
        let turnouts = self.settings.turnouts.addresses();
        match command {
            Command::Speed { step, .. } if speed_of(step).is_none() => {
                return Err(CommandError::Step { step, highest: HIGHEST_STEP });
            }
            Command::Speed { train, .. } | Command::Reverse { train }
                if !trains.contains(&train.0) && self.roster.uid(train).is_none() =>
            {
                return Err(CommandError::Train { train, addresses: (*trains.start(), *trains.end()) });
            }
            Command::Turnout { turnout, .. } if !turnouts.contains(&turnout.0) => {
                return Err(CommandError::Turnout {
                    turnout,
                    addresses: (*turnouts.start(), *turnouts.end()),
                });
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
        let (urgent, paced) = (self.pacing.urgent_at(), self.pacing.usual_at());
        let usual = match &self.opening {
            _ if self.farewell.has_begun() => None,
            Opening::Asking(_) => (!self.outstanding.has_question()).then_some(paced),
            Opening::Open => Some(self.poll_due().max(paced)),
        };
        let stops = self.outstanding.due(true).map(|due| due.max(urgent));
        let others = self.outstanding.due(false).map(|due| due.max(paced));
        let release = self.solenoid.map(|powered| powered.release_at.max(urgent));
        let times =
            [usual, stops, others, release, self.silence.due(), self.waiting_due(), self.farewell.due()];
        times.into_iter().flatten().filter(|at| *at > self.now).min()
    }

    fn close(&mut self, now: Timestamp) {
        if !self.farewell.has_begun() {
            self.farewell.begin(now);
            self.keep_stops();
            self.waiting.clear();
            self.outstanding.clear();
            self.solenoid.iter_mut().for_each(|powered| powered.release_at = now);
            self.stop_driven();
        }
        self.go_on(now);
    }

    fn closing(&self) -> Closing {
        self.farewell.statement(&self.locomotives)
    }
}
