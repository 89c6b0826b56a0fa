//! The line as a guardian's child sees it: every byte passes through the guardian, which also receives the heartbeat.

use std::collections::VecDeque;
use std::io::{Error as IoError, ErrorKind, Result as IoResult};
use std::time::Duration;

use footplate_core::{TimeSpan, Timestamp};

use super::frame::Frame;
use crate::link::{Bequest, Cable, Guardian, Heard, Link, Lost, PERSON_MS};
use crate::runtime::written;

/// Period of the heartbeat: a tenth of what the guardian tolerates. A guardian that hangs is noticed so much later.
const ALIVE_EVERY: TimeSpan = TimeSpan::from_ms(50);
/// A guardian that leaves a heartbeat unanswered for this time hangs. More than it allows its child, because its answer waits for what
/// it writes to the line; less than a second less the time that opening the line takes (requirement).
const UNANSWERED: TimeSpan = TimeSpan::from_ms(600);
/// A guardian opens a line within this time, or hangs: connecting and agreeing on a protocol have 2 s each at most.
const OPENED_WITHIN: TimeSpan = TimeSpan::from_ms(5_000);
/// After this time between two looks, this process itself was suspended, and perhaps its guardian with it.
const SUSPENDED: TimeSpan = TimeSpan::from_ms(300);

/// A connection to a guardian, with a clock beside it.
pub(crate) trait Connection {
    /// Real time, since some moment before.
    fn now(&self) -> Timestamp;

    /// Lets so much of it pass.
    fn pause(&mut self, span: Duration) {
        std::thread::sleep(span);
    }

    /// For how long at most a person waits for an answer of the program.
    fn patience(&self) -> TimeSpan {
        TimeSpan::from_s(1e-3 * PERSON_MS)
    }

    /// # Errors
    /// The guardian is dead, or the frame is too long.
    fn send(&mut self, frame: Frame<'_>) -> IoResult<()>;

    /// Returns the next frame of the guardian; `None` after `within`.
    ///
    /// # Errors
    /// The guardian is dead, or sent what is no frame.
    fn receive(&mut self, within: TimeSpan) -> IoResult<Option<Frame<'_>>>;

    /// Ends the guardian if it is still there, and waits until it has left the line.
    fn end_guardian(&mut self);

    /// Opens the line in this process, for a program that then stops all trains and ends.
    ///
    /// # Errors
    /// The line cannot be opened.
    fn open_line(&mut self) -> Result<(), Lost>;

    /// The line that this process has opened.
    fn own_line(&self) -> Option<&dyn Link>;
    fn own_line_mut(&mut self) -> Option<&mut dyn Link>;

    /// Whether a person does not want to wait any longer until trains are stopped.
    fn gives_up(&self) -> bool {
        false
    }

    /// Says something to people.
    fn say(&mut self, words: &str);
}

/// A line that a guardian holds.
pub(crate) struct WardLink<C> {
    connection: C,
    cable: Cable,
    /// Bytes of the last frame that were not returned yet.
    bytes: VecDeque<u8>,
    cts: Option<bool>,
    /// Why the line is not open.
    lost: Option<Lost>,
    /// Where the time of this link begins.
    began: Timestamp,
    /// Time of the last heartbeat. A program that always writes sends it, too: only its answer shows that the guardian lives.
    beat: Timestamp,
    /// Heartbeats that are not answered yet.
    unanswered: u32,
    /// Since when the first of them is not.
    asked: Option<Timestamp>,
    /// When this process looked for an answer.
    looked: Timestamp,
    runs: bool,
    is_orphan: bool,
    /// Whether it was said that stopping trains is tried for ever.
    tries_on: bool,
}

impl<C: Connection> WardLink<C> {
    /// Asks the guardian at the other end of a connection to open the line.
    ///
    /// # Errors
    /// The line cannot be opened.
    pub(crate) fn over(connection: C, cable: Cable) -> Result<Self, Lost> {
        let now = connection.now();
        let mut link = Self {
            connection,
            cable,
            bytes: VecDeque::new(),
            cts: None,
            lost: None,
            began: Timestamp::ZERO,
            beat: now,
            unanswered: 0,
            asked: None,
            looked: now,
            runs: false,
            is_orphan: false,
            tries_on: false,
        };
        link.have_opened()?;
        Ok(link)
    }

