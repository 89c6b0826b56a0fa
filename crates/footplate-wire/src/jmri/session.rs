//! The session with JMRI: stops first, one command at a time for each train, and everything confirmed by JMRI.

mod hearing;

use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;
use core::ops::{ControlFlow, RangeInclusive};

use footplate_core::{FunctionNumber, SpeedStep, TimeSpan, Timestamp, TrainId, TurnoutId};

use super::json::Lines;
use super::outstanding::Awaited;
use super::request::{LOCOMOTIVES, Request};
use super::settings::{Settings, System};
use super::throttle::ThrottleMessage;
use crate::dcc_ex::{Throttle, speed_of};
use crate::dialogue::Dialogue;
use crate::outstanding::Outgoing;
use crate::pacing::Pacing;
use crate::protocol::{Opening, Protocol};
use crate::reported_functions::ReportedFunctions;
use crate::sensors::Sensors;
use crate::silence::Checks;

/// JMRI reads as fast as it is written to. What it passes on waits for its hardware, of which 100 requests a second ask enough.
const PACING: Pacing = Pacing::new(TimeSpan::from_ms(10), 5, TimeSpan::from_ms(5));

/// JMRI is asked whether it is there when no message has arrived for this time.
const PING_AFTER: TimeSpan = TimeSpan::from_ms(500);

/// What the user should check.
const CHECKS: Checks = Checks {
    nothing_heard: "check that JMRI is running and not in the middle of something, and the network",
    nothing_whole: "check that the port belongs to JMRI's web server (usually port 12080)",
    noise: "check that the port belongs to JMRI's web server (usually port 12080)",
};

/// The client's session with JMRI.
#[derive(Debug, Clone)]
pub struct Client {
    settings: Settings,
    dialogue: Dialogue<Awaited>,
    lines: Lines,
    opening: Opening<Request>,
    system: System,
    sensors: Sensors,
    /// Trains whose throttles have to be asked for their state.
    unverified: Vec<TrainId>,
    /// Trains whose throttles have obeyed over this connection: what JMRI says of them, its hardware does.
    obeyed: Vec<TrainId>,
    identity: Option<String>,
    /// The last reason for which JMRI refused a request.
    refusal: Option<String>,
}

impl Client {
    /// A session over a line that has just been opened.
    pub fn new(now: Timestamp, settings: Settings) -> Self {
        let mut client = Self {
            settings,
            dialogue: Dialogue::new(now, PACING, CHECKS),
            lines: Lines::default(),
            opening: Opening::asking([Request::Powers]),
            system: System::default(),
            sensors: Sensors::default(),
            unverified: Vec::new(),
            obeyed: Vec::new(),
            identity: None,
            refusal: None,
        };
        client.go_on(now);
        client
    }

    /// How JMRI is taken to name sensors and turnouts.
    pub const fn settings(&self) -> &Settings {
        &self.settings
    }

    /// The system that the layout is connected to.
    pub const fn system(&self) -> &System {
        &self.system
    }

    fn ping_due(&self) -> Timestamp {
        self.dialogue.heard + PING_AFTER
    }

    /// JMRI's speed for a step of a train's decoder.
    fn throttle(&self, train: TrainId, step: SpeedStep) -> Throttle {
        Throttle::Speed(speed_of(step, self.dialogue.decoder(train)).unwrap_or_default())
    }

    fn power(&self, on: bool) -> Request {
        Request::Power { system: self.system.name.clone(), on }
    }

    /// Reads all states again, including every locomotive's.
    fn verify(&mut self) {
        self.opening = Opening::asking([Request::Powers]);
        self.unverified = self.dialogue.directed();
    }
}

