//! The session with JMRI: stops first, one command at a time for each train, and everything confirmed by JMRI.

mod hearing;

use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;

use footplate_core::{
    Command, DecoderSteps, FunctionNumber, SensorId, SpeedStep, TimeSpan, Timestamp, TrainId, TurnoutId,
};

use super::json::Lines;
use super::outstanding::Awaited;
use super::request::{LOCOMOTIVES, Request};
use super::settings::{Settings, System};
use super::throttle::ThrottleMessage;
use crate::dcc_ex::{Throttle, speed_of};
use crate::dialogue::{Dialogue, Opening};
use crate::locomotives::ReportedFunctions;
use crate::outstanding::Outgoing;
use crate::pacing::Pacing;
use crate::sensors::Sensors;
use crate::session::{Closing, CommandError, Session, Transmit};
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
    identity: Option<String>,
    /// The last reason for which JMRI refused a request.
    refusal: Option<String>,
    /// Since when JMRI was silent, until its states have been read again.
    blind_since: Option<Timestamp>,
}

impl Client {
    /// A session over a line that has just been opened.
    #[must_use]
    pub fn new(now: Timestamp, settings: Settings) -> Self {
        let mut client = Self {
            settings,
            dialogue: Dialogue::new(now, PACING, CHECKS),
            lines: Lines::default(),
            opening: Opening::asking([Request::Powers]),
            system: System::default(),
            sensors: Sensors::default(),
            unverified: Vec::new(),
            identity: None,
            refusal: None,
            blind_since: None,
        };
        client.go_on(now);
        client
    }

    /// How JMRI is taken to name sensors and turnouts.
    #[must_use]
    pub const fn settings(&self) -> &Settings {
        &self.settings
    }

    /// The system that the layout is connected to.
    #[must_use]
    pub const fn system(&self) -> &System {
        &self.system
    }

    /// Sends what is due.
    fn go_on(&mut self, now: Timestamp) {
        if self.dialogue.watch(now) {
            self.blind_since.get_or_insert(self.dialogue.heard);
        }
        while let Some(next) = self.next(now) {
            self.dialogue.write(next.request.text().into_bytes());
            self.dialogue.sent(now, next);
        }
    }

    /// Returns the next request, if one may be written now.
    fn next(&mut self, now: Timestamp) -> Option<Outgoing<Awaited>> {
        if !self.dialogue.may_write(now) {
            return None;
        }
        if self.dialogue.take_stop_of_all() {
            // JMRI has no other request that stops a train without its throttle.
            return Some(Outgoing::says(self.power(false)));
        }
        if let Some(command) = self.dialogue.next_stop(now, true) {
            return Some(self.outgoing(command));
        }
        if let Some(again) = self.dialogue.next_again(now, true) {
            return Some(again);
        }
        if let Some(train) = self.dialogue.undirected_at_end() {
            return Some(query(train));
        }
        if self.dialogue.switch_off_is_due(now) {
            return Some(self.outgoing(Command::PowerOff));
        }
        if now < self.dialogue.pacing.usual_at() {
            return None;
        }
        let again = self.dialogue.next_again(now, false);
        if self.dialogue.farewell.has_begun() { again } else { again.or_else(|| self.next_usual(now)) }
    }

    fn next_usual(&mut self, now: Timestamp) -> Option<Outgoing<Awaited>> {
        if let Opening::Asking(requests) = &mut self.opening {
            if self.dialogue.outstanding.any(Awaited::is_question) {
                return None;
            }
            let request = requests.pop_front()?;
            return Some(match request {
                Request::Ping => Outgoing::asks(request, Awaited::Pong),
                Request::Powers => Outgoing::asks(request, Awaited::Powers),
                Request::Power { on, .. } => Outgoing::asks(request, Awaited::Power(on)),
                Request::Sensors => Outgoing::asks(request, Awaited::Sensors),
                _ => Outgoing::says(request),
            });
        }
        if let Some(train) = self.unverified.pop() {
            return Some(query(train));
        }
        let outstanding = &self.dialogue.outstanding;
        if let Some(train) = self.dialogue.undirected(|train| outstanding.blocks(train, false).is_some()) {
            return Some(query(train));
        }
        if let Some(command) = self.dialogue.next_command(true) {
            return Some(self.outgoing(command));
        }
        let is_pinged = self.dialogue.outstanding.has(&Awaited::Pong);
        (now >= self.ping_due() && !is_pinged).then(|| Outgoing::asks(Request::Ping, Awaited::Pong))
    }

    fn ping_due(&self) -> Timestamp {
        self.dialogue.heard + PING_AFTER
    }

