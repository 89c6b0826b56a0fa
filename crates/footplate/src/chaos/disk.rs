//! The journal on a slow, full or failing disk, and what a power cut leaves of it.
//!
//! The store is real, and SQLite itself meets the failures, on [files](super::files) of their own. Here is when: a commit that a full
//! disk cuts short, one that the disk does not confirm, and one that is cut off in the middle by the death of the program or the
//! computer. SQLite waits for the disk once in a commit (`synchronous = FULL`).

use std::collections::VecDeque;
use std::path::Path;
use std::rc::Rc;

use anyhow::{Context, bail, ensure};
use footplate_core::{Event, EventKind, TimeSpan, Timestamp, TrainId};
use footplate_eval::seeds::Choice;
use footplate_store::{Direction, Journal, JournalEntry, NewMachine, Side, Store, Traced};

use super::files::{Fault, StoreDisk};
use super::life::Life;
use super::plan::{Planned, Trouble};
use crate::clock::LATEST;
use crate::runtime::Recorder;
use crate::session_journal::IfUnkept;

/// The duration of a commit on a sound disk (measured: 2 to 8 ms).
const COMMIT: TimeSpan = TimeSpan::from_ms(5);
/// The pause after a failure, as in the writing thread of a session.
const RETRY: TimeSpan = TimeSpan::from_ms(500);
/// What a full disk takes of a commit (bytes, at most): a few pages, each with its header in the log.
const ROOM: f64 = 20_000.0;
/// After how many operations on its files a commit is cut off, at most. Most take a dozen, and one that moves the log into the file a
/// thousand; so the logarithm of the number is drawn.
const OPERATIONS: f64 = 3_000.0;

/// Entries of a commit that has not ended.
#[derive(Debug)]
struct Commit {
    entries: usize,
    ends: Timestamp,
    fault: Option<Fault>,
}

/// The recorder of one life of the program.
pub(super) struct FaultyDisk {
    journal: Journal,
    files: StoreDisk,
    choice: Choice,
    life: Rc<Life>,
    troubles: Vec<Planned>,
    began: Timestamp,
    /// The calendar of the computer, when the life began.
    calendar: Timestamp,
    pending: VecDeque<JournalEntry>,
    commit: Option<Commit>,
    retry_at: Timestamp,
    /// Waiting entries of a commit that the disk did not confirm, and may have written all the same.
    unconfirmed: usize,
    is_in_trouble: bool,
    if_unkept: IfUnkept,
    /// All entries passed on, in order.
    recorded: Vec<Event>,
    acknowledged: usize,
    now: Timestamp,
    is_closing: bool,
}

impl FaultyDisk {
    /// Begins a session in the store on a disk.
    pub(super) fn begin(
        files: StoreDisk,
        trains: &[TrainId],
        life: Rc<Life>,
        troubles: &[Planned],
        if_unkept: IfUnkept,
        began: Timestamp,
        calendar: Timestamp,
    ) -> anyhow::Result<Self> {
        let store = Store::open_or_create(&files.path)?;
        let mut journal = Journal::begin(store, "chaos", "track-a", None, &[], calendar)?;
        let trains: Vec<_> = trains.iter().map(|train| serde_json::json!({ "train": train.0 })).collect();
        let body = serde_json::json!({ "trains": trains }).to_string();
        journal.begin_machine(NewMachine { kind: "drive", program: "chaos", body: &body }, calendar)?;
        Ok(Self {
            journal,
            files,
            choice: Choice::new(began.as_ns() as u64),
            life,
            troubles: troubles.to_vec(),
            began,
            calendar,
            pending: VecDeque::new(),
            commit: None,
            retry_at: began,
            unconfirmed: 0,
            is_in_trouble: false,
            if_unkept,
            recorded: Vec::new(),
            acknowledged: 0,
            now: began,
            is_closing: false,
        })
    }

    /// The loop has ended: what a full disk does not take of the last commands is no news any more.
    pub(super) const fn close(&mut self) {
        self.is_closing = true;
    }

    fn age(&self, now: Timestamp) -> Timestamp {
        Timestamp::ZERO + (now - self.began)
    }

    fn trouble<T>(&self, now: Timestamp, pick: impl Fn(Trouble) -> Option<T>) -> Option<T> {
        let age = self.age(now);
        self.troubles
            .iter()
            .filter(|planned| planned.spell.covers(age))
            .find_map(|planned| pick(planned.trouble))
    }

    /// The time of the computer's calendar.
    fn calendar(&self, now: Timestamp) -> Timestamp {
        let jump = self.trouble(now, |trouble| match trouble {
            Trouble::Calendar(jump) => Some(jump),
            _ => None,
        });
        self.calendar + (now - self.began) + jump.unwrap_or(TimeSpan::ZERO)
    }

