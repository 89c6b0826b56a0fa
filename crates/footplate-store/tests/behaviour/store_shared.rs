//! Two processes on one store: readers are not in the way, and a second writer waits and then says why it cannot.

use std::time::Duration;

use footplate_store::{EventKey, Store, StoreError};
use rusqlite::Connection;

use crate::child_process::{ChildProcess, say, store_of_parent, wait_for_parent};
use crate::recordings::ALL;
use crate::stores::{Shelf, import, import_new, minute};

/// Long enough to be noticed and short enough for a test.
const PATIENCE: Duration = Duration::from_millis(50);

#[test]
#[ignore = "the process that is in the way"]
fn writes_until_told() {
    let Some(path) = store_of_parent() else { return };
    let connection = Connection::open(path).unwrap();
    connection.execute_batch("BEGIN IMMEDIATE").unwrap();
    say("writing");
    wait_for_parent();
}

#[test]
fn a_second_writer_waits_and_then_says_who_is_in_the_way() {
    let shelf = Shelf::new();
    let mut store = shelf.store().with_patience(PATIENCE).unwrap();
    import_new(&mut store, ALL[0], minute(0));
    let mut other = ChildProcess::start("store_shared::writes_until_told", &shelf.path());
    assert_eq!(other.next_word().as_deref(), Some("writing"));

    let refused = store.exclude(&[EventKey(1)], "dirty", minute(1)).unwrap_err();
    assert!(matches!(refused, StoreError::InUse(_)), "{refused}");
    assert!(refused.to_string().contains("railway.db is in use by another process"), "{refused}");
    // Readers are not in anybody's way, new ones neither.
    assert_eq!(store.recordings(minute(1)).unwrap().len(), 1);
    assert_eq!(Store::open(&shelf.path()).unwrap().recordings(minute(1)).unwrap().len(), 1);

    other.let_end();
    store.exclude(&[EventKey(1)], "dirty", minute(1)).unwrap();
}

#[test]
fn a_reader_sees_what_was_there_and_then_what_is() {
    let shelf = Shelf::new();
    let mut writer = shelf.store();
    let reader = shelf.store();
    import_new(&mut writer, ALL[0], minute(0));
    assert_eq!(reader.recordings(minute(1)).unwrap().len(), 1);
    import(&mut writer, ALL[1], minute(0));
    assert_eq!(reader.recordings(minute(1)).unwrap().len(), 2);
}