    /// Returns the request for a command, and notes what it commands.
    fn outgoing(&mut self, command: Command) -> Outgoing<Awaited> {
        let (request, awaited) = match command {
            Command::Speed { train, step } => self.drive(train, step, false),
            Command::Reverse { train } => self.drive(train, SpeedStep::STAND, true),
            Command::Turnout { turnout, curved } => self.throw(turnout, curved),
            Command::Function { train, function, on } => switch(train, function, on),
            Command::PowerOff | Command::PowerOn => {
                let on = command == Command::PowerOn;
                self.dialogue.power = on;
                (self.power(on), Awaited::Power(on))
            }
        };
        Outgoing::commands(command, request, Some(awaited))
    }

    fn drive(&mut self, train: TrainId, step: SpeedStep, reverses: bool) -> (Request, Awaited) {
        let forward = self.dialogue.commanded(train, step, reverses);
        let throttle = self.throttle(train, step);
        let message = ThrottleMessage { throttle: Some(throttle), forward: Some(forward), ..asked_of(train) };
        (Request::Throttle(message), Awaited::Driven(train, throttle, forward))
    }

    /// JMRI's speed for a step of a train's decoder.
    fn throttle(&self, train: TrainId, step: SpeedStep) -> Throttle {
        Throttle::Speed(speed_of(step, self.dialogue.decoder(train)).unwrap_or_default())
    }

    fn throw(&self, turnout: TurnoutId, curved: bool) -> (Request, Awaited) {
        let name = self.system.turnout(self.settings.number_of(turnout));
        let thrown = curved == self.settings.closed_is_straight;
        (Request::Turnout { name, thrown }, Awaited::Turnout(turnout, curved))
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

fn switch(train: TrainId, function: FunctionNumber, on: bool) -> (Request, Awaited) {
    let on_bits = if on { function.bit() } else { 0 };
    let functions = ReportedFunctions { known: function.bit(), on: on_bits };
    let message = ThrottleMessage { functions, ..asked_of(train) };
    (Request::Throttle(message), Awaited::Function(train, function, on))
}

/// Asks for a train's throttle, and how it is driven.
fn query(train: TrainId) -> Outgoing<Awaited> {
    Outgoing::asks(Request::Throttle(asked_of(train)), Awaited::Locomotive(train))
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

impl Session for Client {
    fn handle_bytes(&mut self, now: Timestamp, bytes: &[u8]) {
        self.dialogue.now = now;
        if self.dialogue.farewell.is_over() {
            return;
        }
        for byte in bytes {
            self.hear(now, *byte);
        }
        self.go_on(now);
    }

    fn handle_reopened(&mut self, now: Timestamp) {
        self.lines = Lines::default();
        self.blind_since.get_or_insert(self.dialogue.heard);
        self.verify();
        // JMRI stopped the trains when the connection ended, and has given up their throttles.
        for train in self.dialogue.directed() {
            self.lost_throttle(train);
        }
        self.dialogue.reopened();
        self.go_on(now);
    }

    fn set_decoder(&mut self, train: TrainId, steps: DecoderSteps) -> Result<(), CommandError> {
        self.dialogue.set_decoder(train, &LOCOMOTIVES, steps)
    }

    fn set_direction(&mut self, train: TrainId, forward: bool) {
        self.dialogue.locomotives.keep_direction(train, forward);
    }

    fn handle_command(&mut self, now: Timestamp, command: Command) -> Result<(), CommandError> {
        self.dialogue.accept(command, &LOCOMOTIVES, &self.settings.turnouts())?;
        self.go_on(now);
        Ok(())
    }

    fn report_releases(&mut self, of: &[SensorId]) {
        self.dialogue.released = of.to_vec();
    }

    fn expect_delays(&mut self, excess: TimeSpan) {
        self.dialogue.excess = excess;
    }

    fn handle_timeout(&mut self, now: Timestamp) {
        self.go_on(now);
    }

    fn poll_output(&mut self) -> Option<Transmit> {
        self.dialogue.output.pop_front()
    }

    fn next_timeout(&self) -> Option<Timestamp> {
        let paced = self.dialogue.pacing.usual_at();
        let usual = match &self.opening {
            _ if self.dialogue.farewell.has_begun() => Some(self.dialogue.pacing.urgent_at()),
            Opening::Asking(_) if self.dialogue.outstanding.any(Awaited::is_question) => None,
            Opening::Asking(_) => Some(paced),
            Opening::Open => Some(self.ping_due().max(paced)),
        };
        self.dialogue.next_timeout(usual, None, !self.unverified.is_empty())
    }

    fn close(&mut self, now: Timestamp) {
        self.dialogue.close(now, true);
        self.go_on(now);
    }

    fn closing(&self) -> Closing {
        self.dialogue.closing()
    }
}
