//! The journal of a live session: what a railway reports and is told, on the disk as it happens.
//!
//! A session is a recording, and a stretch of it in which the clock is continuous and no train is lifted is a run. An
//! event is acknowledged once it is on the disk (write-ahead journal, `synchronous = FULL`: one wait for the disk a call),
//! and what was acknowledged outlives whatever happens to the process or the power. What came together is handed over
//! together; nobody waits here for more to come.

use footplate_core::{Event, RunId, Timestamp};

use super::decisions::{self, MachineKey, NewMachine, Traced};
use super::error::StoreError;
use super::file::Store;
use super::recordings::{RecordingKey, RunKey};
use super::row;
use crate::recording::TrainAtStart;

/// What a session brings, as it comes.
#[derive(Debug, Clone, PartialEq)]
pub enum JournalEntry {
    /// The railway reported something, or was told.
    Event(Event),
    /// The machine that was begun last was told something, or decided.
    Traced(Traced),
}

impl JournalEntry {
    /// The event, if it is one.
    #[must_use]
    pub const fn event(&self) -> Option<&Event> {
        match self {
            Self::Event(event) => Some(event),
            Self::Traced(_) => None,
        }
    }
}

/// No row has this number, so that the store refuses what is of no machine.
const NO_MACHINE: MachineKey = MachineKey(0);

/// A live session that is being written down.
#[derive(Debug)]
pub struct Journal {
    store: Store,
    recording: RecordingKey,
    run: RunKey,
    number: u32,
    machine: Option<MachineKey>,
    acknowledged: u64,
}

impl Journal {
    /// Begins a session on `layout` with its first run, whose clock stood at zero at `began_at`. `now` since the Unix
    /// epoch, as everywhere in a store.
    ///
    /// # Errors
    /// The store cannot be written: better known before the first train moves.
    pub fn begin(
        mut store: Store,
        name: &str,
        layout: &str,
        began_at: Option<Timestamp>,
        trains: &[TrainAtStart],
        now: Timestamp,
    ) -> Result<Self, StoreError> {
        let recording = store.begin_recording(name, layout, now)?;
        let run = store.begin_run(recording, RunId(1), began_at, trains)?;
        Ok(Self { store, recording, run, number: 1, machine: None, acknowledged: 0 })
    }

    /// Begins the next run: the clock has jumped, a train was lifted, or other trains take part. `began_at` as above, and
    /// what the trains do now.
    ///
    /// # Errors
    /// The store cannot be written; the run before goes on.
    pub fn begin_run(
        &mut self,
        began_at: Option<Timestamp>,
        trains: &[TrainAtStart],
    ) -> Result<(), StoreError> {
        let next = self.number + 1;
        self.run = self.store.begin_run(self.recording, RunId(next), began_at, trains)?;
        self.number = next;
        Ok(())
    }

    /// A machine begins to decide; what is traced from here on is of it.
    ///
    /// # Errors
    /// The store cannot be written: better known before the first train moves.
    pub fn begin_machine(&mut self, new: NewMachine<'_>, now: Timestamp) -> Result<(), StoreError> {
        self.machine = Some(self.store.begin_machine(self.recording, new, now)?);
        Ok(())
    }

    /// Writes events down, in their order. When this returns they are on the disk, all of them; it says how many of the
    /// session are by now.
    ///
    /// # Errors
    /// None of these events was acknowledged. They can be handed over again: nothing is written down twice.
    pub fn append(&mut self, events: &[Event], now: Timestamp) -> Result<u64, StoreError> {
        let entries: Vec<JournalEntry> = events.iter().copied().map(JournalEntry::Event).collect();
        self.append_all(&entries, now)
    }

    /// The same for all that a session brings: in their order, and all of it or nothing.
    ///
    /// # Errors
    /// As [`append`](Self::append); and if something is traced before a machine was begun.
    pub fn append_all(&mut self, entries: &[JournalEntry], now: Timestamp) -> Result<u64, StoreError> {
        if entries.is_empty() {
            return Ok(self.acknowledged);
        }
        let path = self.store.path().to_owned();
        let (run, machine) = (self.run, self.machine.unwrap_or(NO_MACHINE));
        let transaction = self.store.write()?;
        let append = || {
            let mut statement = transaction.prepare_cached(row::INSERT)?;
            entries.iter().try_for_each(|entry| match entry {
                JournalEntry::Event(event) => row::insert(&mut statement, run, None, now, *event),
                JournalEntry::Traced(traced) => decisions::insert(&transaction, machine, traced),
            })
        };
        append().and_then(|()| transaction.commit()).map_err(|error| StoreError::of(&path, error))?;
        let events = entries.iter().filter_map(JournalEntry::event).count();
        self.acknowledged += events as u64;
        Ok(self.acknowledged)
    }

    /// How many events of the session are on the disk.
    #[must_use]
    pub const fn acknowledged(&self) -> u64 {
        self.acknowledged
    }

    /// The session's number among the recordings.
    #[must_use]
    pub const fn recording(&self) -> RecordingKey {
        self.recording
    }

    /// The store in which it is.
    #[must_use]
    pub const fn store(&self) -> &Store {
        &self.store
    }

    /// Ends the session, which changes nothing: all that was acknowledged is there already.
    #[must_use]
    pub fn end(self) -> Store {
        self.store
    }
}
