//! Whatever is destroyed of a store of live sessions, every row that is lost is counted, and none is invented.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
#[cfg(unix)]
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};

use footplate_store::{Salvaged, Store, StoreError, salvage};
use rusqlite::types::Value;
use rusqlite::{Connection, OpenFlags};

use crate::stores::{Shelf, drive, minute};

/// The page size of every store (SQLite's own since 3.12).
const PAGE: usize = 4096;
/// All tables but `replays`, which follows from the rest.
const TABLES: [&str; 14] = [
    "recordings",
    "runs",
    "starts",
    "events",
    "gate_passes",
    "marks",
    "calibrations",
    "profiles",
    "schedules",
    "directions",
    "machines",
    "inputs",
    "decisions",
    "archives",
];

type Rows = BTreeMap<&'static str, BTreeSet<String>>;

/// All rows of a store, as text.
fn rows_of(path: &Path) -> Rows {
    let connection = Connection::open_with_flags(path, OpenFlags::SQLITE_OPEN_READ_ONLY).unwrap();
    let of_table = |table: &&'static str| {
        let mut statement = connection.prepare(&format!("SELECT * FROM {table}")).unwrap();
        let columns = statement.column_count();
        let rows = statement.query_map([], |row| {
            let values = (0..columns).map(|at| row.get::<_, Value>(at));
            Ok(format!("{:?}", values.collect::<rusqlite::Result<Vec<_>>>()?))
        });
        (*table, rows.unwrap().collect::<rusqlite::Result<BTreeSet<String>>>().unwrap())
    };
    TABLES.iter().map(of_table).collect()
}

/// Whether a row stands for one that is lost.
fn is_stand_in(table: &str, row: &str) -> bool {
    match table {
        "recordings" => row.contains("Text(\"salvaged"),
        // It has neither a beginning nor a checksum.
        "runs" => row.ends_with("Null, Null]"),
        _ => false,
    }
}

/// Holds what a salvage says against the rows that there were and are.
fn counted(salvaged: &Salvaged, truth: &Rows, out: &Path, what: &str) {
    let got = rows_of(out);
    for table in &salvaged.tables {
        let (truth, got) = (&truth[table.name], &got[table.name]);
        let name = table.name;
        let invented: Vec<_> = got.difference(truth).filter(|row| !is_stand_in(name, row)).collect();
        assert!(invented.is_empty(), "{what}: {name} has {invented:?}");
        let missing = truth.difference(got).count() as u64;
        assert_eq!((missing, true), (table.lost, table.is_end_known), "{what}: {name}, {salvaged:?}");
    }
}

/// A store after two sessions, closed, so that all of it is in one file.
fn driven(shelf: &Shelf) -> Vec<u8> {
    drop(drive(shelf.store(), 0, 100, 1_200));
    drop(drive(shelf.store(), 1, 100, 200));
    fs::read(shelf.path()).unwrap()
}

#[test]
fn every_page_of_driven_trains_is_destroyed_in_turn_and_every_row_counted() {
    let shelf = Shelf::new();
    let whole = driven(&shelf);
    let truth = rows_of(&shelf.path());
    assert!(truth.values().all(|rows| !rows.is_empty()), "every table has rows");
    let mut tables_with_losses = BTreeSet::new();
    for (number, page) in whole.chunks(PAGE).enumerate() {
        let mut bent = whole.clone();
        bent[number * PAGE..][..page.len()].fill(0x55);
        fs::write(shelf.path(), &bent).unwrap();
        let out = shelf.file(&format!("new-{number}.db"));
        let salvaged = salvage(&shelf.path(), &out).unwrap();
        counted(&salvaged, &truth, &out, &format!("page {}", number + 1));
        assert!(!salvaged.is_all() && salvaged.damage.is_some());
        let lost = salvaged.tables.iter().filter(|table| table.lost > 0).map(|table| table.name);
        tables_with_losses.extend(lost);
        fs::remove_file(out).unwrap();
    }
    assert_eq!(tables_with_losses, TABLES.into(), "a page of each table was among them");
}

