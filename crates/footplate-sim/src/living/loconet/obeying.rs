//! What the virtual command station does with a message of the bus, and what it answers.

use footplate_core::track::Leg;
use footplate_core::{SensorId, TrainId, TurnoutId};
use footplate_wire::loconet::{FunctionGroup, FunctionPacket, Message, SlotData, SlotUse};

use super::{Sender, Slot, VirtualLocoNet, free_slot, number_of};
use crate::living::decoder::DecoderSpeed;

/// The steps of a decoder.
const HIGHEST: u8 = 126;
/// The address that asks detectors for their states, of four that do.
const INTERROGATION: u16 = 1_017;
/// Between the reports of two detectors that were asked (s; chosen).
const REPORTS_S: f64 = 0.001;

impl VirtualLocoNet<'_> {
    pub(super) fn obey(&mut self, message: Message) {
        match message {
            Message::PowerOn | Message::PowerOff => {
                self.is_stopped = false;
                self.world.power(message == Message::PowerOn, self.now);
                if message == Message::PowerOn {
                    // The track carries every locomotive's speed and direction again.
                    (0..self.slots.len()).for_each(|at| self.carry(at));
                }
            }
            Message::StopAll => {
                self.is_stopped = true;
                (0..self.slots.len()).for_each(|at| self.carry(at));
            }
            Message::Speed { slot, speed } => self.command(slot, |data| data.speed = speed),
            Message::Direction { slot, forward, functions } => {
                self.command(slot, |data| {
                    let others = data.functions & !FunctionGroup::Direction.mask();
                    (data.forward, data.functions) = (forward, functions | others);
                });
            }
            Message::Sound { slot, functions } => self.command(slot, |data| {
                data.functions = data.functions & !FunctionGroup::Sound.mask() | functions;
            }),
            Message::Functions(FunctionPacket { address, group, functions }) => {
                if let Some(slot) = self.slots.iter_mut().find(|slot| slot.data.address == address) {
                    slot.higher_functions = slot.higher_functions & !group.mask() | functions;
                }
                self.answer(Message::LongAck { opcode: 0x6D, code: 0x7F });
            }
            Message::Switch { address: INTERROGATION, closed: true, on: false } => self.report_all(),
            // The decoder of a turnout powers its coil for long enough and lets go by itself.
            Message::Switch { address, closed, on: true } if self.world.is_powered() => {
                self.world.points.power(TurnoutId(address), Leg::from_curved(!closed), self.now);
            }
            Message::Locomotive { address } => match self.slot_for(address) {
                Some(at) => self.answer_slot(self.slots[at].data),
                None => self.answer(Message::LongAck { opcode: 0x3F, code: 0 }),
            },
            Message::MoveSlots { from, to } if from == to => {
                let now = self.now;
                if let Some(slot) = self.slots.iter_mut().find(|slot| slot.data.slot == from) {
                    slot.data = slot.data.used_as(SlotUse::InUse);
                    slot.commanded = now;
                    let data = slot.data;
                    self.answer_slot(data);
                }
            }
            Message::ReadSlot { slot } => {
                let known = self.slots.iter().find(|known| known.data.slot == slot);
                self.answer_slot(known.map_or(free_slot(slot), |known| known.data));
            }
            _ => {}
        }
    }

    fn answer_slot(&mut self, data: SlotData) {
        let track = SlotData::track_bits(self.world.is_powered(), self.is_stopped);
        self.answer(Message::Slot(SlotData { track, ..data }));
    }

    /// The place of a locomotive's slot; `None` when no slot is free for it.
    fn slot_for(&mut self, address: u16) -> Option<usize> {
        if let Some(known) = self.slots.iter().position(|slot| slot.data.address == address) {
            return Some(known);
        }
        let is_taken = |number: &u8| self.slots.iter().any(|slot| slot.data.slot == *number);
        let fresh = (1..=self.switches.slots).find(|number| !is_taken(number));
        let given = || {
            let unused = |slot: &&Slot| slot.data.slot_use() != SlotUse::InUse;
            self.slots.iter().find(unused).map(|slot| slot.data.slot)
        };
        let number = fresh.or_else(given)?;
        self.slots.retain(|slot| slot.data.slot != number);
        let data = SlotData { address, ..free_slot(number) }.used_as(SlotUse::Common);
        self.slots.push(Slot { data, higher_functions: 0, commanded: self.now });
        Some(self.slots.len() - 1)
    }

    fn command(&mut self, slot: u8, change: impl FnOnce(&mut SlotData)) {
        let Some(at) = self.slots.iter().position(|known| known.data.slot == slot) else { return };
        change(&mut self.slots[at].data);
        self.slots[at].commanded = self.now;
        self.carry(at);
    }

    /// The track carries the speed and direction of a slot's locomotive.
    fn carry(&mut self, at: usize) {
        let SlotData { address, speed, forward, .. } = self.slots[at].data;
        let speed = match speed {
            0 => DecoderSpeed::Step { step: 0, highest: HIGHEST },
            1 => DecoderSpeed::EmergencyStop,
            _ if self.is_stopped => DecoderSpeed::EmergencyStop,
            code => DecoderSpeed::Step { step: code - 1, highest: HIGHEST },
        };
        self.world.carry(TrainId(address), forward, speed, self.now);
    }

    /// Every detector reports its state, one behind the other.
    fn report_all(&mut self) {
        let sensors: Vec<SensorId> = self.world.s88.sensors().to_vec();
        for (nth, sensor) in sensors.into_iter().enumerate() {
            let is_occupied = self.world.s88.is_occupied(sensor).unwrap_or(false);
            let message = Message::Input { number: number_of(sensor), is_occupied };
            self.queue(Sender::Detector, message, nth as f64 * REPORTS_S);
        }
    }
}
