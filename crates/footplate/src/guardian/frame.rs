//! Frames between a guardian and its child: a letter, a length and a payload.

use std::io::{ErrorKind, Read, Result, Write};
use std::os::unix::net::UnixStream;
use std::time::Duration;

use rustix::event::{PollFd, PollFlags, Timespec, poll};

/// The longest payload. A last will of fifty trains is a tenth of it.
pub(super) const MOST_BYTES: usize = 60_000;
const HEADER: usize = 3;

/// What a frame is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub(super) enum Kind {
    /// Child: open the line, or open it again.
    Open = b'o',
    /// Child: write these bytes to the line in one piece.
    Write = b'w',
    /// Child: the last will, which the guardian sends if the child dies (`runtime/last_will.rs`).
    Will = b'l',
    /// Child: heartbeat. One byte: whether a train is commanded to run.
    Alive = b'a',
    /// Child: no train is left to stop.
    Goodbye = b'g',
    /// Guardian: the line is open. One byte: state of the handshake line.
    Opened = b'O',
    /// Guardian: answer to a heartbeat.
    Here = b'A',
    /// Guardian: bytes from the station; one datagram where it sends datagrams.
    Heard = b'H',
    /// Guardian: the handshake line is up (1) or down (0).
    Cts = b'C',
    /// Guardian: the line is lost or cannot be opened; the reason as text.
    Lost = b'L',
}

impl Kind {
    const ALL: [Self; 10] = [
        Self::Open,
        Self::Write,
        Self::Will,
        Self::Alive,
        Self::Goodbye,
        Self::Opened,
        Self::Here,
        Self::Heard,
        Self::Cts,
        Self::Lost,
    ];

    fn of(letter: u8) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| *kind as u8 == letter)
    }
}

/// Encodes the state of the handshake line.
pub(super) const fn cts_byte(cts: Option<bool>) -> u8 {
    match cts {
        None => 2,
        Some(up) => up as u8,
    }
}

/// Decodes the state of the handshake line.
pub(super) const fn cts_of(byte: u8) -> Option<bool> {
    match byte {
        0 => Some(false),
        1 => Some(true),
        _ => None,
    }
}

/// Writes frames. Its buffer keeps the size of the longest frame.
#[derive(Debug)]
pub(super) struct FrameWriter {
    stream: UnixStream,
    bytes: Vec<u8>,
}

impl FrameWriter {
    pub(super) fn new(stream: UnixStream) -> Self {
        Self { stream, bytes: Vec::with_capacity(HEADER + 256) }
    }

    /// # Errors
    /// The peer has closed, or the payload is too long.
    pub(super) fn send(&mut self, kind: Kind, payload: &[u8]) -> Result<()> {
        let length = u16::try_from(payload.len()).ok().filter(|length| usize::from(*length) <= MOST_BYTES);
        let length = length.ok_or(ErrorKind::InvalidInput)?;
        self.bytes.clear();
        self.bytes.push(kind as u8);
        self.bytes.extend_from_slice(&length.to_le_bytes());
        self.bytes.extend_from_slice(payload);
        self.stream.write_all(&self.bytes)
    }
}

/// Reads frames into a buffer of fixed size.
#[derive(Debug)]
pub(super) struct FrameReader {
    stream: UnixStream,
    bytes: Box<[u8]>,
    /// Bytes that were read and not returned yet are in `begin..end`.
    begin: usize,
    end: usize,
}

impl FrameReader {
    pub(super) fn new(stream: UnixStream) -> Self {
        Self { stream, bytes: vec![0; HEADER + MOST_BYTES].into(), begin: 0, end: 0 }
    }

