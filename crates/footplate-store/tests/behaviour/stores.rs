//! Makes stores in folders of their own, with real recordings in them.

use std::path::PathBuf;

use footplate_core::{Event, EventKind, Report, SensorId, SpeedStep, TimeSpan, Timestamp, TrainId};
use footplate_store::{
    ContentHash, Direction, EventKey, Import, Journal, JournalEntry, NewCalibration, NewMachine,
    RecordingKey, Schedule, Side, Store, Traced, TrainAtStart,
};
use tempfile::TempDir;

use crate::recordings::{ALL, bytes_of, real};

/// A store that vanishes with its folder.
pub(crate) struct Shelf {
    folder: TempDir,
}

impl Shelf {
    pub(crate) fn new() -> Self {
        Self { folder: tempfile::tempdir().unwrap() }
    }

    pub(crate) fn file(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub(crate) fn path(&self) -> PathBuf {
        self.file("railway.db")
    }

    pub(crate) fn store(&self) -> Store {
        Store::open_or_create(&self.path()).unwrap()
    }
}

/// The minute `minutes` of a morning in November 2026.
pub(crate) fn minute(minutes: i64) -> Timestamp {
    Timestamp::from_ns((1_795_248_000 + 60 * minutes) * 1_000_000_000)
}

pub(crate) fn import(store: &mut Store, file: &str, now: Timestamp) -> Import {
    store.import(&real(file), ContentHash::of(&bytes_of(file)), "track-a", now).unwrap()
}

pub(crate) fn import_new(store: &mut Store, file: &str, now: Timestamp) -> RecordingKey {
    match import(store, file, now) {
        Import::New { recording } => recording,
        there @ Import::AlreadyThere { .. } => panic!("{file}: {there:?}"),
    }
}

/// JSON of this many numbers that hardly compress.
pub(crate) fn long_json(seed: u64, numbers: u64) -> String {
    /// Knuth's multiplier of a 64-bit congruential generator.
    const MULTIPLIER: u64 = 6_364_136_223_846_793_005;
    let number = |nth: u64| (seed + nth).wrapping_mul(MULTIPLIER).wrapping_mul(MULTIPLIER | 1) >> 20;
    let numbers: Vec<u64> = (0..numbers).map(number).collect();
    format!(r#"{{"layout":"track-a","train":24,"numbers":{numbers:?}}}"#)
}

/// The inputs and decisions of a machine, with the reports and directions between.
fn entries(number: u64) -> Vec<JournalEntry> {
    let time = Timestamp::ZERO + TimeSpan::from_ms(number as i64);
    let (side, kind) =
        if number.is_multiple_of(3) { (Side::Input, "report") } else { (Side::Decision, "command") };
    let text = format!("\"{number} of a session\"");
    let mut entries = vec![JournalEntry::Traced(Traced { number, time, side, kind: kind.into(), text })];
    if number.is_multiple_of(3) {
        let report = Report { sensor: SensorId(16), poll_interval: None };
        entries.push(JournalEntry::Event(Event { time, kind: EventKind::Sensor(report) }));
    }
    if number.is_multiple_of(50) {
        let forward = number.is_multiple_of(100);
        entries.push(JournalEntry::Direction(Direction { train: TrainId(24), forward }));
    }
    entries
}

/// Drives a session into a store by its journal, an entry a commit or many; every table has rows then.
pub(crate) fn drive(mut store: Store, session: u64, entries_a_commit: usize, length: u64) -> Journal {
    if session == 0 {
        // Light gates.
        import_new(&mut store, ALL[8], minute(0));
        store.exclude(&[EventKey(3)], "a child lifted the train", minute(1)).unwrap();
        store.keep_profile(TrainId(24), None, minute(1)).unwrap();
        let lines = vec!["go 24 to C13".to_owned()];
        let schedule = Schedule { name: "morning".to_owned(), lines, rounds: None, is_button: false };
        store.keep_schedule("track-a", &schedule, minute(1)).unwrap();
    }
    let now = minute(10 * session as i64 + 2);
    let model = long_json(session, 800);
    let model = NewCalibration { train: TrainId(24), as_of: now, model_version: "7", body: &model };
    store.keep_calibration(model, now).unwrap();
    let trains = [24, 58].map(|train| TrainAtStart { train: TrainId(train), step: SpeedStep::STAND });
    let mut journal = Journal::begin(store, "evening", "track-a", Some(now), &trains, now).unwrap();
    let machine = long_json(session + 100, 2_000);
    journal.begin_machine(NewMachine { kind: "drive", program: "1", body: &machine }, now).unwrap();
    let all: Vec<u64> = (0..length).collect();
    for some in all.chunks(entries_a_commit) {
        let some: Vec<JournalEntry> = some.iter().flat_map(|number| entries(*number)).collect();
        journal.append_all(&some, now).unwrap();
    }
    journal.begin_run(Some(now), &trains).unwrap();
    journal
}
