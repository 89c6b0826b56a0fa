//! The real connection of a child to its guardian: a socket, the clock of this computer and the guardian's process.

use std::io::Result as IoResult;
use std::os::unix::net::UnixStream;

use footplate_core::{TimeSpan, Timestamp};

use super::frame::Frame;
use super::frame_stream::{FrameReader, FrameWriter};
use super::ward::{connection, end_guardian};
use super::ward_link::{Connection, WardLink};
use crate::clock::Stopwatch;
use crate::link::{Cable, CableLink, Link, Lost};
use crate::runtime::StopFlag;
use crate::standard_error::say;

/// A connection to a guardian, and the line that this process opens without one.
pub(crate) struct WardConnection {
    cable: Cable,
    frames: FrameReader,
    guardian: FrameWriter,
    stopwatch: Stopwatch,
    own: Option<CableLink>,
}

impl WardConnection {
    /// Asks the guardian to open a line; `None` without a guardian.
    ///
    /// # Errors
    /// The line cannot be opened.
    pub(crate) fn open(cable: &Cable) -> Result<Option<WardLink<Self>>, Lost> {
        let unreached = |error| Lost(format!("cannot reach the guardian: {error}"));
        let Some(stream) = connection().map_err(unreached)? else { return Ok(None) };
        let mut link = WardLink::over(Self::over(stream, cable.clone()).map_err(unreached)?, cable.clone())?;
        link.begin();
        Ok(Some(link))
    }

    /// A connection over one end of a pair of sockets.
    pub(super) fn over(stream: UnixStream, cable: Cable) -> IoResult<Self> {
        Ok(Self {
            cable,
            frames: FrameReader::new(stream.try_clone()?),
            guardian: FrameWriter::new(stream),
            stopwatch: Stopwatch::start(),
            own: None,
        })
    }
}

impl Connection for WardConnection {
    fn now(&self) -> Timestamp {
        self.stopwatch.now()
    }

    fn send(&mut self, frame: Frame<'_>) -> IoResult<()> {
        self.guardian.send(frame)
    }

    fn receive(&mut self, within: TimeSpan) -> IoResult<Option<Frame<'_>>> {
        self.frames.next(Some(within))
    }

    fn end_guardian(&mut self) {
        end_guardian();
    }

    fn open_line(&mut self) -> Result<(), Lost> {
        self.own = Some(CableLink::open(self.cable.clone())?);
        StopFlag::raise();
        Ok(())
    }

    fn own_line(&self) -> Option<&dyn Link> {
        self.own.as_ref().map(|own| own as &dyn Link)
    }

    fn own_line_mut(&mut self) -> Option<&mut dyn Link> {
        self.own.as_mut().map(|own| own as &mut dyn Link)
    }

    fn say(&mut self, words: &str) {
        say!("{words}");
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;
    use crate::link::{Address, Guardian, Heard};

    /// The line of a child whose guardian has said this, after it opened the line.
    fn guarded(frames: &[Frame<'_>]) -> (FrameWriter, WardLink<WardConnection>) {
        let (here, there) = UnixStream::pair().expect("a pair of sockets");
        let mut guardian = FrameWriter::new(here);
        guardian.send(Frame::Opened { cts: None }).expect("sent");
        frames.iter().for_each(|frame| guardian.send(*frame).expect("sent"));
        let address: Address = "dcc-ex:/dev/ttyACM0".parse().expect("a link");
        let cable = address.cable().expect("a cable");
        let connection = WardConnection::over(there, cable.clone()).expect("a connection");
        (guardian, WardLink::over(connection, cable).expect("a guardian"))
    }

    /// What a guardian has been sent.
    fn heard_by(guardian: &FrameWriter) -> Vec<String> {
        let mut frames = FrameReader::new(guardian.stream());
        let next = || frames.next(Some(TimeSpan::ZERO)).ok()?.map(|frame| format!("{frame:?}"));
        std::iter::from_fn(next).collect()
    }

    #[test]
    fn a_program_that_pauses_says_that_it_lives() {
        let (guardian, mut link) = guarded(&[]);
        link.pause(Duration::from_millis(1));
        assert_eq!(heard_by(&guardian), ["Open", "Alive { runs: false }"]);
    }

    #[test]
    fn a_line_that_is_lost_stays_so_until_it_is_open_again() {
        let lost = Frame::Lost("the plug was pulled");
        // The guardian says so of each write.
        let (mut guardian, mut link) = guarded(&[Frame::Heard(b"7"), lost, lost, lost]);
        let until = link.now() + TimeSpan::from_ms(5_000);
        assert!(matches!(link.wait(until), Heard::Byte(b'7')));
        for _ in 0..2 {
            let Heard::Lost(lost) = link.wait(until) else { panic!("the line is lost") };
            assert_eq!(lost.0, "the plug was pulled");
        }
        assert_eq!(link.write(b"stop").expect_err("the line is lost").0, "the plug was pulled");
        guardian.send(Frame::NotOpened("no such port")).expect("sent");
        assert_eq!(link.reopen().expect_err("the line is lost").0, "no such port");
        assert_eq!(link.write(b"stop").expect_err("the line is lost").0, "no such port");
        guardian.send(Frame::Opened { cts: None }).expect("sent");
        link.reopen().expect("the line is open, whatever was said of it before");
        link.write(b"stop").expect("the line is open");
        assert!(link.now() < until, "no wait was for nothing");
    }
    #[test]
    fn a_guardian_is_released_once_it_has_taken_everything() {
        let alive = "Alive { runs: false }";
        // One that answers,
        let (guardian, mut link) = guarded(&[Frame::Heard(b"7"), Frame::Here]);
        link.say_goodbye().expect("it answers");
        assert_eq!(heard_by(&guardian), ["Open", alive, "Goodbye"]);
        // one that could not write the last stops,
        let (guardian, mut link) = guarded(&[Frame::Lost("it is gone"), Frame::Here]);
        assert_eq!(link.say_goodbye().expect_err("the line is lost").0, "it is gone");
        assert_eq!(heard_by(&guardian), ["Open", alive]);
        // and one that hangs, which is ended; then the program opens the line itself.
        let (guardian, mut link) = guarded(&[]);
        let since = link.now();
        assert!(link.say_goodbye().is_err() && Link::guardian(&mut link).is_none());
        let waited = (link.now() - since).as_ms();
        assert!((600.0..900.0).contains(&waited), "{waited}");
        assert_eq!(heard_by(&guardian), ["Open", alive]);
    }
    #[test]
    fn a_program_that_always_writes_notices_a_guardian_that_hangs() {
        let (_guardian, mut link) = guarded(&[]);
        let since = link.now();
        // A 6051 is polled every 65 ms; here more often than heartbeats come.
        let noticed = (1..100).find_map(|poll| {
            link.write(&[0x85]).err().or_else(|| match link.wait(since + TimeSpan::from_ms(20 * poll)) {
                Heard::Lost(lost) => Some(lost),
                _ => None,
            })
        });
        let waited = (link.now() - since).as_ms();
        assert!(noticed.is_some() && (600.0..900.0).contains(&waited), "{waited}: {noticed:?}");
    }
}
