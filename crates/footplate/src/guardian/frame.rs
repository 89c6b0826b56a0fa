//! Frames between a guardian and its child: a letter, a length and a payload.

use std::io::{ErrorKind, Result};

/// The longest payload. A last will of fifty trains is a tenth of it.
pub(super) const MOST_BYTES: usize = 60_000;
const HEADER: usize = 3;

/// What one of the two sends to the other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Frame<'b> {
    /// Child: open the line, or open it again.
    Open,
    /// Child: write these bytes to the line in one piece.
    Write(&'b [u8]),
    /// Child: the last will, which the guardian sends if the child dies (`runtime/last_will.rs`).
    Will(&'b [u8]),
    /// Child: heartbeat, and whether a train is commanded to run.
    Alive { runs: bool },
    /// Child: no train is left to stop.
    Goodbye,
    /// Guardian: the line is open, with this state of the handshake line.
    Opened { cts: Option<bool> },
    /// Guardian: the line cannot be opened; the reason.
    NotOpened(&'b str),
    /// Guardian: answer to a heartbeat.
    Here,
    /// Guardian: bytes from the station; one datagram where it sends datagrams.
    Heard(&'b [u8]),
    /// Guardian: the handshake line is up or down.
    Cts(bool),
    /// Guardian: the line is lost; the reason.
    Lost(&'b str),
}

impl<'b> Frame<'b> {
    /// Letter and payload.
    const fn parts(&self) -> (u8, &'b [u8]) {
        match *self {
            Self::Open => (b'o', &[]),
            Self::Write(bytes) => (b'w', bytes),
            Self::Will(bytes) => (b'l', bytes),
            Self::Alive { runs: false } => (b'a', &[0]),
            Self::Alive { runs: true } => (b'a', &[1]),
            Self::Goodbye => (b'g', &[]),
            Self::Opened { cts: Some(false) } => (b'O', &[0]),
            Self::Opened { cts: Some(true) } => (b'O', &[1]),
            Self::Opened { cts: None } => (b'O', &[2]),
            Self::NotOpened(why) => (b'N', why.as_bytes()),
            Self::Here => (b'A', &[]),
            Self::Heard(bytes) => (b'H', bytes),
            Self::Cts(false) => (b'C', &[0]),
            Self::Cts(true) => (b'C', &[1]),
            Self::Lost(why) => (b'L', why.as_bytes()),
        }
    }

    /// The frame of a letter and a payload, if they are one.
    fn of(letter: u8, payload: &'b [u8]) -> Option<Self> {
        let why = || std::str::from_utf8(payload).ok();
        Some(match (letter, payload) {
            (b'o', []) => Self::Open,
            (b'w', bytes) => Self::Write(bytes),
            (b'l', bytes) => Self::Will(bytes),
            (b'a', [runs @ (0 | 1)]) => Self::Alive { runs: *runs == 1 },
            (b'g', []) => Self::Goodbye,
            (b'O', [cts @ (0 | 1)]) => Self::Opened { cts: Some(*cts == 1) },
            (b'O', [2]) => Self::Opened { cts: None },
            (b'N', _) => Self::NotOpened(why()?),
            (b'A', []) => Self::Here,
            (b'H', bytes) => Self::Heard(bytes),
            (b'C', [up @ (0 | 1)]) => Self::Cts(*up == 1),
            (b'L', _) => Self::Lost(why()?),
            _ => return None,
        })
    }

    /// Encodes it into a buffer, in place of what the buffer held.
    ///
    /// # Errors
    /// The payload is too long.
    pub(crate) fn encode(&self, bytes: &mut Vec<u8>) -> Result<()> {
        let (letter, payload) = self.parts();
        let length = u16::try_from(payload.len()).ok().filter(|length| usize::from(*length) <= MOST_BYTES);
        let [low, high] = length.ok_or(ErrorKind::InvalidInput)?.to_le_bytes();
        bytes.clear();
        bytes.extend([letter, low, high]);
        bytes.extend_from_slice(payload);
        Ok(())
    }
}

/// Joins the pieces in which frames arrive, in a buffer of fixed size.
#[derive(Debug)]
pub(crate) struct FrameBuffer {
    bytes: Box<[u8]>,
    /// Bytes that have arrived and were not returned yet are in `begin..end`.
    begin: usize,
    end: usize,
}

impl FrameBuffer {
    pub(crate) fn new() -> Self {
        Self { bytes: vec![0; HEADER + MOST_BYTES].into(), begin: 0, end: 0 }
    }

    /// Where the next bytes go. There is room for the rest of the first frame.
    pub(crate) fn space(&mut self) -> &mut [u8] {
        self.bytes.copy_within(self.begin..self.end, 0);
        (self.begin, self.end) = (0, self.end - self.begin);
        self.bytes.get_mut(self.end..).unwrap_or_default()
    }

    /// So many bytes were put into that space.
    pub(crate) const fn arrived(&mut self, count: usize) {
        self.end += count;
    }

    /// Whether a whole frame has arrived.
    ///
    /// # Errors
    /// What has arrived is no frame.
    pub(crate) fn has_frame(&self) -> Result<bool> {
        Ok(self.whole()?.is_some())
    }

    /// The next frame, if it has arrived completely.
    ///
    /// # Errors
    /// What has arrived is no frame.
    pub(crate) fn next(&mut self) -> Result<Option<Frame<'_>>> {
        let Some(length) = self.whole()? else { return Ok(None) };
        let at = self.begin;
        self.begin += length;
        let [letter, _, _, payload @ ..] = self.bytes.get(at..at + length).unwrap_or_default() else {
            return Err(ErrorKind::InvalidData.into());
        };
        Ok(Some(Frame::of(*letter, payload).ok_or(ErrorKind::InvalidData)?))
    }

    /// Length of the first frame, once it has arrived completely.
    fn whole(&self) -> Result<Option<usize>> {
        let arrived = self.bytes.get(self.begin..self.end).unwrap_or_default();
        let [_, low, high, ..] = arrived else { return Ok(None) };
        let length = usize::from(u16::from_le_bytes([*low, *high]));
        if length > MOST_BYTES {
            return Err(ErrorKind::InvalidData.into());
        }
        Ok((arrived.len() >= HEADER + length).then_some(HEADER + length))
    }
}

/// Reads bytes as frames, up to the first that is none, and encodes again what it read, for the fuzzer.
///
/// # Errors
/// A frame that was read cannot be encoded.
pub(crate) fn read_fuzzed(mut bytes: &[u8]) -> Result<Vec<u8>> {
    let (mut frames, mut again, mut one) = (FrameBuffer::new(), Vec::new(), Vec::new());
    loop {
        while let Ok(true) = frames.has_frame() {
            let Ok(Some(frame)) = frames.next() else { return Ok(again) };
            frame.encode(&mut one)?;
            again.append(&mut one);
        }
        let space = frames.space();
        let count = bytes.len().min(space.len());
        if count == 0 {
            return Ok(again);
        }
        let (next, rest) = bytes.split_at(count);
        space[..count].copy_from_slice(next);
        frames.arrived(count);
        bytes = rest;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_arrive_as_they_were_sent_however_they_are_cut() {
        let payload: Vec<u8> = (0..MOST_BYTES).map(|at| (at % 251) as u8).collect();
        let all = [
            Frame::Open,
            Frame::Write(&payload[..1]),
            Frame::Will(&payload),
            Frame::Will(&[]),
            Frame::Alive { runs: false },
            Frame::Alive { runs: true },
            Frame::Goodbye,
            Frame::Opened { cts: None },
            Frame::Opened { cts: Some(false) },
            Frame::Opened { cts: Some(true) },
            Frame::NotOpened("no such port"),
            Frame::Here,
            Frame::Heard(&payload[..5_000]),
            Frame::Cts(false),
            Frame::Cts(true),
            Frame::Lost("it is gone"),
        ];
        for piece in [1, 2, 3, 7, 255, 4_096, HEADER + MOST_BYTES] {
            let (mut frames, mut encoded) = (FrameBuffer::new(), Vec::new());
            for frame in &all {
                frame.encode(&mut encoded).expect("a frame");
                for part in encoded.chunks(piece) {
                    assert!(!frames.has_frame().expect("a frame"), "{frame:?} in pieces of {piece}");
                    frames.space()[..part.len()].copy_from_slice(part);
                    frames.arrived(part.len());
                }
                assert_eq!(frames.next().expect("a frame"), Some(*frame));
            }
            assert_eq!(frames.next().expect("no more"), None);
        }
        let too_long = vec![0; MOST_BYTES + 1];
        assert!(Frame::Write(&too_long).encode(&mut Vec::new()).is_err());
    }

    #[test]
    fn what_is_no_frame_is_an_error() {
        // A letter, a length, and payloads that no such frame has.
        let none: [&[u8]; 8] = [
            b"?\0\0",
            &[b'w', 0xff, 0xff],
            &[b'o', 1, 0, 0],
            &[b'a', 0, 0],
            &[b'a', 1, 0, 2],
            &[b'O', 1, 0, 3],
            &[b'C', 2, 0, 1, 1],
            &[b'L', 1, 0, 0xff],
        ];
        for bytes in none {
            let mut frames = FrameBuffer::new();
            frames.space()[..bytes.len()].copy_from_slice(bytes);
            frames.arrived(bytes.len());
            assert!(frames.next().is_err(), "{bytes:?}");
        }
    }
}
