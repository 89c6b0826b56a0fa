//! What every link can do, and what is heard of it.

use std::ops::DerefMut;
use std::time::Duration;

use footplate_core::{TimeSpan, Timestamp};

/// How often people are asked for what they want while nothing else happens (ms): twice as often as a browser is shown a
/// picture, so that fifty a second come out.
pub(crate) const PERSON_MS: f64 = 10.0;

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

    /// Whether the other end may be gone without notice, as that of a connection whose cable was pulled. A station that falls silent
    /// on such a line is looked for over a new one.
    fn may_be_half_open(&self) -> bool {
        false
    }

    /// Real time, since some moment before: how long a person has waited. In a world that is simulated with the program itself,
    /// the time of that world.
    fn real_time(&self) -> Duration;

    /// Lets so much of it pass.
    fn pause(&mut self, span: Duration) {
        std::thread::sleep(span);
    }

    /// The guardian of this line, where another process holds it and stops the trains if this one dies.
    fn guardian(&mut self) -> Option<&mut dyn Guardian> {
        None
    }

    /// Whether the guardian of this line has failed, so that only this process is left to stop trains.
    fn is_without_guardian(&self) -> bool {
        false
    }
}

/// A process that holds the line, seen from the one that drives trains.
pub(crate) trait Guardian {
    /// What is to be said to the station if this program dies, in place of what was said of that before.
    fn bequeath(&mut self, will: &[Bequest]) -> Result<(), Lost>;

    /// Whether a train has been commanded to run: then a program that falls silent is as good as dead.
    fn note_running(&mut self, runs: bool) -> Result<(), Lost>;

    /// All is said: there is nothing left to stop.
    ///
    /// # Errors
    /// The guardian has not put on the line all that was said: the stops must be said again.
    fn say_goodbye(&mut self) -> Result<(), Lost>;
}

/// One part of what is said to a station after the death of a program.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Bequest {
    /// How long to wait before, by the station's clock.
    pub(crate) after: TimeSpan,
    /// What is put on the line then, in one piece.
    pub(crate) bytes: Vec<u8>,
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

/// The methods of a [`Link`] that one around another passes on, all but what is said and heard.
macro_rules! passes_on {
    ($self:ident, $link:expr) => {
        fn now(&$self) -> footplate_core::Timestamp {
            $link.now()
        }
        fn cts(&$self) -> Option<bool> {
            $link.cts()
        }
        fn patience(&$self) -> footplate_core::TimeSpan {
            $link.patience()
        }
        fn reopen(&mut $self) -> Result<(), $crate::link::Lost> {
            $link.reopen()
        }
        fn may_be_half_open(&$self) -> bool {
            $link.may_be_half_open()
        }
        fn real_time(&$self) -> std::time::Duration {
            $link.real_time()
        }
        fn pause(&mut $self, span: std::time::Duration) {
            $link.pause(span);
        }
        fn guardian(&mut $self) -> Option<&mut dyn $crate::link::Guardian> {
            $link.guardian()
        }
        fn is_without_guardian(&$self) -> bool {
            $link.is_without_guardian()
        }
    };
}
pub(super) use passes_on;

/// A link that is owned or borrowed elsewhere.
impl<L: DerefMut<Target: Link>> Link for L {
    passes_on!(self, (**self));

    fn write(&mut self, bytes: &[u8]) -> Result<(), Lost> {
        (**self).write(bytes)
    }
    fn wait(&mut self, until: Timestamp) -> Heard {
        (**self).wait(until)
    }
}
