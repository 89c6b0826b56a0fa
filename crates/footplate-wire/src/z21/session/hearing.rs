//! Handles datagrams from the station.

use alloc::format;
use alloc::vec::Vec;

use footplate_core::{EventKind, SensorId, SpeedStep, TimeSpan, Timestamp, TrainId};

use super::super::broadcasts::Broadcasts;
use super::super::dataset::Datasets;
use super::super::detectors::RailCom;
use super::super::outstanding::Awaited;
use super::super::reply::{Malformed, Reply};
use super::super::request::Request;
use super::super::sensors::Change;
use super::super::speed::Throttle;
use super::super::states::{Firmware, Lock, LocomotiveState, TurnoutPosition};
use super::super::time_model::SENSOR_DELAY_SHORTEST;
use super::{Client, DETECTORS_WITHIN};
use crate::outstanding::{Awaited as _, Outstanding};
use crate::protocol::Opening;
use crate::reported_functions::ReportedFunctions;
use crate::sensors::occupied;
use crate::session::{LinkNotice, Transmit};

/// A speed that a decoder reports again is passed on after this time: stations report many times a second (chosen: a few numbers
/// between two sensors are enough).
const SAME_SPEED_EVERY: TimeSpan = TimeSpan::from_ms(400);
/// What to check on a station that does not report everything.
const CHECK_OF_BROADCASTS: &str =
    "check its firmware, and what its sensors are connected to (feedback=r-bus, can or loconet)";

impl Client {
    /// Takes in one datagram.
    pub(super) fn hear_datagram(&mut self, now: Timestamp, datagram: &[u8]) {
        let mut datasets = Datasets::of(datagram);
        for dataset in datasets.by_ref() {
            match Reply::read(&dataset) {
                Ok(reply) => {
                    let was_silent = self.dialogue.hear(now);
                    if let Some(reply) = reply {
                        self.take(now, &reply);
                    }
                    if was_silent && self.opening.is_open() {
                        self.verify();
                    }
                }
                Err(Malformed) => self.dialogue.hear_noise(dataset.data.len()),
            }
        }
        self.dialogue.hear_noise(datasets.unread());
    }

