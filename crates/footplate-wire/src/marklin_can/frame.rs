//! One frame of the bus: a 29-bit identifier and up to eight bytes, as 13 bytes on a network and as text of a serial adapter.
//!
//! ```text
//! identifier   28..25 priority, 24..17 command, 16 response, 15..0 hash of the sender
//! network      identifier (4, big endian), length (1), data (8, padded with zeros)
//! adapter      T, identifier (8 hexadecimal digits), length (1 digit), data (2 digits a byte), carriage return
//! ```

use alloc::string::String;
use core::fmt::Write;

/// The bytes of a frame on a network.
pub const FRAME_BYTES: usize = 13;

/// The most data that a frame carries.
pub const MOST_DATA: usize = 8;

/// The identifier has 29 bits.
const HIGHEST_IDENTIFIER: u32 = 0x1FFF_FFFF;

/// What the text of a frame begins with at an adapter: data under an identifier of 29 bits.
const TEXT_BEGINS: &str = "T";

/// The data of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Payload {
    length: u8,
    bytes: [u8; MOST_DATA],
}

impl Payload {
    /// Up to eight bytes; `None` if there are more.
    pub fn of(data: &[u8]) -> Option<Self> {
        let mut bytes = [0; MOST_DATA];
        bytes.get_mut(..data.len())?.copy_from_slice(data);
        Some(Self { length: u8::try_from(data.len()).ok()?, bytes })
    }

    /// The bytes.
    pub fn as_slice(&self) -> &[u8] {
        self.bytes.get(..usize::from(self.length)).unwrap_or_default()
    }
}

/// A frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Frame {
    /// From 0, the highest, to 15.
    pub priority: u8,
    /// What it is about.
    pub command: u8,
    /// Whether it answers or reports; otherwise it asks or commands.
    pub is_response: bool,
    /// The hash of the sender. Real stations send others than the published formula yields, and streams of data number their
    /// packets with it, so nothing is concluded from it but which frames are one's own.
    pub hash: u16,
    /// Its data.
    pub data: Payload,
}

impl Frame {
    /// The identifier of 29 bits.
    pub const fn identifier(&self) -> u32 {
        ((self.priority & 0x0F) as u32) << 25
            | (self.command as u32) << 17
            | (self.is_response as u32) << 16
            | self.hash as u32
    }

    /// A frame of an identifier; `None` if that has more than 29 bits.
    pub fn with_identifier(identifier: u32, data: Payload) -> Option<Self> {
        let [top, second, high, low] = identifier.to_be_bytes();
        (identifier <= HIGHEST_IDENTIFIER).then_some(Self {
            priority: top >> 1,
            command: top << 7 | second >> 1,
            is_response: second & 1 != 0,
            hash: u16::from_be_bytes([high, low]),
            data,
        })
    }

    /// The bytes on a network.
    pub const fn encode(&self) -> [u8; FRAME_BYTES] {
        let [i0, i1, i2, i3] = self.identifier().to_be_bytes();
        let [d0, d1, d2, d3, d4, d5, d6, d7] = self.data.bytes;
        [i0, i1, i2, i3, self.data.length, d0, d1, d2, d3, d4, d5, d6, d7]
    }

    /// Reads what [`encode`](Self::encode) writes; `None` for an identifier or a length that no frame has. What pads the data is
    /// not looked at.
    pub fn decode(bytes: [u8; FRAME_BYTES]) -> Option<Self> {
        let [i0, i1, i2, i3, length, data @ ..] = bytes;
        let data = Payload::of(data.get(..usize::from(length))?)?;
        Self::with_identifier(u32::from_be_bytes([i0, i1, i2, i3]), data)
    }

    /// The text that an adapter is written, without the carriage return.
    pub fn to_text(&self) -> String {
        let mut text = String::from(TEXT_BEGINS);
        let data = self.data.as_slice();
        // Writing to a text does not fail.
        let _ = write!(text, "{:08X}{}", self.identifier(), data.len());
        for byte in data {
            let _ = write!(text, "{byte:02X}");
        }
        text
    }

    /// Reads a line of an adapter, without the carriage return. A time stamp of four digits may follow the data.
    pub fn of_text(line: &str) -> Option<Self> {
        let rest = line.strip_prefix(TEXT_BEGINS)?;
        let (identifier, rest) = rest.split_at_checked(8)?;
        let (length, rest) = rest.split_at_checked(1)?;
        let length: usize = length.parse().ok().filter(|length| *length <= MOST_DATA)?;
        let (digits, stamp) = rest.split_at_checked(2 * length)?;
        let is_hexadecimal = |text: &str| text.bytes().all(|byte| byte.is_ascii_hexdigit());
        if !matches!(stamp.len(), 0 | 4) || ![identifier, digits, stamp].into_iter().all(is_hexadecimal) {
            return None;
        }
        let mut data = [0; MOST_DATA];
        for (place, byte) in data.iter_mut().zip(0..length) {
            *place = u8::from_str_radix(digits.get(2 * byte..2 * byte + 2)?, 16).ok()?;
        }
        Self::with_identifier(u32::from_str_radix(identifier, 16).ok()?, Payload::of(data.get(..length)?)?)
    }
}

/// The hash that a participant with a number puts into its frames: both halves of the number combined, with bits 8 and 9 set and bit 7 left out.
pub const fn hash_of(uid: u32) -> u16 {
    let combined = ((uid >> 16) ^ (uid & 0xFFFF)) as u16;
    ((combined << 3) & 0xFF00) | 0x0300 | (combined & 0x7F)
}
