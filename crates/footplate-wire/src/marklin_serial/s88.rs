//! Replies of the interface: the inputs of its S88 sensor modules.
//!
//! Two bytes a module, the first input in the highest bit of the first byte.

use core::fmt::{Display, Formatter, Result as FmtResult};

use footplate_core::SensorId;

use super::codec::Message;

/// Inputs on one S88 module.
pub const INPUTS_PER_MODULE: u16 = 16;

const FIRST_INPUT: u16 = 1 << (INPUTS_PER_MODULE - 1);
const BYTES_PER_MODULE: usize = 2;

/// The inputs of one module, as one reply shows them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ModuleState {
    /// The module, counted from 1.
    pub module: u8,
    /// The inputs that are closed, the first in the highest bit.
    closed: u16,
}

/// A reply that does not fit the request.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum ReplyError {
    /// A byte was lost or one of another reply was taken; no byte of it can be trusted.
    Length {
        /// Bytes that were asked for.
        expected: usize,
        /// Bytes that came.
        found: usize,
    },
}

impl ModuleState {
    /// A module on which these inputs are closed, and no others; inputs of other modules do not count.
    pub fn with_closed(module: u8, inputs: impl IntoIterator<Item = SensorId>) -> Self {
        let open = Self { module, closed: 0 };
        let bits = inputs.into_iter().filter_map(|input| open.bit_of(input));
        Self { module, closed: bits.fold(0, |closed, bit| closed | bit) }
    }

    /// The bytes of the reply.
    #[must_use]
    pub fn encode(self) -> [u8; BYTES_PER_MODULE] {
        self.closed.to_be_bytes()
    }

    /// Reads what [`encode`](Self::encode) writes.
    pub fn decode(module: u8, reply: [u8; BYTES_PER_MODULE]) -> Self {
        Self { module, closed: u16::from_be_bytes(reply) }
    }

    /// The closed inputs in the order of their numbers.
    pub fn closed(self) -> impl Iterator<Item = SensorId> {
        let first = self.first_input();
        let inputs = (0..INPUTS_PER_MODULE).filter(move |at| self.closed & (FIRST_INPUT >> at) != 0);
        inputs.map(move |at| SensorId(first + at))
    }

    /// A module without closed inputs.
    pub(super) const fn all_open(module: u8) -> Self {
        Self { module, closed: 0 }
    }

    pub(super) const fn is_open(self) -> bool {
        self.closed == 0
    }

    /// The inputs that are closed now and were not in an earlier state.
    pub(super) const fn since(self, before: Self) -> Self {
        Self { module: self.module, closed: self.closed & !before.closed }
    }

    /// What is closed in both states.
    pub(super) const fn both(self, other: Self) -> Self {
        Self { module: self.module, closed: self.closed & other.closed }
    }

    fn bit_of(self, input: SensorId) -> Option<u16> {
        let at = input.0.checked_sub(self.first_input()).filter(|at| *at < INPUTS_PER_MODULE)?;
        Some(FIRST_INPUT >> at)
    }

    fn first_input(self) -> u16 {
        u16::from(self.module).saturating_sub(1) * INPUTS_PER_MODULE
    }
}

/// Reads the whole reply to a request, a state for each module in the order in which they came.
///
/// # Errors
///
/// When the reply is shorter or longer than what was asked for. The request must then be said again, after a
/// pause in which the line falls silent.
pub fn decode_reply(request: Message, reply: &[u8]) -> Result<impl Iterator<Item = ModuleState>, ReplyError> {
    let modules = request.modules_read();
    let expected = modules.clone().count() * BYTES_PER_MODULE;
    if reply.len() != expected {
        return Err(ReplyError::Length { expected, found: reply.len() });
    }
    let (pairs, _) = reply.as_chunks::<BYTES_PER_MODULE>();
    Ok(modules.zip(pairs).map(|(module, &pair)| ModuleState::decode(module, pair)))
}

impl Display for ReplyError {
    fn fmt(&self, f: &mut Formatter<'_>) -> FmtResult {
        match self {
            Self::Length { expected, found } => {
                write!(
                    f,
                    "a sensor reply of {found} bytes where {expected} were asked for; drop it and ask again"
                )
            }
        }
    }
}

impl core::error::Error for ReplyError {}

#[cfg(test)]
mod tests {
    extern crate alloc;
    use alloc::vec::Vec;

    use super::*;

    #[test]
    fn the_first_input_is_the_highest_bit() {
        let state = ModuleState::decode(1, [0b1000_0000, 0b0000_0001]);
        assert_eq!(state.closed().collect::<Vec<_>>(), [SensorId(0), SensorId(15)]);
    }

    #[test]
    fn inputs_of_another_module_do_not_count() {
        let state = ModuleState::with_closed(2, [SensorId(15), SensorId(16), SensorId(32)]);
        assert_eq!(state.closed().collect::<Vec<_>>(), [SensorId(16)]);
    }

    #[test]
    fn a_short_reply_is_refused_whole() {
        let refused = decode_reply(Message::ReadModules { count: 5 }, &[0; 9]).err();
        assert_eq!(refused, Some(ReplyError::Length { expected: 10, found: 9 }));
        assert!(decode_reply(Message::Go, &[]).is_ok_and(|mut states| states.next().is_none()));
    }
}
