//! What every link can do, and what is heard of it.

use footplate_core::{TimeSpan, Timestamp};

/// How often people are asked for what they want while nothing else happens (ms): twice as often as a browser is shown a
/// picture, so that fifty a second come out.
pub(super) const PERSON_MS: f64 = 10.0;

/// A line to a command station and the clock beside it.
pub(crate) trait Link {
    /// The time, since the line was opened. On a simulated station it is the station's time.
    fn now(&self) -> Timestamp;

    /// Puts bytes on the line now, in one piece.
    fn write(&mut self, bytes: &[u8]) -> Result<(), Lost>;

    /// Waits until something is heard, but not beyond a time.
    fn wait(&mut self, until: Timestamp) -> Heard;

    /// The station's hand-shake line; `None` where there is none that could be read.
    fn cts(&self) -> Option<bool>;

    /// For how long at most [`wait`](Self::wait) should be called while a person may want something.
    fn patience(&self) -> TimeSpan;

    /// Tries to open a lost line again.
    fn reopen(&mut self) -> Result<(), Lost>;
}

/// What came first while waiting.
#[derive(Debug)]
pub(crate) enum Heard {
    /// A byte from the station.
    Byte(u8),
    /// A whole datagram from the station.
    Datagram(Vec<u8>),
    /// The hand-shake line is up or down now.
    Cts(bool),
    /// Nothing, and the time has come.
    Nothing,
    /// The line is gone.
    Lost(Lost),
}

/// A line that is gone: what a person should look at.
#[derive(Debug, Clone)]
pub(crate) struct Lost(pub(crate) String);

impl std::fmt::Display for Lost {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for Lost {}

impl<L: Link + ?Sized> Link for Box<L> {
    fn now(&self) -> Timestamp {
        (**self).now()
    }
    fn write(&mut self, bytes: &[u8]) -> Result<(), Lost> {
        (**self).write(bytes)
    }
    fn wait(&mut self, until: Timestamp) -> Heard {
        (**self).wait(until)
    }
    fn cts(&self) -> Option<bool> {
        (**self).cts()
    }
    fn patience(&self) -> TimeSpan {
        (**self).patience()
    }
    fn reopen(&mut self) -> Result<(), Lost> {
        (**self).reopen()
    }
}

impl<L: Link + ?Sized> Link for &mut L {
    fn now(&self) -> Timestamp {
        (**self).now()
    }
    fn write(&mut self, bytes: &[u8]) -> Result<(), Lost> {
        (**self).write(bytes)
    }
    fn wait(&mut self, until: Timestamp) -> Heard {
        (**self).wait(until)
    }
    fn cts(&self) -> Option<bool> {
        (**self).cts()
    }
    fn patience(&self) -> TimeSpan {
        (**self).patience()
    }
    fn reopen(&mut self) -> Result<(), Lost> {
        (**self).reopen()
    }
}