/// A message to a train's throttle that asks for its state. The throttle is called by the address.
fn asked_of(train: TrainId) -> ThrottleMessage {
    ThrottleMessage {
        name: format!("{train}"),
        address: Some(train.0),
        asks: true,
        ..ThrottleMessage::default()
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

    fn begin_again(&mut self, _now: Timestamp) {
        self.lines = Lines::default();
        self.verify();
        self.obeyed.clear();
        // JMRI stopped the trains when the connection ended, and has given up their throttles. One that was restarted did not.
        for train in self.dialogue.directed() {
            self.lost_throttle(train);
        }
    }

    fn send(&mut self, now: Timestamp, next: Outgoing<Awaited>) {
        self.dialogue.write(next.request.text().into_bytes());
        self.dialogue.sent(now, next);
    }

    fn addresses(&self, _train: TrainId) -> RangeInclusive<u16> {
        LOCOMOTIVES
    }

    fn turnouts(&self) -> RangeInclusive<u16> {
        self.settings.turnouts()
    }

    /// JMRI has no other request that stops a train without its throttle.
    fn stop_of_all(&self) -> Request {
        self.power(false)
    }

    fn drive(
        &mut self,
        _now: Timestamp,
        train: TrainId,
        step: SpeedStep,
        reverses: bool,
    ) -> (Request, Option<Awaited>) {
        let forward = self.dialogue.commanded(train, step, reverses);
        // JMRI passes on what changes. After a restart it takes all trains to stand, and a plain stop changes nothing then.
        let is_sure = step != SpeedStep::STAND || self.obeyed.contains(&train);
        let throttle = if is_sure { self.throttle(train, step) } else { Throttle::EmergencyStop };
        let message = ThrottleMessage { throttle: Some(throttle), forward: Some(forward), ..asked_of(train) };
        (Request::Throttle(message), Some(Awaited::Driven(train, throttle, forward)))
    }

    fn throw(&mut self, _now: Timestamp, turnout: TurnoutId, curved: bool) -> (Request, Option<Awaited>) {
        let name = self.system.turnout(self.settings.number_of(turnout));
        let thrown = curved == self.settings.closed_is_straight;
        (Request::Turnout { name, thrown }, Some(Awaited::Turnout(turnout, curved)))
    }

    fn switch(&mut self, train: TrainId, function: FunctionNumber, on: bool) -> (Request, Option<Awaited>) {
        let on_bits = if on { function.bit() } else { 0 };
        let functions = ReportedFunctions { known: function.bit(), on: on_bits };
        let message = ThrottleMessage { functions, ..asked_of(train) };
        (Request::Throttle(message), Some(Awaited::Function(train, function, on)))
    }

    fn switch_power(&self, on: bool) -> (Request, Option<Awaited>) {
        (self.power(on), Some(Awaited::Power(on)))
    }

    fn query(&self, train: TrainId) -> Outgoing<Awaited> {
        Outgoing::asks(Request::Throttle(asked_of(train)), Awaited::Locomotive(train))
    }

    fn next_question(&mut self, _now: Timestamp) -> ControlFlow<Option<Outgoing<Awaited>>> {
        if let Opening::Asking(requests) = &mut self.opening {
            if self.dialogue.outstanding.any(Awaited::is_question) {
                return ControlFlow::Break(None);
            }
            return ControlFlow::Break(requests.pop_front().map(|request| match request {
                Request::Ping => Outgoing::asks(request, Awaited::Pong),
                Request::Powers => Outgoing::asks(request, Awaited::Powers),
                Request::Power { .. } => self.wanted_power(),
                Request::Sensors => Outgoing::asks(request, Awaited::Sensors),
                _ => Outgoing::says(request),
            }));
        }
        let unverified = self.dialogue.take_unblocked(&mut self.unverified);
        unverified.map_or(ControlFlow::Continue(()), |train| ControlFlow::Break(Some(self.query(train))))
    }

    fn has_questions(&self) -> bool {
        !self.unverified.is_empty()
    }

    fn next_poll(&mut self, now: Timestamp) -> Option<Outgoing<Awaited>> {
        let is_pinged = self.dialogue.outstanding.has(&Awaited::Pong);
        (now >= self.ping_due() && !is_pinged).then(|| Outgoing::asks(Request::Ping, Awaited::Pong))
    }

    fn asks_at(&self) -> Option<Timestamp> {
        let paced = self.dialogue.pacing.usual_at();
        match &self.opening {
            Opening::Asking(_) => (!self.dialogue.outstanding.any(Awaited::is_question)).then_some(paced),
            Opening::Open => Some(self.ping_due().max(paced)),
        }
    }
}
