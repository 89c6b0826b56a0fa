//! Handles messages from the board.

use alloc::borrow::ToOwned;
use alloc::format;

use footplate_core::{EventKind, SensorId, SpeedStep, Timestamp, TrainId, TurnoutId};

use super::super::definition_number::turnout_of;
use super::super::opening::Opening;
use super::super::outstanding::Awaited;
use super::super::reply::{Malformed, Reply};
use super::super::request::Throttle;
use super::super::settings::TurnoutRequests;
use super::super::time_model::{SENSOR_DELAY_LONGEST, SENSOR_DELAY_SHORTEST};
use super::Client;
use crate::locomotives::Locomotive;
use crate::outstanding::{Awaited as _, Outstanding};
use crate::reported_functions::ReportedFunctions;
use crate::sensors::occupied;
use crate::session::LinkNotice;

impl Client {
    pub(super) fn hear_byte(&mut self, now: Timestamp, byte: u8) {
        let message = self.framing.push(byte).map(|text| (text.len(), Reply::read(text)));
        let unread = self.framing.take_unread();
        self.dialogue.hear_noise(unread);
        match message {
            Some((_, Ok(reply))) => {
                let was_silent = self.dialogue.hear(now);
                if let Some(reply) = reply {
                    self.take(now, reply);
                }
                if was_silent && self.opening.is_open() {
                    self.verify();
                }
            }
            Some((length, Err(Malformed))) => self.dialogue.hear_noise(length),
            None => {}
        }
    }

    fn take(&mut self, now: Timestamp, reply: Reply) {
        let answered = self.dialogue.outstanding.answered(&reply);
        if let Some(on) = reply.main_power() {
            let is_lost = self.dialogue.is_power_lost(on, &Awaited::Power(false));
            self.dialogue.hear_power(on, is_lost);
        }
        match reply {
            Reply::Identity(identity) => self.identified(now, identity.trim(), answered.is_some()),
            Reply::Locomotive { cab, register, throttle, forward, functions } => {
                let reported = ReportedFunctions::all(functions);
                let answer = answered.as_ref().map(|answered| &answered.awaited);
                self.dialogue.hear_of_functions(TrainId(cab), reported, answer);
                let driven = matches!(answer, Some(Awaited::Driven(..)));
                self.hear_of_locomotive(TrainId(cab), Driven { register, throttle, forward }, driven);
            }
            Reply::Turnout { id, thrown } => self.hear_of_turnout(now, id, thrown, answered.is_some()),
            Reply::Definition { id, address, .. } => {
                if let Some(turnout) = turnout_of(id) {
                    self.definitions.heard(turnout, address);
                }
            }
            Reply::Sensor { id, active } => self.hear_of_sensor(now, id, active),
            Reply::Slots(_) if matches!(&self.opening, Opening::States(requests) if requests.is_empty()) => {
                self.opened(now);
            }
            Reply::Failed => {
                let refused = self.dialogue.outstanding.take_first(|one| one.awaited.turnout().is_some());
                if let Some(refused) = refused {
                    self.hear_of_refusal(&refused);
                }
            }
            _ => {}
        }
        match answered {
            Some(Outstanding { awaited: Awaited::Definition(_), command: Some(command), .. }) => {
                self.dialogue.waiting.push_again(command);
            }
            Some(Outstanding { awaited: Awaited::Thrown(turnout, curved), .. }) => {
                self.dialogue.enter(now, EventKind::Turnout { turnout, curved });
            }
            _ => {}
        }
        self.dialogue.end_if_confirmed();
    }

    fn identified(&mut self, now: Timestamp, identity: &str, was_asked: bool) {
        match &self.opening {
            Opening::Banner { .. } | Opening::Identity => {
                let is_used = |known: &Locomotive| known.is_driven || known.forward.is_some();
                let was_reset = self.opening.awaits_banner() && self.dialogue.locomotives.iter().any(is_used);
                self.dialogue.notify(LinkNotice::Identified(identity.to_owned()));
                if was_reset {
                    self.restarted();
                }
                self.verify();
            }
            Opening::Open { .. } if !was_asked && self.opening.is_reset_by_identity(now) => {
                self.dialogue.blind_since.get_or_insert(now);
                self.restarted();
                self.verify();
            }
            Opening::States(_) | Opening::Open { .. } => {}
        }
    }

    /// Reads all states again, including every locomotive's.
    fn verify(&mut self) {
        self.definitions.clear();
        self.opening = Opening::ask_states(&self.settings);
        self.unverified = self.dialogue.directed();
    }

    /// Handles a board that was reset.
    fn restarted(&mut self) {
        self.dialogue.restarted();
        self.unverified.clear();
    }

