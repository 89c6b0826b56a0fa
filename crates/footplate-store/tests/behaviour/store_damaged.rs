//! A damaged store says so, and what can still be read of it comes over into a new one.

use std::fs;
use std::path::Path;

use footplate_store::{EventKey, Salvaged, Store, StoreError, salvage};
use proptest::prelude::{any, proptest};
use proptest::sample::Index;
use proptest::test_runner::Config;

use crate::recordings::ALL;
use crate::stores::{Shelf, import_new, minute};

/// The page size of every store (SQLite's own since 3.12).
const PAGE: usize = 4096;

/// A store with all real recordings and a mark, closed, so that all of it is in one file.
fn full(shelf: &Shelf) -> Vec<u8> {
    let mut store = shelf.store();
    for file in ALL {
        import_new(&mut store, file, minute(0));
    }
    store.exclude(&[EventKey(1)], "stale", minute(1)).unwrap();
    drop(store);
    fs::read(shelf.path()).unwrap()
}

fn rows(salvaged: &Salvaged, table: &str) -> u64 {
    salvaged.tables.iter().find(|found| found.name == table).unwrap().rows
}

/// Opening, checking and reading, as `footplate store show` does.
fn looked_at(path: &Path) -> Result<u64, StoreError> {
    let store = Store::open(path)?;
    store.check()?;
    let recordings = store.recordings(minute(9))?;
    recordings.iter().try_for_each(|recording| store.runs(recording.key, minute(9)).map(drop))?;
    Ok(recordings.iter().map(|recording| recording.events).sum())
}

#[test]
fn a_whole_store_is_salvaged_whole() {
    let shelf = Shelf::new();
    full(&shelf);
    let into = shelf.file("new.db");
    let salvaged = salvage(&shelf.path(), &into).unwrap();
    assert!(salvaged.is_all(), "{salvaged:?}");
    assert_eq!(
        (rows(&salvaged, "recordings"), rows(&salvaged, "runs"), rows(&salvaged, "marks")),
        (9, 96, 1)
    );
    let [old, new] = [shelf.path(), into].map(|path| {
        let store = Store::open(&path).unwrap();
        let recordings = store.recordings(minute(9)).unwrap();
        let runs: Vec<_> =
            recordings.iter().map(|recording| store.runs(recording.key, minute(9)).unwrap()).collect();
        (recordings, runs)
    });
    assert_eq!(new, old);
}

#[test]
fn a_bent_page_is_noticed_and_the_rest_salvaged() {
    let shelf = Shelf::new();
    let whole = full(&shelf);
    let all = looked_at(&shelf.path()).unwrap();
    // Every page in turn, the first with the list of tables among them.
    for (number, page) in whole.chunks(PAGE).enumerate() {
        let mut bent = whole.clone();
        bent[number * PAGE..][..page.len()].fill(0x55);
        fs::write(shelf.path(), &bent).unwrap();
        let error = looked_at(&shelf.path()).unwrap_err();
        let is_first = number == 0 && matches!(error, StoreError::NotAStore(_));
        assert!(is_first || matches!(error, StoreError::Damaged { .. }), "page {number}: {error}");

        let into = shelf.file(&format!("new-{number}.db"));
        let salvaged = salvage(&shelf.path(), &into).unwrap();
        assert_eq!(fs::read(shelf.path()).unwrap(), bent, "the damaged file is not touched");
        let kept = looked_at(&into).unwrap();
        // A page holds at most some hundred events; the leaves of a tree whose root is gone are found by themselves.
        let events = salvaged.tables.iter().find(|table| table.name == "events").unwrap();
        assert_eq!(kept, events.rows);
        assert!(kept + 150 >= all, "page {number}: {kept} of {all}");
        // Only what is lost at the very end leaves no gap by which it is counted, and that is said.
        assert!((all - 150..=all).contains(&(events.rows + events.lost)), "page {number}");
        assert!(!salvaged.is_all() && salvaged.damage.is_some(), "page {number}: {salvaged:?}");
    }
}

