//! The journal of a live session: reports and commands, on disk as they happen.
//!
//! A session is a recording; a part of it with a continuous clock, in which no train is lifted, is a run. An event is
//! acknowledged once it is on disk (write-ahead log, `synchronous = FULL`: one wait for the disk a call). Acknowledged
//! events survive the death of the process and a power cut. The caller passes events together that arrived together; the
//! journal does not wait for more.

use footplate_core::{Event, RunId, Timestamp};

use super::archives;
use super::decisions::{self, MachineKey, NewMachine, Traced};
use super::directions::{self, Direction};
use super::error::StoreError;
use super::file::Store;
use super::keys::{RecordingKey, RunKey};
use super::row;
use crate::recording::TrainAtStart;

/// An entry of a session.
#[derive(Debug, Clone, PartialEq)]
pub enum JournalEntry {
    /// A report of the railway, or a command to it.
    Event(Event),
    /// An input or a decision of the machine that began last.
    Traced(Traced),
    /// The direction that a train was commanded in.
    Direction(Direction),
}

impl JournalEntry {
    /// The event, if it is one.
    pub const fn event(&self) -> Option<&Event> {
        match self {
            Self::Event(event) => Some(event),
            Self::Traced(_) | Self::Direction(_) => None,
        }
    }
}

/// No row has this number: the store refuses entries without a machine.
const NO_MACHINE: MachineKey = MachineKey(0);

/// The recorder of a live session.
#[derive(Debug)]
pub struct Journal {
    store: Store,
    recording: RecordingKey,
    run: RunKey,
    number: u32,
    machine: Option<MachineKey>,
    acknowledged: u64,
    /// Inputs and decisions that are not in an archive yet.
    loose: u64,
}

impl Journal {
    /// Begins a session on `layout` with its first run, whose clock was zero at `began_at`. `now` is the time since the Unix
    /// epoch, as everywhere in a store.
    ///
    /// # Errors
    /// The store cannot be written, which shows before the first train moves.
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
        let mut journal = Self { store, recording, run, number: 1, machine: None, acknowledged: 0, loose: 0 };
        journal.archive_loose()?;
        Ok(journal)
    }

    /// Moves what earlier sessions, or an older Footplate, left outside archives, if it is much.
    fn archive_loose(&mut self) -> Result<(), StoreError> {
        let path = self.store.path().to_owned();
        let transaction = self.store.write()?;
        let archive = || {
            let loose = archives::loose_count(&transaction)?;
            if loose < archives::MOST_LOOSE {
                return Ok(loose);
            }
            archives::archive(&transaction)?;
            Ok(0)
        };
        let loose = archive().and_then(|loose| transaction.commit().map(|()| loose));
        self.loose = loose.map_err(|error| StoreError::of(&path, error))?;
        Ok(())
    }

    /// Begins the next run: the clock has jumped, a train was lifted, or other trains take part. `began_at` as above;
    /// `trains` are their present states.
    ///
    /// # Errors
    /// The store cannot be written; the present run continues.
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

    /// Begins a machine, to which the following traced entries belong.
    ///
    /// # Errors
    /// The store cannot be written, which shows before the first train moves.
    pub fn begin_machine(&mut self, new: NewMachine<'_>, now: Timestamp) -> Result<(), StoreError> {
        self.machine = Some(self.store.begin_machine(self.recording, new, now)?);
        Ok(())
    }

    /// Appends events in order. All of them are on disk when this returns. Returns the number of events of the session on
    /// disk.
    ///
    /// # Errors
    /// None of these events was acknowledged. They can be passed again: no event is stored twice.
    pub fn append(&mut self, events: &[Event], now: Timestamp) -> Result<u64, StoreError> {
        let entries: Vec<JournalEntry> = events.iter().copied().map(JournalEntry::Event).collect();
        self.append_all(&entries, now)
    }

    /// The same for all kinds of entries: in order, and all of them or none.
    ///
    /// # Errors
    /// As [`append`](Self::append); and for a traced entry before the first machine.
    pub fn append_all(&mut self, entries: &[JournalEntry], now: Timestamp) -> Result<u64, StoreError> {
        if entries.is_empty() {
            return Ok(self.acknowledged);
        }
        let path = self.store.path().to_owned();
        let (run, machine) = (self.run, self.machine.unwrap_or(NO_MACHINE));
        let transaction = self.store.write()?;
        let events = entries.iter().filter_map(JournalEntry::event).count() as u64;
        let is_traced = |entry: &&JournalEntry| matches!(entry, JournalEntry::Traced(_));
        let loose = self.loose + entries.iter().filter(is_traced).count() as u64;
        let is_much = loose >= archives::MOST_LOOSE;
        let append = || {
            let mut statement = transaction.prepare_cached(row::INSERT)?;
            entries.iter().try_for_each(|entry| match entry {
                JournalEntry::Event(event) => row::insert(&mut statement, run, None, now, *event),
                JournalEntry::Traced(traced) => decisions::insert(&transaction, machine, traced),
                JournalEntry::Direction(direction) => directions::insert(&transaction, *direction, now),
            })?;
            if is_much { archives::archive(&transaction) } else { Ok(()) }
        };
        append().and_then(|()| transaction.commit()).map_err(|error| StoreError::of(&path, error))?;
        self.acknowledged += events;
        self.loose = if is_much { 0 } else { loose };
        Ok(self.acknowledged)
    }

    /// The number of events of the session on disk.
    pub const fn acknowledged(&self) -> u64 {
        self.acknowledged
    }

    /// The session's number among the recordings.
    pub const fn recording(&self) -> RecordingKey {
        self.recording
    }

    /// Its store.
    pub const fn store(&self) -> &Store {
        &self.store
    }

    /// Ends the session and returns the store. Nothing is written: all acknowledged entries are on disk.
    #[must_use]
    pub fn end(self) -> Store {
        self.store
    }
}
