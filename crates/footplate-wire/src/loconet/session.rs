//! The session with a server: stops first, one command at a time for each train, and everything confirmed by the command station.

mod hearing;

use alloc::string::String;
use alloc::vec::Vec;
use core::ops::{ControlFlow, RangeInclusive};

use footplate_core::{EventKind, FunctionNumber, SpeedStep, TimeSpan, Timestamp, TrainId, TurnoutId};

use super::functions::FunctionGroup;
use super::line::{Line, Lines};
use super::message::Message;
use super::outbox::{Outbox, SENT_WITHIN, SENT_WITHIN_AT_END};
use super::outstanding::Awaited;
use super::request::{INTERROGATIONS, LOCOMOTIVES, Request, speed_of};
use super::settings::Settings;
use super::slot::DrivenSlots;
use crate::dialogue::Dialogue;
use crate::outstanding::Outgoing;
use crate::pacing::Pacing;
use crate::protocol::{Opening, Protocol};
use crate::sensors::Sensors;
use crate::session::LinkNotice;
use crate::silence::Checks;

/// A request is up to three messages of some 5 ms on the bus, which has other users: 30 requests a second leave them half of it.
const PACING: Pacing = Pacing::new(TimeSpan::from_ms(33), 3, TimeSpan::from_ms(5));

/// A slot is read when no message has arrived for this time.
const POLL_EVERY: TimeSpan = TimeSpan::from_ms(500);

/// Between two questions for the states of detectors: each may be answered by many of them, at 2.4 ms a report.
const INTERROGATION_EVERY: TimeSpan = TimeSpan::from_ms(100);

/// A command station gives a slot away whose locomotive was not commanded for about 200 s: it is commanded again before that.
const REFRESHED_EVERY: TimeSpan = TimeSpan::from_ms(60_000);

/// How long an output of a turnout is powered (150 ms are usual).
const PULSE: TimeSpan = TimeSpan::from_ms(150);

/// What the user should check.
const CHECKS: Checks = Checks {
    nothing_heard: "check that the LocoNet server (LbServer) is running, its address and port, and the power of the command station",
    nothing_whole: "check that the port belongs to a LocoNet-over-TCP server (usually port 1234)",
    noise: "check that the port belongs to a LocoNet-over-TCP server (usually port 1234)",
};

/// The client's session with a LocoNet server.
#[derive(Debug, Clone)]
pub struct Client {
    settings: Settings,
    dialogue: Dialogue<Awaited>,
    lines: Lines,
    outbox: Outbox,
    opening: Opening<Request>,
    /// When the next question for the states of detectors may go.
    next_interrogation: Timestamp,
    slots: DrivenSlots,
    /// Slots that are to be put in use, and their trains.
    unused: Vec<(TrainId, u8)>,
    sensors: Sensors,
    /// The output of a turnout that is powered, and until when.
    pulse: Option<(u16, bool, Timestamp)>,
    /// Trains whose slots have to be read again.
    unverified: Vec<TrainId>,
    identity: Option<String>,
    /// Trains for which the station was said to have no slot.
    without_slot: Vec<TrainId>,
    polled: Timestamp,
    polls: usize,
}

impl Client {
    /// A session over a line that has just been opened.
    pub fn new(now: Timestamp, settings: Settings) -> Self {
        let mut client = Self {
            settings,
            dialogue: Dialogue::new(now, PACING, CHECKS),
            lines: Lines::default(),
            outbox: Outbox::default(),
            opening: Opening::asking(questions()),
            next_interrogation: now,
            slots: DrivenSlots::default(),
            unused: Vec::new(),
            sensors: Sensors::default(),
            pulse: None,
            unverified: Vec::new(),
            identity: None,
            without_slot: Vec::new(),
            polled: now,
            polls: 0,
        };
        client.go_on(now);
        client
    }

    /// What the bus is taken to be like.
    pub const fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Writes the message that waits, if the server may be given one.
    fn write_waiting(&mut self, now: Timestamp) {
        if !self.dialogue.farewell.is_over()
            && let Some(message) = self.outbox.next(now, self.sent_within())
        {
            self.dialogue.write(Line::Send(message).text().into_bytes());
        }
    }

    /// How long the server's word on a message is waited for.
    fn sent_within(&self) -> TimeSpan {
        if self.dialogue.farewell.has_begun() { SENT_WITHIN_AT_END } else { SENT_WITHIN }
    }

    fn poll_due(&self) -> Timestamp {
        self.dialogue.heard.max(self.polled) + POLL_EVERY
    }

