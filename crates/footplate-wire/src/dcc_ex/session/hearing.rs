//! What becomes of the messages that come.

use alloc::borrow::ToOwned;

use footplate_core::{Command, EventKind, Report, SensorId, SpeedStep, Timestamp, TrainId, TurnoutId};

use super::super::opening::Opening;
use super::super::outstanding::Awaited;
use super::super::reply::{Malformed, Reply};
use super::super::request::{Throttle, speed_of};
use super::super::sensors::Change;
use super::super::settings::TurnoutRequests;
use super::super::time_model::occupied;
use super::Client;
use crate::session::LinkNotice;

impl Client {
    pub(super) fn hear(&mut self, now: Timestamp, byte: u8) {
        let message = self.framing.push(byte).map(|text| (text.len(), Reply::read(text)));
        let unread = self.framing.take_unread();
        if unread > 0 {
            self.hear_noise(unread);
        }
        match message {
            Some((_, Ok(reply))) => {
                let was_silent = self.silence.heard();
                if let Some(reply) = reply {
                    self.take(now, reply);
                }
                self.heard = now;
                if was_silent && self.opening.is_open() {
                    self.verify();
                }
            }
            Some((length, Err(Malformed))) => self.hear_noise(length),
            None => {}
        }
    }

    fn hear_noise(&mut self, bytes: usize) {
        if let Some(notice) = self.silence.heard_noise(bytes) {
            self.notify(notice);
        }
    }

    fn take(&mut self, now: Timestamp, reply: Reply) {
        let answered = self.outstanding.answered(&reply);
        if let Some(on) = reply.main_power() {
            self.hear_power(on);
        }
        match reply {
            Reply::Identity(identity) => self.identified(now, identity.trim(), answered.is_some()),
            Reply::Locomotive { cab, register, throttle, forward, .. } => {
                let driven =
                    matches!(answered, Some(answered) if matches!(answered.awaited, Awaited::Driven(..)));
                self.hear_of_locomotive(TrainId(cab), Driven { register, throttle, forward }, driven);
            }
            Reply::Turnout { id, thrown } => {
                self.hear_of_turnout(now, TurnoutId(id), thrown, answered.is_some());
            }
            Reply::Sensor { id, active } => self.hear_of_sensor(now, id, active),
            Reply::Slots(_) if matches!(&self.opening, Opening::States(requests) if requests.is_empty()) => {
                self.opened(now);
            }
            Reply::Failed => {
                if let Some(turnout) = self.outstanding.refused() {
                    self.notify(LinkNotice::TurnoutRefused { turnout });
                }
            }
            _ => {}
        }
        self.end_if_confirmed();
    }

    fn identified(&mut self, now: Timestamp, identity: &str, was_asked: bool) {
        match &self.opening {
            Opening::Banner { .. } | Opening::Identity => {
                let was_reset = self.opening.awaits_banner() && self.locomotives.iter().next().is_some();
                self.notify(LinkNotice::Identified { identity: identity.to_owned() });
                if was_reset {
                    self.restarted();
                }
                self.verify();
            }
            Opening::Open { .. } if !was_asked && self.opening.is_reset_by_identity(now) => {
                self.blind_since.get_or_insert(now);
                self.restarted();
                self.verify();
            }
            Opening::States(_) | Opening::Open { .. } => {}
        }
    }

    /// Asks for all states, and how each locomotive is driven.
    fn verify(&mut self) {
        self.opening = Opening::ask_states(&self.settings, self.power);
        let known = self.locomotives.iter().filter(|locomotive| locomotive.forward.is_some());
        self.unverified = known.map(|locomotive| locomotive.train).collect();
    }

    /// The board has forgotten everything: trains have stopped, and their directions are written again.
    fn restarted(&mut self) {
        self.notify(LinkNotice::Restarted);
        self.outstanding.clear();
        self.waiting.clear();
        self.unverified.clear();
        for locomotive in self.locomotives.iter_mut() {
            locomotive.step = SpeedStep::STAND;
        }
        let driven: alloc::vec::Vec<TrainId> =
            self.locomotives.iter().filter(|known| known.is_driven).map(|known| known.train).collect();
        for train in driven {
            // Stops are always taken.
            let _ = self.waiting.push(Command::Speed { train, step: SpeedStep::STAND });
        }
    }

