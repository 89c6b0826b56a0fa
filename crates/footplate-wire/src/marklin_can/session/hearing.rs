//! Handles frames from the bus.

use alloc::format;

use footplate_core::{EventKind, FunctionNumber, SensorId, SpeedStep, Timestamp, TrainId, TurnoutId};

use super::super::frame::Frame;
use super::super::inputs::News;
use super::super::message::{Direction, InputChange, Message, kind_in_words};
use super::super::outstanding::Awaited;
use super::super::session::Question;
use super::super::speed::step_of;
use super::super::time_model::{INPUTS_PER_MODULE, Order};
use super::super::uid::Uid;
use super::{Client, Query};
use crate::outstanding::Awaited as _;
use crate::protocol::Opening;
use crate::queue::train_of;
use crate::reported_functions::ReportedFunctions;
use crate::session::LinkNotice;

/// What this program answers to a ping: the version of the protocol that it speaks, and a device without a cable of its
/// own on the bus.
const VERSION: (u8, u8) = (2, 0);
const KIND: u16 = 0xFFE0;

/// The list of locomotives, once its stream comes.
const ROSTER: Awaited = Awaited::Roster { has_begun: true };

impl Client {
    pub(super) fn hear_byte(&mut self, now: Timestamp, byte: u8) {
        let frame = self.framing.push(byte);
        let unread = self.framing.take_unread() + self.framing.take_refused();
        self.dialogue.hear_noise(unread);
        let Some(frame) = frame else { return };
        let is_own = frame.hash == self.hash && !frame.is_response;
        if is_own {
            // An echo says nothing of the station.
            return;
        }
        let was_silent = self.dialogue.hear(now);
        self.take(now, &frame);
        if was_silent && self.opening.is_open() {
            self.verify();
        }
        self.dialogue.end_if_confirmed();
    }

    fn take(&mut self, now: Timestamp, frame: &Frame) {
        let message = Message::of(frame);
        match (message, frame.is_response) {
            (Message::Ping, false) => {
                let participant =
                    Message::Participant { uid: self.settings.uid, version: VERSION, kind: KIND };
                self.write(participant, true);
            }
            // Other programs on the bus ask for files, too, and their streams say not of what.
            (Message::StreamBegins { .. } | Message::StreamGoesOn(_), _) if !self.awaits_roster() => {}
            (Message::StreamBegins { length, .. }, _) => {
                self.dialogue.outstanding.goes_on(ROSTER, now);
                self.roster.begins(length);
            }
            (Message::StreamGoesOn(bytes), _) => {
                self.dialogue.outstanding.goes_on(ROSTER, now);
                if self.roster.goes_on(bytes) == Some(true) {
                    self.dialogue.outstanding.take(&ROSTER);
                }
            }
            (Message::Overload { .. }, _) => self.hear_power(false),
            (message, true) => self.respond(now, message),
            // Requests of other programs count only when the station confirms them.
            _ => {}
        }
    }

    fn awaits_roster(&self) -> bool {
        self.dialogue.outstanding.has(&ROSTER)
    }

