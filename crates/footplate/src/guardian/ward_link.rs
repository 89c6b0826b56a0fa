//! The line as a guardian's child sees it: every byte passes through the guardian, which also receives the heartbeat.

use std::collections::VecDeque;
use std::io::{ErrorKind, Result as IoResult};
use std::os::unix::net::UnixStream;
use std::time::Duration;

use footplate_core::{TimeSpan, Timestamp};

use super::frame::{FrameReader, FrameWriter, Kind, cts_of};
use super::ward::{connection, end_guardian};
use crate::clock::Stopwatch;
use crate::link::{Bequest, Cable, CableLink, Guardian, Heard, Link, Lost, PERSON_MS};
use crate::runtime::{StopFlag, written};
use crate::standard_error::say;

/// Period of the heartbeat: a fifth of what the guardian tolerates.
const ALIVE_EVERY: Duration = Duration::from_millis(100);
/// A guardian that leaves a heartbeat unanswered for this time hangs. More than it allows its child, because its answer waits for what
/// it writes to the line; less than a second less the time that opening the line takes (requirement).
const UNANSWERED: Duration = Duration::from_millis(700);
/// A guardian opens a line within this time, or hangs: connecting and agreeing on a protocol have 2 s each at most.
const OPENED_WITHIN: Duration = Duration::from_secs(5);
/// After this time between two looks, this process itself was suspended, and perhaps its guardian with it.
const SUSPENDED: Duration = Duration::from_millis(300);

/// A line that a guardian holds.
pub(crate) struct WardLink {
    cable: Cable,
    frames: FrameReader,
    guardian: FrameWriter,
    /// Bytes of the last frame that were not returned yet.
    bytes: VecDeque<u8>,
    cts: Option<bool>,
    stopwatch: Stopwatch,
    /// Time since the last frame to the guardian.
    spoken: Stopwatch,
    /// Time since the first heartbeat that is not answered yet.
    asked: Option<Stopwatch>,
    /// Time since this process looked for an answer.
    looked: Stopwatch,
    runs: bool,
    is_orphan: bool,
    /// The line, which this process opens itself after the guardian's death.
    own: Option<CableLink>,
}

impl WardLink {
    /// Asks the guardian to open the line; `None` without a guardian.
    ///
    /// # Errors
    /// The line cannot be opened.
    pub(crate) fn open(cable: &Cable) -> Result<Option<Self>, Lost> {
        let unreached = |error| Lost(format!("cannot reach the guardian: {error}"));
        let Some(stream) = connection().map_err(unreached)? else { return Ok(None) };
        Self::over(stream.try_clone().map_err(unreached)?, stream, cable.clone()).map(Some)
    }

    /// The same over both ends of a connection to a guardian.
    pub(super) fn over(reads: UnixStream, writes: UnixStream, cable: Cable) -> Result<Self, Lost> {
        let mut link = Self {
            cable,
            frames: FrameReader::new(reads),
            guardian: FrameWriter::new(writes),
            bytes: VecDeque::new(),
            cts: None,
            stopwatch: Stopwatch::start(),
            spoken: Stopwatch::start(),
            asked: None,
            looked: Stopwatch::start(),
            runs: false,
            is_orphan: false,
            own: None,
        };
        link.have_opened()?;
        link.stopwatch = Stopwatch::start();
        Ok(link)
    }

    fn tell(&mut self, kind: Kind, bytes: &[u8]) -> Result<(), Lost> {
        if self.is_orphan {
            return Err(self.orphaned());
        }
        self.spoken = Stopwatch::start();
        if kind == Kind::Alive {
            self.asked.get_or_insert_with(Stopwatch::start);
        }
        self.guardian.send(kind, bytes).map_err(|error| self.bereft(&error))
    }

    fn bereft(&mut self, error: &std::io::Error) -> Lost {
        if error.kind() == ErrorKind::InvalidInput {
            return Lost("so much cannot be said to a guardian at once".to_owned());
        }
        self.without_guardian()
    }

    /// Ends a guardian that answers nothing, so that this process can open the line itself.
    fn silent(&mut self, waited: Duration) -> Lost {
        say!("the guardian has answered nothing for {} ms; it is ended", waited.as_millis());
        self.without_guardian()
    }

    fn without_guardian(&mut self) -> Lost {
        self.is_orphan = true;
        end_guardian();
        self.orphaned()
    }

    /// Notes that this process looks for an answer. If it was suspended, its guardian has its whole time again.
    fn look(&mut self) {
        if self.looked.elapsed() > SUSPENDED {
            self.asked = self.asked.as_ref().map(|_| Stopwatch::start());
        }
        self.looked = Stopwatch::start();
    }

    fn orphaned(&self) -> Lost {
        Lost(format!("the guardian that held `{}` has died", self.cable))
    }