    /// Begins the time of this link.
    pub(super) fn begin(&mut self) {
        self.began = self.connection.now();
    }

    pub(crate) const fn connection_mut(&mut self) -> &mut C {
        &mut self.connection
    }

    fn tell(&mut self, frame: Frame<'_>) -> Result<(), Lost> {
        if self.is_orphan {
            return Err(self.orphaned());
        }
        if let Frame::Alive { .. } = frame {
            self.beat = self.connection.now();
            self.unanswered += 1;
            self.asked.get_or_insert(self.beat);
        }
        self.connection.send(frame).map_err(|error| self.bereft(&error))
    }

    fn bereft(&mut self, error: &IoError) -> Lost {
        if error.kind() == ErrorKind::InvalidInput {
            return Lost("so much cannot be said to a guardian at once".to_owned());
        }
        self.without_guardian()
    }

    /// Ends a guardian that answers nothing, so that this process can open the line itself.
    fn silent(&mut self, waited: TimeSpan) -> Lost {
        let words = format!("the guardian has answered nothing for {:.0} ms; it is ended", waited.as_ms());
        self.connection.say(&words);
        self.without_guardian()
    }

    fn without_guardian(&mut self) -> Lost {
        self.is_orphan = true;
        self.connection.end_guardian();
        self.orphaned()
    }

    /// Notes that this process looks for an answer. If it was suspended, its guardian has its whole time again.
    fn look(&mut self) {
        let now = self.connection.now();
        if now - self.looked > SUSPENDED {
            self.asked = self.asked.map(|_| now);
        }
        self.looked = now;
    }

    fn is_unanswered(&self) -> bool {
        self.asked.is_some_and(|asked| self.connection.now() - asked >= UNANSWERED)
    }

    fn orphaned(&self) -> Lost {
        Lost(format!("the guardian that held `{}` has died", self.cable))
    }

    /// Asks the guardian to open the line and waits for the answer.
    fn have_opened(&mut self) -> Result<(), Lost> {
        self.tell(Frame::Open)?;
        self.bytes.clear();
        let until = self.connection.now() + OPENED_WITHIN;
        loop {
            let left = (until - self.connection.now()).max(TimeSpan::ZERO);
            let answer = match self.connection.receive(left) {
                Ok(None) if left == TimeSpan::ZERO => return Err(self.silent(OPENED_WITHIN)),
                Ok(Some(Frame::Opened { cts })) => Ok(cts),
                Ok(Some(Frame::NotOpened(why))) => Err(Lost(why.to_owned())),
                // What was sent of an earlier opening.
                Ok(_) => continue,
                Err(error) => return Err(self.bereft(&error)),
            };
            // While it opened the line, it answered no heartbeat, and before that all of them.
            (self.beat, self.asked, self.unanswered) = (self.connection.now(), None, 0);
            self.lost = answer.as_ref().err().cloned();
            self.cts = answer?;
            return Ok(());
        }
    }

    /// What comes first within a time.
    fn hear(&mut self, within: TimeSpan) -> IoResult<Heard> {
        Ok(match self.connection.receive(within)? {
            Some(Frame::Heard(bytes)) => {
                if self.cable.has_datagrams() {
                    return Ok(Heard::Datagram(bytes.to_vec()));
                }
                self.bytes.extend(bytes);
                self.bytes.pop_front().map_or(Heard::Nothing, Heard::Byte)
            }
            Some(Frame::Cts(up)) => {
                self.cts = Some(up);
                Heard::Cts(up)
            }
            Some(Frame::Lost(why)) => {
                let lost = Lost(why.to_owned());
                self.lost = Some(lost.clone());
                Heard::Lost(lost)
            }
            Some(Frame::Here) => {
                self.unanswered = self.unanswered.saturating_sub(1);
                self.asked = (self.unanswered > 0).then(|| self.connection.now());
                Heard::Nothing
            }
            _ => Heard::Nothing,
        })
    }

    /// Waits until the guardian has taken everything that was sent to it.
    fn await_answer(&mut self) -> Result<(), Lost> {
        self.tell(Frame::Alive { runs: self.runs })?;
        while let Some(asked) = self.asked {
            self.look();
            match self.hear((asked + UNANSWERED - self.connection.now()).max(TimeSpan::ZERO)) {
                Ok(Heard::Lost(lost)) => return Err(lost),
                Ok(_) if self.is_unanswered() => return Err(self.silent(UNANSWERED)),
                Ok(_) => {}
                Err(error) => return Err(self.bereft(&error)),
            }
        }
        Ok(())
    }

