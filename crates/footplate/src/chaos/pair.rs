//! The program and its guardian as two processes: the bytes between them, and how either of them hangs and dies.
//!
//! What the guardian decides is [`Monitor`], and the program's side is [`WardLink`](crate::guardian::WardLink) over this connection:
//! both are those of the real processes. Bytes between the two arrive at once, in pieces of arbitrary size.

use std::collections::VecDeque;
use std::io::{ErrorKind, Result as IoResult};
use std::rc::Rc;
use std::time::Duration;

use footplate_core::{TimeSpan, Timestamp};
use footplate_eval::seeds::Choice;

use super::life::{Death, Life, Spell};
use super::line::{FaultyLine, PATIENCE};
use super::plan::Trouble;
use crate::guardian::{Connection, Frame, FrameBuffer, Monitor, Request, Step};
use crate::link::{Heard, Link, Lost};
use crate::runtime::carry_out;

/// The state of the guardian's process.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Guardian {
    Runs,
    /// It hangs until a time; [`FOR_EVER`] for good.
    Hangs {
        since: Timestamp,
        until: Timestamp,
    },
    /// It was killed, or ended because it hung since a time.
    Dead {
        since: Timestamp,
    },
}

const FOR_EVER: Timestamp = Timestamp::from_ns(i64::MAX);

/// A person ends a program that still tries to stop its trains so long after its guardian has failed. No line is cut for so long.
const TRIES_FOR: TimeSpan = TimeSpan::from_ms(120_000);

/// Bytes from one process to the other that it has not read.
struct Pipe {
    sent: VecDeque<u8>,
    frames: FrameBuffer,
    encoded: Vec<u8>,
}

impl Pipe {
    fn new() -> Self {
        Self { sent: VecDeque::new(), frames: FrameBuffer::new(), encoded: Vec::new() }
    }

    fn send(&mut self, frame: Frame<'_>) -> IoResult<()> {
        frame.encode(&mut self.encoded)?;
        self.sent.extend(&self.encoded);
        Ok(())
    }

    /// Reads until a whole frame has arrived, in pieces of arbitrary size. Returns whether one has.
    fn has_frame(&mut self, pieces: &mut Choice) -> IoResult<bool> {
        while !self.frames.has_frame()? {
            if self.sent.is_empty() {
                return Ok(false);
            }
            let space = self.frames.space();
            let count = 1 + pieces.between(0.0, self.sent.len() as f64) as usize;
            let count = count.min(self.sent.len()).min(space.len());
            space.iter_mut().zip(self.sent.drain(..count)).for_each(|(to, from)| *to = from);
            self.frames.arrived(count);
        }
        Ok(true)
    }
}

/// The two processes of one life.
pub(super) struct Pair<'l> {
    pub(super) line: FaultyLine<'l>,
    life: Rc<Life>,
    guardian: Guardian,
    monitor: Monitor,
    to_guardian: Pipe,
    to_program: Pipe,
    pieces: Choice,
    /// Since when the program has hung that its guardian has ended.
    pub(super) hung_since: Option<Timestamp>,
    /// When the guardian hung.
    pub(super) without_guardian: Vec<Spell>,
    /// Whether one of the two took the other for dead, which was alive.
    pub(super) wronged: Option<&'static str>,
    is_hanging: bool,
    /// What the program's last heartbeat said.
    said_running: bool,
    /// Whether the next wait belongs to a step that was counted.
    is_counted: bool,
    /// Whether the program died while it sent something.
    is_cut: bool,
    /// Whether the program has opened the line itself.
    holds_line: bool,
    /// The time that the loop of a dead program takes to end, while the world stands still.
    after_death: TimeSpan,
}

impl<'l> Pair<'l> {
    pub(super) fn new(line: FaultyLine<'l>, life: Rc<Life>, pieces: Choice) -> Self {
        Self {
            life,
            guardian: Guardian::Runs,
            monitor: Monitor::new(line.time()),
            line,
            to_guardian: Pipe::new(),
            to_program: Pipe::new(),
            pieces,
            hung_since: None,
            without_guardian: Vec::new(),
            wronged: None,
            is_hanging: false,
            said_running: false,
            is_counted: false,
            is_cut: false,
            holds_line: false,
            after_death: TimeSpan::ZERO,
        }
    }

    pub(super) const fn guardian(&self) -> Guardian {
        self.guardian
    }

    /// Whether the program was still trying to stop its trains when a person ended it.
    pub(super) fn tried_in_vain(&self) -> bool {
        matches!(self.guardian, Guardian::Dead { since } if self.line.time() - since > TRIES_FOR)
    }

