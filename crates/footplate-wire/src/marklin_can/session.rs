//! Speaks with the station: what stops first, one command a train at a time, and everything confirmed.

mod closing;
mod hearing;

use alloc::collections::VecDeque;
use alloc::vec::Vec;

use footplate_core::{Command, Event, EventKind, SpeedStep, TimeSpan, Timestamp, TrainId, TurnoutId};

use super::contacts::Contacts;
use super::frame::{Frame, hash_of};
use super::framing::Framing;
use super::message::{Direction, Message};
use super::opening::{Opening, Question};
use super::outstanding::{AllOutstanding, Awaited, LIST_TRIES, MOST_TRIES, Outstanding};
use super::roster::{LOCOMOTIVES_FILE, ListedLocomotive, Roster};
use super::settings::{Settings, Transport};
use super::solenoid::Solenoid;
use super::speed::{HIGHEST_STEP, speed_of};
use super::uid::Uid;
use crate::farewell::Farewell;
use crate::locomotives::Locomotives;
use crate::pacing::Pacing;
use crate::queue::Queue;
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
        if self.switch_off_is_due(now) {
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

    fn asking(&mut self, now: Timestamp, question: Question) -> Outgoing {
        match question {
            Question::Ping => {
                self.polled = now;
                Outgoing::asks(Message::Ping, Awaited::Participant)
            }
            Question::Modules => {
                self.polled = now;
                let modules = self.settings.modules;
                Outgoing::asks(Message::ModulePoll { uid: Uid::ALL, modules }, Awaited::Modules)
            }
            Question::Power => {
                let message = if self.power { Message::Go(Uid::ALL) } else { Message::Stop(Uid::ALL) };
                Outgoing::asks(message, Awaited::Power(self.power))
            }
            Question::Roster => Outgoing::asks(Message::File(LOCOMOTIVES_FILE), Awaited::Roster),
        }
    }

    fn poll_due(&self) -> Timestamp {
        self.polled + POLL_EVERY
    }

    fn query(&self, train: TrainId, query: Query) -> Outgoing {
        let uid = self.uid(train);
        match query {
            Query::Speed => {
                Outgoing::asks(Message::Speed { uid, speed: None }, Awaited::AnySpeed(train, uid))
            }
            Query::Direction => {
                Outgoing::asks(Message::Direction { uid, direction: None }, Awaited::AnyDirection(train, uid))
            }
        }
    }

    /// The number of a train on the bus: by the station's list, or by its address.
    fn uid(&self, train: TrainId) -> Uid {
        self.roster.uid(train).unwrap_or_else(|| self.settings.locomotives.uid(train.0))
    }

    /// The coil that has been powered for long enough is released.
    fn next_release(&mut self, now: Timestamp) -> Option<Outgoing> {
        let Solenoid { turnout, curved, .. } = self.solenoid.take_if(|powered| now >= powered.release_at)?;
        let (uid, position) = (self.settings.turnout(turnout), position_of(curved));
        let message = Message::Accessory { uid, position, current: 0, time: None };
        Some(Outgoing::asks(message, Awaited::Accessory(turnout, uid, position, 0)))
    }

    /// A request that was not answered in time, unless something newer waits or it was repeated often enough.
    fn next_repeat(&mut self, now: Timestamp, only_urgent: bool) -> Option<Outgoing> {
        while let Some(due) = self.outstanding.take_due(now, only_urgent) {
            let Outstanding { message, awaited, command, tries, .. } = due;
            if command.is_some_and(|command| self.waiting.outdates(command)) {
                continue;
            }
            // A list that was damaged on its way comes whole another time.
            let most =
                if awaited == Awaited::Roster && self.roster.has_begun() { LIST_TRIES } else { MOST_TRIES };
            if tries >= most && due.may_be_given_up() {
                if let Some(given_up) = self.given_up(awaited, command) {
                    return Some(given_up);
                }
                continue;
            }
            // Once is no news on a network that loses datagrams.
            if let Some(command) = command.filter(|_| tries > 1) {
                self.notify(LinkNotice::Repeated { command });
            }
            return Some(Outgoing {
                message,
                awaited: Some(awaited),
                command,
                tries: tries.saturating_add(1),
            });
        }
        None
    }

    /// The station does not answer this; what is done instead.
    fn given_up(&mut self, awaited: Awaited, command: Option<Command>) -> Option<Outgoing> {
        if let Some(command) = command {
            self.notify(LinkNotice::Unconfirmed { command });
        }
        match awaited {
            Awaited::Modules => self.has_modules = false,
            Awaited::AnyDirection(train, uid) => {
                // It cannot be asked which end leads: it is commanded, so that it is known.
                self.locomotives.know(train);
                let locomotive = self.locomotives.get_mut(train)?;
                if locomotive.forward.is_none() {
                    locomotive.forward = Some(true);
                    let message = Message::Direction { uid, direction: Some(Direction::Forward) };
                    return Some(Outgoing::asks(message, Awaited::Direction(train, uid, true)));
                }
            }
            _ => {}
        }
        None
    }

    /// The request of a command, and what was commanded by it.
    fn outgoing(&mut self, now: Timestamp, command: Command) -> Outgoing {
        let (message, awaited) = match command {
            Command::Speed { train, step } => {
                let uid = self.uid(train);
                self.commanded(train, step, false);
                let speed = Some(speed_of(step).unwrap_or_default());
                (Message::Speed { uid, speed }, Awaited::Speed(train, uid, step))
            }
            Command::Reverse { train } => {
                let uid = self.uid(train);
                let forward = self.commanded(train, SpeedStep::STAND, true);
                let direction = Some(Direction::of(forward));
                (Message::Direction { uid, direction }, Awaited::Direction(train, uid, forward))
            }
            Command::Turnout { turnout, curved } => {
                self.solenoid = Some(Solenoid::powered(turnout, curved, now));
                let (uid, position) = (self.settings.turnout(turnout), position_of(curved));
                let message = Message::Accessory { uid, position, current: 1, time: None };
                (message, Awaited::Accessory(turnout, uid, position, 1))
            }
            Command::PowerOff | Command::PowerOn => {
                let on = command == Command::PowerOn;
                self.power = on;
                let message = if on { Message::Go(Uid::ALL) } else { Message::Stop(Uid::ALL) };
                (message, Awaited::Power(on))
            }
        };
        Outgoing { message, awaited: Some(awaited), command: Some(command), tries: 1 }
    }

    /// A train is commanded to run at a step, and the other way if it is reversed; returns whether its front end leads then.
    fn commanded(&mut self, train: TrainId, step: SpeedStep, reverses: bool) -> bool {
        self.locomotives.know(train);
        self.suspected.retain(|other| *other != train);
        let Some(locomotive) = self.locomotives.get_mut(train) else { return true };
        if reverses {
            locomotive.forward = Some(!locomotive.forward.unwrap_or(true));
        }
        (locomotive.step, locomotive.is_driven, locomotive.is_stopped) = (step, true, false);
        locomotive.forward.unwrap_or(true)
    }

    fn write(&mut self, message: Message, is_response: bool) {
        let frame: Frame = message.frame(is_response, self.hash);
        let bytes = match self.settings.transport {
            Transport::Network => frame.encode().to_vec(),
            Transport::Adapter => {
                let mut line = frame.to_text().into_bytes();
                line.push(b'\r');
                line
            }
        };
        self.output.push_back(Transmit::Message(bytes));
    }

    fn send(&mut self, now: Timestamp, outgoing: Outgoing) {
        let Outgoing { message, awaited, command, tries } = outgoing;
        self.pacing.sent(now);
        self.write(message, false);
        if let Some(awaited) = awaited {
            self.outstanding.push(Outstanding { message, awaited, command, sent: now, tries });
            self.silence.asked(now);
        }
        let kind = match command {
            Some(Command::Speed { train, step }) => EventKind::Speed { train, step },
            // A repetition sets the same direction again.
            Some(Command::Reverse { train }) if tries == 1 => EventKind::Reverse { train },
            Some(Command::Turnout { turnout, curved }) => {
                self.solenoid = Some(Solenoid::powered(turnout, curved, now));
                EventKind::Turnout { turnout, curved }
            }
            _ => return,
        };
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

fn silence(transport: Transport) -> Silence {
    Silence::new(match transport {
        Transport::Network => NETWORK_CHECKS,
        Transport::Adapter => ADAPTER_CHECKS,
    })
}

/// The train that a command is for.
const fn train_of(command: &Command) -> Option<TrainId> {
    match command {
        Command::Speed { train, .. } | Command::Reverse { train } => Some(*train),
        _ => None,
    }
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
        self.statement()
    }
}
