//! Messages of the bus: an opcode, its operands, and a byte that makes the XOR of all bytes 0xFF.
//!
//! ```text
//! opcode 100xxxxx  2 bytes        110xxxxx  6 bytes
//!        101xxxxx  4 bytes        111xxxxx  as many as the second byte says
//! ```
//!
//! Only the opcode has its highest bit set. Source: Digitrax, LocoNet Personal Use Edition 1.0; the meaning of the direction bit (set
//! is backward) as all programs that were looked at have it.

use alloc::vec::Vec;

use super::functions::{FunctionPacket, direction_byte, direction_of, sound, sound_bits};
use super::operand::{OPERAND, address_bytes};
use super::slot::SlotData;

const BUSY: u8 = 0x81;
const POWER_OFF: u8 = 0x82;
const POWER_ON: u8 = 0x83;
const IDLE: u8 = 0x85;
const SPEED: u8 = 0xA0;
const DIRECTION: u8 = 0xA1;
const SOUND: u8 = 0xA2;
const SWITCH: u8 = 0xB0;
const INPUT: u8 = 0xB2;
const LONG_ACK: u8 = 0xB4;
const MOVE_SLOTS: u8 = 0xBA;
const READ_SLOT: u8 = 0xBB;
const LOCOMOTIVE: u8 = 0xBF;
const SLOT: u8 = 0xE7;
const PACKET: u8 = 0xED;

/// Bits of a switch's second operand: the direction (closed) and whether the output is on.
const CLOSED: u8 = 0x20;
const ON: u8 = 0x10;
/// Bits of an input's second operand: the second of a pair, occupied, and one that is always set.
const SECOND: u8 = 0x20;
const OCCUPIED: u8 = 0x10;
const ALWAYS: u8 = 0x40;
/// The upper part of an address in a second operand.
const UPPER: u8 = 0x0F;
/// The length of a slot's data.
const SLOT_LENGTH: u8 = 14;

/// A message of the bus.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Message {
    /// The command station needs more time.
    Busy,
    /// The track has no power, or is to have none.
    PowerOff,
    /// The track has power, or is to have it.
    PowerOn,
    /// All locomotives stop at once; the track keeps its power.
    StopAll,
    /// The locomotive of a slot runs at a speed: 0 stop, 1 emergency stop, 2 to 127 the decoder's steps 1 to 126.
    Speed {
        /// The slot.
        slot: u8,
        /// The speed.
        speed: u8,
    },
    /// Direction and first functions of the locomotive of a slot.
    Direction {
        /// The slot.
        slot: u8,
        /// Whether it runs forward.
        forward: bool,
        /// Those of F0 to F4 that are on, F0 in the lowest bit.
        functions: u32,
    },
    /// Functions F5 to F8 of the locomotive of a slot.
    Sound {
        /// The slot.
        slot: u8,
        /// Those that are on, F0 in the lowest bit.
        functions: u32,
    },
    /// A packet for the rails that switches higher functions of a decoder.
    Functions(FunctionPacket),
    /// An output of a turnout is to be switched.
    Switch {
        /// Its address, from 1.
        address: u16,
        /// The output: closed (straight), or thrown.
        closed: bool,
        /// Whether it is powered.
        on: bool,
    },
    /// A detector reports.
    Input {
        /// Its address, from 1.
        number: u16,
        /// Whether it is occupied.
        is_occupied: bool,
    },
    /// The answer to a message that has no other.
    LongAck {
        /// The opcode that it answers, without its highest bit.
        opcode: u8,
        /// What it says; 0 is a refusal.
        code: u8,
    },
    /// A slot is moved; to itself, it is put in use.
    MoveSlots {
        /// From here.
        from: u8,
        /// To here.
        to: u8,
    },
    /// A slot is to be read.
    ReadSlot {
        /// The slot.
        slot: u8,
    },
    /// A slot is wanted for a locomotive.
    Locomotive {
        /// Its decoder's address.
        address: u16,
    },
    /// A slot, in answer to one of the three before.
    Slot(SlotData),
    /// A sound message of another kind.
    Other {
        /// Its opcode.
        opcode: u8,
    },
}

/// Bytes that are no message.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Malformed;

