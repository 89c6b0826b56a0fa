//! A store that an older Footplate made opens, and has everything in it that it had.

use std::fs;
use std::path::Path;

use footplate_core::TrainId;
use footplate_store::{EventKey, MotionFile, MotionFileError, Run, Schedule, StoredRun};

use crate::recordings::{ALL, real};
use crate::stores::{Shelf, minute};

/// The committed stores, one of every version. A new version adds its own and leaves these alone.
const OLD: [&str; 9] = [
    "store-1.sqlite",
    "store-2.sqlite",
    "store-3.sqlite",
    "store-4.sqlite",
    "store-5.sqlite",
    "store-6.sqlite",
    "store-7.sqlite",
    "store-8.sqlite",
    "store-9.sqlite",
];

fn copy_of(file: &str) -> Shelf {
    let committed = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../testdata/compat").join(file);
    let shelf = Shelf::new();
    fs::copy(committed, shelf.path()).unwrap();
    shelf
}

#[test]
fn every_old_store_opens_with_all_it_had() {
    for (number, file) in OLD.into_iter().enumerate() {
        let shelf = copy_of(file);
        let store = shelf.store();
        store.check().unwrap();
        // Decisions are kept from version 3 on.
        assert_eq!(store.machines().unwrap().len(), [0, 0, 1, 2, 3, 0, 0, 3, 1][number], "{file}");
        let late = minute(1_000_000);
        let recordings = store.recordings(late).unwrap();
        let counts: Vec<_> =
            recordings.iter().map(|recording| (recording.events, recording.excluded)).collect();
        assert_eq!(counts[..2], [(91, 1), (580, 0)], "{file}");
        // Live sessions: none, one, and those whose decisions are kept; the last four files come from the first.
        let live = [0, 1, 2, 3, 4, 0, 0, 3, 1][number];
        let events = [0, 200, 200, 200, 200, 0, 0, 22, 40][number];
        assert_eq!(counts.get(2), (live > 0).then_some(&(events, 0)), "{file}");
        assert_eq!(counts.len(), live + 2, "{file}");
        let light_gates = store.runs(recordings[1].key, late).unwrap();
        assert_eq!(light_gates.iter().map(StoredRun::accepted).collect::<Vec<Run>>(), real(ALL[8]).runs);
        // A fit of the old form stays in the history, and is not read as a model.
        assert_eq!(store.calibrations(TrainId(24)).unwrap()[0].body, r#"{"train":24}"#);
        let model = store.calibration(TrainId(24), late).unwrap();
        assert!(model.is_none_or(|model| model.body != r#"{"train":24}"#));
    }
}

#[test]
fn a_live_session_and_a_motion_model_of_version_2_are_still_read() {
    let shelf = copy_of("store-2.sqlite");
    let store = shelf.store();
    let late = minute(1_000_000);
    let live = &store.recordings(late).unwrap()[2];
    assert!(live.is_live());
    assert_eq!(store.runs(live.key, late).unwrap().len(), 2);
    // Its model was made by other formulas; its events are there, and it is learnt again from them.
    let kept = MotionFile::of_store(&store, TrainId(24), late).unwrap_err();
    assert!(matches!(kept, MotionFileError::OtherModel { ref found, .. } if found == "1"), "{kept}");
}

#[test]
fn a_machine_and_its_decisions_of_version_3_are_still_read() {
    let shelf = copy_of("store-3.sqlite");
    let store = shelf.store();
    let machines = store.machines().unwrap();
    let machine = &machines[0];
    assert_eq!((machine.kind.as_str(), machine.is_whole), ("drive", true));
    let trace = store.trace(machine.key).unwrap();
    assert!(trace.iter().zip(0..).all(|(row, number)| row.number == number));
    assert_eq!(trace.last().map(|row| row.kind.as_ref()), Some("end"));
    assert!(trace.iter().any(|row| row.kind == "command" && row.text == "step 9 for train 58"));
}

#[test]
fn a_profile_of_version_6_and_a_schedule_of_version_7_are_still_read() {
    let late = minute(1_000_000);
    for file in ["store-6.sqlite", "store-7.sqlite"] {
        let shelf = copy_of(file);
        let store = shelf.store();
        let profile = store.profile(TrainId(24), late).unwrap().expect(file);
        // `testdata/profiles/jmri_learnt.xml`: what is unusable in it was left out when it was imported.
        assert_eq!(profile.speeds.len(), 5, "{file}");
        let schedules = store.schedules("track-a").unwrap();
        let expected = Schedule {
            name: "Morning".to_owned(),
            lines: vec!["go 24 to C13".to_owned(), "wait 24 at rest".to_owned()],
            rounds: Some(2),
            is_button: true,
        };
        assert_eq!(schedules, if file == "store-7.sqlite" { vec![expected] } else { vec![] }, "{file}");
    }
}

#[test]
fn an_archive_of_version_8_is_still_read_and_its_trains_have_no_direction() {
    let shelf = copy_of("store-8.sqlite");
    let store = shelf.store();
    let machines = store.machines().unwrap();
    let trace = store.trace(machines[0].key).unwrap();
    assert!(trace.iter().zip(0..).all(|(row, number)| row.number == number));
    assert_eq!(trace.last().map(|row| row.kind.as_ref()), Some("end"));
    assert!(trace.iter().any(|row| row.kind == "command" && row.text == "step 9 for train 24"));
    assert!(store.directions().unwrap().is_empty());
}

#[test]
fn directions_of_version_9_are_still_read_and_what_is_added_has_checksums() {
    let shelf = copy_of("store-9.sqlite");
    let mut store = shelf.store();
    // The session reversed the train once.
    assert_eq!(store.directions().unwrap(), [(TrainId(24), false)].into());
    store.exclude(&[EventKey(700)], "a child lifted the train", minute(1_000_000)).unwrap();
    store.check().unwrap();
    drop(store);
    let connection = rusqlite::Connection::open(shelf.path()).unwrap();
    let with_checksum = "SELECT count(crc32), count(*) FROM marks";
    let counts: (i64, i64) =
        connection.query_row(with_checksum, [], |row| Ok((row.get(0)?, row.get(1)?))).unwrap();
    assert_eq!(counts, (1, 2), "a row of an older program has none");
}