    /// Lets everything happen that is due.
    fn turn(&mut self) {
        while let Some((trouble, span)) = self.line.happen() {
            match trouble {
                Trouble::Hang if !self.life.is_over() => self.hang(span),
                Trouble::GuardianHang if self.guardian == Guardian::Runs => {
                    self.hang_guardian(self.line.time() + span);
                }
                _ => {}
            }
        }
        let lives = !matches!(self.guardian, Guardian::Dead { .. } | Guardian::Hangs { until: FOR_EVER, .. });
        match self.life.death() {
            Some(Death::GuardianKilled) if lives => {
                self.line.tell("the guardian is killed");
                self.lose_guardian();
            }
            Some(Death::GuardianHangs) if lives => {
                self.line.tell("the guardian hangs for good");
                self.hang_guardian(FOR_EVER);
            }
            _ => {}
        }
        self.serve();
    }

    fn hang_guardian(&mut self, until: Timestamp) {
        let since = self.line.time();
        self.guardian = Guardian::Hangs { since, until };
        self.without_guardian.push(Spell { from: since, until });
        self.line.watch_stops(true);
    }

    /// The guardian is gone, and with it its end of the line.
    fn lose_guardian(&mut self) {
        let now = self.line.time();
        let since = if let Guardian::Hangs { since, .. } = self.guardian { since } else { now };
        if let Some(spell) = self.without_guardian.last_mut() {
            spell.until = spell.until.min(now);
        }
        self.guardian = Guardian::Dead { since };
        self.line.close();
        if since == now {
            self.line.watch_stops(true);
        }
    }

    /// The program hangs for a while. Its guardian ends it if that lasts too long while trains run.
    fn hang(&mut self, span: TimeSpan) {
        let (since, until) = (self.line.time(), self.line.time() + span);
        self.is_hanging = true;
        while self.line.time() < until && !self.life.is_over() {
            self.line.step(self.wakes_guardian().map_or(until, |at| at.min(until)));
            self.serve();
        }
        self.is_hanging = false;
        if self.life.is_over() {
            self.hung_since = Some(since);
        }
    }

    /// When the guardian does something of its own.
    fn wakes_guardian(&self) -> Option<Timestamp> {
        match self.guardian {
            Guardian::Runs => self.monitor.deadline(),
            Guardian::Hangs { until, .. } => Some(until),
            Guardian::Dead { .. } => None,
        }
    }

    /// The guardian takes what has arrived from both sides.
    fn serve(&mut self) {
        let now = self.line.time();
        if matches!(self.guardian, Guardian::Hangs { until, .. } if now >= until) {
            self.guardian = Guardian::Runs;
            self.line.watch_stops(false);
        }
        if self.guardian != Guardian::Runs {
            return;
        }
        while let Some(heard) = self.line.arrived() {
            let _ = match &heard {
                Heard::Byte(byte) => self.to_program.send(Frame::Heard(&[*byte])),
                Heard::Datagram(bytes) => self.to_program.send(Frame::Heard(bytes)),
                Heard::Cts(up) => self.to_program.send(Frame::Cts(*up)),
                Heard::Lost(lost) => self.to_program.send(Frame::Lost(&lost.0)),
                Heard::Nothing => Ok(()),
            };
        }
        while self.monitor.serves() {
            match self.to_guardian.has_frame(&mut self.pieces) {
                Ok(true) => {}
                Ok(false) => {
                    self.monitor.silent(now);
                    break;
                }
                // The next call says so once more.
                Err(_) => {}
            }
            let Ok(Some(frame)) = self.to_guardian.frames.next() else {
                self.monitor.closed();
                break;
            };
            let _ = match self.monitor.hear(frame) {
                Some(Request::Open) => match self.line.connect() {
                    Ok(()) => self.to_program.send(Frame::Opened { cts: self.line.cts() }),
                    Err(lost) => self.to_program.send(Frame::NotOpened(&lost.0)),
                },
                Some(Request::Write(bytes)) => match self.line.put(bytes) {
                    Ok(()) => Ok(()),
                    Err(lost) => self.to_program.send(Frame::Lost(&lost.0)),
                },
                Some(Request::Answer) => self.to_program.send(Frame::Here),
                None => Ok(()),
            };
            self.monitor.dealt(now);
        }
        if self.monitor.is_late() && !self.life.is_over() {
            if !self.is_hanging || !self.said_running {
                self.wronged =
                    Some("the guardian ended a program that did not hang, or whose trains did not run");
            }
            self.life.end(Death::Hangs);
        }
    }

