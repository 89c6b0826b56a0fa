//! What a session passes to the thread that records it, and what both of them share.

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicI64, AtomicU64};
use std::sync::mpsc::{SyncSender, TrySendError};

use footplate_core::Timestamp;
use footplate_store::{JournalEntry, TrainAtStart};

/// The version of the program that decides.
pub(crate) const PROGRAM: &str = env!("CARGO_PKG_VERSION");
/// Capacity of the queue: more than five minutes of a busy line (50 events a second) with all decisions, about 10 MB.
pub(super) const QUEUE: usize = 60_000;

/// The beginning of a run.
#[derive(Debug, Clone)]
pub(super) struct Beginning {
    pub(super) began_at: Option<Timestamp>,
    pub(super) trains: Vec<TrainAtStart>,
}

/// One entry of the queue.
#[derive(Debug)]
pub(super) enum Entry {
    Of(JournalEntry),
    Run(Beginning),
    /// The traced entries that follow belong to this machine: its kind and its body.
    Machine(&'static str, String),
    /// No more entries follow; it only wakes the thread.
    End,
}

impl Entry {
    pub(super) const fn of_journal(&self) -> Option<&JournalEntry> {
        match self {
            Self::Of(entry) => Some(entry),
            Self::Run(_) | Self::Machine(..) | Self::End => None,
        }
    }
}

/// What to do when the queue is full.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum WhenFull {
    /// Lose the entry: real trains do not wait.
    Lose,
    /// Wait for the disk: a simulated clock stands still meanwhile.
    Wait,
}

impl WhenFull {
    /// Offers an entry to a queue; returns whether the queue took it.
    pub(super) fn offer(self, queue: &SyncSender<Entry>, entry: Entry) -> bool {
        match self {
            Self::Wait => queue.send(entry).is_ok(),
            Self::Lose => match queue.try_send(entry) {
                Ok(()) => true,
                Err(TrySendError::Full(_) | TrySendError::Disconnected(_)) => false,
            },
        }
    }
}

/// State that the thread shares.
#[derive(Debug, Default)]
pub(super) struct Shared {
    /// No more entries follow.
    pub(super) ended: AtomicBool,
    /// Events in the queue so far, and those of them that are on disk.
    pub(super) taken: AtomicU64,
    pub(super) acknowledged: AtomicU64,
    /// Time of the last event on disk, in ns.
    pub(super) written_ns: AtomicI64,
    pub(super) lost: AtomicU64,
    pub(super) trouble: Mutex<Option<String>>,
}