    /// Returns the next frame; `None` after `within`. Without a time it waits for ever.
    ///
    /// # Errors
    /// The peer has closed, or sent something that is not a frame.
    pub(super) fn next(&mut self, within: Option<Duration>) -> Result<Option<(Kind, &[u8])>> {
        loop {
            if let Some(length) = self.whole()? {
                let at = self.begin;
                self.begin += length;
                let frame = self.bytes.get(at..at + length).unwrap_or_default();
                let (Some(kind), Some(payload)) = (frame.first(), frame.get(HEADER..)) else {
                    return Err(ErrorKind::InvalidData.into());
                };
                let kind = Kind::of(*kind).ok_or(ErrorKind::InvalidData)?;
                return Ok(Some((kind, payload)));
            }
            if !is_readable(&self.stream, within)? {
                return Ok(None);
            }
            self.bytes.copy_within(self.begin..self.end, 0);
            (self.begin, self.end) = (0, self.end - self.begin);
            let free = self.bytes.get_mut(self.end..).unwrap_or_default();
            match self.stream.read(free) {
                Ok(0) => return Err(ErrorKind::UnexpectedEof.into()),
                Ok(count) => self.end += count,
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) => return Err(error),
            }
        }
    }

    /// Length of the first frame, once it has arrived completely.
    fn whole(&self) -> Result<Option<usize>> {
        let come = self.bytes.get(self.begin..self.end).unwrap_or_default();
        let [_, low, high, ..] = come else { return Ok(None) };
        let length = usize::from(u16::from_le_bytes([*low, *high]));
        if length > MOST_BYTES {
            return Err(ErrorKind::InvalidData.into());
        }
        Ok((come.len() >= HEADER + length).then_some(HEADER + length))
    }
}

/// Waits until the stream is readable, with a resolution below a millisecond. Returns whether it is.
fn is_readable(stream: &UnixStream, within: Option<Duration>) -> Result<bool> {
    let limit = within.map(|within| Timespec {
        tv_sec: within.as_secs().try_into().unwrap_or(i64::MAX),
        tv_nsec: within.subsec_nanos().into(),
    });
    match poll(&mut [PollFd::new(stream, PollFlags::IN)], limit.as_ref()) {
        Ok(count) => Ok(count > 0),
        // The caller checks the clock again.
        Err(rustix::io::Errno::INTR) => Ok(false),
        Err(error) => Err(error.into()),
    }
}

/// Reads bytes as frames, up to the first that is none, and writes what it read again, for the fuzzer.
///
/// # Errors
/// There are no sockets, or a frame that was read cannot be written.
pub(crate) fn read_fuzzed(bytes: &[u8]) -> Result<Vec<u8>> {
    let (mut here, there) = UnixStream::pair()?;
    here.write_all(bytes)?;
    drop(here);
    let mut reader = FrameReader::new(there);
    let mut again = Vec::new();
    while let Ok(Some((kind, payload))) = reader.next(None) {
        again.push(kind as u8);
        again.extend(u16::try_from(payload.len()).map_err(|_| ErrorKind::InvalidData)?.to_le_bytes());
        again.extend_from_slice(payload);
    }
    Ok(again)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_come_as_they_were_sent_however_they_are_cut() {
        let (here, there) = UnixStream::pair().expect("a pair of sockets");
        let mut raw = here.try_clone().expect("a handle");
        let mut writer = FrameWriter::new(here);
        let mut reader = FrameReader::new(there);
        let now = Some(Duration::ZERO);
        for length in [0, 1, 2, 255, 256, 5_000, MOST_BYTES] {
            let payload: Vec<u8> = (0..length).map(|at| (at % 251) as u8).collect();
            writer.send(Kind::Will, &payload).expect("sent");
            writer.send(Kind::Alive, &[1]).expect("sent");
            assert_eq!(reader.next(None).expect("a frame"), Some((Kind::Will, &payload[..])));
            assert_eq!(reader.next(None).expect("a frame"), Some((Kind::Alive, &[1][..])));
            assert_eq!(reader.next(now).expect("nothing yet"), None);
        }
        assert!(writer.send(Kind::Will, &[0; MOST_BYTES + 1]).is_err());
        raw.write_all(&[b'w', 2]).expect("sent");
        assert_eq!(reader.next(now).expect("half a frame"), None);
        raw.write_all(&[0, 7, 8]).expect("sent");
        assert_eq!(reader.next(now).expect("a frame"), Some((Kind::Write, &[7, 8][..])));
        // What is no frame ends the connection.
        raw.write_all(b"?\0\0").expect("sent");
        assert!(reader.next(now).is_err());
    }

    #[test]
    fn the_end_of_the_other_side_is_an_error() {
        let (here, there) = UnixStream::pair().expect("a pair of sockets");
        let mut reader = FrameReader::new(there);
        drop(here);
        assert!(reader.next(None).is_err());
    }
}