    fn take(&mut self, now: Timestamp, reply: &Reply) {
        let answered = self.dialogue.outstanding.answered(reply);
        if let Some(on) = reply.power() {
            self.hear_power(on, reply.confirms_power(false));
        }
        match *reply {
            Reply::SerialNumber(number) => self.serial_number = number,
            Reply::Hardware { kind, firmware } => self.identified(kind, firmware),
            Reply::LockCode(Lock::Locked) => self.dialogue.notify(LinkNotice::Locked),
            Reply::Broadcasts(reported) => self.hear_of_broadcasts(reported),
            Reply::Locomotive(state) => {
                let driven = |answered: Outstanding<Awaited>| matches!(answered.awaited, Awaited::Driven(..));
                let answer = answered.as_ref().map(|answered| &answered.awaited);
                let reported = ReportedFunctions::all(state.functions);
                self.dialogue.hear_of_functions(TrainId(state.address), reported, answer);
                self.hear_of_locomotive(&state, answered.is_some_and(driven));
            }
            Reply::Turnout { address, position: TurnoutPosition::Output { second } } => {
                self.hear_of_turnout(now, address, second, answered.is_some());
            }
            Reply::Feedback { .. } | Reply::Can(_) | Reply::LocoNet(_) => {
                // A change found by a poll may have happened any time since the sensor was last reported free.
                let is_answer = matches!(reply, Reply::Can(_))
                    && self.asked_detectors.is_some_and(|asked| now - asked < DETECTORS_WITHIN);
                let was_missed = answered.is_some() || is_answer || self.dialogue.blind_since.is_some();
                let detections: Vec<(u16, bool)> = self.settings.feedback.detections(reply).collect();
                for (number, is_occupied) in detections {
                    self.hear_of_sensor(now, number, is_occupied, was_missed);
                }
            }
            Reply::RailCom(report) => self.hear_of_speed(now, report),
            _ => {}
        }
        if self.dialogue.end_if_confirmed() {
            self.log_off();
        }
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
            self.dialogue.notify(LinkNotice::Identified(identity));
        }
    }

    /// Reads all states again, including every locomotive's.
    pub(super) fn verify(&mut self) {
        self.opening = Opening::asking(self.settings.questions(self.wanted, self.is_subscribed));
        self.unverified = self.dialogue.directed();
    }

    /// Handles a station that was reset.
    fn restarted(&mut self) {
        self.dialogue.restarted();
        self.suspected.clear();
    }

    /// Frees this client's place at the station.
    fn log_off(&mut self) {
        let mut bytes = Vec::new();
        Request::LogOff.write(&mut bytes);
        self.dialogue.write(bytes);
    }

    pub(super) fn opened(&mut self) {
        self.opening = Opening::Open;
        (self.dialogue.blind_since, self.polled) = (None, self.dialogue.now);
        self.dialogue.notify(LinkNotice::Answers);
    }

    /// The subscription of this client.
    fn hear_of_broadcasts(&mut self, reported: Broadcasts) {
        if reported.has(self.wanted) {
            self.is_subscribed = true;
            return;
        }
        if self.is_subscribed {
            self.is_subscribed = false;
            self.dialogue.blind_since.get_or_insert(self.dialogue.heard);
            self.restarted();
            return self.verify();
        }
        // It is repeated until the station accepts or refuses it.
        let Some(asked) = self.dialogue.outstanding.take(&Awaited::Broadcasts(self.wanted)) else { return };
        if asked.tries < Awaited::REPEATS.most_tries {
            return self.dialogue.outstanding.push(asked);
        }
        let missing = self.wanted.0 & !reported.0;
        self.wanted = Broadcasts(self.wanted.0 & reported.0);
        self.is_subscribed = true;
        self.dialogue.notify(LinkNotice::BroadcastsRefused { missing, check: CHECK_OF_BROADCASTS });
    }

    /// Whether trains can run, and whether that is because the track has no power.
    fn hear_power(&mut self, on: bool, is_off: bool) {
        let is_unexpected = self.dialogue.is_power_lost(on, &Awaited::Power(false));
        if is_unexpected && !self.power_is_suspect {
            (self.power_is_suspect, self.asks_status) = (true, true);
            return;
        }
        self.power_is_suspect = false;
        if on || is_off {
            self.dialogue.hear_power(on, is_unexpected);
        } else {
            self.dialogue.hear_of_stop(is_unexpected);
        }
    }

    /// Compares a train's state with the commanded one.
    fn hear_of_locomotive(&mut self, state: &LocomotiveState, is_confirmed: bool) {
        let train = TrainId(state.address);
        let is_outstanding = self.dialogue.outstanding.blocks(train, false).is_some();
        let step = self.dialogue.locomotives.get(train).map_or(SpeedStep::STAND, |known| known.step);
        let (steps, wanted) = self.throttle(train, step);
        let Some(locomotive) = self.dialogue.locomotive(train) else { return };
        if is_confirmed {
            self.dialogue.obeyed(train);
            return self.suspected.retain(|(other, ..)| *other != train);
        }
        let is_blank = !state.busy && state.throttle == Throttle::Stop && state.functions == 0;
        let Some(forward) = locomotive.forward else {
            return self.dialogue.hear_first_direction(train, state.forward, is_blank);
        };
        let as_fast = state.throttle.is_like(state.steps, wanted, steps);
        if is_outstanding || as_fast && state.forward == forward {
            return self.suspected.retain(|(other, ..)| *other != train);
        }
        if !locomotive.is_driven {
            return self.dialogue.hear_first_direction(train, state.forward, is_blank);
        }
        // It may be an old datagram: it counts when the station repeats it in answer to a question.
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
        locomotive.is_stopped = false;
        self.dialogue.faces(train, state.forward);
        self.suspected.retain(|(other, ..)| *other != train);
        self.dialogue.stop_at_end(train);
        self.dialogue.notify(LinkNotice::OtherThrottle { train, reversed: state.forward != forward });
    }

    /// Passes on the speed of a train of this client. A report is old if the station has received no further message of the decoder.
    fn hear_of_speed(&mut self, now: Timestamp, report: RailCom) {
        let train = TrainId(report.address);
        let Some(number) = report.reported_speed() else { return };
        if !self.dialogue.locomotives.get(train).is_some_and(|locomotive| locomotive.is_driven) {
            return;
        }
        match self.reported.iter_mut().find(|(_, last)| last.address == report.address) {
            Some((_, last)) if last.received == report.received => return,
            Some((at, last)) if last.speed == report.speed && now - *at < SAME_SPEED_EVERY => return,
            Some(last) => *last = (now, report),
            None => self.reported.push((now, report)),
        }
        self.dialogue.output.push_back(Transmit::ReportedSpeed(train, number));
    }

    fn hear_of_turnout(&mut self, now: Timestamp, address: u16, second: bool, was_asked: bool) {
        let Some(turnout) = self.settings.turnout_at(address) else { return };
        let curved = second != self.settings.second_is_straight;
        let before = self.dialogue.hear_of_turnout(turnout, curved);
        let is_outstanding = self.dialogue.outstanding.has(&Awaited::Turnout(turnout, address, second));
        if !was_asked && !is_outstanding && before == Some(!curved) {
            // Another throttle has thrown it.
            self.dialogue.enter(now, EventKind::Turnout { turnout, curved });
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
                let (latest, width) = occupied(
                    now,
                    self.dialogue.last_entry,
                    [SENSOR_DELAY_SHORTEST, self.settings.sensor_delay],
                    free_at,
                );
                self.dialogue.report(sensor, latest, width);
            }
            Change::Freed => {
                let (latest, width) = occupied(
                    now,
                    self.dialogue.last_entry,
                    [SENSOR_DELAY_SHORTEST, self.settings.sensor_delay],
                    None,
                );
                self.dialogue.report_free(sensor, latest, width);
            }
            Change::HeldFromStart => self.dialogue.notify(LinkNotice::HeldClosed(sensor)),
            Change::None => {}
        }
    }
}
