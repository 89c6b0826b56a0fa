//! Writes down what a machine is told and what it decides, on the way of a session's events.

use std::borrow::Cow;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::sync::mpsc::SyncSender;

use footplate_core::Timestamp;
use footplate_store::{JournalEntry, Side, Traced};

use super::{Entry, Shared, WhenFull};

/// The way from one machine to the disk: the queue of its session, so that all stands there in the order in which it
/// happened.
#[derive(Debug)]
pub(crate) struct Scribe {
    queue: SyncSender<Entry>,
    when_full: WhenFull,
    shared: Arc<Shared>,
    number: u64,
    /// When the machine was told something last.
    told: Timestamp,
}

impl Scribe {
    pub(super) const fn new(queue: SyncSender<Entry>, when_full: WhenFull, shared: Arc<Shared>) -> Self {
        Self { queue, when_full, shared, number: 0, told: Timestamp::ZERO }
    }

    /// The machine is about to be told something.
    pub(crate) fn input(&mut self, now: Timestamp, kind: &'static str, text: String) {
        self.told = now;
        self.write(Side::Input, kind, text);
    }

    /// The machine has decided something, and nobody has acted upon it yet.
    pub(crate) fn decision(&mut self, kind: &'static str, text: String) {
        self.write(Side::Decision, kind, text);
    }

    /// Hands over. What the queue does not take is counted as lost, and leaves a gap in the numbers.
    fn write(&mut self, side: Side, kind: &'static str, text: String) {
        let (number, time) = (self.number, self.told);
        self.number += 1;
        let traced = Traced { number, time, side, kind: Cow::Borrowed(kind), text };
        if !self.when_full.offer(&self.queue, Entry::Of(JournalEntry::Traced(traced))) {
            self.shared.lost.fetch_add(1, Ordering::Relaxed);
        }
    }
}