    /// Advances the disk to a time.
    pub(super) fn advance(&mut self, now: Timestamp) -> anyhow::Result<()> {
        self.now = now;
        if let Some(commit) = self.commit.take_if(|commit| commit.ends <= now) {
            self.files.fails(commit.fault);
            let appended = self.append(commit.entries);
            self.files.fails(None);
            self.is_in_trouble = appended.is_err();
            self.unconfirmed = if self.is_in_trouble { commit.entries } else { 0 };
            if self.is_in_trouble {
                self.retry_at = commit.ends + RETRY;
            }
            if commit.fault.is_none() {
                appended?;
            }
        }
        if self.commit.is_none() && !self.pending.is_empty() && now >= self.retry_at {
            let slow = self.trouble(now, |trouble| match trouble {
                Trouble::DiskSlow(takes) => Some(takes),
                _ => None,
            });
            let fails = self.trouble(now, |trouble| (trouble == Trouble::DiskFails).then_some(())).is_some();
            let fault = fails.then(|| match self.choice.between(0.0, 1.0) < 0.5 {
                true => Fault::Full(self.choice.between(0.0, ROOM) as usize),
                false => Fault::Unsynced(0),
            });
            let ends = now + slow.unwrap_or(COMMIT);
            self.commit = Some(Commit { entries: self.pending.len(), ends, fault });
        }
        Ok(())
    }

    fn append(&mut self, count: usize) -> anyhow::Result<()> {
        let calendar = self.calendar(self.now);
        let entries = self.pending.make_contiguous().get(..count).unwrap_or_default();
        self.acknowledged = usize::try_from(self.journal.append_all(entries, calendar)?)?;
        self.pending.drain(..count);
        Ok(())
    }

    /// Ends the session in order: writes all waiting entries, and its end.
    pub(super) fn finish(mut self) -> anyhow::Result<()> {
        self.append(self.pending.len())?;
        let end =
            Traced { number: 0, time: self.now, side: Side::Input, kind: "end".into(), text: String::new() };
        self.journal.append_all(&[JournalEntry::Traced(end)], self.calendar(self.now))?;
        let (files, recorded, acknowledged) = (self.files.clone(), self.recorded.clone(), self.acknowledged);
        drop(self);
        kept(&files.path, &recorded, acknowledged, acknowledged)
    }

    /// The commands that were sent, with their times.
    pub(super) fn sent(&self) -> Vec<(Timestamp, String)> {
        let is_command = |event: &&Event| !matches!(event.kind, EventKind::Sensor(_) | EventKind::Freed(_));
        let commands = self.recorded.iter().filter(is_command);
        commands.map(|event| (event.time, format!("sent: {:?}", event.kind))).collect()
    }

    /// The program dies, perhaps in the middle of a commit. What it wrote stays.
    pub(super) fn die(self) -> anyhow::Result<()> {
        self.cut_off(|files| {
            files.restart();
            Ok(())
        })
    }

    /// The computer loses its power, perhaps in the middle of a commit.
    pub(super) fn lose_power(self) -> anyhow::Result<()> {
        self.cut_off(StoreDisk::lose_power)
    }

    /// Nothing reaches the files any more, perhaps in the middle of a commit. The store must hold all acknowledged entries, and no others
    /// than recorded ones.
    fn cut_off(mut self, end: impl FnOnce(&StoreDisk) -> std::io::Result<()>) -> anyhow::Result<()> {
        let uncommitted = self.commit.as_ref().map_or(0, |commit| commit.entries);
        let most = self.acknowledged + uncommitted.max(self.unconfirmed);
        if uncommitted > 0 {
            let operations = libm::exp(self.choice.between(0.0, libm::log(OPERATIONS))) as usize;
            self.files.fails(Some(Fault::Over(operations)));
            // It is not known whether it ended before.
            let _ = self.append(uncommitted);
        }
        let (files, recorded) = (self.files.clone(), self.recorded.clone());
        let least = self.acknowledged;
        files.fails(Some(Fault::Over(0)));
        drop(self);
        end(&files)?;
        kept(&files.path, &recorded, least, most)
    }
}

impl Recorder for FaultyDisk {
    fn record(&mut self, events: &[Event]) -> anyhow::Result<()> {
        if !self.life.step() {
            ensure!(self.is_closing, "this program is dead");
            return Ok(());
        }
        self.pending.extend(events.iter().copied().map(JournalEntry::Event));
        self.recorded.extend(events);
        if self.is_in_trouble && !self.is_closing && self.if_unkept == IfUnkept::Stop {
            bail!("the session cannot be written down: the disk is full");
        }
        Ok(())
    }

    fn record_direction(&mut self, direction: Direction) {
        self.pending.push_back(JournalEntry::Direction(direction));
    }
}

