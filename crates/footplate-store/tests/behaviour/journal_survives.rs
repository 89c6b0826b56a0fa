//! A live session is written down as it happens, and no acknowledged event of it is lost, whoever is killed when.

use std::borrow::Cow;
use std::thread;
use std::time::Duration;

use footplate_core::{Event, EventKind, Report, SensorId, SpeedStep, Timestamp, TrainId};
use footplate_store::{Journal, JournalEntry, NewMachine, Side, Store, StoreError, Traced, TrainAtStart};

use crate::child_process::{ChildProcess, say, store_of_parent};
use crate::drawn_moments::DrawnMoments;
use crate::stores::{Shelf, minute};

/// Events of a run in the child, chosen: a commit hits the change of runs often.
const RUN: usize = 13;

fn event(number: usize) -> Event {
    let time = Timestamp::from_ns(20_000_000 * number as i64);
    let kind = if number.is_multiple_of(5) {
        EventKind::Speed { train: TrainId(24), step: SpeedStep::new((number % 15) as u8).unwrap() }
    } else {
        EventKind::Sensor(Report { sensor: SensorId((number % 80) as u16), poll_interval: None })
    };
    Event { time, kind }
}

/// Sessions that are killed: enough that a commit is hit in its every part, in some seconds.
const KILLS: usize = 30;
/// A kill comes so long (µs) after the first word: a commit takes some milliseconds.
const KILLED_WITHIN_US: std::ops::Range<u64> = 0..60_000;

/// Behind every event the machine is told of it, and decides something.
fn traced(number: usize) -> [Traced; 2] {
    let time = event(number).time;
    let [told, decided] =
        [(Side::Input, "event"), (Side::Decision, "command")].map(|(side, kind)| (side, Cow::Borrowed(kind)));
    [(0, told), (1, decided)].map(|(place, (side, kind))| Traced {
        number: 2 * number as u64 + place,
        time,
        side,
        kind,
        text: format!("of {number}"),
    })
}

const STANDING: TrainAtStart = TrainAtStart { train: TrainId(24), step: SpeedStep::STAND };

#[test]
#[ignore = "the process that is killed"]
fn writes_down_until_killed() {
    let Some(path) = store_of_parent() else { return };
    let store = Store::open_or_create(&path).unwrap();
    let mut journal =
        Journal::begin(store, "evening", "track-a", Some(minute(0)), &[STANDING], minute(0)).unwrap();
    journal.begin_machine(NewMachine { kind: "drive", program: "1", body: "{}" }, minute(0)).unwrap();
    // As a link brings them: one by one, sometimes two or three together.
    for group in [1, 1, 3, 1, 2].iter().cycle() {
        let from = journal.acknowledged() as usize;
        let of_one = |number| {
            let traced = traced(number).map(JournalEntry::Traced);
            [JournalEntry::Event(event(number))].into_iter().chain(traced)
        };
        let entries: Vec<JournalEntry> = (from..from + group).flat_map(of_one).collect();
        if from / RUN != (from + group) / RUN {
            journal.begin_run(Some(minute(1)), &[STANDING]).unwrap();
        }
        say(journal.append_all(&entries, minute(1)).unwrap());
    }
}

#[test]
fn every_acknowledged_event_and_decision_of_a_session_is_there_after_a_kill() {
    let mut moments = DrawnMoments::new();
    for kill in 0..KILLS {
        let wait = moments.wait_us(KILLED_WITHIN_US);
        println!("kill {kill} of seed {}: after {wait:?}", moments.seed);
        let shelf = Shelf::new();
        let mut child = ChildProcess::start("journal_survives::writes_down_until_killed", &shelf.path());
        let mut acknowledged: usize = child.next_word().unwrap().parse().unwrap();
        thread::sleep(wait);
        child.kill();
        while let Some(word) = child.next_word() {
            acknowledged = word.parse().unwrap();
        }

        let store = Store::open(&shelf.path()).unwrap();
        store.check().unwrap();
        let recording = &store.recordings(minute(2)).unwrap()[0];
        assert_eq!((recording.name.as_str(), recording.form.as_str()), ("evening", "live"));
        let runs = store.runs(recording.key, minute(2)).unwrap();
        let events: Vec<Event> =
            runs.iter().flat_map(|run| &run.events).map(|stored| stored.raw.event).collect();
        assert!(events.len() >= acknowledged, "{} of {acknowledged} are there", events.len());
        assert!(events.iter().enumerate().all(|(number, stored)| *stored == event(number)));
        assert!(runs.iter().all(|run| run.trains == [STANDING]));
        // What followed from the events came with them, whole.
        let machine = store.machines().unwrap()[0].key;
        let followed: Vec<Traced> = (0..events.len()).flat_map(traced).collect();
        assert_eq!(store.trace(machine).unwrap(), followed);
        // And the next session begins as if nothing had happened.
        let mut next = Journal::begin(store, "next", "track-a", None, &[], minute(3)).unwrap();
        assert_eq!(next.append(&[event(1), event(2)], minute(3)).unwrap(), 2);
    }
}

#[test]
fn a_session_that_could_not_be_kept_for_a_while_loses_nothing_and_repeats_nothing() {
    let shelf = Shelf::new();
    let store = shelf.store().with_patience(Duration::from_millis(1)).unwrap();
    let mut journal = Journal::begin(store, "evening", "track-a", None, &[], minute(0)).unwrap();
    journal.append(&[event(0)], minute(0)).unwrap();
    // Given somebody else who is writing,
    let mut other = ChildProcess::start("store_shared::writes_until_told", &shelf.path());
    assert_eq!(other.next_word().as_deref(), Some("writing"));
    // then the event is refused with the reason, and can be handed over again once the other has ended.
    let refused = journal.append(&[event(1)], minute(0)).unwrap_err();
    assert!(matches!(refused, StoreError::InUse(_)), "{refused}");
    assert_eq!(journal.acknowledged(), 1);
    other.let_end();
    assert_eq!(journal.append(&[event(1), event(2)], minute(0)).unwrap(), 3);
    let recording = journal.recording();
    let store = journal.end();
    let runs = store.runs(recording, minute(1)).unwrap();
    let times: Vec<Timestamp> = runs[0].events.iter().map(|stored| stored.raw.event.time).collect();
    assert_eq!(times, [0, 20, 40].map(|ms| Timestamp::from_ns(ms * 1_000_000)));
}