    /// Asks the guardian to open the line and waits for the answer.
    fn have_opened(&mut self) -> Result<(), Lost> {
        self.tell(Kind::Open, &[])?;
        self.bytes.clear();
        let watch = Stopwatch::start();
        loop {
            let answer = match self.frames.next(Some(OPENED_WITHIN.saturating_sub(watch.elapsed()))) {
                Ok(None) if watch.elapsed() >= OPENED_WITHIN => return Err(self.silent(OPENED_WITHIN)),
                Ok(Some((Kind::Opened, payload))) => Ok(payload.first().copied().and_then(cts_of)),
                Ok(Some((Kind::Lost, why))) => Err(Lost(String::from_utf8_lossy(why).into_owned())),
                // Arrivals of an earlier opening.
                Ok(_) => continue,
                Err(error) => return Err(self.bereft(&error)),
            };
            // While it opened the line, it answered no heartbeat.
            (self.spoken, self.asked) = (Stopwatch::start(), None);
            self.cts = answer?;
            return Ok(());
        }
    }

    /// What comes first within a time.
    fn hear(&mut self, within: Duration) -> IoResult<Heard> {
        Ok(match self.frames.next(Some(within))? {
            Some((Kind::Heard, bytes)) => {
                if self.cable.has_datagrams() {
                    return Ok(Heard::Datagram(bytes.to_vec()));
                }
                self.bytes.extend(bytes);
                self.bytes.pop_front().map_or(Heard::Nothing, Heard::Byte)
            }
            Some((Kind::Cts, up)) => {
                let up = up == [1];
                self.cts = Some(up);
                Heard::Cts(up)
            }
            Some((Kind::Lost, why)) => Heard::Lost(Lost(String::from_utf8_lossy(why).into_owned())),
            Some((Kind::Here, _)) => {
                self.asked = None;
                Heard::Nothing
            }
            _ => Heard::Nothing,
        })
    }
}

impl Link for WardLink {
    fn now(&self) -> Timestamp {
        Timestamp::from_s(self.stopwatch.elapsed().as_secs_f64() * self.cable.speed())
    }

    fn write(&mut self, bytes: &[u8]) -> Result<(), Lost> {
        match &mut self.own {
            Some(own) => own.write(bytes),
            None => self.tell(Kind::Write, bytes),
        }
    }

    fn wait(&mut self, until: Timestamp) -> Heard {
        if let Some(own) = &mut self.own {
            // The clock of the own line began later.
            let span = until - Timestamp::from_s(self.stopwatch.elapsed().as_secs_f64() * self.cable.speed());
            let until = own.now() + span;
            return own.wait(until);
        }
        if let Some(byte) = self.bytes.pop_front() {
            return Heard::Byte(byte);
        }
        loop {
            let due = ALIVE_EVERY.saturating_sub(self.spoken.elapsed());
            if due.is_zero()
                && let Err(lost) = self.tell(Kind::Alive, &[self.runs.into()])
            {
                return Heard::Lost(lost);
            }
            let left_s = ((until - self.now()).as_s() / self.cable.speed()).max(0.0);
            let due = ALIVE_EVERY.saturating_sub(self.spoken.elapsed());
            self.look();
            match self.hear(Duration::from_secs_f64(left_s).min(due)) {
                Ok(Heard::Nothing)
                    if self.asked.as_ref().is_some_and(|asked| asked.elapsed() >= UNANSWERED) =>
                {
                    return Heard::Lost(self.silent(UNANSWERED));
                }
                Ok(Heard::Nothing) if left_s > 0.0 => {}
                Ok(heard) => return heard,
                Err(error) => return Heard::Lost(self.bereft(&error)),
            }
        }
    }

    fn cts(&self) -> Option<bool> {
        self.own.as_ref().map_or(self.cts, Link::cts)
    }

    fn patience(&self) -> TimeSpan {
        TimeSpan::from_s(PERSON_MS * 1e-3 * self.cable.speed())
    }

    fn real_time(&self) -> Duration {
        self.stopwatch.elapsed()
    }

    fn reopen(&mut self) -> Result<(), Lost> {
        if let Some(own) = &mut self.own {
            return own.reopen();
        }
        if !self.is_orphan {
            return self.have_opened();
        }
        // No train runs without a guardian: open the line to stop them.
        self.own = Some(CableLink::open(self.cable.clone())?);
        StopFlag::raise();
        say!("without a guardian all trains are stopped, and the program ends");
        Ok(())
    }

    fn may_be_half_open(&self) -> bool {
        self.cable.is_connection()
    }

    fn guardian(&mut self) -> Option<&mut dyn Guardian> {
        if self.is_orphan { None } else { Some(self) }
    }
}

impl Guardian for WardLink {
    fn bequeath(&mut self, will: &[Bequest]) -> Result<(), Lost> {
        self.tell(Kind::Will, &written(will, self.cable.speed()))
    }

    fn note_running(&mut self, runs: bool) -> Result<(), Lost> {
        self.runs = runs;
        self.tell(Kind::Alive, &[runs.into()])
    }

    fn say_goodbye(&mut self) -> Result<(), Lost> {
        self.runs = false;
        self.tell(Kind::Goodbye, &[])
    }
}
