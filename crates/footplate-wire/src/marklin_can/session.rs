//! The session with a station: stops first, one command at a time for each train, and everything confirmed.

mod commanding;
mod hearing;

use alloc::vec::Vec;
use core::ops::{ControlFlow, RangeInclusive};

use footplate_core::{EventKind, FunctionNumber, SpeedStep, TimeSpan, Timestamp, TrainId, TurnoutId};

use super::frame::hash_of;
use super::framing::Framing;
use super::inputs::Inputs;
use super::message::{Direction, Message};
use super::outstanding::Awaited;
use super::roster::{ListedLocomotive, Roster};
use super::settings::{Settings, Transport};
use super::speed::speed_of;
use super::uid::Uid;
use crate::dialogue::{Dialogue, Repeat};
use crate::outstanding::Outgoing;
use crate::pacing::Pacing;
use crate::protocol::{Opening, Protocol};
use crate::session::CommandError;
use crate::silence::Checks;

/// A frame takes half a millisecond on the bus, and datagrams in quick succession get lost: 100 a second, four at once, and a stop
/// 2 ms after the frame before it.
const PACING: Pacing = Pacing::new(TimeSpan::from_ms(10), 4, TimeSpan::from_ms(2));

/// The interval between polls of all inputs, which find changes whose reports were lost and show that the station is alive.
const POLL_EVERY: TimeSpan = TimeSpan::from_ms(1_000);

/// The rest of a frame arrives within this time.
const FRAME_WITHIN: TimeSpan = TimeSpan::from_ms(200);

/// Opens an adapter: end a half-written line, close, 250 kbit/s, open.
const OPEN_ADAPTER: &[u8] = b"\r\rC\rS5\rO\r";

/// What the user should check on a network.
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

/// The client's session with a station.
#[derive(Debug, Clone)]
pub struct Client {
    settings: Settings,
    hash: u16,
    dialogue: Dialogue<Awaited>,
    framing: Framing,
    opening: Opening<Question>,
    roster: Roster,
    inputs: Inputs,
    /// Participants that have identified themselves.
    participants: Vec<Uid>,
    solenoid: Option<Solenoid>,
    /// Locomotives whose state must be read, and those whose reported state does not fit the commands.
    unverified: Vec<(TrainId, Query)>,
    suspected: Vec<TrainId>,
    /// Whether the station answers polls of its modules, and when it was polled last.
    has_modules: bool,
    polled: Timestamp,
    /// When the last byte arrived.
    arrived: Timestamp,
}

/// A question about a locomotive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Query {
    Speed,
    Direction,
}

impl Client {
    /// A session over a line that has just been opened.
    pub fn new(now: Timestamp, settings: Settings) -> Self {
        let checks = match settings.transport {
            Transport::Network => NETWORK_CHECKS,
            Transport::Adapter => ADAPTER_CHECKS,
        };
        let mut client = Self {
            settings,
            hash: hash_of(settings.uid.0),
            dialogue: Dialogue::new(now, PACING, checks),
            framing: Framing::new(settings.transport),
            opening: Opening::asking(Question::ALL),
            roster: Roster::default(),
            inputs: Inputs::default(),
            participants: Vec::new(),
            solenoid: None,
            unverified: Vec::new(),
            suspected: Vec::new(),
            has_modules: true,
            polled: now,
            arrived: now,
        };
        client.open_adapter();
        client.go_on(now);
        client
    }

    /// What it was opened with.
    pub const fn settings(&self) -> &Settings {
        &self.settings
    }

    /// The locomotives that the station has listed.
    pub fn listed_locomotives(&self) -> &[ListedLocomotive] {
        self.roster.list()
    }

    /// Opens an adapter, and starts a track box behind it that may wait in its loader.
    fn open_adapter(&mut self) {
        if self.settings.transport == Transport::Adapter {
            self.dialogue.write(OPEN_ADAPTER.to_vec());
            self.write(Message::Start(Uid::ALL), false);
        }
    }