    /// The station confirms or reports something.
    fn respond(&mut self, now: Timestamp, message: Message) {
        let answered = self.dialogue.outstanding.answered(&message).map(|outstanding| outstanding.awaited);
        match message {
            Message::Participant { uid, version, kind } => self.hear_of_participant(uid, version, kind),
            Message::Go(_) => self.hear_power(true),
            Message::Stop(_) => self.hear_power(false),
            Message::Halt(_) => {
                for train in self.running() {
                    self.suspect(train, Query::Speed);
                }
            }
            Message::EmergencyStop(uid) => {
                if let Some(train) = self.train(uid) {
                    self.suspect(train, Query::Speed);
                }
            }
            Message::Speed { uid, speed: Some(speed) } => {
                if let Some(train) = self.train(uid) {
                    self.hear_of_speed(train, step_of(speed, self.dialogue.decoder(train)), answered);
                }
            }
            Message::Direction { uid, direction: Some(direction) } => {
                if let (Some(train), Direction::Forward | Direction::Backward) = (self.train(uid), direction)
                {
                    self.hear_of_direction(train, direction == Direction::Forward, answered);
                }
            }
            Message::Function { uid, function, value: Some(value) } => {
                if let (Some(train), Some(function)) = (self.train(uid), FunctionNumber::new(function)) {
                    let known = function.bit();
                    let reported = ReportedFunctions { known, on: if value == 0 { 0 } else { known } };
                    self.dialogue.hear_of_functions(train, reported, answered.as_ref());
                }
            }
            Message::Accessory { uid, position, current, .. } => {
                let address = self.settings.turnouts.address(uid);
                if let Some(turnout) = address.filter(|_| current > 0 && position < 2).map(TurnoutId) {
                    self.hear_of_turnout(now, turnout, position == 0, answered.is_some());
                }
            }
            Message::ModuleState { module, inputs, .. } => self.hear_of_module(now, module, inputs),
            Message::Input { device, input, change: Some(change) }
                if self.settings.device.is_none_or(|wanted| wanted == device) =>
            {
                self.hear_of_input(now, input, change);
            }
            _ => {}
        }
    }

    /// Returns the train with a number on the bus, if it was commanded here.
    fn train(&self, uid: Uid) -> Option<TrainId> {
        let known = self.dialogue.locomotives.iter().map(|locomotive| locomotive.train);
        known.chain(self.dialogue.waiting.iter().filter_map(train_of)).find(|train| self.uid(*train) == uid)
    }

    fn running(&self) -> alloc::vec::Vec<TrainId> {
        let runs = self
            .dialogue
            .locomotives
            .iter()
            .filter(|known| known.is_driven && known.step != SpeedStep::STAND);
        runs.map(|locomotive| locomotive.train).collect()
    }

    fn hear_of_participant(&mut self, uid: Uid, (major, minor): (u8, u8), kind: u16) {
        // A bus has few participants; a flood of made-up ones is neither kept nor reported.
        let is_full = self.participants.len() >= usize::from(u8::MAX);
        if uid == self.settings.uid || is_full || self.participants.contains(&uid) {
            return;
        }
        self.participants.push(uid);
        let identity = format!("{}, number {:08X}, version {major}.{minor}", kind_in_words(kind), uid.0);
        self.dialogue.notify(LinkNotice::Identified(identity));
    }

    /// Reads all states again, including every locomotive's.
    pub(super) fn verify(&mut self) {
        let is_listed = !self.roster.list().is_empty();
        let questions: &[Question] = if is_listed { &Question::AGAIN } else { &Question::ALL };
        self.opening = Opening::asking(questions.iter().copied());
        self.has_modules = true;
        let queries = self
            .dialogue
            .directed()
            .into_iter()
            .flat_map(|train| [(train, Query::Direction), (train, Query::Speed)]);
        self.unverified = queries.collect();
    }

    /// Ends the opening: trains may run.
    pub(super) fn opened(&mut self) {
        self.opening = Opening::Open;
        self.dialogue.blind_since = None;
        self.dialogue.notify(LinkNotice::Answers);
    }

    fn hear_power(&mut self, on: bool) {
        let is_lost = self.dialogue.is_power_lost(on, &Awaited::Power(false));
        self.dialogue.hear_power(on, is_lost);
    }

    /// Reads the state of a train that does not fit the commands: it may be an old frame, or another throttle.
    fn suspect(&mut self, train: TrainId, query: Query) {
        if !self.suspected.contains(&train) {
            self.suspected.push(train);
        }
        if !self.unverified.contains(&(train, query)) {
            self.unverified.push((train, query));
        }
    }

