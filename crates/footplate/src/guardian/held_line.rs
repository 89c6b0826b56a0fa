//! The line that a guardian holds: opened when its child asks, and again for ever when trains have to be stopped.

use std::io::Write;
use std::sync::atomic::{AtomicBool, AtomicU8, AtomicU32, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use super::frame::{FrameWriter, Kind, cts_byte, cts_of};
use super::signals::Signals;
use super::voice::say;
use crate::clock::Stopwatch;
use crate::link::{Arrival, Cable, Lost};

/// Between two attempts to open a line again.
const REOPEN_EVERY: Duration = Duration::from_millis(250);
/// How long a byte waits for the hand-shake: a station that keeps it down for longer is told all the same.
const HAND_SHAKE_WITHIN: Duration = Duration::from_millis(100);
/// How often the hand-shake line is looked at meanwhile.
const HAND_SHAKE_EVERY: Duration = Duration::from_micros(500);
/// How long the hand-shake may take to go down after a byte, which it needs to be believed when it is up.
const HAND_SHAKE_FALLS: Duration = Duration::from_millis(10);

/// Who is told what is heard on the line: the child that there is now.
pub(super) type Ear = Arc<Mutex<Option<FrameWriter>>>;

/// A line, open or not.
pub(super) struct HeldLine {
    cable: Cable,
    ear: Ear,
    writer: Option<Box<dyn Write + Send>>,
    cts: Arc<AtomicU8>,
    /// Which opening it is: what is heard of an earlier one is of no interest. An even number: the line is gone.
    opening: Arc<AtomicU32>,
    /// Whether the station has said anything since this was cleared.
    has_heard: Arc<AtomicBool>,
}

impl HeldLine {
    pub(super) fn new(cable: Cable, ear: Ear) -> Self {
        let cts = Arc::new(AtomicU8::new(cts_byte(None)));
        Self { cable, ear, writer: None, cts, opening: Arc::default(), has_heard: Arc::default() }
    }

    pub(super) fn is_open(&self) -> bool {
        self.writer.is_some() && !self.opening.load(Ordering::Acquire).is_multiple_of(2)
    }

    /// Opens the line, anew if it is open. Says how the hand-shake line is.
    ///
    /// # Errors
    /// When the port cannot be opened.
    pub(super) fn open(&mut self) -> Result<Option<bool>, Lost> {
        self.writer = None;
        // The next odd number.
        let this = (self.opening.load(Ordering::Acquire) + 1) | 1;
        self.opening.store(this, Ordering::Release);
        let (opening, ear, cts) = (Arc::clone(&self.opening), Arc::clone(&self.ear), Arc::clone(&self.cts));
        let (name, has_heard) = (self.cable.to_string(), Arc::clone(&self.has_heard));
        let end = self.cable.open(move |arrival| {
            if opening.load(Ordering::Acquire) != this {
                return false;
            }
            let told = |kind, bytes: &[u8]| {
                let mut ear = ear.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
                // A child that is gone hears nothing; its guardian notices by itself.
                let _ = ear.as_mut().map(|child| child.send(kind, bytes));
            };
            match arrival {
                Arrival::Bytes(bytes) => {
                    has_heard.store(true, Ordering::Release);
                    told(Kind::Heard, bytes);
                }
                Arrival::Cts(up) => {
                    cts.store(cts_byte(Some(up)), Ordering::Release);
                    told(Kind::Cts, &[up.into()]);
                }
                Arrival::Lost(why) => {
                    let _ = opening.compare_exchange(this, this + 1, Ordering::AcqRel, Ordering::Acquire);
                    told(Kind::Lost, format!("`{name}` is gone: {why}").as_bytes());
                    return false;
                }
            }
            true
        });
        match end {
            Ok(end) => {
                self.cts.store(cts_byte(end.cts), Ordering::Release);
                self.writer = Some(end.writer);
                Ok(end.cts)
            }
            Err(lost) => {
                self.opening.store(this + 1, Ordering::Release);
                Err(lost)
            }
        }
    }

    /// Puts bytes on the line now.
    ///
    /// # Errors
    /// When the line is gone.
    pub(super) fn write(&mut self, bytes: &[u8]) -> Result<(), Lost> {
        let lost = |why: &dyn std::fmt::Display| Lost(format!("cannot write to `{}`: {why}", self.cable));
        if self.opening.load(Ordering::Acquire).is_multiple_of(2) {
            return Err(lost(&"it is gone"));
        }
        let Some(writer) = &mut self.writer else { return Err(lost(&"it is not open")) };
        let written = writer.write_all(bytes).and_then(|()| writer.flush());
        written.map_err(|error| {
            let lost = lost(&error);
            self.writer = None;
            lost
        })
    }

    /// Says a last will, from its beginning each time the line had to be opened again, until all of it is said or people
    /// do not want to wait any longer. Returns whether it was said.
    pub(super) fn carry_out(&mut self, will: &[u8], signals: &Signals) -> bool {
        let mut was_gone = false;
        while !signals.gives_up() {
            if !self.is_open()
                && let Err(lost) = self.open()
            {
                if !was_gone {
                    say(&format!("{lost}; trying for ever (Ctrl-C gives up, and leaves trains running)"));
                }
                was_gone = true;
                std::thread::sleep(REOPEN_EVERY);
                continue;
            }
            if std::mem::take(&mut was_gone) {
                say("the line is open again");
            }
            match self.try_to_carry_out(will) {
                Ok(()) => return true,
                Err(lost) => {
                    say(&format!("{lost}; trying for ever (Ctrl-C gives up, and leaves trains running)"));
                    (self.writer, was_gone) = (None, true);
                    std::thread::sleep(REOPEN_EVERY);
                }
            }
        }
        false
    }

    fn try_to_carry_out(&mut self, will: &[u8]) -> Result<(), Lost> {
        self.has_heard.store(false, Ordering::Release);
        let mut rest = will;
        while let [a, b, c, d, low, high, more @ ..] = rest {
            let pause = u32::from_le_bytes([*a, *b, *c, *d]);
            let length = usize::from(u16::from_le_bytes([*low, *high]));
            let (bytes, further) = more.split_at_checked(length).unwrap_or((more, &[]));
            std::thread::sleep(Duration::from_micros(pause.into()));
            self.await_hand_shake();
            self.write(bytes)?;
            rest = further;
        }
        // A line that went during the last bytes did not carry them.
        std::thread::sleep(REOPEN_EVERY);
        if !self.is_open() {
            return Err(Lost(format!("`{}` is gone", self.cable)));
        }
        // Datagrams vanish without notice. A station that exchanges them answers each command.
        if self.cable.has_datagrams() && !self.has_heard.load(Ordering::Acquire) {
            return Err(Lost(format!("{} does not answer", self.cable)));
        }
        Ok(())
    }

    /// Waits until the station takes the next byte, where its hand-shake line can be read.
    fn await_hand_shake(&self) {
        let watch = Stopwatch::start();
        let cts = || cts_of(self.cts.load(Ordering::Acquire));
        while cts() == Some(true) && watch.elapsed() < HAND_SHAKE_FALLS {
            std::thread::sleep(HAND_SHAKE_EVERY);
        }
        while cts() == Some(false) && watch.elapsed() < HAND_SHAKE_WITHIN {
            std::thread::sleep(HAND_SHAKE_EVERY);
        }
    }
}