    /// A sign of life: the slots of trains in turn, written again where they have not been for long.
    fn poll(&mut self, now: Timestamp) -> Outgoing<Awaited> {
        (self.polled, self.polls) = (now, self.polls.wrapping_add(1));
        let free = |train: &TrainId| self.dialogue.outstanding.blocks(*train, false).is_none();
        let stale =
            self.slots.iter().find(|slot| now - slot.refreshed > REFRESHED_EVERY && free(&slot.train));
        let stale = stale.and_then(|slot| self.dialogue.locomotives.get(slot.train));
        if let Some((train, step)) = stale.map(|known| (known.train, known.step)) {
            let (request, awaited) = self.driving(now, train, step);
            return Outgoing { request, awaited, command: None, tries: 1 };
        }
        let driven: Vec<TrainId> = self.slots.iter().map(|slot| slot.train).filter(free).collect();
        let turn = self.polls.checked_rem(driven.len() + 1).unwrap_or(0);
        match driven.get(turn) {
            Some(train) => self.query(*train),
            None => Outgoing::asks(Request::Slot(0), Awaited::Status),
        }
    }

    /// A question of the opening.
    fn question(&mut self, now: Timestamp, request: Request) -> Outgoing<Awaited> {
        let awaited = match request {
            Request::Power { .. } => return self.wanted_power(),
            Request::Interrogate(nth) => {
                self.next_interrogation = now + INTERROGATION_EVERY;
                Awaited::Interrogation(nth)
            }
            _ => Awaited::Status,
        };
        Outgoing::asks(request, awaited)
    }

    /// The request that drives a train as it is commanded to run.
    fn driving(&mut self, now: Timestamp, train: TrainId, step: SpeedStep) -> (Request, Option<Awaited>) {
        let forward = self.dialogue.locomotives.get(train).and_then(|known| known.forward).unwrap_or(true);
        let speed = speed_of(step, self.dialogue.decoder(train)).unwrap_or_default();
        let request = self.drive_request(now, train, speed, forward);
        (request, Some(Awaited::Driven(train, speed, forward)))
    }

    /// Sets the direction, too, if the slot was last read with another one. A train without a slot gets one first.
    fn drive_request(&mut self, now: Timestamp, train: TrainId, speed: u8, forward: bool) -> Request {
        let found = self.slots.of_mut(train).and_then(|slot| Some((slot.number?, slot)));
        let Some((number, slot)) = found else { return Request::Locomotive(train.0) };
        slot.refreshed = now;
        let direction = (slot.forward != forward).then_some((forward, slot.functions));
        Request::Drive { slot: number, speed, direction }
    }

    /// Ends the opening: trains may run.
    fn opened(&mut self) {
        self.opening = Opening::Open;
        (self.dialogue.blind_since, self.polled) = (None, self.dialogue.now);
        self.dialogue.notify(LinkNotice::Answers);
    }

    /// Reads all states again, including every locomotive's.
    fn verify(&mut self) {
        self.opening = Opening::asking(questions());
        self.unverified = self.dialogue.directed();
    }
}

/// What is asked before trains are driven: whether the station answers, the power, and what detectors see. Whether power is switched on
/// or off is decided when it is written.
fn questions() -> impl Iterator<Item = Request> {
    let first = [Request::Slot(0), Request::Power { on: true }];
    first.into_iter().chain((0..INTERROGATIONS).map(Request::Interrogate)).chain([Request::Slot(0)])
}

const fn acquire(train: TrainId) -> Outgoing<Awaited> {
    Outgoing::asks(Request::Locomotive(train.0), Awaited::Locomotive(train))
}

impl Protocol for Client {
    type Awaited = Awaited;

    fn dialogue(&self) -> &Dialogue<Awaited> {
        &self.dialogue
    }

    fn dialogue_mut(&mut self) -> &mut Dialogue<Awaited> {
        &mut self.dialogue
    }

    fn hear(&mut self, now: Timestamp, bytes: &[u8]) {
        for byte in bytes {
            self.hear_byte(now, *byte);
        }
    }

    fn advance(&mut self, now: Timestamp) {
        self.write_waiting(now);
    }

    fn begin_again(&mut self, _now: Timestamp) {
        self.lines = Lines::default();
        self.outbox.clear();
        self.unused.clear();
        self.verify();
    }

    fn send(&mut self, now: Timestamp, mut next: Outgoing<Awaited>) {
        // Slots report more after the first try: the slot itself, or another direction, which only a message of its own sets.
        if let (2.., Some(Awaited::Driven(train, speed, forward))) = (next.tries, next.awaited) {
            next.request = self.drive_request(now, train, speed, forward);
        }
        let request = next.request;
        self.outbox.push(request.messages());
        self.write_waiting(now);
        let entry = self.dialogue.sent(now, next);
        if let (Some(EventKind::Turnout { .. }), Request::Switch { address, closed, .. }) = (entry, request) {
            self.pulse = Some((address, closed, now + PULSE));
        }
    }

    /// A request waits until the messages of the one before are on the bus: so a stop waits for one request at most.
    fn may_write(&self, now: Timestamp) -> bool {
        self.dialogue.may_write(now) && self.outbox.is_empty()
    }

    fn addresses(&self, _train: TrainId) -> RangeInclusive<u16> {
        LOCOMOTIVES
    }

