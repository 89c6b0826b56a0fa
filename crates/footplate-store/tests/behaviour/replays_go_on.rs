//! What a train taught is learnt again from where the last replay came, to the same numbers to the last bit.

use footplate_core::{SpeedStep, TrainId};
use footplate_store::{ContentHash, MOTION_MODEL_VERSION, MotionReplay, Store, built_in};

use crate::recordings::ALL;
use crate::stores::{Shelf, import_new, minute};

const TRAIN: TrainId = TrainId(24);
/// Recordings of that train.
const RUN: &str = ALL[2];
const STOP: &str = ALL[3];
const LATER: i64 = 1_000_000;

/// All that a replay says, to the last bit.
fn replayed(store: &mut Store) -> String {
    let layout = built_in("track-a").unwrap().layout;
    let highest = SpeedStep::new(14).unwrap();
    let replay = MotionReplay::of_store(&layout, store, TRAIN, highest, minute(LATER)).unwrap();
    assert!(!replay.is_empty());
    serde_json::to_string(&replay).unwrap()
}

/// Of a store that has never been replayed.
fn afresh(prepare: impl FnOnce(&mut Store)) -> String {
    let shelf = Shelf::new();
    let mut store = shelf.store();
    prepare(&mut store);
    replayed(&mut store)
}

/// Runs a statement behind the program's back.
fn tamper(shelf: &Shelf, sql: &str) {
    let changed = rusqlite::Connection::open(shelf.path()).unwrap().execute(sql, []).unwrap();
    assert_eq!(changed, 1, "{sql}");
}

#[test]
fn a_replay_that_goes_on_says_what_one_from_the_beginning_says() {
    let shelf = Shelf::new();
    let mut store = shelf.store();
    import_new(&mut store, RUN, minute(1));
    let first = replayed(&mut store);
    assert_eq!(first, replayed(&mut store));
    import_new(&mut store, STOP, minute(2));
    let second = replayed(&mut store);
    assert_ne!(first, second);
    let both = afresh(|store| {
        import_new(store, RUN, minute(1));
        import_new(store, STOP, minute(2));
    });
    assert_eq!(second, both);
}

#[test]
fn it_does_go_on_from_what_was_kept() {
    let shelf = Shelf::new();
    let mut store = shelf.store();
    import_new(&mut store, RUN, minute(1));
    let first = replayed(&mut store);
    // Nothing of this is in the recordings, so whoever says it has read it here.
    let body: String = rusqlite::Connection::open(shelf.path())
        .unwrap()
        .query_row(
            "SELECT replace(body, '\"recordings\":[', '\"recordings\":[\"made up\",') FROM replays",
            [],
            |row| row.get(0),
        )
        .unwrap();
    let hash = ContentHash::of(body.as_bytes());
    tamper(&shelf, &format!("UPDATE replays SET body = '{body}', body_sha256 = '{hash}'"));
    let again = replayed(&mut store);
    assert!(again.contains("made up") && !first.contains("made up"), "{again}");
}

#[test]
fn what_a_person_excludes_is_excluded_from_what_was_kept_too() {
    let shelf = Shelf::new();
    let mut store = shelf.store();
    let recording = import_new(&mut store, RUN, minute(1));
    let all = replayed(&mut store);
    let exclude = |store: &mut Store| {
        let runs = store.runs(recording, minute(LATER)).unwrap();
        let event = runs.iter().flat_map(|run| &run.events).nth(100).unwrap().key;
        store.exclude(&[event], "a child lifted the train", minute(3)).unwrap();
    };
    exclude(&mut store);
    let without = replayed(&mut store);
    assert_ne!(all, without);
    let never_seen = afresh(|store| {
        import_new(store, RUN, minute(1));
        exclude(store);
    });
    assert_eq!(without, never_seen);
}

#[test]
fn a_kept_replay_that_is_damaged_or_of_other_formulas_is_passed_over() {
    let shelf = Shelf::new();
    let mut store = shelf.store();
    import_new(&mut store, RUN, minute(1));
    let first = replayed(&mut store);
    for sql in [
        "UPDATE replays SET body = replace(body, '\"runs\":', '\"runs\":1')",
        "UPDATE replays SET body = '{}', body_sha256 = '44136fa355b3678a1146ad16f7e8649e94fb4fc21fe77e8310c060f61caaff8a'",
        "UPDATE replays SET of_sha256 = 'of another version'",
    ] {
        tamper(&shelf, sql);
        assert_eq!(first, replayed(&mut store), "{sql}");
    }
}

#[test]
fn the_version_of_the_model_is_raised_with_its_formulas() {
    let said = afresh(|store| {
        import_new(store, RUN, minute(1));
        import_new(store, STOP, minute(2));
    });
    // Printed by this test when it fails: whoever changed the numbers raises MOTION_MODEL_VERSION, and writes down both here.
    let known = [("13", "9df8b594fa79422f0a01644a23f2b74554eb8bea7bca7e8187e8b6780358a36b")];
    let found = ContentHash::of(said.as_bytes()).to_string();
    assert_eq!(known.last(), Some(&(MOTION_MODEL_VERSION, found.as_str())));
}