#[test]
fn no_row_of_an_old_store_is_invented_when_its_list_of_tables_is_destroyed() {
    let shelf = Shelf::new();
    let compat = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../testdata/compat/store-9.sqlite");
    fs::copy(compat, shelf.path()).unwrap();
    // Migrated: its rows have no checksums, and its list of tables has pages behind them.
    drop(shelf.store());
    let truth = rows_of(&shelf.path());
    let connection = Connection::open(shelf.path()).unwrap();
    let list = "SELECT pageno FROM dbstat WHERE name IN ('sqlite_schema', 'runs', 'directions')";
    let pages = connection
        .prepare(list)
        .unwrap()
        .query_map([], |row| row.get::<_, usize>(0))
        .unwrap()
        .collect::<rusqlite::Result<Vec<_>>>()
        .unwrap();
    drop(connection);
    let whole = fs::read(shelf.path()).unwrap();
    assert!(pages.len() > 7);
    for page in pages {
        let mut bent = whole.clone();
        bent[(page - 1) * PAGE..page * PAGE].fill(0x55);
        fs::write(shelf.path(), &bent).unwrap();
        let out = shelf.file(&format!("new-{page}.db"));
        let salvaged = salvage(&shelf.path(), &out).unwrap();
        assert!(!salvaged.is_all());
        let got = rows_of(&out);
        for table in &salvaged.tables {
            let (truth, got, name) = (&truth[table.name], &got[table.name], table.name);
            let invented: Vec<_> = got.difference(truth).filter(|row| !is_stand_in(name, row)).collect();
            assert!(invented.is_empty(), "page {page}: {name} has {invented:?}");
            let missing = truth.difference(got).count() as u64;
            assert!(
                missing == table.lost || (missing > table.lost && !table.is_end_known),
                "page {page}: {name} misses {missing}, {salvaged:?}"
            );
        }
    }
}

#[test]
fn a_changed_value_of_any_table_is_noticed_and_its_row_counted_as_lost() {
    let shelf = Shelf::new();
    let whole = driven(&shelf);
    let changes = [
        ("recordings", "name = name || 'x'"),
        ("runs", "began_at_ns = 7"),
        ("starts", "step = 9"),
        ("events", "time_ns = time_ns + 1"),
        ("gate_passes", "time_ns = time_ns + 1"),
        ("marks", "reason = 'another'"),
        ("calibrations", "packed = zeroblob(length(packed))"),
        ("profiles", "source = 'another'"),
        ("schedules", "name = 'evening'"),
        ("directions", "forward = 1 - forward"),
        ("machines", "program = '2'"),
        ("inputs", "text = text || 'x'"),
        ("decisions", "time_ns = time_ns + 1"),
        ("archives", "has_end = 1 - has_end"),
    ];
    assert_eq!(changes.map(|(table, _)| table), TABLES);
    for (table, change) in changes {
        fs::write(shelf.path(), &whole).unwrap();
        let connection = Connection::open(shelf.path()).unwrap();
        let update = format!(
            "DROP TRIGGER {table}_are_not_changed; \
             UPDATE {table} SET {change} WHERE id = (SELECT max(id) FROM {table})"
        );
        connection.execute_batch(&update).unwrap();
        drop(connection);
        let error = Store::open(&shelf.path()).unwrap().check().unwrap_err().to_string();
        assert!(error.contains(&format!("of {table} is not as it was written")), "{error}");
        let salvaged = salvage(&shelf.path(), &shelf.file(&format!("{table}.db"))).unwrap();
        let lost = salvaged.tables.iter().find(|found| found.name == table).unwrap().lost;
        assert_eq!((lost, salvaged.is_all()), (1, false), "{table}: {salvaged:?}");
    }
}

/// A store whose newest commits are in its log, as after a power cut: copies of both, and what was in them.
fn with_log(shelf: &Shelf) -> (PathBuf, Vec<u8>, Rows) {
    drop(drive(shelf.store(), 0, 100, 200));
    let journal = drive(shelf.store(), 1, 1, 60);
    let [store, log] = ["cut.db", "cut.db-wal"].map(|name| shelf.file(name));
    fs::copy(shelf.path(), &store).unwrap();
    fs::copy(shelf.file("railway.db-wal"), log).unwrap();
    let log = fs::read(shelf.file("railway.db-wal")).unwrap();
    let truth = rows_of(&shelf.path());
    drop(journal);
    (store, log, truth)
}

/// The size of a frame of a log, behind a header of 32 bytes (SQLite file format, section 4.1).
const FRAME: usize = 24 + PAGE;

