//! The journal on a slow, full or failing disk, and what a power cut leaves of it.
//!
//! The store is real. The disk is simulated between commits: when a commit ends, whether it fails, and which sectors of the
//! last commit survive a power cut. SQLite waits for the disk once in a commit (`synchronous = FULL`); sectors written
//! before that wait may reach the disk in any order, or not at all.

use std::collections::VecDeque;
use std::fs;
use std::path::{Path, PathBuf};
use std::rc::Rc;

use anyhow::{Context, bail, ensure};
use footplate_core::{Event, EventKind, TimeSpan, Timestamp, TrainId};
use footplate_eval::seeds::Choice;
use footplate_store::{Direction, Journal, JournalEntry, NewMachine, Side, Store, Traced};

use super::life::Life;
use super::plan::{Planned, Trouble};
use crate::clock::LATEST;
use crate::runtime::Recorder;
use crate::session_journal::IfUnkept;

/// The duration of a commit on a sound disk (measured: 2 to 8 ms).
const COMMIT: TimeSpan = TimeSpan::from_ms(5);
/// The pause after a failure, as in the writing thread of a session.
const RETRY: TimeSpan = TimeSpan::from_ms(500);
/// The unit that a disk writes as a whole.
const SECTOR: usize = 512;

/// Entries of a commit that has not ended.
#[derive(Debug)]
struct Commit {
    entries: usize,
    ends: Timestamp,
    fails: bool,
}

/// The recorder of one life of the program.
pub(super) struct FaultyDisk {
    journal: Journal,
    path: PathBuf,
    life: Rc<Life>,
    troubles: Vec<Planned>,
    began: Timestamp,
    /// The calendar of the computer, when the life began.
    calendar: Timestamp,
    pending: VecDeque<JournalEntry>,
    commit: Option<Commit>,
    retry_at: Timestamp,
    is_in_trouble: bool,
    if_unkept: IfUnkept,
    /// All entries passed on, in order.
    recorded: Vec<Event>,
    acknowledged: usize,
    now: Timestamp,
    is_closing: bool,
}

impl FaultyDisk {
    /// Begins a session in the store at `path`.
    pub(super) fn begin(
        path: &Path,
        trains: &[TrainId],
        life: Rc<Life>,
        troubles: &[Planned],
        if_unkept: IfUnkept,
        began: Timestamp,
        calendar: Timestamp,
    ) -> anyhow::Result<Self> {
        let store = Store::open_or_create(path)?;
        let mut journal = Journal::begin(store, "chaos", "track-a", None, &[], calendar)?;
        let trains: Vec<_> = trains.iter().map(|train| serde_json::json!({ "train": train.0 })).collect();
        let body = serde_json::json!({ "trains": trains }).to_string();
        journal.begin_machine(NewMachine { kind: "drive", program: "chaos", body: &body }, calendar)?;
        Ok(Self {
            journal,
            path: path.to_owned(),
            life,
            troubles: troubles.to_vec(),
            began,
            calendar,
            pending: VecDeque::new(),
            commit: None,
            retry_at: began,
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
            self.is_in_trouble = commit.fails;
            if commit.fails {
                self.retry_at = commit.ends + RETRY;
            } else {
                self.append(commit.entries)?;
            }
        }
        if self.commit.is_none() && !self.pending.is_empty() && now >= self.retry_at {
            let slow = self.trouble(now, |trouble| match trouble {
                Trouble::DiskSlow(takes) => Some(takes),
                _ => None,
            });
            let fails = self.trouble(now, |trouble| (trouble == Trouble::DiskFull).then_some(())).is_some();
            let ends = now + slow.unwrap_or(COMMIT);
            self.commit = Some(Commit { entries: self.pending.len(), ends, fails });
        }
        Ok(())
    }

    fn append(&mut self, count: usize) -> anyhow::Result<()> {
        let entries: Vec<JournalEntry> = self.pending.drain(..count).collect();
        let calendar = self.calendar(self.now);
        self.acknowledged = usize::try_from(self.journal.append_all(&entries, calendar)?)?;
        Ok(())
    }

    /// Ends the session in order: writes all waiting entries, and its end.
    pub(super) fn finish(mut self) -> anyhow::Result<()> {
        self.append(self.pending.len())?;
        let end =
            Traced { number: 0, time: self.now, side: Side::Input, kind: "end".into(), text: String::new() };
        self.journal.append_all(&[JournalEntry::Traced(end)], self.calendar(self.now))?;
        let (path, recorded, acknowledged) = (self.path.clone(), self.recorded.clone(), self.acknowledged);
        drop(self);
        kept(&path, &recorded, acknowledged, acknowledged)
    }

    /// The commands that were sent, with their times.
    pub(super) fn sent(&self) -> Vec<(Timestamp, String)> {
        let is_command = |event: &&Event| !matches!(event.kind, EventKind::Sensor(_) | EventKind::Freed(_));
        let commands = self.recorded.iter().filter(is_command);
        commands.map(|event| (event.time, format!("sent: {:?}", event.kind))).collect()
    }

    /// The program dies. The store must hold all acknowledged entries, and no others than recorded ones.
    pub(super) fn die(self) -> anyhow::Result<()> {
        let (path, recorded, acknowledged) = (self.path.clone(), self.recorded.clone(), self.acknowledged);
        drop(self);
        kept(&path, &recorded, acknowledged, acknowledged)
    }

    /// The computer loses its power, perhaps in the middle of a commit.
    pub(super) fn lose_power(mut self, choice: &mut Choice) -> anyhow::Result<()> {
        let acknowledged = self.acknowledged;
        let uncommitted = self.commit.as_ref().map_or(0, |commit| commit.entries);
        let before = Image::of(&self.path)?;
        self.append(uncommitted)?;
        let after = Image::of(&self.path)?;
        let (path, recorded) = (self.path.clone(), self.recorded.clone());
        drop(self);
        before.torn(&after, choice).write(&path)?;
        kept(&path, &recorded, acknowledged, acknowledged + uncommitted)
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

/// The files of a store: what would be there after a power cut between two commits.
struct Image {
    file: Vec<u8>,
    log: Vec<u8>,
}

impl Image {
    fn of(path: &Path) -> anyhow::Result<Self> {
        Ok(Self { file: fs::read(path)?, log: fs::read(beside(path, "-wal")).unwrap_or_default() })
    }

    /// A power cut before the disk had said that the second image was written: the file of before, as the log is moved into it
    /// only once it is on the disk, and of the log any of the sectors that are new.
    fn torn(self, after: &Self, choice: &mut Choice) -> Self {
        let mut log = self.log.clone();
        for (nth, new) in after.log.chunks(SECTOR).enumerate() {
            let at = nth * SECTOR;
            let old = self.log.get(at..(at + SECTOR).min(self.log.len())).unwrap_or_default();
            if old == new || choice.between(0.0, 1.0) < 0.5 {
                continue;
            }
            if log.len() < at + new.len() {
                log.resize(at + new.len(), 0);
            }
            log[at..at + new.len()].copy_from_slice(new);
        }
        Self { file: self.file, log }
    }

    fn write(&self, path: &Path) -> anyhow::Result<()> {
        fs::write(path, &self.file)?;
        fs::write(beside(path, "-wal"), &self.log)?;
        // SQLite makes it again from the log.
        let _ = fs::remove_file(beside(path, "-shm"));
        Ok(())
    }
}

fn beside(path: &Path, ending: &str) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(ending);
    name.into()
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