    fn turnouts(&self) -> RangeInclusive<u16> {
        self.settings.turnouts()
    }

    fn stop_of_all(&self) -> Request {
        Request::StopAll
    }

    fn before_stops(&mut self) -> Option<Outgoing<Awaited>> {
        let (train, slot) = self.unused.pop()?;
        let drives = |awaited: &Awaited| matches!(awaited, Awaited::Driven(of, ..) if *of == train);
        if self.dialogue.outstanding.any(drives) {
            // Its repeats show whether the slot is in use, and a question would end them.
            return Some(Outgoing::says(Request::Use(slot)));
        }
        Some(Outgoing::asks(Request::Use(slot), Awaited::Locomotive(train)))
    }

    fn drive(
        &mut self,
        now: Timestamp,
        train: TrainId,
        step: SpeedStep,
        reverses: bool,
    ) -> (Request, Option<Awaited>) {
        self.dialogue.commanded(train, step, reverses);
        self.driving(now, train, step)
    }

    fn throw(&mut self, now: Timestamp, turnout: TurnoutId, curved: bool) -> (Request, Option<Awaited>) {
        let address = self.settings.address_of(turnout);
        let closed = curved != self.settings.closed_is_straight;
        self.pulse = Some((address, closed, now + PULSE));
        let message = Message::Switch { address, closed, on: true };
        (Request::Switch { address, closed, on: true }, Some(Awaited::Turnout(turnout, message)))
    }

    /// One message sets all functions of a group: a newer request includes what an earlier one switched.
    fn switch(&mut self, train: TrainId, function: FunctionNumber, on: bool) -> (Request, Option<Awaited>) {
        let Some(slot) = self.slots.of_mut(train) else { return (Request::Locomotive(train.0), None) };
        let bit = function.bit();
        slot.functions = if on { slot.functions | bit } else { slot.functions & !bit };
        let (forward, functions, group) = (slot.forward, slot.functions, FunctionGroup::of(function));
        let request = match slot.number {
            Some(slot) => Request::Functions { slot, address: train.0, forward, group, functions },
            None => Request::Locomotive(train.0),
        };
        (request, Some(Awaited::Functions(train, group, functions)))
    }

    fn switch_power(&self, on: bool) -> (Request, Option<Awaited>) {
        (Request::Power { on }, Some(Awaited::Power(on)))
    }

    fn next_release(&mut self, now: Timestamp) -> Option<Outgoing<Awaited>> {
        let (address, closed, _) = self.pulse.take_if(|(.., until)| now >= *until)?;
        let request = Request::Switch { address, closed, on: false };
        let message = Message::Switch { address, closed, on: false };
        let turnout = self.settings.turnout_at(address);
        Some(turnout.map_or(Outgoing::says(request), |turnout| {
            Outgoing::asks(request, Awaited::Release(turnout, message))
        }))
    }

    fn release_at(&self) -> Option<Timestamp> {
        self.pulse.map(|(.., until)| until)
    }

    fn query(&self, train: TrainId) -> Outgoing<Awaited> {
        match self.slots.of(train).and_then(|slot| slot.number) {
            Some(slot) => Outgoing::asks(Request::Slot(slot), Awaited::Locomotive(train)),
            None => acquire(train),
        }
    }

    fn next_question(&mut self, now: Timestamp) -> ControlFlow<Option<Outgoing<Awaited>>> {
        if let Opening::Asking(requests) = &mut self.opening {
            if self.dialogue.outstanding.any(Awaited::is_question) || now < self.next_interrogation {
                return ControlFlow::Break(None);
            }
            match requests.pop_front() {
                Some(request) => return ControlFlow::Break(Some(self.question(now, request))),
                None => self.opened(),
            }
        }
        let unverified = self.dialogue.take_unblocked(&mut self.unverified);
        unverified.map_or(ControlFlow::Continue(()), |train| ControlFlow::Break(Some(self.query(train))))
    }

    fn has_questions(&self) -> bool {
        !self.unverified.is_empty() || !self.unused.is_empty()
    }

    fn next_poll(&mut self, now: Timestamp) -> Option<Outgoing<Awaited>> {
        let is_polled = self.dialogue.outstanding.has(&Awaited::Status);
        (now >= self.poll_due() && !is_polled).then(|| self.poll(now))
    }

    fn asks_at(&self) -> Option<Timestamp> {
        let paced = self.dialogue.pacing.usual_at();
        match &self.opening {
            Opening::Asking(_) if self.dialogue.outstanding.any(Awaited::is_question) => None,
            Opening::Asking(_) => Some(self.next_interrogation.max(paced)),
            Opening::Open => Some(self.poll_due().max(paced)),
        }
    }

    fn end_begins(&mut self, now: Timestamp) {
        self.pulse.iter_mut().for_each(|(.., until)| *until = now);
    }

    /// Nothing is written before the server has said what became of the last message.
    fn written_at(&self) -> Option<Timestamp> {
        self.outbox.due(self.sent_within())
    }
}
