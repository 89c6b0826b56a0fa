//! What a machine was told and decided comes back as it was, and belongs to a machine that began.

use std::borrow::Cow;

use footplate_core::{Event, EventKind, SpeedStep, Timestamp, TrainId};
use footplate_store::{Journal, JournalEntry, MachineKey, NewMachine, Side, Store, Traced, salvage};

use crate::stores::{Shelf, minute};

const DRIVE: NewMachine<'_> =
    NewMachine { kind: "drive", program: "0.1.0", body: r#"{"number":0.30000000000000004}"# };

fn traced(number: u64) -> Traced {
    let (side, kind) = match number % 3 {
        0 => (Side::Input, "timeout"),
        1 => (Side::Decision, "command"),
        _ => (Side::Decision, "notice"),
    };
    let text = format!("\"{number} \u{b1} ä\"\n");
    Traced { number, time: Timestamp::from_ns(number as i64 * 7), side, kind: Cow::Borrowed(kind), text }
}

fn journal(shelf: &Shelf) -> Journal {
    Journal::begin(shelf.store(), "evening", "track-a", None, &[], minute(0)).unwrap()
}

#[test]
fn a_trace_comes_back_in_its_order_whatever_stands_between() {
    let shelf = Shelf::new();
    let mut journal = journal(&shelf);
    journal.begin_machine(DRIVE, minute(0)).unwrap();
    let event = Event { time: Timestamp::ZERO, kind: EventKind::Reverse { train: TrainId(24) } };
    for number in 0..50 {
        let entries = [JournalEntry::Event(event), JournalEntry::Traced(traced(number))];
        assert_eq!(journal.append_all(&entries, minute(1)).unwrap(), number + 1, "only events are counted");
    }
    // Another machine of the same session counts anew.
    journal.begin_machine(NewMachine { kind: "calibrate", ..DRIVE }, minute(2)).unwrap();
    journal.append_all(&[JournalEntry::Traced(traced(0))], minute(2)).unwrap();

    let store = journal.end();
    let machines = store.machines().unwrap();
    let counts: Vec<_> =
        machines.iter().map(|one| (one.kind.as_str(), one.is_whole, one.inputs, one.decisions)).collect();
    assert_eq!(counts, [("drive", true, 17, 33), ("calibrate", true, 1, 0)]);
    assert_eq!(machines[0].body, DRIVE.body);
    assert_eq!(store.trace(machines[0].key).unwrap(), (0..50).map(traced).collect::<Vec<_>>());
    assert_eq!(store.trace(machines[1].key).unwrap(), [traced(0)]);
    assert_eq!(store.trace(MachineKey(9)).unwrap(), []);
    // And all of it comes over when the store is salvaged.
    drop(store);
    let into = shelf.file("new.db");
    salvage(&shelf.path(), &into).unwrap();
    let salvaged = Store::open(&into).unwrap();
    assert_eq!(salvaged.machines().unwrap(), machines);
    assert_eq!(salvaged.trace(machines[0].key).unwrap(), (0..50).map(traced).collect::<Vec<_>>());
}

#[test]
fn what_no_machine_decided_is_refused_with_all_that_came_together_with_it() {
    let shelf = Shelf::new();
    let mut journal = journal(&shelf);
    let event = Event { time: Timestamp::ZERO, kind: EventKind::Reverse { train: TrainId(24) } };
    let entries = [JournalEntry::Event(event), JournalEntry::Traced(traced(0))];
    assert!(journal.append_all(&entries, minute(1)).is_err());
    assert_eq!(journal.acknowledged(), 0);
    let recording = journal.recording();
    assert!(journal.end().runs(recording, minute(2)).unwrap()[0].events.is_empty());
}

#[test]
fn a_beginning_that_was_changed_from_outside_is_noticed() {
    let shelf = Shelf::new();
    let mut journal = journal(&shelf);
    journal.begin_machine(DRIVE, minute(0)).unwrap();
    drop(journal);
    let other = rusqlite::Connection::open(shelf.path()).unwrap();
    other.execute_batch("DROP TRIGGER machines_are_not_changed; UPDATE machines SET body = '{}'").unwrap();
    assert!(!shelf.store().machines().unwrap()[0].is_whole);
}

#[test]
fn a_session_without_an_end_is_unfinished_with_all_trains_that_may_run() {
    let shelf = Shelf::new();
    assert_eq!(shelf.store().unfinished_session().unwrap(), None);
    let mut journal = journal(&shelf);
    // A train that it began with may have been commanded before that was written down.
    let body = r#"{"models": [{"train": 77, "speed": 1.0}]}"#;
    journal.begin_machine(NewMachine { body, ..DRIVE }, minute(0)).unwrap();
    for (train, step) in [(58, 4), (24, 8), (24, 0), (63, 0)] {
        let (train, step) = (TrainId(train), SpeedStep::new(step).unwrap());
        let event = Event { time: Timestamp::ZERO, kind: EventKind::Speed { train, step } };
        journal.append(&[event], minute(0)).unwrap();
    }
    let unfinished = shelf.store().unfinished_session().unwrap().unwrap();
    assert_eq!(unfinished.name, "evening");
    assert_eq!(unfinished.trains, [24, 58, 63, 77].map(TrainId));
    // It was told the end after all.
    let end = Traced { kind: Cow::Borrowed("end"), ..traced(0) };
    journal.append_all(&[JournalEntry::Traced(end)], minute(1)).unwrap();
    assert_eq!(journal.end().unfinished_session().unwrap(), None);
}

#[test]
fn a_simulated_session_does_not_hide_one_over_a_real_line_that_has_no_end() {
    let shelf = Shelf::new();
    let mut real = journal(&shelf);
    real.begin_machine(NewMachine { body: r#"{"train": 24}"#, ..DRIVE }, minute(0)).unwrap();
    let mut simulated = Journal::begin(real.end(), "demo", "track-a", None, &[], minute(1)).unwrap();
    let body = r#"{"train": 58, "is_simulated": true}"#;
    simulated.begin_machine(NewMachine { body, ..DRIVE }, minute(1)).unwrap();
    let end = Traced { kind: Cow::Borrowed("end"), ..traced(0) };
    simulated.append_all(&[JournalEntry::Traced(end)], minute(1)).unwrap();
    let unfinished = simulated.end().unfinished_session().unwrap().unwrap();
    assert_eq!((unfinished.name.as_str(), unfinished.trains), ("evening", vec![TrainId(24)]));
}

#[test]
fn trains_of_a_damaged_store_are_those_that_can_be_read() {
    let shelf = Shelf::new();
    let mut journal = journal(&shelf);
    journal.begin_machine(NewMachine { body: r#"{"train": 77}"#, ..DRIVE }, minute(0)).unwrap();
    let event = Event { time: Timestamp::ZERO, kind: EventKind::Reverse { train: TrainId(24) } };
    journal.append(&[event], minute(0)).unwrap();
    drop(journal);
    let other = rusqlite::Connection::open(shelf.path()).unwrap();
    other.query_row("PRAGMA wal_checkpoint(TRUNCATE)", [], |_| Ok(())).unwrap();
    let place = |name| {
        let page = "SELECT pageno FROM dbstat WHERE name = ?1";
        other.query_row(page, [name], |row| row.get::<_, usize>(0)).unwrap()
    };
    let size: usize = other.pragma_query_value(None, "page_size", |row| row.get(0)).unwrap();
    let whole = std::fs::read(shelf.path()).unwrap();
    for (table, is_known, trains) in [("machines", false, [24].as_slice()), ("events", true, &[77])] {
        let page = place(table);
        let mut bytes = whole.clone();
        bytes[(page - 1) * size..page * size].fill(0x55);
        let damaged = shelf.file(&format!("{table}.db"));
        std::fs::write(&damaged, bytes).unwrap();
        let store = Store::open(&damaged).unwrap();
        assert_eq!(store.known_trains(), trains.iter().copied().map(TrainId).collect::<Vec<_>>(), "{table}");
        assert_eq!(store.unfinished_session().is_ok_and(|found| found.is_some()), is_known, "{table}");
    }
}

/// Entries that fill a store until they move into archives.
const FILLS: u64 = 1_024;

fn entries(numbers: std::ops::Range<u64>) -> Vec<JournalEntry> {
    numbers.map(traced).map(JournalEntry::Traced).collect()
}

#[test]
fn entries_of_long_sessions_are_archived_and_come_back() {
    let shelf = Shelf::new();
    let mut journal = journal(&shelf);
    journal.begin_machine(DRIVE, minute(0)).unwrap();
    for first in (0..10_000).step_by(500) {
        journal.append_all(&entries(first..first + 500), minute(1)).unwrap();
    }
    // A later session continues where the first left off.
    let mut journal = Journal::begin(journal.end(), "night", "track-a", None, &[], minute(2)).unwrap();
    journal.begin_machine(NewMachine { kind: "tour", ..DRIVE }, minute(2)).unwrap();
    journal.append_all(&entries(0..4_000), minute(2)).unwrap();
    let store = journal.end();
    store.check().unwrap();

    let file = rusqlite::Connection::open(shelf.path()).unwrap();
    let count = |sql: &str| file.query_row(sql, [], |row| row.get::<_, u64>(0)).unwrap();
    let loose = count("SELECT (SELECT count(*) FROM inputs) + (SELECT count(*) FROM decisions)");
    assert!(loose < FILLS, "{loose} entries are outside archives");
    assert_eq!(count("SELECT sum(inputs + decisions) FROM archives") + loose, 14_000);
    let machines = store.machines().unwrap();
    // Every third entry is an input, the first one included.
    let counts: Vec<_> = machines.iter().map(|one| (one.inputs, one.decisions)).collect();
    assert_eq!(counts, [(3_334, 6_666), (1_334, 2_666)]);
    assert_eq!(store.trace(machines[0].key).unwrap(), (0..10_000).map(traced).collect::<Vec<_>>());
    assert_eq!(store.trace(machines[1].key).unwrap(), (0..4_000).map(traced).collect::<Vec<_>>());
    // What is in no archive stays.
    if loose > 0 {
        assert!(file.execute_batch("DELETE FROM inputs; DELETE FROM decisions").is_err());
    }

    let into = shelf.file("new.db");
    let salvaged = salvage(&shelf.path(), &into).unwrap();
    assert!(salvaged.is_all(), "{salvaged:?}");
    let salvaged = Store::open(&into).unwrap();
    assert_eq!(salvaged.machines().unwrap(), machines);
    assert_eq!(salvaged.trace(machines[0].key).unwrap(), (0..10_000).map(traced).collect::<Vec<_>>());
    // A changed archive is noticed.
    file.execute_batch(
        "DROP TRIGGER archives_are_not_changed; UPDATE archives SET last = last + 1 WHERE id = 1",
    )
    .unwrap();
    let damage = store.check().unwrap_err().to_string();
    assert!(damage.contains("row 1 of archives is not as it was written"), "{damage}");
}

#[test]
fn a_session_whose_end_is_in_an_archive_has_ended() {
    let shelf = Shelf::new();
    let mut journal = journal(&shelf);
    journal.begin_machine(DRIVE, minute(0)).unwrap();
    journal.append_all(&entries(0..FILLS - 1), minute(1)).unwrap();
    assert!(shelf.store().unfinished_session().unwrap().is_some());
    let end = Traced { side: Side::Input, kind: Cow::Borrowed("end"), ..traced(FILLS - 1) };
    journal.append_all(&[JournalEntry::Traced(end)], minute(1)).unwrap();
    let store = journal.end();
    let file = rusqlite::Connection::open(shelf.path()).unwrap();
    let inputs: u64 = file.query_row("SELECT count(*) FROM inputs", [], |row| row.get(0)).unwrap();
    assert_eq!((inputs, store.unfinished_session().unwrap()), (0, None));
}

#[test]
fn a_changed_entry_is_not_hidden_in_an_archive() {
    let shelf = Shelf::new();
    let mut journal = journal(&shelf);
    journal.begin_machine(DRIVE, minute(0)).unwrap();
    journal.append_all(&entries(0..FILLS - 1), minute(1)).unwrap();
    let file = rusqlite::Connection::open(shelf.path()).unwrap();
    file.execute_batch("DROP TRIGGER inputs_are_not_changed; UPDATE inputs SET text = 'other' WHERE id = 7")
        .unwrap();
    journal.append_all(&entries(FILLS - 1..FILLS + 1), minute(1)).unwrap();
    let damage = journal.end().check().unwrap_err().to_string();
    assert!(damage.contains("row 7 of inputs is not as it was written"), "{damage}");
}