    fn opened(&mut self, now: Timestamp) {
        self.opening = Opening::Open { since: now };
        self.dialogue.blind_since = None;
        self.dialogue.notify(LinkNotice::Answers);
    }

    /// Compares a train's state with the commanded one.
    fn hear_of_locomotive(&mut self, train: TrainId, driven: Driven, is_confirmed: bool) {
        let is_outstanding = self.dialogue.outstanding.blocks(train, false).is_some();
        let step = self.dialogue.locomotives.get(train).map_or(SpeedStep::STAND, |known| known.step);
        let wanted = self.throttle(train, step);
        let Some(locomotive) = self.dialogue.locomotive(train) else { return };
        if is_confirmed {
            return self.dialogue.obeyed(train);
        }
        let Some(forward) = locomotive.forward else {
            // A board says `forward` of a locomotive that it does not drive. Its decoder goes on as it ran last.
            let last = self.dialogue.locomotives.last_direction(train);
            if let Some(last) = last.filter(|_| driven.register < 0) {
                return self.dialogue.faces(train, last);
            }
            let alike = self.count_alike(train, driven);
            let known = u8::from(last == Some(driven.forward));
            if alike + known >= driven.reports_needed() {
                self.dialogue.hear_first_direction(train, driven.forward, false);
            }
            return;
        };
        let is_as_commanded = driven.throttle == wanted && driven.forward == forward;
        if is_outstanding || is_as_commanded {
            return;
        }
        if !locomotive.is_driven {
            // It is asked for again before it is used.
            locomotive.forward = None;
            self.count_alike(train, driven);
            return;
        }
        if driven.register < 0 {
            // The board does not drive it: it was restarted while the line was silent.
            self.restarted();
            return self.verify();
        }
        let reversed = driven.forward != forward;
        locomotive.is_stopped = false;
        self.dialogue.faces(train, driven.forward);
        self.dialogue.stop_at_end(train);
        self.dialogue.notify(LinkNotice::OtherThrottle { train, reversed });
    }

    /// Counts the last reports of a locomotive that were all alike.
    fn count_alike(&mut self, train: TrainId, driven: Driven) -> u8 {
        let before = self.unconfirmed.get(&train).filter(|(before, _)| *before == driven);
        let count = before.map_or(0, |(_, count)| *count).saturating_add(1);
        self.unconfirmed.insert(train, (driven, count));
        count
    }

    /// The board refuses a request that concerns a turnout, or one that was garbled.
    fn hear_of_refusal(&mut self, refused: &Outstanding<Awaited>) {
        match refused.awaited {
            Awaited::Definition(turnout) => self.definitions.missing(turnout),
            Awaited::Thrown(turnout, _) => self.definitions.forget(turnout),
            Awaited::Turnout(turnout, _) => {
                let check = format!(
                    "define it there (<T {turnout} DCC address sub>), or leave out `turnouts=defined`"
                );
                return self.dialogue.notify(LinkNotice::TurnoutRefused { turnout, check });
            }
            _ => {}
        }
        // It is defined, and thrown then.
        if let Some(command) = refused.command {
            self.dialogue.waiting.push_again(command);
        }
    }

    fn hear_of_turnout(&mut self, now: Timestamp, id: u16, thrown: bool, was_asked: bool) {
        let turnout = match self.settings.turnouts {
            TurnoutRequests::Confirmed => turnout_of(id),
            TurnoutRequests::Defined => Some(TurnoutId(id)),
            TurnoutRequests::Accessory => None,
        };
        let Some(turnout) = turnout else { return };
        let before = self.dialogue.hear_of_turnout(turnout, thrown);
        if !was_asked && before == Some(!thrown) {
            // Another throttle has thrown it.
            self.dialogue.enter(now, EventKind::Turnout { turnout, curved: thrown });
        }
    }

    fn hear_of_sensor(&mut self, now: Timestamp, id: u16, active: bool) {
        let Some(number) = id.checked_sub(self.settings.first_sensor) else { return };
        let sensor = SensorId(number);
        let change = self.sensors.heard(id, active, self.opening.is_listing());
        let span =
            occupied(now, self.dialogue.last_entry, [SENSOR_DELAY_SHORTEST, SENSOR_DELAY_LONGEST], None);
        self.dialogue.hear_of_change(sensor, change, span);
    }
}

/// A locomotive's state on the board.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Driven {
    register: i16,
    throttle: Throttle,
    forward: bool,
}

impl Driven {
    /// How many reports alike are needed. Messages have no checksum, and `128`, forward and at rest, is a speed backward if any of its
    /// digits is lost: two have to agree, and three where a locomotive is said to run that no one has driven here.
    fn reports_needed(self) -> u8 {
        if self.throttle == Throttle::Speed(0) { 2 } else { 3 }
    }
}
