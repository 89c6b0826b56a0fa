//! Finds frames in a stream, whatever portions it arrives in.

use alloc::vec::Vec;

use super::frame::{FRAME_BYTES, Frame, MOST_DATA};
use super::settings::Transport;

/// The longest line of an adapter: a frame with eight bytes and a time stamp.
pub const LONGEST_LINE: usize = 1 + 8 + 1 + 2 * MOST_DATA + 4;

/// What an adapter ends its lines with.
const END_OF_LINE: u8 = b'\r';
/// The answer of an adapter that refuses a line.
const REFUSED: u8 = 0x07;

/// Cuts what arrives into frames; memory is bounded.
#[derive(Debug, Clone)]
pub struct Framing {
    transport: Transport,
    held: Vec<u8>,
    unread: usize,
    refused: usize,
}

impl Framing {
    /// Nothing has arrived yet.
    pub const fn new(transport: Transport) -> Self {
        Self { transport, held: Vec::new(), unread: 0, refused: 0 }
    }

    /// Takes the next byte; returns the frame that it completes.
    pub fn push(&mut self, byte: u8) -> Option<Frame> {
        match self.transport {
            Transport::Network => self.push_to_frame(byte),
            Transport::Adapter => self.push_to_line(byte),
        }
    }

    /// The bytes since the last call that belong to no frame.
    pub const fn take_unread(&mut self) -> usize {
        core::mem::replace(&mut self.unread, 0)
    }

    /// How often an adapter has refused a line since the last call.
    pub const fn take_refused(&mut self) -> usize {
        core::mem::replace(&mut self.refused, 0)
    }

    /// What has begun will not go on: the rest of a datagram, or what came before a pause.
    pub fn give_up(&mut self) {
        self.unread = self.unread.saturating_add(self.held.len());
        self.held.clear();
    }

    fn push_to_frame(&mut self, byte: u8) -> Option<Frame> {
        self.held.push(byte);
        // What cannot begin a frame is dropped byte by byte until the rest can.
        while !self.may_begin() {
            self.held.remove(0);
            self.unread = self.unread.saturating_add(1);
        }
        let whole = <[u8; FRAME_BYTES]>::try_from(self.held.as_slice()).ok()?;
        self.held.clear();
        let frame = Frame::decode(whole);
        self.unread = self.unread.saturating_add(if frame.is_none() { FRAME_BYTES } else { 0 });
        frame
    }

    /// Whether what is held may be the beginning of a frame, by the identifier's highest bits and the length.
    fn may_begin(&self) -> bool {
        let identifier = self.held.first().is_none_or(|top| top >> 5 == 0);
        let length = self.held.get(4).is_none_or(|length| usize::from(*length) <= MOST_DATA);
        identifier && length
    }

    fn push_to_line(&mut self, byte: u8) -> Option<Frame> {
        match byte {
            END_OF_LINE => {
                let line = core::str::from_utf8(&self.held).unwrap_or("\u{fffd}");
                let frame = Frame::of_text(line);
                // Confirmations, answers to questions for a version, and frames of another kind.
                let is_other =
                    line.is_empty() || line.starts_with(['z', 'Z', 'V', 'v', 'N', 'F', 't', 'r', 'R']);
                if frame.is_some() || is_other {
                    self.held.clear();
                } else {
                    self.give_up();
                }
                frame
            }
            REFUSED => {
                self.give_up();
                self.refused = self.refused.saturating_add(1);
                None
            }
            _ => {
                if self.held.len() >= LONGEST_LINE {
                    self.give_up();
                }
                self.held.push(byte);
                None
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(transport: Transport, bytes: &[u8]) -> (Vec<Frame>, usize) {
        let mut framing = Framing::new(transport);
        let frames = bytes.iter().filter_map(|byte| framing.push(*byte)).collect();
        (frames, framing.take_unread())
    }

    /// Speed 500 for the DCC locomotive 24.
    const SPEED: [u8; FRAME_BYTES] = [0, 8, 3, 0, 6, 0, 0, 0xC0, 0x18, 1, 0xF4, 0, 0];

    #[test]
    fn frames_are_found_behind_what_is_none() {
        let noise = [0xFF, 0xE0, 0x9A];
        let bytes: Vec<u8> = noise.into_iter().chain(SPEED).chain(SPEED).collect();
        let (frames, unread) = read(Transport::Network, &bytes);
        assert_eq!((frames.len(), unread), (2, 3));
        assert_eq!(frames.first(), Frame::decode(SPEED).as_ref());
    }

    #[test]
    fn lines_are_found_between_confirmations_and_refusals() {
        let text = Frame::decode(SPEED).map(|frame| frame.to_text()).unwrap_or_default();
        assert_eq!(text, "T0008030060000C01801F4");
        let line = alloc::format!("\rV1013\r\x07z\r{text}\rt1230\r{text}1A2B\rTnoise\r");
        let (frames, unread) = read(Transport::Adapter, line.as_bytes());
        assert_eq!((frames.len(), unread), (2, 6));
        assert_eq!(frames.first(), frames.last());
    }

    #[test]
    fn a_line_without_an_end_is_given_up() {
        let (frames, unread) = read(Transport::Adapter, &[b'x'; 1_000]);
        assert!(frames.is_empty() && unread > 900, "{unread}");
    }
}