/// Checks that the last session of a store holds the recorded entries in order: at least the acknowledged ones, and none
/// beyond those of the unfinished commit.
fn kept(path: &Path, recorded: &[Event], least: usize, most: usize) -> anyhow::Result<()> {
    let store = Store::open(path).context("the store cannot be opened after its program died")?;
    store.check()?;
    let recordings = store.recordings(LATEST)?;
    let session = recordings.last().context("the session is not in the store")?;
    let runs = store.runs(session.key, LATEST)?;
    let events: Vec<Event> = runs.iter().flat_map(|run| &run.events).map(|stored| stored.raw.event).collect();
    ensure!(
        (least..=most).contains(&events.len()),
        "{} events are in the store, {least} were acknowledged and {} not committed yet",
        events.len(),
        most - least
    );
    let first_other = events.iter().zip(recorded).position(|(one, other)| one != other);
    ensure!(first_other.is_none(), "event {first_other:?} is not what was recorded");
    Ok(())
}

#[cfg(test)]
mod tests {
    use tempfile::TempDir;

    use super::*;

    /// Entries that were acknowledged before the disk fails, and in all.
    const BEFORE: usize = 100;
    const ALL: usize = 1_000;

    fn events() -> Vec<Event> {
        let at = |nth: usize| Timestamp::ZERO + TimeSpan::from_ms(nth as i64);
        (0..ALL).map(|nth| Event { time: at(nth), kind: EventKind::Reverse { train: TrainId(24) } }).collect()
    }

    /// A session some of whose entries are acknowledged.
    struct Trial {
        files: StoreDisk,
        journal: Journal,
        _folder: TempDir,
    }

    impl Trial {
        fn begin(seed: u64) -> Self {
            let folder = tempfile::tempdir().expect("a folder");
            let path = folder.path().join("store.db");
            let files = StoreDisk::under(&path, seed).expect("a disk");
            let store = Store::open_or_create(&path).expect("a store");
            let mut journal =
                Journal::begin(store, "drive", "track-a", None, &[], Timestamp::ZERO).expect("a session");
            let machine = NewMachine { kind: "drive", program: "", body: "{}" };
            journal.begin_machine(machine, Timestamp::ZERO).expect("a machine");
            let mut trial = Self { files, journal, _folder: folder };
            assert!(trial.append(0..BEFORE), "the disk is sound");
            trial
        }

        fn append(&mut self, range: std::ops::Range<usize>) -> bool {
            let entries: Vec<_> = events()[range].iter().copied().map(JournalEntry::Event).collect();
            self.journal.append_all(&entries, Timestamp::ZERO).is_ok()
        }

        /// The program dies, and perhaps the computer with it. Checks what is left, and that a new session can be written down.
        fn end(self, is_power_cut: bool, least: usize) {
            self.files.fails(Some(Fault::Over(0)));
            drop(self.journal);
            match is_power_cut {
                true => self.files.lose_power().expect("the files are there"),
                false => self.files.restart(),
            }
            kept(&self.files.path, &events(), least, ALL)
                .expect("all that was acknowledged, and no more than was recorded");
            let store = Store::open(&self.files.path).expect("a store");
            Journal::begin(store, "drive", "track-a", None, &[], Timestamp::ZERO).expect("a new session");
        }
    }

    #[test]
    fn a_commit_that_is_cut_off_anywhere_takes_nothing_with_it() {
        for is_power_cut in [false, true] {
            for operations in 0.. {
                let mut trial = Trial::begin(operations);
                trial.files.fails(Some(Fault::Over(operations as usize)));
                let is_acknowledged = trial.append(BEFORE..ALL);
                let was_cut_off = trial.files.has_refused();
                assert_ne!(is_acknowledged, was_cut_off, "after {operations} operations");
                trial.end(is_power_cut, if is_acknowledged { ALL } else { BEFORE });
                if !was_cut_off {
                    assert!(operations > 20, "a commit writes several pages, and waits for the disk");
                    break;
                }
            }
        }
    }

    #[test]
    fn a_commit_that_fails_is_tried_again_and_kept() {
        let full = (0..100).map(|nth| Fault::Full(500 * nth));
        for (nth, fault) in full.chain((0..4).map(Fault::Unsynced)).enumerate() {
            let mut trial = Trial::begin(nth as u64);
            trial.files.fails(Some(fault));
            let is_acknowledged = trial.append(BEFORE..ALL);
            assert_ne!(is_acknowledged, trial.files.has_refused(), "{fault:?}");
            trial.files.fails(None);
            assert!(is_acknowledged || trial.append(BEFORE..ALL), "{fault:?}");
            trial.end(true, ALL);
        }
    }
}
