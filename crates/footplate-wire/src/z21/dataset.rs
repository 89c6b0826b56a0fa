//! The envelope: a datagram holds datasets, each with its length, a header and its data.
//!
//! ```text
//! 0..1  length, little endian, of the whole dataset
//! 2..3  header, little endian
//! 4..   data; under header 0x40 an X-BUS message, whose last byte is the XOR of those before it
//! ```

use alloc::vec::Vec;

/// The most that a datagram holds without being cut into parts on an Ethernet.
pub const LONGEST_DATAGRAM: usize = 1472;

/// Length and header.
const HEAD: usize = 4;

/// The header of X-BUS messages.
pub(super) const X_BUS: u16 = 0x40;

/// One dataset.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Dataset<'d> {
    /// What kind it is.
    pub header: u16,
    /// What follows the header.
    pub data: &'d [u8],
}

impl<'d> Dataset<'d> {
    /// An X-BUS message without its XOR byte, if this is one. Whether that byte is right is not looked at: a hand-set of the
    /// makers and a widespread program send wrong ones.
    pub fn x_bus(&self) -> Option<&'d [u8]> {
        let (_, message) = self.data.split_last().filter(|(_, message)| !message.is_empty())?;
        (self.header == X_BUS).then_some(message)
    }

    /// Whether the XOR byte is right, or there is none.
    pub fn is_sound(&self) -> bool {
        self.header != X_BUS || self.data.iter().fold(0, |xor, byte| xor ^ byte) == 0
    }

    /// Its bytes, behind those that are there.
    pub(super) fn write(header: u16, data: &[u8], bytes: &mut Vec<u8>) {
        let length = u16::try_from(HEAD + data.len()).unwrap_or(u16::MAX);
        bytes.extend(length.to_le_bytes());
        bytes.extend(header.to_le_bytes());
        bytes.extend(data);
    }

    /// The bytes of an X-BUS message, with its XOR byte, behind those that are there.
    pub(super) fn write_x_bus(message: &[u8], bytes: &mut Vec<u8>) {
        let xor = message.iter().fold(0, |xor, byte| xor ^ byte);
        let data: Vec<u8> = message.iter().copied().chain([xor]).collect();
        Self::write(X_BUS, &data, bytes);
    }
}

/// The datasets of a datagram, in order, up to the first whose length cannot be true.
#[derive(Debug, Clone)]
pub struct Datasets<'d> {
    rest: &'d [u8],
}

impl<'d> Datasets<'d> {
    /// The datasets of a datagram.
    pub const fn of(datagram: &'d [u8]) -> Self {
        Self { rest: datagram }
    }

    /// Bytes that were not read: all that remain once the iterator has ended.
    pub const fn unread(&self) -> usize {
        self.rest.len()
    }
}

impl<'d> Iterator for Datasets<'d> {
    type Item = Dataset<'d>;

    fn next(&mut self) -> Option<Dataset<'d>> {
        let [low, high, header_low, header_high, ..] = *self.rest else { return None };
        let length = usize::from(u16::from_le_bytes([low, high]));
        let (whole, rest) = self.rest.split_at_checked(length)?;
        let data = whole.get(HEAD..)?;
        self.rest = rest;
        Some(Dataset { header: u16::from_le_bytes([header_low, header_high]), data })
    }
}
