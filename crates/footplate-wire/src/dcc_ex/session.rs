//! The session with a board: stops first, one command at a time for each train, and everything confirmed.

mod hearing;

use alloc::collections::BTreeMap;
use alloc::string::ToString;
use alloc::vec::Vec;
use core::ops::{ControlFlow, RangeInclusive};

use footplate_core::{FunctionNumber, SpeedStep, TimeSpan, Timestamp, TrainId, TurnoutId};

use hearing::Driven;

use super::definitions::{Definitions, by_address, question_after};
use super::framing::Framing;
use super::opening::Opening;
use super::outstanding::Awaited;
use super::request::{CABS, Power, Request, Throttle, speed_of};
use super::settings::{Settings, TurnoutRequests};
use crate::dialogue::Dialogue;
use crate::outstanding::Outgoing;
use crate::pacing::Pacing;
use crate::protocol::Protocol;
use crate::sensors::Sensors;
use crate::silence::Checks;

/// The board is polled when no message has arrived for this time.
const KEEP_ALIVE: TimeSpan = TimeSpan::from_ms(500);

/// About 20 requests a second are safe (the project's own client library asks for the same). Three of the longest,
/// `<t 10239 126 1>`, fill 45 of the board's 64 bytes. The board has read a request after 10 ms, as its longest answer took
/// 9.1 ms.
const PACING: Pacing = Pacing::new(TimeSpan::from_ms(50), 3, TimeSpan::from_ms(10));

/// What the user should check.
const CHECKS: Checks = Checks {
    nothing_heard: "check its power, the cable and the port",
    nothing_whole: "check the line's speed (115200 baud) and that the port belongs to a DCC-EX board",
    noise: "check the line's speed (115200 baud), the cable, and that no other program writes to the port",
};

/// The client's session with a DCC-EX board.
#[derive(Debug, Clone)]
pub struct Client {
    settings: Settings,
    dialogue: Dialogue<Awaited>,
    framing: Framing,
    opening: Opening,
    sensors: Sensors,
    /// Locomotives whose state must be read again.
    unverified: Vec<TrainId>,
    /// How each locomotive was driven by its last reports, which were alike, and how many of them there were; too few yet to count.
    unconfirmed: BTreeMap<TrainId, (Driven, u8)>,
    definitions: Definitions,
}

impl Client {
    /// A session over a line that has just been opened.
    pub fn new(now: Timestamp, settings: Settings) -> Self {
        let mut client = Self {
            settings,
            dialogue: Dialogue::new(now, PACING, CHECKS),
            framing: Framing::default(),
            opening: Opening::begin(now, &settings),
            sensors: Sensors::default(),
            unverified: Vec::new(),
            unconfirmed: BTreeMap::new(),
            definitions: Definitions::default(),
        };
        client.go_on(now);
        client
    }