    fn hear_of_speed(&mut self, train: TrainId, step: SpeedStep, answered: Option<Awaited>) {
        let decoder = self.dialogue.decoder(train);
        let is_outstanding = self.dialogue.outstanding.has(&Awaited::Speed(train, Uid::ALL, step, decoder));
        let Some(locomotive) = self.dialogue.locomotives.get_mut(train).filter(|known| known.is_driven)
        else {
            return;
        };
        if matches!(answered, Some(Awaited::Speed(..))) {
            locomotive.is_stopped = step == SpeedStep::STAND && locomotive.step == SpeedStep::STAND;
            return;
        }
        if locomotive.step == step || is_outstanding {
            return;
        }
        if answered.is_none() {
            return self.suspect(train, Query::Speed);
        }
        // The station confirms a state that was not commanded.
        let was_blind = self.dialogue.blind_since.is_some();
        (locomotive.step, locomotive.is_stopped) = (step, false);
        self.dialogue.stop_at_end(train);
        if was_blind && step == SpeedStep::STAND {
            self.dialogue.notify(LinkNotice::Restarted);
            self.dialogue.stop(train);
        } else {
            self.dialogue.notify(LinkNotice::OtherThrottle { train, reversed: false });
        }
    }

    fn hear_of_direction(&mut self, train: TrainId, forward: bool, answered: Option<Awaited>) {
        let is_outstanding = self.dialogue.outstanding.has(&Awaited::Direction(train, Uid::ALL, forward));
        self.dialogue.locomotives.know(train);
        let Some(locomotive) = self.dialogue.locomotives.get_mut(train) else { return };
        if matches!(answered, Some(Awaited::Direction(..))) {
            // A station sets the speed to 0 with it.
            return self.dialogue.obeyed(train);
        }
        if is_outstanding || locomotive.forward == Some(forward) {
            return;
        }
        if locomotive.forward.is_none() {
            return self.dialogue.hear_first_direction(train, forward, false);
        }
        if !locomotive.is_driven {
            return self.dialogue.faces(train, forward);
        }
        if answered.is_none() {
            return self.suspect(train, Query::Direction);
        }
        locomotive.step = SpeedStep::STAND;
        self.dialogue.faces(train, forward);
        self.dialogue.notify(LinkNotice::OtherThrottle { train, reversed: true });
    }

    fn hear_of_turnout(&mut self, now: Timestamp, turnout: TurnoutId, curved: bool, was_asked: bool) {
        let before = self.dialogue.hear_of_turnout(turnout, curved);
        let is_own = was_asked || self.dialogue.outstanding.any(|awaited| awaited.turnout() == Some(turnout));
        if !is_own && before != Some(curved) {
            // Another throttle has thrown it.
            self.dialogue.enter(now, EventKind::Turnout { turnout, curved });
        }
    }

    fn hear_of_module(&mut self, now: Timestamp, module: u8, inputs: u16) {
        let Some(before) = module.checked_sub(1).filter(|_| module <= self.settings.modules) else { return };
        self.has_modules = true;
        let listing = !self.opening.is_open();
        for bit in 0..INPUTS_PER_MODULE {
            let input = u16::from(before) * INPUTS_PER_MODULE + bit + 1;
            let Some(number) = input.checked_sub(self.settings.first_input) else { continue };
            let news = self.inputs.asked(now, input, inputs & 1 << bit != 0, listing);
            self.report(now, input, SensorId(number), news);
        }
    }

    fn hear_of_input(&mut self, now: Timestamp, input: u16, change: InputChange) {
        let Some(number) = input.checked_sub(self.settings.first_input) else { return };
        let news = self.inputs.changed(now, input, change);
        self.report(now, input, SensorId(number), news);
    }

    fn report(&mut self, now: Timestamp, input: u16, sensor: SensorId, news: News) {
        match news {
            News::Occupied(span) => {
                let order = Order { not_before: self.dialogue.last_entry, now };
                let (latest, width) = span.entry(input, self.settings.scan, order);
                self.dialogue.report(sensor, latest, width);
            }
            News::Freed(span) => {
                let order = Order { not_before: self.dialogue.last_entry, now };
                let (latest, width) = span.entry(input, self.settings.scan, order);
                self.dialogue.report_free(sensor, latest, width);
            }
            News::HeldFromStart => self.dialogue.notify(LinkNotice::HeldClosed(sensor)),
            News::None => {}
        }
    }
}
