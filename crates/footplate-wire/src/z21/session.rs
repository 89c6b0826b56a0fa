//! The session with a Z21: stops first, one command at a time for each train, and everything confirmed by the station's own words.

mod asking;
mod hearing;

use alloc::string::String;
use alloc::vec::Vec;
use core::ops::{ControlFlow, RangeInclusive};

use footplate_core::{
    DecoderSteps, EventKind, FunctionNumber, SpeedStep, TimeSpan, Timestamp, TrainId, TurnoutId,
};

use super::broadcasts::Broadcasts;
use super::detectors::RailCom;
use super::outstanding::Awaited;
use super::request::{FunctionSwitch, LOCOMOTIVES, Request};
use super::sensors::Sensors;
use super::settings::Settings;
use super::speed::Throttle;
use super::turnouts::Outputs;
use crate::dialogue::{Dialogue, Repeat};
use crate::outstanding::Outgoing;
use crate::pacing::Pacing;
use crate::protocol::{Opening, Protocol};
use crate::silence::Checks;

/// Many quick datagrams from a computer are lost now and then; some milliseconds between them are asked for.
const PACING: Pacing = Pacing::new(TimeSpan::from_ms(20), 3, TimeSpan::from_ms(5));

/// The detectors of the CAN bus answer one after the other within this time after they were asked (chosen).
const DETECTORS_WITHIN: TimeSpan = TimeSpan::from_ms(50);

/// What the user should check.
const CHECKS: Checks = Checks {
    nothing_heard: "check its power, the network cable, that its address is right (a Z21 has 192.168.0.111 unless changed) and \
                    that this computer is in its network",
    nothing_whole: "check that the address belongs to a Z21 (UDP port 21105)",
    noise: "check that the address belongs to a Z21 (UDP port 21105)",
};

/// The client's session with a Z21.
#[derive(Debug, Clone)]
pub struct Client {
    settings: Settings,
    dialogue: Dialogue<Awaited>,
    opening: Opening<Request>,
    sensors: Sensors,
    outputs: Outputs,
    /// What this client subscribes to, and whether the station has confirmed it.
    wanted: Broadcasts,
    is_subscribed: bool,
    /// The station reported once that the track has no power; it may be an old datagram.
    power_is_suspect: bool,
    asks_status: bool,
    /// A state does not fit the commands: the station may have been restarted and have lost the subscription.
    asks_broadcasts: bool,
    /// Locomotives whose state must be read again.
    unverified: Vec<TrainId>,
    /// States of locomotives that were reported once and do not fit the commands: an old datagram, or another throttle.
    suspected: Vec<(TrainId, Throttle, bool)>,
    /// The last speed that each decoder reported and that was passed on, and when.
    reported: Vec<(Timestamp, RailCom)>,
    identity: Option<String>,
    serial_number: u32,
    polls: u32,
    polled: Timestamp,
    /// When the detectors on the CAN bus were polled last.
    asked_detectors: Option<Timestamp>,
}

impl Client {
    /// A session over a line that has just been opened.
    pub fn new(now: Timestamp, settings: Settings) -> Self {
        let wanted = settings.broadcasts();
        let mut client = Self {
            settings,
            dialogue: Dialogue::new(now, PACING, CHECKS),
            opening: Opening::asking(settings.questions(wanted, false)),
            sensors: Sensors::default(),
            outputs: Outputs::default(),
            wanted,
            is_subscribed: false,
            power_is_suspect: false,
            asks_status: false,
            asks_broadcasts: false,
            unverified: Vec::new(),
            suspected: Vec::new(),
            reported: Vec::new(),
            identity: None,
            serial_number: 0,
            polls: 0,
            polled: now,
            asked_detectors: None,
        };
        client.go_on(now);
        client
    }

    /// The settings of the station, its sensors and its turnouts.
    pub const fn settings(&self) -> &Settings {
        &self.settings
    }

    /// How a train is commanded to run at a step, and in which steps.
    fn throttle(&self, train: TrainId, step: SpeedStep) -> (DecoderSteps, Throttle) {
        let decoder = self.dialogue.decoder(train);
        let steps = if decoder == DecoderSteps::Fourteen { self.settings.steps } else { decoder };
        (steps, Throttle::of(step, decoder, steps).unwrap_or(Throttle::Stop))
    }
}