    /// Until the next heartbeat.
    fn beats_in(&self) -> TimeSpan {
        (self.beat + ALIVE_EVERY - self.connection.now()).max(TimeSpan::ZERO)
    }
}

impl<C: Connection> Link for WardLink<C> {
    fn now(&self) -> Timestamp {
        let since = self.connection.now() - self.began;
        Timestamp::from_s(since.as_s() * self.cable.speed())
    }

    fn write(&mut self, bytes: &[u8]) -> Result<(), Lost> {
        match self.connection.own_line_mut() {
            Some(own) => own.write(bytes),
            None => self.lost.clone().map_or_else(|| self.tell(Frame::Write(bytes)), Err),
        }
    }

    fn wait(&mut self, until: Timestamp) -> Heard {
        let span = until - self.now();
        if let Some(own) = self.connection.own_line_mut() {
            // The clock of the own line began later.
            let until = own.now() + span;
            return own.wait(until);
        }
        if let Some(byte) = self.bytes.pop_front() {
            return Heard::Byte(byte);
        }
        if let Some(lost) = &self.lost {
            return Heard::Lost(lost.clone());
        }
        loop {
            if self.beats_in() == TimeSpan::ZERO
                && let Err(lost) = self.tell(Frame::Alive { runs: self.runs })
            {
                return Heard::Lost(lost);
            }
            let left = TimeSpan::from_s(((until - self.now()).as_s() / self.cable.speed()).max(0.0));
            self.look();
            match self.hear(left.min(self.beats_in())) {
                Ok(Heard::Nothing) if self.is_unanswered() => return Heard::Lost(self.silent(UNANSWERED)),
                Ok(Heard::Nothing) if self.now() < until => {}
                Ok(heard) => return heard,
                Err(error) => return Heard::Lost(self.bereft(&error)),
            }
        }
    }

    fn cts(&self) -> Option<bool> {
        self.connection.own_line().map_or(self.cts, Link::cts)
    }

    fn patience(&self) -> TimeSpan {
        TimeSpan::from_s(self.connection.patience().as_s() * self.cable.speed())
    }

    fn real_time(&self) -> Duration {
        Duration::from_secs_f64((self.connection.now() - Timestamp::ZERO).as_s())
    }

    fn pause(&mut self, span: Duration) {
        // A program that pauses lives. If the guardian is dead, opening the line says so.
        let _ = self.tell(Frame::Alive { runs: self.runs });
        self.connection.pause(span);
    }

    fn reopen(&mut self) -> Result<(), Lost> {
        if !self.is_orphan {
            return self.have_opened();
        }
        // No train runs without a guardian: open the line to stop them.
        let is_first = self.connection.own_line().is_none();
        let opened = match self.connection.own_line_mut() {
            Some(own) => own.reopen(),
            None => self.connection.open_line(),
        };
        match &opened {
            Ok(()) if is_first => {
                self.connection.say("without a guardian all trains are stopped, and the program ends");
            }
            Err(lost) if !std::mem::replace(&mut self.tries_on, true) => {
                self.connection.say(&format!(
                    "{lost}; trying for ever to stop all trains (Ctrl-C three times gives up, and leaves trains running)"
                ));
            }
            _ => {}
        }
        opened
    }

    fn may_be_half_open(&self) -> bool {
        self.cable.is_connection()
    }

    fn guardian(&mut self) -> Option<&mut dyn Guardian> {
        if self.is_orphan { None } else { Some(self) }
    }

    fn is_without_guardian(&self) -> bool {
        self.is_orphan && !self.connection.gives_up()
    }
}

impl<C: Connection> Guardian for WardLink<C> {
    fn bequeath(&mut self, will: &[Bequest]) -> Result<(), Lost> {
        self.tell(Frame::Will(&written(will, self.cable.speed())))
    }

    fn note_running(&mut self, runs: bool) -> Result<(), Lost> {
        self.runs = runs;
        self.tell(Frame::Alive { runs })
    }

    fn say_goodbye(&mut self) -> Result<(), Lost> {
        // A guardian that hangs, or has lost the line, has not written the last stops.
        self.await_answer()?;
        self.runs = false;
        self.tell(Frame::Goodbye)
    }
}
