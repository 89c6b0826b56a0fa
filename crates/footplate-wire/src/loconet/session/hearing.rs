//! Handles lines from the server.

use alloc::string::String;

use footplate_core::{EventKind, SensorId, Timestamp, TrainId};

use super::super::line::{Line, SentReport};
use super::super::message::{Malformed, Message};
use super::super::outstanding::{Answer, Awaited};
use super::super::request::speed_of;
use super::super::slot::{SlotData, SlotUse};
use super::super::time_model::SENSOR_DELAY_SHORTEST;
use super::Client;
use crate::outstanding::Awaited as _;
use crate::reported_functions::ReportedFunctions;
use crate::sensors::occupied;
use crate::session::LinkNotice;

/// The opcode of a request for a slot, as the station's refusal of it names it.
const NO_SLOT: Message = Message::LongAck { opcode: 0x3F, code: 0 };
/// The opcode of a packet for the rails in the station's answer, and as the LocoNet Personal Use Edition writes it.
const PACKET: u8 = 0x6D;
const PACKET_AS_WRITTEN: u8 = 0x7D;

impl Client {
    pub(super) fn hear_byte(&mut self, now: Timestamp, byte: u8) {
        let line = self.lines.push(byte).map(|text| (text.len(), Line::read(text)));
        let unread = self.lines.take_unread();
        self.dialogue.hear_noise(unread);
        match line {
            Some((_, Ok(line))) => {
                // A server that only returns this client's messages says nothing about the command station.
                let is_of_bus = matches!(&line, Line::Receive(message) if !self.outbox.is_own(message));
                let was_silent = is_of_bus && self.dialogue.hear(now);
                match line {
                    Line::Version(version) => self.identified(version),
                    Line::Receive(message) => self.take(now, message),
                    Line::Sent(report) => self.sent(report),
                    Line::Send(_) | Line::Other => {}
                }
                if was_silent && self.opening.is_open() {
                    self.verify();
                }
                self.dialogue.end_if_confirmed();
            }
            Some((length, Err(Malformed))) => self.dialogue.hear_noise(length),
            None => {}
        }
    }

    fn identified(&mut self, identity: String) {
        if self.identity.as_ref() != Some(&identity) {
            self.identity = Some(identity.clone());
            self.dialogue.notify(LinkNotice::Identified(identity));
        }
    }

    /// The server has said what became of a message of this client.
    fn sent(&mut self, report: SentReport) {
        if let Some(message) = self.outbox.sent().filter(|_| report == SentReport::Ok) {
            self.dialogue.outstanding.answered(&Answer::Sent(message));
        }
    }

    /// A message has passed on the bus.
    fn take(&mut self, now: Timestamp, message: Message) {
        let is_own = self.outbox.is_own(&message);
        match message {
            Message::PowerOn => self.hear_power(true),
            Message::PowerOff => self.hear_power(false),
            Message::Slot(data) => self.hear_of_slot(now, &data),
            Message::Input { number, is_occupied } => self.hear_of_sensor(now, number, is_occupied),
            Message::Switch { address, closed, on: true } => {
                self.hear_of_turnout(now, address, closed, is_own);
            }
            Message::LongAck { opcode: PACKET | PACKET_AS_WRITTEN, code: 1.. } => {
                let answered =
                    self.dialogue.outstanding.answered(&Answer::Packet).map(|answered| answered.awaited);
                if let Some(Awaited::Functions(train, group, on)) = answered {
                    let reported = ReportedFunctions { known: group.mask(), on };
                    self.dialogue.hear_of_functions(train, reported, answered.as_ref());
                }
            }
            Message::Speed { slot, .. } | Message::Direction { slot, .. } | Message::Sound { slot, .. }
                if !is_own =>
            {
                // Another throttle drives it: the slot says how.
                if let Some(train) =
                    self.slots.train_in(slot).filter(|train| !self.unverified.contains(train))
                {
                    self.unverified.push(train);
                }
            }
            NO_SLOT => {
                let waiting = self.dialogue.waiting.iter().filter_map(crate::queue::train_of);
                let refused = waiting.chain(self.dialogue.locomotives.driven(false)).find(|train| {
                    let has_slot = self.slots.of(*train).is_some_and(|slot| slot.number.is_some());
                    !has_slot && !self.without_slot.contains(train)
                });
                if let Some(train) = refused {
                    self.without_slot.push(train);
                    self.dialogue.notify(LinkNotice::NoSlot(train));
                }
            }
            _ => {}
        }
    }

