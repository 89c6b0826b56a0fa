//! A socket that frames are written to and read from.

use std::io::{ErrorKind, Read, Result, Write};
use std::os::unix::net::UnixStream;

use footplate_core::TimeSpan;
use rustix::event::{PollFd, PollFlags, Timespec, poll};

use super::frame::{Frame, FrameBuffer};

/// Writes frames. Its buffer keeps the size of the longest frame.
#[derive(Debug)]
pub(super) struct FrameWriter {
    stream: UnixStream,
    bytes: Vec<u8>,
}

impl FrameWriter {
    pub(super) const fn new(stream: UnixStream) -> Self {
        Self { stream, bytes: Vec::new() }
    }

    /// # Errors
    /// The peer has closed, or the payload is too long.
    pub(super) fn send(&mut self, frame: Frame<'_>) -> Result<()> {
        frame.encode(&mut self.bytes)?;
        self.stream.write_all(&self.bytes)
    }

    #[cfg(test)]
    pub(super) fn stream(&self) -> UnixStream {
        self.stream.try_clone().expect("a handle")
    }
}

/// Reads frames.
#[derive(Debug)]
pub(super) struct FrameReader {
    stream: UnixStream,
    frames: FrameBuffer,
}

impl FrameReader {
    pub(super) fn new(stream: UnixStream) -> Self {
        Self { stream, frames: FrameBuffer::new() }
    }

    /// Returns the next frame; `None` after `within`. Without a time it waits for ever.
    ///
    /// # Errors
    /// The peer has closed, or sent something that is not a frame.
    pub(super) fn next(&mut self, within: Option<TimeSpan>) -> Result<Option<Frame<'_>>> {
        while !self.frames.has_frame()? {
            if !is_readable(&self.stream, within)? {
                return Ok(None);
            }
            match self.stream.read(self.frames.space()) {
                Ok(0) => return Err(ErrorKind::UnexpectedEof.into()),
                Ok(count) => self.frames.arrived(count),
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) => return Err(error),
            }
        }
        self.frames.next()
    }
}

/// Waits until the stream is readable, with a resolution below a millisecond. Returns whether it is.
fn is_readable(stream: &UnixStream, within: Option<TimeSpan>) -> Result<bool> {
    const NS_PER_S: i64 = 1_000_000_000;
    let limit = within.map(|within| {
        let ns = within.as_ns().max(0);
        Timespec { tv_sec: ns / NS_PER_S, tv_nsec: ns % NS_PER_S }
    });
    match poll(&mut [PollFd::new(stream, PollFlags::IN)], limit.as_ref()) {
        Ok(count) => Ok(count > 0),
        // The caller checks the clock again.
        Err(rustix::io::Errno::INTR) => Ok(false),
        Err(error) => Err(error.into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_a_frame_is_waited_for_and_what_is_none_ends_the_connection() {
        let (here, there) = UnixStream::pair().expect("a pair of sockets");
        let mut raw = here.try_clone().expect("a handle");
        let (mut writer, mut reader) = (FrameWriter::new(here), FrameReader::new(there));
        let now = Some(TimeSpan::ZERO);
        writer.send(Frame::Alive { runs: true }).expect("sent");
        raw.write_all(&[b'w', 2]).expect("sent");
        assert_eq!(reader.next(None).expect("a frame"), Some(Frame::Alive { runs: true }));
        assert_eq!(reader.next(now).expect("half a frame"), None);
        raw.write_all(&[0, 7, 8]).expect("sent");
        assert_eq!(reader.next(now).expect("a frame"), Some(Frame::Write(&[7, 8])));
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