#[test]
fn a_value_that_was_changed_into_another_possible_one_is_noticed() {
    let shelf = Shelf::new();
    full(&shelf);
    let connection = rusqlite::Connection::open(shelf.path()).unwrap();
    connection
        .execute_batch(
            "DROP TRIGGER events_are_not_changed; UPDATE events SET time_ns = time_ns + 1 WHERE id = 700;",
        )
        .unwrap();
    drop(connection);
    let error = looked_at(&shelf.path()).unwrap_err();
    assert!(error.to_string().contains("row 700 of events is not as it was written"), "{error}");
    let into = shelf.file("new.db");
    let salvaged = salvage(&shelf.path(), &into).unwrap();
    let events = salvaged.tables.iter().find(|table| table.name == "events").unwrap();
    assert_eq!((events.rows, events.lost), (2367, 1));
    assert!(!salvaged.is_all());
    assert_eq!(looked_at(&into).unwrap(), 2367);
}

#[test]
fn a_file_without_its_first_page_still_has_its_events() {
    let shelf = Shelf::new();
    let mut headless = full(&shelf);
    headless[..PAGE].fill(0);
    fs::write(shelf.path(), &headless).unwrap();
    assert!(matches!(looked_at(&shelf.path()), Err(StoreError::NotAStore(_))));
    let salvaged = salvage(&shelf.path(), &shelf.file("new.db")).unwrap();
    assert_eq!((rows(&salvaged, "recordings"), rows(&salvaged, "events")), (9, 2368));
}

#[test]
fn a_file_that_was_cut_off_keeps_what_is_left() {
    let shelf = Shelf::new();
    let whole = full(&shelf);
    // The newest quarter is gone; events fill the file from a quarter on, where the list of tables ends.
    fs::write(shelf.path(), &whole[..whole.len() / 4 * 3]).unwrap();
    let error = looked_at(&shelf.path()).unwrap_err();
    assert!(matches!(error, StoreError::Damaged { .. }), "{error}");
    assert!(error.to_string().contains("is damaged"), "{error}");
    let salvaged = salvage(&shelf.path(), &shelf.file("new.db")).unwrap();
    let events = rows(&salvaged, "events");
    assert!((1200..2368).contains(&events), "{events}");
}

#[test]
fn a_file_cut_off_within_its_list_of_tables_keeps_its_recordings() {
    let shelf = Shelf::new();
    let whole = full(&shelf);
    fs::write(shelf.path(), &whole[..16 * PAGE]).unwrap();
    let salvaged = salvage(&shelf.path(), &shelf.file("new.db")).unwrap();
    // The rows of recordings and runs are on the first pages after those with which the list begins.
    assert_eq!((rows(&salvaged, "recordings"), rows(&salvaged, "runs")), (9, 96));
}

#[test]
fn events_whose_recording_is_lost_are_kept_under_a_stand_in() {
    let shelf = Shelf::new();
    full(&shelf);
    let connection = rusqlite::Connection::open(shelf.path()).unwrap();
    connection
        .execute_batch(
            "PRAGMA foreign_keys = OFF; DROP TRIGGER recordings_are_not_deleted; DROP TRIGGER runs_are_not_deleted; \
             DELETE FROM recordings WHERE id = 2; DELETE FROM runs WHERE id = 1;",
        )
        .unwrap();
    drop(connection);
    assert!(matches!(looked_at(&shelf.path()), Err(StoreError::Damaged { .. })));
    let into = shelf.file("new.db");
    let salvaged = salvage(&shelf.path(), &into).unwrap();
    assert_eq!(rows(&salvaged, "events"), 2368);
    assert_eq!(looked_at(&into).unwrap(), 2368);
    let names: Vec<String> = Store::open(&into)
        .unwrap()
        .recordings(minute(9))
        .unwrap()
        .into_iter()
        .map(|found| found.name)
        .collect();
    assert_eq!((names[1].as_str(), names[9].as_str()), ("lost recording", "lost runs"));
}