/// The question in the same datagram, whose answer confirms a request even without a broadcast.
const fn question_with(request: Request) -> Option<Request> {
    match request {
        Request::Drive { address, .. } | Request::Function { address, .. } => {
            Some(Request::Locomotive { address })
        }
        Request::SetTurnout { address, activate: true, .. } => Some(Request::Turnout { address }),
        Request::SetBroadcasts(_) => Some(Request::Broadcasts),
        _ => None,
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
        self.hear_datagram(now, bytes);
    }

    fn begin_again(&mut self, _now: Timestamp) {
        self.verify();
    }

    fn send(&mut self, now: Timestamp, next: Outgoing<Awaited>) {
        let Outgoing { request, tries, .. } = next;
        if request == Request::ALL_CAN {
            self.asked_detectors = Some(now);
        }
        let mut bytes = Vec::new();
        request.write(&mut bytes);
        if let Some(question) = question_with(request) {
            // Some clones read only the first dataset of a datagram: a repeat uses two datagrams.
            if tries > 1 {
                self.dialogue.write(core::mem::take(&mut bytes));
            }
            question.write(&mut bytes);
        }
        self.dialogue.write(bytes);
        let entry = self.dialogue.sent(now, next);
        if let (Some(EventKind::Turnout { .. }), Request::SetTurnout { address, second, .. }) =
            (entry, request)
        {
            self.outputs.powered(address, second, now);
        }
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

    fn drive(
        &mut self,
        _now: Timestamp,
        train: TrainId,
        step: SpeedStep,
        reverses: bool,
    ) -> (Request, Option<Awaited>) {
        self.suspected.retain(|(other, ..)| *other != train);
        let forward = self.dialogue.commanded(train, step, reverses);
        let (steps, throttle) = self.throttle(train, step);
        let request = Request::Drive { address: train.0, steps, throttle, forward };
        (request, Some(Awaited::Driven(train, steps, throttle, forward)))
    }

    fn throw(&mut self, now: Timestamp, turnout: TurnoutId, curved: bool) -> (Request, Option<Awaited>) {
        let address = self.settings.address_of(turnout);
        let second = curved != self.settings.second_is_straight;
        self.outputs.powered(address, second, now);
        let request = Request::SetTurnout { address, second, activate: true, queue: false };
        (request, Some(Awaited::Turnout(turnout, address, second)))
    }

    fn switch(&mut self, train: TrainId, function: FunctionNumber, on: bool) -> (Request, Option<Awaited>) {
        let switch = if on { FunctionSwitch::On } else { FunctionSwitch::Off };
        let request = Request::Function { address: train.0, function: function.get(), switch };
        (request, Some(Awaited::Function(train, function, on)))
    }

    fn switch_power(&self, on: bool) -> (Request, Option<Awaited>) {
        (Request::Power { on }, Some(Awaited::Power(on)))
    }

    fn next_again(&mut self, now: Timestamp, only_urgent: bool) -> Option<Outgoing<Awaited>> {
        let may_throw = self.may_throw();
        loop {
            match self.dialogue.next_repeat(now, only_urgent, may_throw)? {
                // Inputs are polled anyway.
                Repeat::Again(outgoing)
                    if !(self.opening.is_open() && matches!(outgoing.request, Request::Feedback { .. })) =>
                {
                    return Some(outgoing);
                }
                _ => {}
            }
        }
    }

    fn next_release(&mut self, now: Timestamp) -> Option<Outgoing<Awaited>> {
        self.outputs.take_release(now).map(Outgoing::says)
    }

    fn release_at(&self) -> Option<Timestamp> {
        self.outputs.release_due()
    }

    fn query(&self, train: TrainId) -> Outgoing<Awaited> {
        Outgoing::asks(Request::Locomotive { address: train.0 }, Awaited::Locomotive(train))
    }

    fn next_question(&mut self, _now: Timestamp) -> ControlFlow<Option<Outgoing<Awaited>>> {
        if let Opening::Asking(requests) = &mut self.opening {
            if self.dialogue.outstanding.any(Awaited::is_question) {
                return ControlFlow::Break(None);
            }
            match requests.pop_front() {
                Some(request) => return ControlFlow::Break(Some(self.question(request))),
                None => self.opened(),
            }
        }
        let question = if core::mem::take(&mut self.asks_status) {
            self.question(Request::Status)
        } else if core::mem::take(&mut self.asks_broadcasts) {
            self.question(Request::Broadcasts)
        } else if let Some(train) = self.dialogue.take_unblocked(&mut self.unverified) {
            self.query(train)
        } else {
            return ControlFlow::Continue(());
        };
        ControlFlow::Break(Some(question))
    }

    fn has_questions(&self) -> bool {
        !self.unverified.is_empty() || self.asks_status || self.asks_broadcasts
    }

    fn next_poll(&mut self, now: Timestamp) -> Option<Outgoing<Awaited>> {
        (now >= self.poll_due()).then(|| self.poll(now))
    }

    fn asks_at(&self) -> Option<Timestamp> {
        let paced = self.dialogue.pacing.usual_at();
        match &self.opening {
            Opening::Asking(_) => (!self.dialogue.outstanding.any(Awaited::is_question)).then_some(paced),
            Opening::Open => Some(self.poll_due().max(paced)),
        }
    }
}
