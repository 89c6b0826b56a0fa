//! The line that a guardian holds. It opens the line when its child asks, and retries for ever when trains must be stopped.

use std::io::Write;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use super::frame::Frame;
use super::frame_stream::FrameWriter;
use super::signals::Signals;
use super::voice::say;
use crate::link::{Arrival, Cable, Lost};
use crate::runtime::WillLine;

/// The present child, which receives everything that arrives on the line.
pub(super) type Ear = Arc<Mutex<Option<FrameWriter>>>;

/// Sends a frame to the present child. If it is gone, reading from it reports that.
pub(super) fn tell(ear: &Ear, frame: Frame<'_>) {
    let _ = locked(ear).as_mut().map(|child| child.send(frame));
}

pub(super) fn locked<T>(shared: &Mutex<T>) -> MutexGuard<'_, T> {
    shared.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A line, open or not.
pub(super) struct HeldLine {
    cable: Cable,
    ear: Ear,
    writer: Option<Box<dyn Write + Send>>,
    cts: Arc<Mutex<Option<bool>>>,
    /// Counts openings, so that arrivals of an earlier one are ignored. An even number: the line is lost.
    opening: Arc<AtomicU32>,
    /// Whether the station has sent anything since this was cleared.
    has_heard: Arc<AtomicBool>,
}

impl HeldLine {
    pub(super) fn new(cable: Cable, ear: Ear) -> Self {
        let (cts, opening, has_heard) = (Arc::default(), Arc::default(), Arc::default());
        Self { cable, ear, writer: None, cts, opening, has_heard }
    }

    pub(super) fn is_open(&self) -> bool {
        self.writer.is_some() && !self.opening.load(Ordering::Acquire).is_multiple_of(2)
    }

    /// Opens the line; reopens it if it is open. Returns the state of the handshake line.
    ///
    /// # Errors
    /// The port cannot be opened.
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
            match arrival {
                Arrival::Bytes(bytes) => {
                    has_heard.store(true, Ordering::Release);
                    tell(&ear, Frame::Heard(bytes));
                }
                Arrival::Cts(up) => {
                    *locked(&cts) = Some(up);
                    tell(&ear, Frame::Cts(up));
                }
                Arrival::Lost(why) => {
                    let _ = opening.compare_exchange(this, this + 1, Ordering::AcqRel, Ordering::Acquire);
                    tell(&ear, Frame::Lost(&format!("`{name}` is gone: {why}")));
                    return false;
                }
            }
            true
        });
        match end {
            Ok(end) => {
                *locked(&self.cts) = end.cts;
                self.writer = Some(end.writer);
                Ok(end.cts)
            }
            Err(lost) => {
                self.opening.store(this + 1, Ordering::Release);
                Err(lost)
            }
        }
    }

    /// Writes bytes to the line.
    ///
    /// # Errors
    /// The line is lost.
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
}

/// The held line while a last will is sent, and the signals by which people give up.
pub(super) struct LastLine<'l> {
    pub(super) line: &'l mut HeldLine,
    pub(super) signals: &'l Signals,
}

impl WillLine for LastLine<'_> {
    fn is_open(&self) -> bool {
        self.line.is_open()
    }
    fn open(&mut self) -> Result<(), Lost> {
        self.line.open().map(drop)
    }
    fn close(&mut self) {
        self.line.writer = None;
    }
    fn write(&mut self, bytes: &[u8]) -> Result<(), Lost> {
        self.line.write(bytes)
    }
    fn cts(&self) -> Option<bool> {
        *locked(&self.line.cts)
    }
    fn pause(&mut self, span: Duration) {
        std::thread::sleep(span);
    }
    fn has_answered(&self) -> bool {
        !self.line.cable.has_answers() || self.line.has_heard.load(Ordering::Acquire)
    }
    fn expect_answer(&mut self) {
        self.line.has_heard.store(false, Ordering::Release);
    }
    fn gives_up(&self) -> bool {
        self.signals.gives_up()
    }
    fn say(&self, words: &str) {
        say(&format!("{}: {words}", self.line.cable));
    }
}