#[test]
fn directions_whose_tree_is_lost_are_not_taken_for_runs() {
    /// Enough for several pages.
    const DIRECTIONS: u64 = 1_000;
    let shelf = Shelf::new();
    full(&shelf);
    let connection = rusqlite::Connection::open(shelf.path()).unwrap();
    let insert = "INSERT INTO directions (train, forward, stored_at_ns) VALUES (?1, ?2, ?3)";
    for nth in 0..DIRECTIONS {
        connection.execute(insert, (24 + nth % 3, nth % 2, 1_000 + nth)).unwrap();
    }
    let root: usize = connection
        .query_row("SELECT rootpage FROM sqlite_schema WHERE name = 'directions'", [], |row| row.get(0))
        .unwrap();
    drop(connection);
    let mut bent = fs::read(shelf.path()).unwrap();
    bent[(root - 1) * PAGE..root * PAGE].fill(0x55);
    fs::write(shelf.path(), &bent).unwrap();
    let salvaged = salvage(&shelf.path(), &shelf.file("new.db")).unwrap();
    assert_eq!((rows(&salvaged, "directions"), salvaged.ambiguous), (DIRECTIONS, 0));
    assert_eq!((rows(&salvaged, "runs"), rows(&salvaged, "recordings")), (96, 9), "and no run is invented");
}

#[test]
fn what_is_only_in_the_journal_is_salvaged_too() {
    let shelf = Shelf::new();
    let mut store = shelf.store();
    import_new(&mut store, ALL[0], minute(0));
    // The store is still open: its newest pages are in the journal beside it.
    let salvaged = salvage(&shelf.path(), &shelf.file("new.db")).unwrap();
    assert_eq!(rows(&salvaged, "events"), 382);
}

#[test]
fn salvaging_overwrites_nothing_and_invents_nothing() {
    let shelf = Shelf::new();
    full(&shelf);
    let there = shelf.file("there.db");
    fs::write(&there, "precious").unwrap();
    assert!(matches!(salvage(&shelf.path(), &there), Err(StoreError::Exists(_))));
    assert_eq!(fs::read(&there).unwrap(), b"precious");
    let into = shelf.file("new.db");
    assert!(matches!(salvage(&shelf.file("missing.db"), &into), Err(StoreError::Missing(_))));
    for other in ["", "a letter", &"a long letter ".repeat(1000)] {
        fs::write(shelf.path(), other).unwrap();
        assert!(matches!(salvage(&shelf.path(), &into), Err(StoreError::NothingReadable(_))), "{other:.20}");
        assert!(matches!(Store::open(&shelf.path()), Err(StoreError::NotAStore(_))) || other.is_empty());
    }
    assert!(!into.exists());
    assert_eq!(
        fs::read_dir(shelf.path().parent().unwrap()).unwrap().count(),
        2,
        "nothing is left beside them"
    );
}

proptest! {
    #![proptest_config(Config { cases: 32, ..Config::default() })]

    #[test]
    fn no_damage_panics(damage in proptest::collection::vec((any::<Index>(), any::<u8>()), 1..40), cut in any::<Index>()) {
        let shelf = Shelf::new();
        let mut store = shelf.store();
        import_new(&mut store, ALL[7], minute(0));
        drop(store);
        let mut bytes = fs::read(shelf.path()).unwrap();
        for (at, value) in damage {
            let at = at.index(bytes.len());
            bytes[at] = value;
        }
        // Every other case loses its end as well.
        let cut = cut.index(2 * bytes.len());
        bytes.truncate(cut);
        fs::write(shelf.path(), &bytes).unwrap();
        let _ = looked_at(&shelf.path());
        let into = shelf.file("new.db");
        if salvage(&shelf.path(), &into).is_ok() {
            // Whatever came over is a sound store.
            looked_at(&into).unwrap();
        }
    }
}
