//! No acknowledged measurement is lost, whenever the process that wrote it is killed.

use footplate_core::{Event, EventKind, Report, RunId, SensorId, Timestamp};
use footplate_store::{ContentHash, Store};

use crate::child_process::{ChildProcess, say, store_of_parent};
use crate::drawn_moments::DrawnMoments;
use crate::recordings::{ALL, real};
use crate::stores::{Shelf, import_new, minute};

/// Processes that are killed: enough that a commit is hit in its every part, in some seconds.
const KILLS: usize = 24;
const KILLED_IMPORTS: usize = 10;
/// A kill comes so long (µs) after the word it waits for: a commit takes some milliseconds.
const KILLED_WITHIN_US: std::ops::Range<u64> = 0..10_000;

/// How many events go to the disk together in the child: commits of one page and of many.
const BATCHES: [usize; 3] = [1, 7, 400];

fn report(number: usize) -> Event {
    let kind = EventKind::Sensor(Report { sensor: SensorId((number % 80) as u16), poll_interval: None });
    Event { time: Timestamp::from_ns(number as i64), kind }
}

#[test]
#[ignore = "the process that is killed"]
fn appends_until_killed() {
    let Some(path) = store_of_parent() else { return };
    let mut store = Store::open_or_create(&path).unwrap();
    let recording = store.begin_recording("live", "track-a", minute(0)).unwrap();
    let run = store.begin_run(recording, RunId(1), None, &[]).unwrap();
    let mut acknowledged = 0;
    for batch in BATCHES.iter().cycle() {
        let events: Vec<Event> = (acknowledged..acknowledged + batch).map(report).collect();
        store.append(run, &events, minute(0)).unwrap();
        acknowledged += batch;
        say(acknowledged);
    }
}

#[test]
fn what_was_acknowledged_is_there_after_a_kill() {
    let mut moments = DrawnMoments::new();
    for kill in 0..KILLS {
        let (words, wait) = (moments.one_of(1..30), moments.wait_us(KILLED_WITHIN_US));
        println!("kill {kill} of seed {}: {wait:?} after word {words}", moments.seed);
        let shelf = Shelf::new();
        let mut child = ChildProcess::start("store_survives::appends_until_killed", &shelf.path());
        let mut acknowledged = 0;
        for _ in 0..words {
            acknowledged = child.next_word().unwrap().parse().unwrap();
        }
        std::thread::sleep(wait);
        child.kill();
        // What it said before the end counts, even if nobody had listened yet.
        while let Some(word) = child.next_word() {
            acknowledged = word.parse().unwrap();
        }

        let store = Store::open(&shelf.path()).unwrap();
        store.check().unwrap();
        let recording = store.recordings(minute(1)).unwrap()[0].key;
        let events = &store.runs(recording, minute(1)).unwrap()[0].events;
        assert!(events.len() >= acknowledged, "{} of {acknowledged} are there", events.len());
        // A batch is there whole or not at all, and in its order.
        let next = BATCHES.iter().cycle().scan(0, |sum, batch| {
            *sum += batch;
            Some(*sum)
        });
        assert!(next.take_while(|sum| *sum <= events.len()).any(|sum| sum == events.len()));
        assert!(events.iter().enumerate().all(|(number, stored)| stored.raw.event == report(number)));
    }
}

/// Says how many events were acknowledged, and then why no more are taken.
#[test]
#[ignore = "the process whose disk is small"]
fn appends_until_full() {
    let Some(path) = store_of_parent() else { return };
    let mut store = Store::open_or_create(&path).unwrap();
    let recording = store.begin_recording("live", "track-a", minute(0)).unwrap();
    let run = store.begin_run(recording, RunId(1), None, &[]).unwrap();
    let mut acknowledged = 0;
    let error = loop {
        let events: Vec<Event> = (acknowledged..acknowledged + 400).map(report).collect();
        match store.append(run, &events, minute(0)) {
            Ok(()) => acknowledged += 400,
            Err(error) => break error,
        }
        assert!(acknowledged < 1_000_000, "the disk is not small");
    };
    say(acknowledged);
    say(error);
}

#[test]
#[cfg(unix)]
fn a_disk_that_takes_no_more_loses_nothing_and_says_so() {
    let shelf = Shelf::new();
    let test = "store_survives::appends_until_full";
    let mut child = ChildProcess::start_with_small_disk(test, &shelf.path(), 512);
    let acknowledged: usize = child.next_word().unwrap().parse().unwrap();
    let error = child.next_word().unwrap();
    child.let_end();
    assert!(acknowledged > 0);
    assert!(error.contains("nothing of this was stored, and what was stored before is safe"), "{error}");

    let store = Store::open(&shelf.path()).unwrap();
    store.check().unwrap();
    assert_eq!(store.recordings(minute(1)).unwrap()[0].events, acknowledged as u64);
}

#[test]
#[ignore = "the process that is killed"]
fn imports_until_killed() {
    let Some(path) = store_of_parent() else { return };
    let mut store = Store::open_or_create(&path).unwrap();
    let recording = real(ALL[4]);
    for number in 0_u64.. {
        let content = ContentHash::of(&number.to_le_bytes());
        store.import(&recording, content, "track-a", minute(0)).unwrap();
        say(number + 1);
    }
}

#[test]
fn an_import_is_there_whole_or_not_at_all_after_a_kill() {
    let mut moments = DrawnMoments::new();
    for kill in 0..KILLED_IMPORTS {
        let (words, wait) = (moments.one_of(1..12) as usize, moments.wait_us(KILLED_WITHIN_US));
        println!("kill {kill} of seed {}: {wait:?} after word {words}", moments.seed);
        let shelf = Shelf::new();
        let mut child = ChildProcess::start("store_survives::imports_until_killed", &shelf.path());
        for _ in 0..words {
            child.next_word().unwrap();
        }
        std::thread::sleep(wait);
        child.kill();
        let mut store = Store::open(&shelf.path()).unwrap();
        store.check().unwrap();
        let recordings = store.recordings(minute(1)).unwrap();
        assert!(recordings.len() >= words);
        // By awk: 456 sensor and 14 speed rows.
        assert!(recordings.iter().all(|recording| (recording.runs, recording.events) == (14, 470)));
        // And the store takes the next file as if nothing had happened.
        import_new(&mut store, ALL[4], minute(1));
    }
}
