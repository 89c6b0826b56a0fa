//! What becomes of the datagrams that come.

use alloc::format;
use alloc::vec::Vec;

use footplate_core::{Command, EventKind, Report, SensorId, SpeedStep, Timestamp, TrainId};

use super::super::broadcasts::Broadcasts;
use super::super::dataset::Datasets;
use super::super::opening::Opening;
use super::super::outstanding::{Awaited, MOST_TRIES, Outstanding};
use super::super::reply::{Malformed, Reply};
use super::super::sensors::Change;
use super::super::speed::Throttle;
use super::super::states::{Firmware, Lock, LocomotiveState, TurnoutPosition};
use super::super::time_model::occupied;
use super::{Client, DETECTORS_WITHIN};
use crate::session::LinkNotice;

impl Client {
    /// Takes in one datagram.
    pub(super) fn hear(&mut self, now: Timestamp, datagram: &[u8]) {
        let mut datasets = Datasets::of(datagram);
        for dataset in datasets.by_ref() {
            match Reply::read(&dataset) {
                Ok(reply) => {
                    let was_silent = self.silence.heard();
                    if let Some(reply) = reply {
                        self.take(now, &reply);
                    }
                    self.heard = now;
                    if was_silent && self.opening.is_open() {
                        self.verify();
                    }
                }
                Err(Malformed) => self.hear_noise(dataset.data.len()),
            }
        }
        self.hear_noise(datasets.unread());
    }

    fn hear_noise(&mut self, bytes: usize) {
        if bytes > 0
            && let Some(notice) = self.silence.heard_noise(bytes)
        {
            self.notify(notice);
        }
    }

    fn take(&mut self, now: Timestamp, reply: &Reply) {
        let answered = self.outstanding.answered(reply);
        if let Some(on) = reply.power() {
            self.hear_power(on);
        }
        match *reply {
            Reply::SerialNumber(number) => self.serial_number = number,
            Reply::Hardware { kind, firmware } => self.identified(kind, firmware),
            Reply::LockCode(Lock::Locked) => self.notify(LinkNotice::Locked),
            Reply::Broadcasts(told) => self.hear_of_broadcasts(told),
            Reply::Locomotive(state) => {
                let driven = |answered: Outstanding| matches!(answered.awaited, Awaited::Driven(..));
                self.hear_of_locomotive(&state, answered.is_some_and(driven));
            }
            Reply::Turnout { address, position: TurnoutPosition::Output { second } } => {
                self.hear_of_turnout(now, address, second, answered.is_some());
            }
            Reply::Feedback { .. } | Reply::Can(_) | Reply::LocoNet(_) => {
                // What is found when it is asked for may have been so since it was said to be free.
                let is_answer = matches!(reply, Reply::Can(_))
                    && self.asked_detectors.is_some_and(|asked| now - asked < DETECTORS_WITHIN);
                let was_missed = answered.is_some() || is_answer || self.is_blind;
                let detections: Vec<(u16, bool)> = self.settings.feedback.detections(reply).collect();
                for (number, is_occupied) in detections {
                    self.hear_of_sensor(now, number, is_occupied, was_missed);
                }
            }
            _ => {}
        }
        self.end_if_confirmed();
    }

    fn identified(&mut self, kind: u32, firmware: Firmware) {
        let name = match kind {
            0x200 | 0x201 => "Z21",
            0x202 => "SmartRail",
            0x203 => "z21",
            0x204 => "z21start",
            0x205 => "10806 Single Booster",
            0x206 => "10807 Dual Booster",
            0x211 => "Z21 XL",
            _ => "Z21-compatible station",
        };
        let identity = format!("{name}, firmware {firmware}, serial number {}", self.serial_number);
        if self.identity.as_ref() != Some(&identity) {
            self.identity = Some(identity.clone());
            self.notify(LinkNotice::Identified { identity });
        }
    }

    /// Asks for all states, and how each locomotive is driven.
    pub(super) fn verify(&mut self) {
        self.opening = Opening::begin(&self.settings, self.wanted, self.is_subscribed, self.power);
        let known = self.locomotives.iter().filter(|locomotive| locomotive.forward.is_some());
        self.unverified = known.map(|locomotive| locomotive.train).collect();
    }

    /// The station has forgotten everything: trains have stopped, and their directions are written again.
    fn restarted(&mut self) {
        self.notify(LinkNotice::Restarted);
        self.outstanding.clear();
        self.waiting.clear();
        self.suspected.clear();
        for locomotive in self.locomotives.iter_mut() {
            locomotive.step = SpeedStep::STAND;
        }
        let driven: Vec<TrainId> =
            self.locomotives.iter().filter(|known| known.is_driven).map(|known| known.train).collect();
        for train in driven {
            // Stops are always taken.
            let _ = self.waiting.push(Command::Speed { train, step: SpeedStep::STAND });
        }
    }