#[test]
fn a_flipped_byte_in_the_log_is_noticed_and_what_is_behind_it_salvaged() {
    let shelf = Shelf::new();
    let (store, log, truth) = with_log(&shelf);
    let bytes = fs::read(&store).unwrap();
    let frames = (log.len() - 32) / FRAME;
    let mut with_losses = 0;
    for frame in (0..frames - 8).step_by(5) {
        let mut bent = log.clone();
        bent[32 + frame * FRAME + 24 + 2_000] ^= 0x10;
        let beside = shelf.file("cut.db-wal");
        fs::write(&store, &bytes).unwrap();
        fs::write(&beside, &bent).unwrap();
        let says = format!("frame {} of {frames} in {} is damaged", frame + 1, beside.display());
        let reading = Store::open_to_read(&store).unwrap().check().unwrap_err();
        let writing = Store::open(&store).unwrap_err();
        for error in [reading, writing] {
            assert!(matches!(error, StoreError::Damaged { .. }), "{error}");
            assert!(error.to_string().contains(&says), "{error}");
        }
        assert_eq!(fs::read(&beside).unwrap(), bent, "the log stays as it is for a salvage");
        let out = shelf.file(&format!("new-{frame}.db"));
        let salvaged = salvage(&store, &out).unwrap();
        assert!(!salvaged.is_all() && salvaged.unread_log.unwrap().contains(&says));
        let got = rows_of(&out);
        for (table, truth) in &truth {
            let invented: Vec<_> =
                got[table].difference(truth).filter(|row| !is_stand_in(table, row)).collect();
            assert!(invented.is_empty(), "frame {frame}: {table} has {invented:?}");
        }
        with_losses += u64::from(truth["events"] != got["events"]);
        Store::open(&out).unwrap().check().unwrap();
    }
    // The next image of the same page, a few frames behind, has the events of a damaged one, too.
    assert_eq!(with_losses, 0);
}

#[test]
fn a_commit_that_was_cut_off_is_no_damage_but_a_salvage_cannot_know() {
    let shelf = Shelf::new();
    let (store, log, truth) = with_log(&shelf);
    let last = log.len() - FRAME;
    // What the disk had not written yet when the power was cut: the last frame, which ends the commit, or one before it.
    let mut torn = log.clone();
    torn[last + 24..].fill(0);
    fs::write(shelf.file("cut.db-wal"), &torn).unwrap();
    let salvaged = salvage(&store, &shelf.file("new.db")).unwrap();
    let says = salvaged.unread_log.clone().unwrap();
    assert!(says.starts_with("the last commit in ") && says.contains(" is not whole: "), "{says}");
    assert!(!salvaged.is_all());
    // A check reports it, too; the store without it is sound.
    let read = Store::open_to_read(&store).unwrap();
    read.check().unwrap();
    assert_eq!(read.cut_commit().as_ref(), Some(&says));
    drop(read);
    // The railway runs on.
    let opened = Store::open(&store).unwrap();
    opened.check().unwrap();
    drop(opened);
    assert_eq!(Store::open_to_read(&store).unwrap().cut_commit(), None);
    assert!(rows_of(&store)["events"].len() >= truth["events"].len() - 1);
    // A commit without its last frame was never acknowledged.
    fs::write(shelf.file("cut.db-wal"), &log[..last]).unwrap();
    assert!(salvage(&store, &shelf.file("newer.db")).unwrap().is_all());
}

#[test]
fn a_log_without_its_header_is_salvaged() {
    let shelf = Shelf::new();
    let (store, mut log, truth) = with_log(&shelf);
    log[17] ^= 1;
    fs::write(shelf.file("cut.db-wal"), &log).unwrap();
    let error = Store::open(&store).unwrap_err().to_string();
    assert!(error.contains("the header of ") && error.contains(" commits cannot be read"), "{error}");
    let out = shelf.file("new.db");
    assert!(!salvage(&store, &out).unwrap().is_all());
    let got = rows_of(&out);
    for table in TABLES {
        let lost: Vec<_> = truth[table].difference(&got[table]).collect();
        assert!(lost.is_empty() && got[table].len() == truth[table].len(), "{table}: {lost:.200?}");
    }
}

#[cfg(unix)]
#[test]
fn a_store_that_may_only_be_read_is_read_where_it_is() {
    let shelf = Shelf::new();
    fs::create_dir(shelf.file("folder")).unwrap();
    let path = shelf.file("folder/evening 100%?.db");
    fs::write(&path, driven(&shelf)).unwrap();
    let set = |path: &Path, mode| fs::set_permissions(path, fs::Permissions::from_mode(mode)).unwrap();
    set(&path, 0o444);
    set(&shelf.file("folder"), 0o555);
    let store = Store::open_to_read(&path);
    set(&shelf.file("folder"), 0o755);
    let store = store.unwrap();
    store.check().unwrap();
    assert_eq!(store.recordings(minute(100)).unwrap().len(), 3);
    // The superuser may write all the same.
    if fs::OpenOptions::new().write(true).open(&path).is_err() {
        assert_eq!(fs::read_dir(shelf.file("folder")).unwrap().count(), 1, "nothing is left beside it");
    }
}
