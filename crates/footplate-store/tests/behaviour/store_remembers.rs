//! A store gives back what it was given, as it was at any date, and says what changed since.

use footplate_core::{Event, EventKind, Report, RunId, SensorId, SpeedStep, TimeSpan, Timestamp, TrainId};
use footplate_store::{
    Change, EventKey, Import, MarkKind, NewCalibration, Run, Store, StoreError, StoredEvent, StoredRun,
    TrainAtStart,
};

use crate::recordings::{ALL, real};
use crate::stores::{Shelf, import, import_new, minute};

const LATER: i64 = 1_000_000;

#[test]
fn every_real_recording_comes_back_as_it_was_read() {
    let shelf = Shelf::new();
    let mut store = shelf.store();
    for file in ALL {
        let key = import_new(&mut store, file, minute(0));
        let runs: Vec<Run> =
            store.runs(key, minute(LATER)).unwrap().iter().map(StoredRun::accepted).collect();
        assert_eq!(runs, real(file).runs, "{file}");
    }
    // Another process reads the same.
    let listed = shelf.store().recordings(minute(LATER)).unwrap();
    let sums = listed.iter().fold((0, 0, 0), |(runs, events, excluded), recording| {
        (runs + recording.runs, events + recording.events, excluded + recording.excluded)
    });
    // By awk: 96 runs; 1687 + 580 sensor rows, 67 `speed`, 17 `stop` and 17 `stopped` rows.
    assert_eq!((listed.len(), sums), (9, (96, 2368, 0)));
    store.check().unwrap();
}

#[test]
fn a_file_is_imported_once() {
    let shelf = Shelf::new();
    let mut store = shelf.store();
    let recording = import_new(&mut store, ALL[0], minute(1));
    let again = import(&mut store, ALL[0], minute(2));
    assert_eq!(again, Import::AlreadyThere { recording, stored_at: minute(1) });
    assert_eq!(store.recordings(minute(3)).unwrap().len(), 1);
}

#[test]
fn events_of_a_live_session_come_in_as_they_happen() {
    let shelf = Shelf::new();
    let mut store = shelf.store();
    let trains = [24, 58].map(|train| TrainAtStart { train: TrainId(train), step: SpeedStep::STAND });
    let recording = store.begin_recording("evening", "track-b", minute(0)).unwrap();
    let run = store.begin_run(recording, RunId(1), Some(minute(0)), &trains).unwrap();
    let event = |seconds: i64, sensor| Event {
        time: Timestamp::ZERO + TimeSpan::from_ms(seconds * 1_000),
        kind: EventKind::Sensor(Report {
            sensor: SensorId(sensor),
            poll_interval: Some(TimeSpan::from_us(65_350)),
        }),
    };
    store.append(run, &[event(1, 10), event(2, 11)], minute(1)).unwrap();
    let report = Report { sensor: SensorId(12), poll_interval: None };
    let freed = Event { kind: EventKind::Freed(report), ..event(4, 12) };
    store.append(run, &[event(3, 12), freed], minute(2)).unwrap();

    let [at_one, at_two] = [1, 2].map(|minutes| store.runs(recording, minute(minutes)).unwrap());
    assert_eq!(at_one[0].events.len(), 2);
    assert_eq!(at_two[0].accepted().reports().count(), 3);
    assert_eq!(at_two[0].trains, trains);
    assert_eq!(at_two[0].events[2].raw.event, event(3, 12));
    assert_eq!(at_two[0].events[3].raw.event, freed, "the release of a block is no detection");
    let listed = &store.recordings(minute(1)).unwrap()[0];
    assert_eq!((listed.form.as_str(), listed.layout.as_str(), listed.events), ("live", "track-b", 2));
}

/// The first event of a recording, with its marks.
fn first_event(store: &Store, at: Timestamp) -> StoredEvent {
    let recording = store.recordings(at).unwrap()[0].key;
    store.runs(recording, at).unwrap()[0].events[0].clone()
}

#[test]
fn what_was_excluded_at_a_date_can_be_had_again() {
    let shelf = Shelf::new();
    let mut store = shelf.store();
    import_new(&mut store, ALL[0], minute(0));
    let event = first_event(&store, minute(0)).key;
    store.exclude(&[event], "a child lifted the train", minute(10)).unwrap();
    store.restore(&[event], "it was another train", minute(20)).unwrap();
    store.exclude(&[event], "it was this one after all", minute(30)).unwrap();

    let excluded_at = |minutes| first_event(&store, minute(minutes)).is_excluded();
    assert_eq!([9, 10, 19, 20, 29, 30].map(excluded_at), [false, true, true, false, false, true]);
    let mark = first_event(&store, minute(25)).mark.unwrap();
    assert_eq!((mark.kind, mark.reason.as_str()), (MarkKind::Restored, "it was another train"));
    let counts = [15, 25].map(|minutes| store.recordings(minute(minutes)).unwrap()[0].excluded);
    assert_eq!(counts, [1, 0]);

    let recording = store.recordings(minute(30)).unwrap()[0].key;
    let run = &store.runs(recording, minute(30)).unwrap()[0];
    assert_eq!(run.accepted().events.len() + 1, run.events.len(), "the estimator does not see it, people do");
}