    pub(super) fn opened(&mut self) {
        self.opening = Opening::Open;
        (self.is_blind, self.polled) = (false, self.now);
        self.notify(LinkNotice::Answers);
    }

    /// What this client is told.
    fn hear_of_broadcasts(&mut self, told: Broadcasts) {
        if told.has(self.wanted) {
            self.is_subscribed = true;
            return;
        }
        if self.is_subscribed {
            self.is_subscribed = false;
            self.is_blind = true;
            self.restarted();
            return self.verify();
        }
        // It is written again until the station has it, or does not want it.
        let Some(asked) = self.outstanding.take(Awaited::Broadcasts(self.wanted)) else { return };
        if asked.tries < MOST_TRIES {
            return self.outstanding.push(asked);
        }
        let missing = self.wanted.0 & !told.0;
        self.wanted = Broadcasts(self.wanted.0 & told.0);
        self.is_subscribed = true;
        self.notify(LinkNotice::BroadcastsRefused { missing });
    }

    fn hear_power(&mut self, on: bool) {
        let is_unexpected =
            self.is_powered && !on && self.power && !self.outstanding.has(Awaited::Power(false));
        if is_unexpected && !self.power_is_suspect {
            (self.power_is_suspect, self.asks_status) = (true, true);
            return;
        }
        if is_unexpected {
            self.notify(LinkNotice::PowerLost);
        }
        self.power_is_suspect = false;
        self.is_powered = on;
        if !on {
            self.farewell.power_went_off();
        }
    }

    /// How a train is driven, and whether that is what was asked for.
    fn hear_of_locomotive(&mut self, state: &LocomotiveState, is_confirmed: bool) {
        let train = TrainId(state.address);
        let is_outstanding = self.outstanding.blocks(train, false).is_some();
        let Some(locomotive) = self.locomotives.get_mut(train) else {
            // Asked for before its first command, or driven by others.
            if self.waiting.iter().any(|command| super::train_of(command) == Some(train)) {
                self.locomotives.know(train);
                self.hear_of_locomotive(state, is_confirmed);
            }
            return;
        };
        if is_confirmed {
            locomotive.is_stopped = locomotive.step == SpeedStep::STAND;
            return self.suspected.retain(|(other, ..)| *other != train);
        }
        let Some(forward) = locomotive.forward else {
            locomotive.forward = Some(state.forward);
            return;
        };
        let wanted = self.settings.steps.throttle_of(locomotive.step).unwrap_or(Throttle::Stop);
        let as_fast = state.throttle.is_like(state.steps, wanted, self.settings.steps);
        if is_outstanding || as_fast && state.forward == forward {
            return self.suspected.retain(|(other, ..)| *other != train);
        }
        if !locomotive.is_driven {
            locomotive.forward = Some(state.forward);
            return;
        }
        // An old datagram may say so: it counts when it is said again in answer to a question.
        let said = (train, state.throttle, state.forward);
        if !self.suspected.contains(&said) {
            self.suspected.retain(|(other, ..)| *other != train);
            self.suspected.push(said);
            self.asks_broadcasts = true;
            if !self.unverified.contains(&train) {
                self.unverified.push(train);
            }
            return;
        }
        locomotive.forward = Some(state.forward);
        locomotive.is_stopped = false;
        self.suspected.retain(|(other, ..)| *other != train);
        if self.farewell.has_begun() {
            // Stops are always taken.
            let _ = self.waiting.push(Command::Speed { train, step: SpeedStep::STAND });
        }
        self.notify(LinkNotice::OtherThrottle { train, reversed: state.forward != forward });
    }

    fn hear_of_turnout(&mut self, now: Timestamp, address: u16, second: bool, was_asked: bool) {
        let Some(turnout) = self.settings.turnout_at(address) else { return };
        let curved = second != self.settings.second_is_straight;
        let before = self.turnouts.heard(turnout, curved);
        let is_outstanding = self.outstanding.has(Awaited::Turnout(turnout, address, second));
        if !was_asked && !is_outstanding && before == Some(!curved) {
            // Somebody else has thrown it: that is how it lies from now on.
            self.enter(now, EventKind::Turnout { turnout, curved });
        }
    }

    fn hear_of_sensor(&mut self, now: Timestamp, number: u16, is_occupied: bool, was_missed: bool) {
        let Some(index) = number.checked_sub(self.settings.first_sensor) else { return };
        if number > self.settings.last_sensor {
            return;
        }
        let sensor = SensorId(index);
        let is_listing = !self.opening.is_open();
        match self.sensors.heard(now, number, is_occupied, is_listing) {
            Change::Occupied { free_at } => {
                let free_at = free_at.filter(|_| was_missed);
                let (latest, width) = occupied(now, self.last_entry, self.settings.sensor_delay, free_at);
                self.enter(latest, EventKind::Sensor(Report { sensor, poll_interval: Some(width) }));
            }
            Change::HeldFromStart => self.notify(LinkNotice::HeldClosed { sensor }),
            Change::None => {}
        }
    }
}