impl Message {
    /// Reads one whole message.
    ///
    /// # Errors
    /// When its length, one of its bytes or its checksum cannot be right.
    pub fn decode(bytes: &[u8]) -> Result<Self, Malformed> {
        let [opcode, operands @ .., _] = bytes else { return Err(Malformed) };
        let length = match (opcode & 0x60) >> 5 {
            0 => 2,
            1 => 4,
            2 => 6,
            _ => usize::from(*operands.first().ok_or(Malformed)?),
        };
        let is_sound = *opcode > OPERAND
            && bytes.len() == length
            && bytes.iter().skip(1).all(|byte| *byte <= OPERAND)
            && bytes.iter().fold(0, |xor, byte| xor ^ byte) == u8::MAX;
        if !is_sound {
            return Err(Malformed);
        }
        Ok(match (*opcode, operands) {
            (BUSY, _) => Self::Busy,
            (POWER_OFF, _) => Self::PowerOff,
            (POWER_ON, _) => Self::PowerOn,
            (IDLE, _) => Self::StopAll,
            (SPEED, &[slot, speed]) => Self::Speed { slot, speed },
            (DIRECTION, &[slot, dirf]) => {
                let (forward, functions) = direction_of(dirf);
                Self::Direction { slot, forward, functions }
            }
            (SOUND, &[slot, byte]) => Self::Sound { slot, functions: sound(byte) },
            (SWITCH, &[low, high]) => Self::Switch {
                address: (u16::from(high & UPPER) << 7 | u16::from(low)) + 1,
                closed: high & CLOSED != 0,
                on: high & ON != 0,
            },
            (INPUT, &[low, high]) => {
                let pair = u16::from(high & UPPER) << 7 | u16::from(low);
                let number = pair * 2 + u16::from(high & SECOND != 0) + 1;
                Self::Input { number, is_occupied: high & OCCUPIED != 0 }
            }
            (LONG_ACK, &[opcode, code]) => Self::LongAck { opcode, code },
            (MOVE_SLOTS, &[from, to]) => Self::MoveSlots { from, to },
            (READ_SLOT, &[slot, _]) => Self::ReadSlot { slot },
            (LOCOMOTIVE, &[high, low]) => Self::Locomotive { address: u16::from(high) << 7 | u16::from(low) },
            (PACKET, operands) => {
                FunctionPacket::read(operands).map_or(Self::Other { opcode: PACKET }, Self::Functions)
            }
            (SLOT, [SLOT_LENGTH, slot @ ..]) => Self::Slot(SlotData::read(slot).ok_or(Malformed)?),
            (opcode, _) => Self::Other { opcode },
        })
    }

    /// The bytes on the bus; none for a message of another kind.
    pub fn encode(&self) -> Vec<u8> {
        let mut bytes = Vec::new();
        match *self {
            Self::Busy => bytes.push(BUSY),
            Self::PowerOff => bytes.push(POWER_OFF),
            Self::PowerOn => bytes.push(POWER_ON),
            Self::StopAll => bytes.push(IDLE),
            Self::Speed { slot, speed } => bytes.extend([SPEED, slot, speed]),
            Self::Direction { slot, forward, functions } => {
                bytes.extend([DIRECTION, slot, direction_byte(forward, functions)]);
            }
            Self::Sound { slot, functions } => bytes.extend([SOUND, slot, sound_bits(functions)]),
            Self::Functions(packet) => {
                bytes.push(PACKET);
                bytes.extend(packet.operands());
            }
            Self::Switch { address, closed, on } => {
                let (high, low) = address_bytes(address.saturating_sub(1));
                let closed = if closed { CLOSED } else { 0 };
                bytes.extend([SWITCH, low, high & UPPER | closed | if on { ON } else { 0 }]);
            }
            Self::Input { number, is_occupied } => {
                let number = number.saturating_sub(1);
                let (high, low) = address_bytes(number / 2);
                let second = if number % 2 == 1 { SECOND } else { 0 };
                let occupied = if is_occupied { OCCUPIED } else { 0 };
                bytes.extend([INPUT, low, ALWAYS | second | occupied | high & UPPER]);
            }
            Self::LongAck { opcode, code } => bytes.extend([LONG_ACK, opcode, code]),
            Self::MoveSlots { from, to } => bytes.extend([MOVE_SLOTS, from, to]),
            Self::ReadSlot { slot } => bytes.extend([READ_SLOT, slot, 0]),
            Self::Locomotive { address } => {
                let (high, low) = address_bytes(address);
                bytes.extend([LOCOMOTIVE, high, low]);
            }
            Self::Slot(slot) => {
                bytes.extend([SLOT, SLOT_LENGTH]);
                bytes.extend(slot.bytes());
            }
            Self::Other { .. } => return bytes,
        }
        bytes.iter_mut().skip(1).for_each(|byte| *byte &= OPERAND);
        bytes.push(bytes.iter().fold(u8::MAX, |xor, byte| xor ^ byte));
        bytes
    }
}
