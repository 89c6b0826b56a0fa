//! The session with a board: stops first, one command at a time for each train, and everything confirmed.

mod hearing;

use alloc::collections::BTreeMap;
use alloc::string::ToString;
use alloc::vec::Vec;

use footplate_core::{
    Command, DecoderSteps, FunctionNumber, SensorId, SpeedStep, TimeSpan, Timestamp, TrainId, TurnoutId,
};

use super::framing::Framing;
use super::opening::Opening;
use super::outstanding::Awaited;
use super::request::{CABS, Power, Request, Throttle, speed_of};
use super::settings::{Settings, TurnoutRequests};
use crate::dialogue::Dialogue;
use crate::outstanding::Outgoing;
use crate::pacing::Pacing;
use crate::sensors::Sensors;
use crate::session::{Closing, CommandError, Session, Transmit};
use crate::silence::Checks;

/// The board is polled when no message has arrived for this time.
const KEEP_ALIVE: TimeSpan = TimeSpan::from_ms(500);

/// About 20 requests a second are safe (the project's own client library asks for the same). Three of the longest,
/// `<t 10239 126 1>`, fill 45 of the board's 64 bytes. The board has read a request after 10 ms, as its longest answer took
/// 9.1 ms.
const PACING: Pacing = Pacing::new(TimeSpan::from_ms(50), 3, TimeSpan::from_ms(10));

/// While messages are garbled, a request that the board does not confirm is written this often at once. Three of the longest,
/// `<a 2044 1>`, fill 30 of the board's 64 bytes; where two of five are garbled, one of 240 pairs of such commands is lost.
const TIMES_IN_NOISE: usize = 3;

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
    /// Whether each locomotive ran forward by a report that no other has confirmed yet.
    reported_once: BTreeMap<TrainId, bool>,
    /// Since when the station was silent, until its states have been read again.
    blind_since: Option<Timestamp>,
}

impl Client {
    /// A session over a line that has just been opened.
    #[must_use]
    pub fn new(now: Timestamp, settings: Settings) -> Self {
        let mut client = Self {
            settings,
            dialogue: Dialogue::new(now, PACING, CHECKS),
            framing: Framing::default(),
            opening: Opening::begin(now, &settings),
            sensors: Sensors::default(),
            unverified: Vec::new(),
            reported_once: BTreeMap::new(),
            blind_since: None,
        };
        client.go_on(now);
        client
    }

    /// Sends what is due.
    fn go_on(&mut self, now: Timestamp) {
        if self.dialogue.watch(now) {
            self.blind_since.get_or_insert(self.dialogue.heard);
        }
        if matches!(self.opening, Opening::Banner { until } if now >= until) {
            self.opening = Opening::Identity;
        }
        while let Some(next) = self.next(now) {
            let request = match next.request {
                // The first request may have been obeyed and its answer lost: a second one changes nothing then, and has none.
                Request::Function { cab, .. } if next.tries % 2 == 0 => Request::Locomotive { cab },
                request => request,
            };
            let is_unconfirmed = matches!(request, Request::Accessory { .. });
            let times = if is_unconfirmed && self.dialogue.is_noisy() { TIMES_IN_NOISE } else { 1 };
            let mut text = request.to_string().repeat(times);
            // A train of unknown direction has to stop now: the stop of all may have been lost as well.
            if matches!(request, Request::Locomotive { .. })
                && next.tries > 1
                && self.dialogue.farewell.has_begun()
            {
                text.insert_str(0, &Request::StopAll.to_string());
            }
            self.dialogue.write(text.into_bytes());
            self.dialogue.sent(now, next);
        }
    }

    /// Returns the next request, if one may be written now.
    fn next(&mut self, now: Timestamp) -> Option<Outgoing<Awaited>> {
        let is_closing = self.dialogue.farewell.has_begun();
        if !self.dialogue.may_write(now) || self.opening.awaits_banner() && !is_closing {
            return None;
        }
        if self.dialogue.take_stop_of_all() {
            return Some(Outgoing::says(Request::StopAll));
        }
        if let Some(command) = self.dialogue.next_stop(now, true) {
            return Some(self.outgoing(command));
        }
        // At the end the stop of a train waits for the answer in which direction it runs.
        if let Some(repeat) = self.dialogue.next_again(now, !is_closing) {
            return Some(repeat);
        }
        if let Some(train) = self.dialogue.undirected_at_end() {
            return Some(query(train));
        }
        if self.dialogue.switch_off_is_due(now) {
            return Some(self.outgoing(Command::PowerOff));
        }
        if now < self.dialogue.pacing.usual_at() || is_closing {
            return None;
        }
        self.dialogue.next_again(now, false).or_else(|| self.next_usual(now))
    }