#[test]
fn a_mark_that_changes_nothing_is_refused_and_so_are_those_beside_it() {
    let shelf = Shelf::new();
    let mut store = shelf.store();
    import_new(&mut store, ALL[0], minute(0));
    let [first, second, missing] = [EventKey(1), EventKey(2), EventKey(999_999)];
    store.exclude(&[first], "dirty wheel", minute(1)).unwrap();
    let both_then = |store: &Store| store.recordings(minute(LATER)).unwrap()[0].excluded;

    let twice = store.exclude(&[second, first], "again", minute(2)).unwrap_err();
    assert_eq!(twice.to_string(), "event 1 is excluded already: dirty wheel");
    let unknown = store.exclude(&[second, missing], "gone", minute(2)).unwrap_err();
    assert_eq!(unknown.to_string(), "there is no event 999999; `footplate store show` lists them");
    let never = store.restore(&[second], "why not", minute(2)).unwrap_err();
    assert_eq!(never.to_string(), "event 2 was never excluded; there is nothing to restore");
    assert!(matches!(store.exclude(&[second], "  ", minute(2)), Err(StoreError::NoReason)));
    assert_eq!(both_then(&store), 1, "none of the refused marks was made");
}

#[test]
fn the_calibration_in_force_at_a_date_is_the_last_one_made_until_then() {
    let shelf = Shelf::new();
    let mut store = shelf.store();
    let calibration =
        |train, body| NewCalibration { train: TrainId(train), as_of: minute(0), model_version: "3", body };
    store.keep_calibration(calibration(24, r#"{"speed":1}"#), minute(10)).unwrap();
    store.keep_calibration(calibration(58, r#"{"speed":9}"#), minute(15)).unwrap();
    store.keep_calibration(calibration(24, r#"{"speed":2}"#), minute(20)).unwrap();
    let in_force = |minutes| {
        store.calibration(TrainId(24), minute(minutes)).unwrap().map(|calibration| calibration.body)
    };
    assert_eq!(in_force(9), None);
    assert_eq!(in_force(19).as_deref(), Some(r#"{"speed":1}"#));
    assert_eq!(in_force(20).as_deref(), Some(r#"{"speed":2}"#));
    assert_eq!(store.calibrations(TrainId(24)).unwrap().len(), 2);
    assert_eq!(store.calibrated_trains().unwrap(), [TrainId(24), TrainId(58)]);
    let broken = store.keep_calibration(calibration(24, "{speed:"), minute(30)).unwrap_err();
    assert_eq!(broken.to_string(), "the calibration of train 24 is not JSON");
}

#[test]
fn what_changed_between_two_dates_is_told_in_order() {
    let shelf = Shelf::new();
    let mut store = shelf.store();
    import_new(&mut store, ALL[0], minute(0));
    let body = NewCalibration { train: TrainId(1), as_of: minute(1), model_version: "3", body: "{}" };
    store.keep_calibration(body, minute(1)).unwrap();
    import_new(&mut store, ALL[1], minute(2));
    store.exclude(&[EventKey(2)], "stale", minute(3)).unwrap();
    store.keep_calibration(NewCalibration { as_of: minute(4), ..body }, minute(4)).unwrap();

    let changes = store.changes(minute(1), minute(4)).unwrap();
    assert_eq!(changes.iter().map(Change::at).collect::<Vec<_>>(), [minute(2), minute(3), minute(4)]);
    // By awk: 84 sensor, 4 speed, 4 stop and 4 stopped rows.
    assert!(
        matches!(&changes[0], Change::Measured { name, events: 96, .. } if name.ends_with("train1_stop"))
    );
    assert!(matches!(&changes[1], Change::Marked(mark) if mark.reason == "stale"));
    assert!(matches!(changes[2], Change::Calibrated { train: TrainId(1), .. }));
    assert_eq!(store.changes(minute(4), minute(LATER)).unwrap(), []);
}

#[test]
fn a_recording_that_is_not_there_is_named() {
    let store = Shelf::new();
    let store = store.store();
    let error = store.runs(footplate_store::RecordingKey(3), minute(0)).unwrap_err();
    assert_eq!(error.to_string(), "there is no recording 3; `footplate store show` lists them");
}