    /// The guardian notices how the program's process ended, and stops the trains that it has left.
    pub(super) fn bury(&mut self, hangs: bool) -> Option<Burial> {
        self.is_hanging = hangs;
        loop {
            self.turn();
            if !self.monitor.serves() {
                break;
            }
            match self.wakes_guardian() {
                None if self.guardian != Guardian::Runs => return None,
                Some(FOR_EVER) => return None,
                Some(at) if hangs || self.guardian != Guardian::Runs => self.line.step(at),
                // A program that hangs while no train runs is ended by a person.
                _ => self.monitor.closed(),
            }
        }
        let (mut was_late, mut burial) = (false, None);
        while let Some(step) = self.monitor.step() {
            match step {
                Step::Kill => {
                    was_late = true;
                    self.line.tell("the guardian ends a program that hangs");
                }
                Step::CarryOut(will) => {
                    let began = self.line.time();
                    self.line.tell(format!("the guardian begins with a last will of {} bytes", will.len()));
                    self.line.watch_stops(true);
                    let is_said = carry_out(&mut self.line, will);
                    burial = Some(Burial { was_late, began, is_said });
                }
                Step::AwaitEnd => {}
            }
        }
        burial
    }
}

/// How a guardian has sent a last will.
#[derive(Debug, Clone, Copy)]
pub(super) struct Burial {
    /// Whether the program had hung.
    pub(super) was_late: bool,
    pub(super) began: Timestamp,
    pub(super) is_said: bool,
}

impl Connection for Pair<'_> {
    fn now(&self) -> Timestamp {
        self.line.time() + self.after_death
    }

    fn pause(&mut self, span: Duration) {
        let until = self.now() + TimeSpan::from_s(span.as_secs_f64());
        while self.now() < until {
            self.turn();
            if self.life.is_over() {
                self.after_death += until - self.now();
            } else {
                self.line.step(self.wakes_guardian().map_or(until, |at| at.min(until)));
            }
        }
    }

    fn patience(&self) -> TimeSpan {
        PATIENCE
    }

    fn send(&mut self, frame: Frame<'_>) -> IoResult<()> {
        // A heartbeat without news, and what opens the line, belong to the wait around them.
        self.is_counted = match frame {
            Frame::Open => true,
            Frame::Alive { runs } => std::mem::replace(&mut self.said_running, runs) == runs,
            _ => false,
        };
        if !self.is_counted {
            self.life.step();
        }
        self.turn();
        if self.life.is_over() {
            if !std::mem::replace(&mut self.is_cut, true) {
                frame.encode(&mut self.to_guardian.encoded)?;
                let sent = self.pieces.between(0.0, self.to_guardian.encoded.len() as f64) as usize;
                self.to_guardian.sent.extend(self.to_guardian.encoded.iter().take(sent));
            }
            return Err(ErrorKind::BrokenPipe.into());
        }
        if let Guardian::Dead { .. } = self.guardian {
            return Err(ErrorKind::BrokenPipe.into());
        }
        self.to_guardian.send(frame)?;
        self.serve();
        Ok(())
    }

    fn receive(&mut self, within: TimeSpan) -> IoResult<Option<Frame<'_>>> {
        if !std::mem::take(&mut self.is_counted) {
            self.life.step();
        }
        let until = self.line.time() + within;
        loop {
            self.turn();
            if self.life.is_over() {
                return Err(ErrorKind::BrokenPipe.into());
            }
            if self.to_program.has_frame(&mut self.pieces)? {
                let frame = self.to_program.frames.next();
                self.is_counted = matches!(frame, Ok(Some(Frame::Here)));
                return frame;
            }
            if let Guardian::Dead { .. } = self.guardian {
                return Err(ErrorKind::UnexpectedEof.into());
            }
            if self.line.time() >= until {
                return Ok(None);
            }
            self.line.step(self.wakes_guardian().map_or(until, |at| at.min(until)));
        }
    }

    fn end_guardian(&mut self) {
        if self.life.is_over() || matches!(self.guardian, Guardian::Dead { .. }) {
            return;
        }
        if self.guardian == Guardian::Runs {
            self.wronged = Some("the program ended a guardian that did not hang");
        }
        self.lose_guardian();
    }

    fn open_line(&mut self) -> Result<(), Lost> {
        if self.life.is_over() {
            return Err(Lost("this program is dead".to_owned()));
        }
        self.line.connect()?;
        self.life.orphan();
        self.holds_line = true;
        Ok(())
    }

    fn own_line(&self) -> Option<&dyn Link> {
        (self.holds_line && !self.life.is_over()).then_some(&self.line as &dyn Link)
    }

    fn own_line_mut(&mut self) -> Option<&mut dyn Link> {
        (self.holds_line && !self.life.is_over()).then_some(&mut self.line as &mut dyn Link)
    }

    fn gives_up(&self) -> bool {
        self.life.is_over() || self.tried_in_vain()
    }

    fn say(&mut self, words: &str) {
        self.line.tell(words);
    }
}
