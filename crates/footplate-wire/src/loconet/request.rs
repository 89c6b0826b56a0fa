//! What the session asks for, as messages of the bus in their order.

use alloc::vec::Vec;
use core::ops::RangeInclusive;

use footplate_core::{DecoderSteps, SpeedStep};

use super::functions::{FunctionGroup, FunctionPacket};
use super::message::Message;

/// The decoders' addresses.
pub const LOCOMOTIVES: RangeInclusive<u16> = 1..=9_983;

/// The addresses of turnouts.
pub const TURNOUTS: RangeInclusive<u16> = 1..=2_048;

/// The speed of an emergency stop; the decoder's steps lie above it.
const EMERGENCY_STOP: u8 = 1;

/// How often detectors are asked for their states: four addresses of turnouts that no turnout has, each in both positions. Detectors report what
/// they see in answer to one of them (as JMRI asks them).
pub(super) const INTERROGATIONS: u8 = 8;
const FIRST_INTERROGATION: u16 = 1_017;

/// The speed of a slot for a step of a decoder: all steps are equally far apart, and the highest is the highest. `None` beyond
/// the highest step.
pub fn speed_of(step: SpeedStep, decoder: DecoderSteps) -> Option<u8> {
    match decoder.scaled(step, SpeedStep::HIGHEST)? {
        0 => Some(0),
        step => Some(step + EMERGENCY_STOP),
    }
}

/// What is asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Request {
    Power {
        on: bool,
    },
    StopAll,
    /// A slot's state; slot 0 is the station's own.
    Slot(u8),
    /// The nth question for the states of detectors.
    Interrogate(u8),
    /// A slot for a decoder's address.
    Locomotive(u16),
    /// That a slot is in use by a throttle.
    Use(u8),
    /// How a slot's locomotive is driven; its direction and functions where they change.
    Drive {
        slot: u8,
        speed: u8,
        direction: Option<(bool, u32)>,
    },
    /// A group of functions of a slot's locomotive.
    Functions {
        slot: u8,
        address: u16,
        forward: bool,
        group: FunctionGroup,
        functions: u32,
    },
    Switch {
        address: u16,
        closed: bool,
        on: bool,
    },
}

impl Request {
    /// The messages, in the order in which they are put on the bus.
    pub(super) fn messages(self) -> Vec<Message> {
        let mut messages = Vec::new();
        match self {
            Self::Power { on } => {
                messages.push(if on { Message::PowerOn } else { Message::PowerOff });
                messages.push(Message::ReadSlot { slot: 0 });
            }
            Self::StopAll => messages.push(Message::StopAll),
            Self::Slot(slot) => messages.push(Message::ReadSlot { slot }),
            Self::Interrogate(nth) => {
                let address = FIRST_INTERROGATION + u16::from(nth % (INTERROGATIONS / 2));
                messages.push(Message::Switch { address, closed: nth < INTERROGATIONS / 2, on: false });
            }
            Self::Locomotive(address) => messages.push(Message::Locomotive { address }),
            Self::Use(slot) => messages.push(Message::MoveSlots { from: slot, to: slot }),
            Self::Drive { slot, speed, direction } => {
                let direction =
                    direction.map(|(forward, functions)| Message::Direction { slot, forward, functions });
                // A locomotive stops before it is reversed, and is reversed before it starts.
                let (before, after) = if speed == 0 { (None, direction) } else { (direction, None) };
                messages.extend(before);
                messages.push(Message::Speed { slot, speed });
                messages.extend(after);
                messages.push(Message::ReadSlot { slot });
            }
            Self::Functions { slot, address, forward, group, functions } => {
                messages.push(match group {
                    FunctionGroup::Direction => Message::Direction { slot, forward, functions },
                    FunctionGroup::Sound => Message::Sound { slot, functions },
                    _ => Message::Functions(FunctionPacket { address, group, functions }),
                });
                messages.extend(group.is_in_slot().then_some(Message::ReadSlot { slot }));
            }
            Self::Switch { address, closed, on } => {
                messages.push(Message::Switch { address, closed, on });
            }
        }
        messages
    }
}