    fn poll_due(&self) -> Timestamp {
        self.polled + POLL_EVERY
    }
}

/// The position of a turnout on the bus: 0 is round, 1 is straight.
const fn position_of(curved: bool) -> u8 {
    if curved { 0 } else { 1 }
}

impl Protocol for Client {
    type Awaited = Awaited;

    /// A speed contains no direction, so a train can be stopped before its direction is known.
    const STOPS_SET_DIRECTIONS: bool = false;

    fn dialogue(&self) -> &Dialogue<Awaited> {
        &self.dialogue
    }

    fn dialogue_mut(&mut self) -> &mut Dialogue<Awaited> {
        &mut self.dialogue
    }

    fn hear(&mut self, now: Timestamp, bytes: &[u8]) {
        if now - self.arrived > FRAME_WITHIN {
            self.framing.give_up();
        }
        self.arrived = now;
        for byte in bytes {
            self.hear_byte(now, *byte);
        }
    }

    fn begin_again(&mut self, _now: Timestamp) {
        self.framing = Framing::new(self.settings.transport);
        self.open_adapter();
        self.verify();
    }

    fn send(&mut self, now: Timestamp, next: Outgoing<Awaited>) {
        self.write(next.request, false);
        if let Some(EventKind::Turnout { turnout, curved }) = self.dialogue.sent(now, next) {
            self.solenoid = Some(Solenoid::powered(turnout, curved, now));
        }
    }

    fn addresses(&self, train: TrainId) -> RangeInclusive<u16> {
        let is_listed = self.roster.uid(train).is_some();
        if is_listed { 0..=u16::MAX } else { self.settings.locomotives.addresses() }
    }

    /// A train may be in the station's list, which comes later.
    fn check_decoder(&self, _train: TrainId) -> Result<(), CommandError> {
        Ok(())
    }

    fn turnouts(&self) -> RangeInclusive<u16> {
        self.settings.turnouts.addresses()
    }

    fn stop_of_all(&self) -> Message {
        Message::Halt(Uid::ALL)
    }

    fn drive(
        &mut self,
        _now: Timestamp,
        train: TrainId,
        step: SpeedStep,
        reverses: bool,
    ) -> (Message, Option<Awaited>) {
        let uid = self.uid(train);
        let forward = self.commanded(train, step, reverses);
        if reverses {
            let direction = Some(Direction::of(forward));
            return (Message::Direction { uid, direction }, Some(Awaited::Direction(train, uid, forward)));
        }
        let decoder = self.dialogue.decoder(train);
        let speed = Some(speed_of(step, decoder).unwrap_or_default());
        (Message::Speed { uid, speed }, Some(Awaited::Speed(train, uid, step, decoder)))
    }

    fn throw(&mut self, now: Timestamp, turnout: TurnoutId, curved: bool) -> (Message, Option<Awaited>) {
        self.solenoid = Some(Solenoid::powered(turnout, curved, now));
        let (uid, position) = (self.settings.turnout(turnout), position_of(curved));
        let message = Message::Accessory { uid, position, current: 1, time: None };
        (message, Some(Awaited::Accessory(turnout, uid, position, 1)))
    }

    fn switch(&mut self, train: TrainId, function: FunctionNumber, on: bool) -> (Message, Option<Awaited>) {
        let uid = self.uid(train);
        let message = Message::Function { uid, function: function.get(), value: Some(u8::from(on)) };
        (message, Some(Awaited::Function(train, uid, function, on)))
    }

    fn switch_power(&self, on: bool) -> (Message, Option<Awaited>) {
        let message = if on { Message::Go(Uid::ALL) } else { Message::Stop(Uid::ALL) };
        (message, Some(Awaited::Power(on)))
    }

