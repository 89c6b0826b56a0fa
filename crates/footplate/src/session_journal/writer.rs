//! The thread that records a session: it commits together what has gathered, and retries what failed.

use std::sync::atomic::Ordering;
use std::sync::mpsc::{Receiver, TryRecvError};
use std::sync::{Arc, PoisonError};
use std::thread;
use std::time::Duration;

use footplate_store::{Journal, JournalEntry, NewMachine, StoreError};

use super::entry::{Entry, PROGRAM, QUEUE, Shared};
use crate::clock::now;

/// Most entries in one commit: so many are written in a few milliseconds.
const MOST_TOGETHER: usize = 2_000;
/// Pause after a failure (chosen: short for a person, long for a disk).
const RETRY: Duration = Duration::from_millis(500);

/// The state of the recording thread.
pub(super) struct Writer {
    pub(super) journal: Journal,
    pub(super) shared: Arc<Shared>,
}

impl Writer {
    pub(super) fn run(mut self, entries: &Receiver<Entry>) -> Journal {
        // Entries that are not on disk yet, in order.
        let mut pending: Vec<Entry> = Vec::new();
        loop {
            // Read before the queue: entries that arrive between the two are taken next time.
            let ended = self.shared.ended.load(Ordering::Acquire);
            let ended = gather(entries, &mut pending, ended) || ended && pending.len() >= QUEUE;
            let written = self.write(&mut pending);
            self.say(written.err().map(|error| error.to_string()));
            if ended {
                let left = pending.drain(..).chain(entries.try_iter());
                let lost = left.filter(|entry| !matches!(entry, Entry::Run(_) | Entry::End)).count();
                self.shared.lost.fetch_add(lost as u64, Ordering::Relaxed);
                return self.journal;
            }
            if !pending.is_empty() {
                thread::sleep(RETRY);
            }
        }
    }

    /// Writes what it can, and keeps the rest.
    fn write(&mut self, pending: &mut Vec<Entry>) -> Result<(), StoreError> {
        while let Some(first) = pending.first() {
            match first {
                Entry::Of(_) => {
                    let entries = pending.iter().map_while(Entry::of_journal).take(MOST_TOGETHER);
                    let entries: Vec<JournalEntry> = entries.cloned().collect();
                    let acknowledged = self.journal.append_all(&entries, now())?;
                    if let Some(event) = entries.iter().rev().find_map(JournalEntry::event) {
                        self.shared.written_ns.store(event.time.as_ns(), Ordering::Release);
                    }
                    self.shared.acknowledged.store(acknowledged, Ordering::Release);
                    pending.drain(..entries.len());
                    continue;
                }
                Entry::Run(beginning) => self.journal.begin_run(beginning.began_at, &beginning.trains)?,
                Entry::Machine(kind, body) => {
                    self.journal.begin_machine(NewMachine { kind, program: PROGRAM, body }, now())?;
                }
                Entry::End => {}
            }
            pending.remove(0);
        }
        Ok(())
    }

    fn say(&self, trouble: Option<String>) {
        *self.shared.trouble.lock().unwrap_or_else(PoisonError::into_inner) = trouble;
    }
}

/// Waits for an entry, unless some are pending or the session has ended, and takes all that are in the queue. Returns
/// whether no more follow.
fn gather(entries: &Receiver<Entry>, pending: &mut Vec<Entry>, ended: bool) -> bool {
    if pending.is_empty() && !ended {
        match entries.recv() {
            Ok(entry) => pending.push(entry),
            Err(_) => return true,
        }
    }
    while pending.len() < QUEUE {
        match entries.try_recv() {
            Ok(entry) => pending.push(entry),
            Err(TryRecvError::Empty) => return ended,
            Err(TryRecvError::Disconnected) => return true,
        }
    }
    false
}
