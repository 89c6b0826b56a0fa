//! The functions of a locomotive: those in its slot, and packets for the rails that switch the others.
//!
//! Sets of functions have F0 in the lowest bit. A slot holds F0 to F8; the station puts higher functions on the rails as a packet
//! (OPC_IMM_PACKET) when a client says so, and forgets them.
//!
//! ```text
//! ED 0B 7F  REPS            DHI                  IM1 … IM5
//!           0nnn0rrr        0 0 1 IM5.7 … IM1.7  the packet without its checksum, seven bits of each byte
//!           n bytes, r more times
//! ```
//!
//! Sources: Digitrax, LocoNet Personal Use Edition 1.0; NMRA S-9.2.1 for what is in the packet.

use core::ops::RangeInclusive;

use footplate_core::FunctionNumber;

use super::operand::OPERAND;

/// Length of the message, and the byte that follows it.
pub(super) const PACKET_LENGTH: u8 = 11;
const CHECK: u8 = 0x7F;
/// How often the station repeats a packet, because decoders miss some: the most that JMRI and locodrive ask for.
const REPEATED: u8 = 4;
const MOST_REPEATED: u8 = 0x07;
/// The bit of the high bits' byte that is always set.
const ALWAYS: u8 = 0x20;
/// The highest address that a decoder takes in one byte; higher ones have two, with both upper bits of the first set.
const HIGHEST_SHORT: u16 = 127;
const LONG: u8 = 0xC0;
/// The direction bit of a locomotive: backward.
const BACKWARD: u8 = 0x20;
/// Instructions to a decoder (S-9.2.1): function group two, F9 to F12, and the two expansions.
const GROUP_TWO: u8 = 0xA0;
const EXPANSION_13: u8 = 0xDE;
const EXPANSION_21: u8 = 0xDF;

/// Functions that are switched together.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FunctionGroup {
    /// F0 to F4, beside the direction of a slot.
    Direction,
    /// F5 to F8, the sound of a slot.
    Sound,
    /// F9 to F12, in a packet.
    F9To12,
    /// F13 to F20, in a packet.
    F13To20,
    /// F21 to F28, in a packet.
    F21To28,
}

impl FunctionGroup {
    const ALL: [Self; 5] = [Self::Direction, Self::Sound, Self::F9To12, Self::F13To20, Self::F21To28];

    /// The group of a function.
    pub fn of(function: FunctionNumber) -> Self {
        let has = |group: &Self| group.mask() & function.bit() != 0;
        Self::ALL.into_iter().find(has).unwrap_or(Self::F21To28)
    }

    /// The group's functions.
    #[must_use]
    pub const fn mask(self) -> u32 {
        let numbers = self.numbers();
        (1 << (*numbers.end() + 1)) - (1 << *numbers.start())
    }

    const fn numbers(self) -> RangeInclusive<u8> {
        match self {
            Self::Direction => 0..=4,
            Self::Sound => 5..=8,
            Self::F9To12 => 9..=12,
            Self::F13To20 => 13..=20,
            Self::F21To28 => 21..=28,
        }
    }

    /// Whether slots hold the group.
    #[must_use]
    pub const fn is_in_slot(self) -> bool {
        matches!(self, Self::Direction | Self::Sound)
    }

    /// The group's functions, the first in the lowest bit.
    const fn bits(self, functions: u32) -> u8 {
        let [bits, ..] = ((functions & self.mask()) >> *self.numbers().start()).to_le_bytes();
        bits
    }

    const fn set(self, bits: u8) -> u32 {
        ((bits as u32) << *self.numbers().start()) & self.mask()
    }
}

/// A packet for the rails that switches one group of functions of a decoder.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FunctionPacket {
    /// The decoder's address.
    pub address: u16,
    /// The group; one that is not in slots.
    pub group: FunctionGroup,
    /// Those of its functions that are on; all others of the group are off.
    pub functions: u32,
}

impl FunctionPacket {
    /// Reads what follows the opcode; `None` for packets that switch no such functions.
    pub(super) fn read(operands: &[u8]) -> Option<Self> {
        let [PACKET_LENGTH, CHECK, repeats, high, packet @ ..] = operands else { return None };
        let length = usize::from(repeats >> 4);
        let byte = |at: usize| {
            let low = packet.get(at).filter(|_| at < length)?;
            Some(low | if high >> at & 1 == 1 { OPERAND + 1 } else { 0 })
        };
        let first = byte(0)?;
        let (address, at) = match first {
            1..=127 => (u16::from(first), 1),
            LONG.. => (u16::from_be_bytes([first & !LONG, byte(1)?]), 2),
            _ => return None,
        };
        let instruction = byte(at)?;
        let (group, bits) = match instruction {
            EXPANSION_13 => (FunctionGroup::F13To20, byte(at + 1)?),
            EXPANSION_21 => (FunctionGroup::F21To28, byte(at + 1)?),
            _ if instruction & 0xF0 == GROUP_TWO => (FunctionGroup::F9To12, instruction & 0x0F),
            _ => return None,
        };
        Some(Self { address, group, functions: group.set(bits) })
    }

    /// What follows the opcode.
    pub(super) fn operands(&self) -> [u8; 9] {
        let [high, low] = self.address.to_be_bytes();
        let bits = self.group.bits(self.functions);
        let is_long = self.address > HIGHEST_SHORT;
        let (first, second) = match self.group {
            FunctionGroup::F13To20 => (EXPANSION_13, Some(bits)),
            FunctionGroup::F21To28 => (EXPANSION_21, Some(bits)),
            _ => (GROUP_TWO | bits, None),
        };
        let bytes = is_long.then_some(high | LONG).into_iter().chain([low, first]).chain(second);
        let (mut operands, mut length) = ([PACKET_LENGTH, CHECK, 0, ALWAYS, 0, 0, 0, 0, 0], 0);
        let [_, _, repeats, highs, packet @ ..] = &mut operands;
        for (place, byte) in packet.iter_mut().zip(bytes) {
            *place = byte & OPERAND;
            *highs |= (byte >> 7) << length;
            length += 1;
        }
        *repeats = length << 4 | REPEATED & MOST_REPEATED;
        operands
    }
}

/// Direction and functions F0 to F4 from their byte.
pub(super) const fn direction_of(byte: u8) -> (bool, u32) {
    (byte & BACKWARD == 0, beside_direction(byte))
}

/// The byte of a direction and functions F0 to F4.
pub(super) const fn direction_byte(forward: bool, functions: u32) -> u8 {
    direction_bits(functions) | if forward { 0 } else { BACKWARD }
}

/// F0 to F4 from their bits beside a direction, where F0 is above F1 to F4.
const fn beside_direction(bits: u8) -> u32 {
    ((bits & 0x0F) << 1 | bits >> 4 & 1) as u32
}

/// The bits of F0 to F4 beside a direction.
const fn direction_bits(functions: u32) -> u8 {
    let bits = FunctionGroup::Direction.bits(functions);
    bits >> 1 | (bits & 1) << 4
}

/// F5 to F8 from their byte.
pub(super) const fn sound(byte: u8) -> u32 {
    FunctionGroup::Sound.set(byte)
}

/// The byte of F5 to F8.
pub(super) const fn sound_bits(functions: u32) -> u8 {
    FunctionGroup::Sound.bits(functions)
}
