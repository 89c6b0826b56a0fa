//! Slots: the places of the command station in which locomotives are driven.

use alloc::vec::Vec;

use footplate_core::TrainId;

use super::functions::{FunctionGroup, direction_byte, direction_of, sound, sound_bits};
use super::operand::{OPERAND, address_bytes};

/// Bits of a slot's status: who uses it.
const USE: u8 = 0x30;
/// Bits of the track: it has power, and it is not stopped.
const POWER: u8 = 0x01;
const RUNS: u8 = 0x02;

/// Who uses a slot.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SlotUse {
    /// No throttle, and no locomotive is in it.
    Free,
    /// No throttle; its locomotive is refreshed.
    Common,
    /// No throttle; its locomotive is not refreshed.
    Idle,
    /// A throttle.
    InUse,
}

/// A slot as the command station says it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SlotData {
    /// Its number; 0 is the station itself.
    pub slot: u8,
    /// Who uses it, whether it is in a consist, and its decoder's steps, in bits.
    pub status: u8,
    /// The decoder's address.
    pub address: u16,
    /// 0 stop, 1 emergency stop, 2 to 127 the decoder's steps 1 to 126.
    pub speed: u8,
    /// Whether it runs forward.
    pub forward: bool,
    /// Those of F0 to F8 that are on, F0 in the lowest bit.
    pub functions: u32,
    /// The state of the track, in bits.
    pub track: u8,
    /// More of its status, and the throttle's number.
    pub rest: [u8; 3],
}

impl SlotData {
    /// The functions that slots hold: F0 to F8.
    pub const FUNCTIONS: u32 = FunctionGroup::Direction.mask() | FunctionGroup::Sound.mask();

    /// What it says of its use.
    pub const fn slot_use(&self) -> SlotUse {
        match (self.status & USE) >> 4 {
            0 => SlotUse::Free,
            1 => SlotUse::Common,
            2 => SlotUse::Idle,
            _ => SlotUse::InUse,
        }
    }

    /// Its status with another use.
    #[must_use]
    pub const fn used_as(mut self, slot_use: SlotUse) -> Self {
        let bits = match slot_use {
            SlotUse::Free => 0,
            SlotUse::Common => 1,
            SlotUse::Idle => 2,
            SlotUse::InUse => 3,
        };
        self.status = self.status & !USE | bits << 4;
        self
    }

    /// Whether the track has power.
    pub const fn is_powered(&self) -> bool {
        self.track & POWER != 0
    }

    /// The bits of a track with power, or without it.
    pub const fn track_bits(is_powered: bool, is_stopped: bool) -> u8 {
        (if is_powered { POWER } else { 0 }) | if is_stopped { 0 } else { RUNS }
    }

    /// Reads what follows the length.
    pub(super) fn read(bytes: &[u8]) -> Option<Self> {
        let [slot, status, low, speed, dirf, track, more, high, snd, first, second] = *bytes else {
            return None;
        };
        let (forward, functions) = direction_of(dirf);
        let address = u16::from(high) << 7 | u16::from(low);
        Some(Self {
            slot,
            status,
            address,
            speed,
            forward,
            functions: functions | sound(snd),
            track,
            rest: [more, first, second],
        })
    }

    /// What follows the length.
    pub(super) fn bytes(&self) -> [u8; 11] {
        let (high, low) = address_bytes(self.address);
        let dirf = direction_byte(self.forward, self.functions);
        let snd = sound_bits(self.functions);
        let [more, first, second] = self.rest;
        [self.slot, self.status, low, self.speed, dirf, self.track, more, high, snd, first, second]
            .map(|byte| byte & OPERAND)
    }
}

/// The slot in which a train is driven.
#[derive(Debug, Clone, Copy)]
pub(super) struct DrivenSlot {
    pub(super) train: TrainId,
    /// The slot's number, while the station is known to have one for it.
    pub(super) number: Option<u8>,
    /// Direction and functions, by the station's own message; functions beyond those of slots as they were commanded.
    pub(super) forward: bool,
    pub(super) functions: u32,
    /// When its speed was written last.
    pub(super) refreshed: footplate_core::Timestamp,
}

/// The slots of all trains that are driven or about to be.
#[derive(Debug, Clone, Default)]
pub(super) struct DrivenSlots(Vec<DrivenSlot>);

impl DrivenSlots {
    pub(super) fn of(&self, train: TrainId) -> Option<&DrivenSlot> {
        self.0.iter().find(|slot| slot.train == train)
    }

    pub(super) fn of_mut(&mut self, train: TrainId) -> Option<&mut DrivenSlot> {
        self.0.iter_mut().find(|slot| slot.train == train)
    }

    /// The train that is driven in a slot.
    pub(super) fn train_in(&self, number: u8) -> Option<TrainId> {
        self.0.iter().find(|slot| slot.number == Some(number)).map(|slot| slot.train)
    }

    /// The station has a slot for a train.
    pub(super) fn found(&mut self, train: TrainId, data: &SlotData, now: footplate_core::Timestamp) {
        let (number, SlotData { forward, functions, .. }) = (Some(data.slot), *data);
        match self.of_mut(train) {
            Some(slot) => {
                let beyond = slot.functions & !SlotData::FUNCTIONS;
                (slot.number, slot.forward, slot.functions) = (number, forward, functions | beyond);
            }
            None => {
                self.0.push(DrivenSlot { train, number, forward, functions, refreshed: now });
            }
        }
    }

    pub(super) fn iter_mut(&mut self) -> impl Iterator<Item = &mut DrivenSlot> {
        self.0.iter_mut()
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = &DrivenSlot> {
        self.0.iter()
    }
}