    fn next_again(&mut self, now: Timestamp, only_urgent: bool) -> Option<Outgoing<Awaited>> {
        let may_throw = self.release_at().is_none();
        loop {
            match self.dialogue.next_repeat(now, only_urgent, may_throw)? {
                Repeat::Again(outgoing) => return Some(outgoing),
                Repeat::GivenUp(given_up) => {
                    if let Some(instead) = self.instead_of(&given_up) {
                        return Some(instead);
                    }
                }
            }
        }
    }

    fn next_release(&mut self, now: Timestamp) -> Option<Outgoing<Awaited>> {
        let Solenoid { turnout, curved, .. } = self.solenoid.take_if(|powered| now >= powered.release_at)?;
        let (uid, position) = (self.settings.turnout(turnout), position_of(curved));
        let message = Message::Accessory { uid, position, current: 0, time: None };
        Some(Outgoing::asks(message, Awaited::Accessory(turnout, uid, position, 0)))
    }

    fn release_at(&self) -> Option<Timestamp> {
        self.solenoid.map(|powered| powered.release_at)
    }

    fn query(&self, train: TrainId) -> Outgoing<Awaited> {
        self.querying(train, Query::Direction)
    }

    fn is_asked(&self, train: TrainId) -> bool {
        self.dialogue.outstanding.has(&Awaited::AnyDirection(train, Uid::ALL))
    }

    fn next_question(&mut self, now: Timestamp) -> ControlFlow<Option<Outgoing<Awaited>>> {
        if let Opening::Asking(questions) = &mut self.opening {
            if self.dialogue.outstanding.any(Awaited::is_question) {
                return ControlFlow::Break(None);
            }
            match questions.pop_front() {
                Some(question) => return ControlFlow::Break(Some(self.asking(now, question))),
                None => self.opened(),
            }
        }
        match self.unverified.pop() {
            Some((train, query)) => ControlFlow::Break(Some(self.querying(train, query))),
            None => ControlFlow::Continue(()),
        }
    }

    fn has_questions(&self) -> bool {
        !self.unverified.is_empty()
    }

    fn next_poll(&mut self, now: Timestamp) -> Option<Outgoing<Awaited>> {
        let question = if self.has_modules { Question::Modules } else { Question::Ping };
        let is_asked = self.dialogue.outstanding.any(Awaited::is_question);
        (now >= self.poll_due() && !is_asked).then(|| self.asking(now, question))
    }

    fn asks_at(&self) -> Option<Timestamp> {
        let paced = self.dialogue.pacing.usual_at();
        match &self.opening {
            Opening::Asking(_) => (!self.dialogue.outstanding.any(Awaited::is_question)).then_some(paced),
            Opening::Open => Some(self.poll_due().max(paced)),
        }
    }

    fn end_begins(&mut self, now: Timestamp) {
        // Before the station's list is read, the number of a locomotive is only supposed: a stop may reach none.
        if matches!(self.opening, Opening::Asking(_)) {
            self.dialogue.stop_all_next();
        }
        self.solenoid.iter_mut().for_each(|powered| powered.release_at = now);
    }
}

/// A question.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Question {
    /// Who is there.
    Ping,
    /// The inputs of all modules.
    Modules,
    /// Sets the track power.
    Power,
    /// The list of locomotives.
    Roster,
}

impl Question {
    /// All questions, in the order in which they are asked.
    pub(super) const ALL: [Self; 4] = [Self::Ping, Self::Modules, Self::Power, Self::Roster];
    /// The questions after a silence, when the list of locomotives is known.
    pub(super) const AGAIN: [Self; 3] = [Self::Ping, Self::Modules, Self::Power];
}

/// How long a coil is powered (another program was seen to release it after 200 ms).
const PULSE: TimeSpan = TimeSpan::from_ms(200);

/// A coil under power.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Solenoid {
    pub(super) turnout: TurnoutId,
    pub(super) curved: bool,
    pub(super) release_at: Timestamp,
}

impl Solenoid {
    pub(super) fn powered(turnout: TurnoutId, curved: bool, now: Timestamp) -> Self {
        Self { turnout, curved, release_at: now + PULSE }
    }
}