    /// The board's speed for a step of a train.
    fn throttle(&self, train: TrainId, step: SpeedStep) -> Throttle {
        Throttle::Speed(speed_of(step, self.dialogue.decoder(train)).unwrap_or_default())
    }
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
        if matches!(self.opening, Opening::Banner { until } if now >= until) {
            self.opening = Opening::Identity;
        }
    }

    fn begin_again(&mut self, now: Timestamp) {
        self.framing = Framing::default();
        self.opening = Opening::begin(now, &self.settings);
    }

    fn send(&mut self, now: Timestamp, next: Outgoing<Awaited>) {
        let request = match next.request {
            // The first request may have been obeyed and its answer lost: a second one changes nothing then, and has none.
            Request::Function { cab, .. } if next.tries.is_multiple_of(2) => Request::Locomotive { cab },
            request => request,
        };
        let mut text = request.to_string();
        if let Some(awaited) = next.awaited {
            self.definitions.sent(awaited, self.dialogue.is_noisy());
            if let Some(question) = question_after(awaited, request) {
                text.push_str(&question.to_string());
            }
        }
        let is_ending = self.dialogue.farewell.has_begun();
        // A train of unknown direction has to stop now: the stop of all may have been lost as well.
        if matches!(request, Request::Locomotive { .. }) && next.tries > 1 && is_ending {
            text.insert_str(0, &Request::StopAll.to_string());
        }
        self.dialogue.write(text.into_bytes());
        self.dialogue.sent(now, next);
    }

    fn may_write(&self, now: Timestamp) -> bool {
        let is_ending = self.dialogue.farewell.has_begun();
        self.dialogue.may_write(now) && (is_ending || !self.opening.awaits_banner())
    }

    /// `<a 153 0>` that loses a digit throws turnout 15, under whatever train is there, and the board says nothing of it.
    fn may_throw(&self) -> bool {
        let is_confirmed =
            self.settings.turnouts == TurnoutRequests::Confirmed && self.definitions.are_all_own();
        is_confirmed || !self.dialogue.is_noisy()
    }

    fn addresses(&self, _train: TrainId) -> RangeInclusive<u16> {
        CABS
    }

    fn turnouts(&self) -> RangeInclusive<u16> {
        self.settings.turnouts.numbers()
    }

    fn stop_of_all(&self) -> Request {
        Request::StopAll
    }

    fn drive(
        &mut self,
        _now: Timestamp,
        train: TrainId,
        step: SpeedStep,
        reverses: bool,
    ) -> (Request, Option<Awaited>) {
        let forward = self.dialogue.commanded(train, step, reverses);
        let throttle = self.throttle(train, step);
        (Request::Drive { cab: train.0, throttle, forward }, Some(Awaited::Driven(train, throttle, forward)))
    }

    fn throw(&mut self, _now: Timestamp, turnout: TurnoutId, curved: bool) -> (Request, Option<Awaited>) {
        match self.settings.turnouts {
            TurnoutRequests::Confirmed => self.definitions.throw(turnout, curved),
            TurnoutRequests::Accessory => by_address(turnout, curved),
            TurnoutRequests::Defined => {
                // The board answers only when the state changes.
                let changes = !self.dialogue.lies(turnout, curved);
                let awaited = changes.then_some(Awaited::Turnout(turnout, curved));
                (Request::Turnout { id: turnout.0, thrown: curved }, awaited)
            }
        }
    }

    /// The board answers only when the state changes.
    fn switch(&mut self, train: TrainId, function: FunctionNumber, on: bool) -> (Request, Option<Awaited>) {
        let known = self.dialogue.locomotives.get(train).and_then(|known| known.functions.is_on(function));
        let changes = known != Some(on);
        let request = Request::Function { cab: train.0, function: function.get(), on };
        (request, changes.then_some(Awaited::Function(train, function, on)))
    }

    fn switch_power(&self, on: bool) -> (Request, Option<Awaited>) {
        let tracks = if on { Power::Main } else { Power::All };
        (Request::Power { on, tracks }, Some(Awaited::Power(on)))
    }

    /// At the end the stop of a train waits for the answer in which direction it runs.
    fn next_again(&mut self, now: Timestamp, only_urgent: bool) -> Option<Outgoing<Awaited>> {
        let is_ending = self.dialogue.farewell.has_begun();
        self.dialogue.next_again(now, only_urgent && !is_ending, true)
    }

    fn query(&self, train: TrainId) -> Outgoing<Awaited> {
        Outgoing::asks(Request::Locomotive { cab: train.0 }, Awaited::Locomotive(train))
    }

    fn next_question(&mut self, _now: Timestamp) -> ControlFlow<Option<Outgoing<Awaited>>> {
        let question = match &mut self.opening {
            Opening::Banner { .. } => None,
            Opening::Identity if self.dialogue.outstanding.has(&Awaited::Identity) => None,
            Opening::Identity => Some(Outgoing::asks(Request::Status, Awaited::Identity)),
            Opening::States(requests) => requests.pop_front().map(|request| match request {
                Request::Slots => Outgoing::asks(request, Awaited::Slots),
                Request::Power { .. } => self.wanted_power(),
                _ => Outgoing::says(request),
            }),
            Opening::Open { .. } => match self.dialogue.take_unblocked(&mut self.unverified) {
                Some(train) => Some(self.query(train)),
                None => return ControlFlow::Continue(()),
            },
        };
        ControlFlow::Break(question)
    }

    fn has_questions(&self) -> bool {
        !self.unverified.is_empty()
    }

    fn next_poll(&mut self, now: Timestamp) -> Option<Outgoing<Awaited>> {
        let lives = now - self.dialogue.heard < KEEP_ALIVE || self.dialogue.outstanding.has(&Awaited::Slots);
        (!lives).then_some(Outgoing::asks(Request::Slots, Awaited::Slots))
    }

    fn asks_at(&self) -> Option<Timestamp> {
        let paced = self.dialogue.pacing.usual_at();
        match &self.opening {
            Opening::Banner { until } => Some(*until),
            Opening::Identity => Some(paced),
            Opening::States(requests) => (!requests.is_empty()).then_some(paced),
            Opening::Open { .. } => Some((self.dialogue.heard + KEEP_ALIVE).max(paced)),
        }
    }
}