    fn next_usual(&mut self, now: Timestamp) -> Option<Outgoing<Awaited>> {
        let outstanding = &self.dialogue.outstanding;
        match &mut self.opening {
            Opening::Banner { .. } => return None,
            Opening::Identity if outstanding.has(&Awaited::Identity) => return None,
            Opening::Identity => return Some(Outgoing::asks(Request::Status, Awaited::Identity)),
            Opening::States(requests) => {
                let request = requests.pop_front()?;
                return Some(match request {
                    Request::Slots => Outgoing::asks(request, Awaited::Slots),
                    Request::Power { on, .. } => Outgoing::asks(request, Awaited::Power(on)),
                    _ => Outgoing::says(request),
                });
            }
            Opening::Open { .. } => {}
        }
        if let Some(train) = self.unverified.pop() {
            return Some(query(train));
        }
        let is_asked = |train| outstanding.blocks(train, false).is_some();
        if let Some(train) = self.dialogue.undirected(is_asked) {
            return Some(query(train));
        }
        if let Some(command) = self.dialogue.next_command(true) {
            return Some(self.outgoing(command));
        }
        let lives = now - self.dialogue.heard < KEEP_ALIVE || self.dialogue.outstanding.has(&Awaited::Slots);
        (!lives).then_some(Outgoing::asks(Request::Slots, Awaited::Slots))
    }

    /// Returns the request for a command, and notes what it commands.
    fn outgoing(&mut self, command: Command) -> Outgoing<Awaited> {
        let (request, awaited) = match command {
            Command::Speed { train, step } => self.drive(train, step, false),
            Command::Reverse { train } => self.drive(train, SpeedStep::STAND, true),
            Command::Turnout { turnout, curved } => self.throw(turnout, curved),
            Command::Function { train, function, on } => self.switch(train, function, on),
            Command::PowerOff | Command::PowerOn => {
                let on = command == Command::PowerOn;
                self.dialogue.power = on;
                let tracks = if on { Power::Main } else { Power::All };
                (Request::Power { on, tracks }, Some(Awaited::Power(on)))
            }
        };
        Outgoing::commands(command, request, awaited)
    }

    fn drive(&mut self, train: TrainId, step: SpeedStep, reverses: bool) -> (Request, Option<Awaited>) {
        let forward = self.dialogue.commanded(train, step, reverses);
        let throttle = self.throttle(train, step);
        (Request::Drive { cab: train.0, throttle, forward }, Some(Awaited::Driven(train, throttle, forward)))
    }

    /// The board's speed for a step of a train.
    fn throttle(&self, train: TrainId, step: SpeedStep) -> Throttle {
        Throttle::Speed(speed_of(step, self.dialogue.decoder(train)).unwrap_or_default())
    }

    /// The board answers only when the state changes.
    fn switch(&self, train: TrainId, function: FunctionNumber, on: bool) -> (Request, Option<Awaited>) {
        let known = self.dialogue.locomotives.get(train).and_then(|known| known.functions.is_on(function));
        let changes = known != Some(on);
        let request = Request::Function { cab: train.0, function: function.get(), on };
        (request, changes.then_some(Awaited::Function(train, function, on)))
    }

    fn throw(&self, turnout: TurnoutId, curved: bool) -> (Request, Option<Awaited>) {
        match self.settings.turnouts {
            TurnoutRequests::Accessory => (Request::Accessory { address: turnout.0, on: curved }, None),
            TurnoutRequests::Defined => {
                // The board answers only when the state changes.
                let changes = !self.dialogue.lies(turnout, curved);
                let awaited = changes.then_some(Awaited::Turnout(turnout, curved));
                (Request::Turnout { id: turnout.0, thrown: curved }, awaited)
            }
        }
    }
}

const fn query(train: TrainId) -> Outgoing<Awaited> {
    Outgoing::asks(Request::Locomotive { cab: train.0 }, Awaited::Locomotive(train))
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
        self.framing = Framing::default();
        self.blind_since.get_or_insert(self.dialogue.heard);
        self.opening = Opening::begin(now, &self.settings);
        self.dialogue.reopened();
        self.go_on(now);
    }

    fn set_decoder(&mut self, train: TrainId, steps: DecoderSteps) -> Result<(), CommandError> {
        self.dialogue.set_decoder(train, &CABS, steps)
    }

    fn set_direction(&mut self, train: TrainId, forward: bool) {
        self.dialogue.locomotives.keep_direction(train, forward);
    }

    fn handle_command(&mut self, now: Timestamp, command: Command) -> Result<(), CommandError> {
        self.dialogue.accept(command, &CABS, &self.settings.turnouts.numbers())?;
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
            Opening::Banner { until } => Some(*until),
            Opening::Identity => Some(paced),
            Opening::States(requests) => (!requests.is_empty()).then_some(paced),
            Opening::Open { .. } => Some((self.dialogue.heard + KEEP_ALIVE).max(paced)),
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