    fn hear_power(&mut self, on: bool) {
        let is_lost = self.dialogue.is_power_lost(on, &Awaited::Power(false));
        self.dialogue.hear_power(on, is_lost);
    }

    fn hear_of_slot(&mut self, now: Timestamp, data: &SlotData) {
        self.hear_power(data.is_powered());
        let answered = self.dialogue.outstanding.answered(&Answer::Slot(*data));
        if data.slot == 0 {
            return;
        }
        if let Some(train) = self.slots.train_in(data.slot)
            && (train.0 != data.address || data.slot_use() == SlotUse::Free)
        {
            return self.restarted();
        }
        let train = TrainId(data.address);
        let is_outstanding = self.dialogue.outstanding.blocks(train, false).is_some();
        if self.dialogue.locomotive(train).is_none() {
            return;
        }
        let reported = ReportedFunctions { known: SlotData::FUNCTIONS, on: data.functions };
        self.dialogue.hear_of_functions(train, reported, answered.as_ref().map(|answered| &answered.awaited));
        // The answer to an older request does not undo what a newer one switched.
        let is_switching = self.dialogue.outstanding.any(|awaited| awaited.switched() == Some(train));
        let switched = self.slots.of(train).map(|slot| slot.functions);
        self.slots.found(train, data, now);
        if let (true, Some(functions), Some(slot)) = (is_switching, switched, self.slots.of_mut(train)) {
            slot.functions = functions;
        }
        self.without_slot.retain(|other| *other != train);
        if data.slot_use() != SlotUse::InUse && !self.unused.iter().any(|(other, _)| *other == train) {
            self.unused.push((train, data.slot));
        }
        let decoder = self.dialogue.decoder(train);
        let Some(locomotive) = self.dialogue.locomotive(train) else { return };
        if matches!(answered, Some(answered) if matches!(answered.awaited, Awaited::Driven(..))) {
            return self.dialogue.obeyed(train);
        }
        let Some(forward) = locomotive.forward else {
            if data.slot_use() == SlotUse::InUse {
                let is_blank = data.speed == 0 && data.functions == 0;
                self.dialogue.hear_first_direction(train, data.forward, is_blank);
            }
            return;
        };
        let is_as_commanded =
            Some(data.speed) == speed_of(locomotive.step, decoder) && data.forward == forward;
        if is_outstanding || is_as_commanded {
            return;
        }
        if !locomotive.is_driven {
            return self.dialogue.faces(train, data.forward);
        }
        locomotive.is_stopped = false;
        self.dialogue.faces(train, data.forward);
        self.dialogue.stop_at_end(train);
        self.dialogue.notify(LinkNotice::OtherThrottle { train, reversed: data.forward != forward });
    }

    /// The station has given a slot to others or has forgotten it: trains have stopped, and all slots are asked for again.
    fn restarted(&mut self) {
        for slot in self.slots.iter_mut() {
            slot.number = None;
        }
        self.dialogue.restarted();
        self.unused.clear();
        self.dialogue.forget_directions();
        self.verify();
    }

    fn hear_of_turnout(&mut self, now: Timestamp, address: u16, closed: bool, is_own: bool) {
        let Some(turnout) = self.settings.turnout_at(address) else { return };
        let curved = closed != self.settings.closed_is_straight;
        let before = self.dialogue.hear_of_turnout(turnout, curved);
        if !is_own && before != Some(curved) {
            // Another throttle has thrown it.
            self.dialogue.enter(now, EventKind::Turnout { turnout, curved });
        }
    }

    fn hear_of_sensor(&mut self, now: Timestamp, number: u16, is_occupied: bool) {
        let Some(index) = number.checked_sub(self.settings.first_sensor) else { return };
        let sensor = SensorId(index);
        let change = self.sensors.heard(number, is_occupied, !self.opening.is_open());
        let span = occupied(
            now,
            self.dialogue.last_entry,
            [SENSOR_DELAY_SHORTEST, self.settings.sensor_delay],
            None,
        );
        self.dialogue.hear_of_change(sensor, change, span);
    }
}