    fn opened(&mut self, now: Timestamp) {
        self.opening = Opening::Open { since: now };
        self.blind_since = None;
        self.notify(LinkNotice::Answers);
    }

    fn hear_power(&mut self, on: bool) {
        if self.is_powered && !on && self.power && !self.outstanding.has(Awaited::Power(false)) {
            self.notify(LinkNotice::PowerLost);
        }
        self.is_powered = on;
        if !on {
            self.farewell.power_went_off();
        }
    }

    /// How a train is driven, and whether that is what was asked for.
    fn hear_of_locomotive(&mut self, train: TrainId, driven: Driven, is_confirmed: bool) {
        let is_outstanding = self.outstanding.blocks(train, false).is_some();
        let Some(locomotive) = self.locomotives.get_mut(train) else {
            // Asked for before its first command, or driven by others.
            if self.waiting.iter().any(|command| super::train_of(command) == Some(train)) {
                self.locomotives.know(train);
                self.hear_of_locomotive(train, driven, is_confirmed);
            }
            return;
        };
        if is_confirmed {
            locomotive.is_stopped = locomotive.step == SpeedStep::STAND;
            return;
        }
        let Some(forward) = locomotive.forward else {
            locomotive.forward = Some(driven.forward);
            return;
        };
        let wanted = Throttle::Speed(speed_of(locomotive.step).unwrap_or_default());
        let is_as_commanded = driven.throttle == wanted && driven.forward == forward;
        if is_outstanding || is_as_commanded {
            return;
        }
        if !locomotive.is_driven {
            locomotive.forward = Some(driven.forward);
            return;
        }
        if driven.register < 0 {
            // The board does not drive it at all: it was restarted while nothing was heard of it.
            self.restarted();
            return;
        }
        let reversed = driven.forward != forward;
        locomotive.forward = Some(driven.forward);
        locomotive.is_stopped = false;
        if self.farewell.has_begun() {
            // Stops are always taken.
            let _ = self.waiting.push(Command::Speed { train, step: SpeedStep::STAND });
        }
        self.notify(LinkNotice::OtherThrottle { train, reversed });
    }

    fn hear_of_turnout(&mut self, now: Timestamp, turnout: TurnoutId, thrown: bool, was_asked: bool) {
        let known = self.turnouts.iter_mut().find(|(known, _)| *known == turnout);
        let before = match known {
            Some((_, lies)) => Some(core::mem::replace(lies, thrown)),
            None => {
                self.turnouts.push((turnout, thrown));
                None
            }
        };
        let is_used = self.settings.turnouts == TurnoutRequests::Defined;
        if is_used && !was_asked && before == Some(!thrown) {
            // Somebody else has thrown it: that is how it lies from now on.
            self.enter(now, EventKind::Turnout { turnout, curved: thrown });
        }
    }

    fn hear_of_sensor(&mut self, now: Timestamp, id: u16, active: bool) {
        let Some(number) = id.checked_sub(self.settings.first_sensor) else { return };
        let sensor = SensorId(number);
        match self.sensors.heard(id, active, self.opening.is_listing()) {
            Change::Occupied => {
                let (latest, width) = occupied(now, self.last_entry);
                // It may have become occupied at any time since nothing was heard.
                let width = self.blind_since.map_or(width, |since| width.max(latest - since));
                self.enter(latest, EventKind::Sensor(Report { sensor, poll_interval: Some(width) }));
            }
            Change::HeldFromStart => self.notify(LinkNotice::HeldClosed { sensor }),
            Change::None => {}
        }
    }
}

/// How the board drives a locomotive.
#[derive(Clone, Copy)]
struct Driven {
    register: i16,
    throttle: Throttle,
    forward: bool,
}
