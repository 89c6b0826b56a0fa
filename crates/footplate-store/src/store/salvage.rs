//! Copies the readable rows of a damaged store into a new one.
//!
//! The damaged file is not changed: a copy of it is read row by row, by number, without the rows of damaged pages. Then
//! every page is searched by itself for rows that no tree reaches any more. Events whose run or recording is lost get a
//! placeholder, so that no readable row is dropped.

mod leaf_pages;
mod strays;

use std::fs;
use std::path::{Path, PathBuf};

use rusqlite::types::Value;
use rusqlite::{Connection, Statement, Transaction, params_from_iter};

use self::leaf_pages::Pages;
use self::strays::Strays;
use super::checksum;
use super::error::StoreError;
use super::file::Store;

/// The rows that were copied and lost.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Salvaged {
    /// The tables in the order of their dependences.
    pub tables: Vec<SalvagedTable>,
    /// The damage of the file; `None` if it has none. With damage more rows may be lost than the tables count: rows at the
    /// end of a table leave no gap.
    pub damage: Option<String>,
    /// Rows found in pages by themselves that could belong to more than one table; they were not copied.
    pub ambiguous: u64,
}

impl Salvaged {
    /// Whether all rows were copied, as far as pages and numbers show: damage that turns a value into another possible one is
    /// not visible there.
    #[must_use]
    pub fn is_all(&self) -> bool {
        let is_lost = |table: &SalvagedTable| table.lost + table.stand_ins > 0;
        self.damage.is_none() && self.ambiguous == 0 && !self.tables.iter().any(is_lost)
    }
}

/// The rows of one table.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SalvagedTable {
    /// The table.
    pub name: &'static str,
    /// Rows that were read and are valid.
    pub rows: u64,
    /// Unreadable rows, by the gaps in the numbers. Rows lost at the end leave no gap and are not counted.
    pub lost: u64,
    /// Lost rows of other tables that got a placeholder, because rows of this one refer to them.
    pub stand_ins: u64,
}

/// The tables with their parents, parents first. States of replays are not copied: they follow from the rest.
const TABLES: [(&str, Option<Parent>); 14] = [
    ("recordings", None),
    ("runs", Some(Parent { column: "recording", table: "recordings", stand_in: STAND_IN_RECORDING })),
    ("starts", Some(Parent { column: "run", table: "runs", stand_in: STAND_IN_RUN })),
    ("events", Some(Parent { column: "run", table: "runs", stand_in: STAND_IN_RUN })),
    ("gate_passes", Some(Parent { column: "run", table: "runs", stand_in: STAND_IN_RUN })),
    // A mark is useless without its event.
    ("marks", None),
    ("calibrations", None),
    ("profiles", None),
    ("schedules", None),
    ("directions", None),
    ("machines", Some(Parent { column: "recording", table: "recordings", stand_in: STAND_IN_RECORDING })),
    // Without the initial state no decision can be replayed.
    ("inputs", None),
    ("decisions", None),
    ("archives", None),
];

/// The parent of a row.
#[derive(Clone, Copy)]
struct Parent {
    column: &'static str,
    table: &'static str,
    /// Inserts the row `?1` of the parent table.
    stand_in: &'static str,
}

const STAND_IN_RECORDING: &str = "INSERT INTO recordings (id, name, form, layout, stored_at_ns) \
     VALUES (?1, 'lost recording', 'salvaged', 'unknown', 0)";
/// All lost runs get one recording, under their numbers in the store.
const STAND_IN_RUN: &str = "INSERT INTO runs (id, recording, number) \
     SELECT ?1, id, ?1 FROM recordings WHERE form = 'salvaged runs'";
/// The number of that recording, above all numbers that were read.
const RECORDING_OF_LOST_RUNS: &str = "INSERT INTO recordings (name, form, layout, stored_at_ns) \
     SELECT 'lost runs', 'salvaged runs', 'unknown', 0 \
     WHERE NOT EXISTS (SELECT 1 FROM recordings WHERE form = 'salvaged runs')";

/// The smallest size of a row in the file: header and key of a cell (SQLite file format, section 1.6).
const LEAST_ROW_BYTES: u64 = 4;
/// The offset of the size of the file in pages in its header; with zero SQLite counts them (SQLite file format, 1.3).
const SIZE_IN_HEADER: std::ops::Range<usize> = 28..32;

/// Copies the readable rows of the store at `damaged` into a new store at `into`, where no file may exist.
pub fn salvage(damaged: &Path, into: &Path) -> Result<Salvaged, StoreError> {
    let exists = |path: &Path| path.try_exists().unwrap_or(true);
    if !exists(damaged) {
        return Err(StoreError::Missing { file: damaged.to_owned() });
    }
    if exists(into) {
        return Err(StoreError::Exists { file: into.to_owned() });
    }
    let beside = into.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let folder = tempfile::tempdir_in(beside).map_err(system(into, "write beside"))?;
    let fresh = folder.path().join("new.db");
    drop(Store::open_or_create(&fresh)?);

    let damage = damage_of(&copy_of(damaged, folder.path())?);
    let copy = copy_of(damaged, folder.path())?;
    let mut salvaged = match copy_rows(&copy, &fresh) {
        Ok(salvaged) if !salvaged.is_empty() => salvaged,
        // A file without its first pages has lost the list of its tables; a new store has the same list.
        _ => {
            let copy = copy_of(damaged, folder.path())?;
            replace_list_of_tables(&copy, &fresh)?;
            let salvaged = copy_rows(&copy, &fresh)?;
            if salvaged.is_empty() {
                return Err(StoreError::NothingReadable { file: damaged.to_owned() });
            }
            salvaged
        }
    };
    salvaged.damage = damage;
    fs::rename(&fresh, into).map_err(system(into, "write"))?;
    Ok(salvaged)
}

/// The damage of a store; `None` if it is whole.
fn damage_of(copy: &Path) -> Option<String> {
    let checked = Store::open(copy).and_then(|store| store.check());
    checked.err().map(|error| match error {
        StoreError::Damaged { what, .. } => what,
        other => other.to_string(),
    })
}

impl Salvaged {
    fn is_empty(&self) -> bool {
        self.tables.iter().all(|table| table.rows == 0)
    }
}

fn system(file: &Path, doing: &'static str) -> impl FnOnce(std::io::Error) -> StoreError {
    let file = file.to_owned();
    move |source| StoreError::System { file, doing, source }
}

/// A copy of a store, with the readable part of its write-ahead log.
fn copy_of(damaged: &Path, folder: &Path) -> Result<PathBuf, StoreError> {
    let with = |path: &Path, suffix: &str| {
        let mut name = path.as_os_str().to_owned();
        name.push(suffix);
        PathBuf::from(name)
    };
    let copy = folder.join("damaged.db");
    let _ = fs::remove_file(with(&copy, "-shm"));
    fs::copy(damaged, &copy).map_err(system(damaged, "read"))?;
    let journal = with(damaged, "-wal");
    if journal.exists() {
        fs::copy(&journal, with(&copy, "-wal")).map_err(system(&journal, "read"))?;
    }
    Ok(copy)
}

/// Replaces the pages that list the tables with those of a new store, which has the same tables in the same places.
fn replace_list_of_tables(copy: &Path, fresh: &Path) -> Result<(), StoreError> {
    let pages = || {
        let fresh = Connection::open(fresh)?;
        let size = fresh.pragma_query_value(None, "page_size", |row| row.get(0))?;
        let mut statement = fresh.prepare("SELECT pageno - 1 FROM dbstat WHERE name = 'sqlite_schema'")?;
        let pages = statement.query_map([], |row| row.get(0))?.collect::<rusqlite::Result<Vec<usize>>>()?;
        Ok((pages, size))
    };
    let (pages, size): (_, usize) = pages().map_err(|error| StoreError::of(fresh, error))?;
    let good = fs::read(fresh).map_err(system(fresh, "read"))?;
    let mut bytes = fs::read(copy).map_err(system(copy, "read"))?;
    for page in pages {
        let range = page * size..(page + 1) * size;
        // The file may end before the end of the list.
        bytes.resize(bytes.len().max(range.end), 0);
        if let (Some(bytes), Some(good)) = (bytes.get_mut(range.clone()), good.get(range)) {
            bytes.copy_from_slice(good);
        }
    }
    if let Some(pages) = bytes.get_mut(SIZE_IN_HEADER) {
        pages.fill(0);
    }
    fs::write(copy, bytes).map_err(system(copy, "write"))
}

fn copy_rows(copy: &Path, fresh: &Path) -> Result<Salvaged, StoreError> {
    // Moves the write-ahead log into the file, if that still works.
    drop(Connection::open(copy).and_then(|copy| copy.execute_batch("PRAGMA wal_checkpoint(TRUNCATE)")));
    let bytes = fs::read(copy).map_err(system(copy, "read"))?;
    let strays = Strays::new(Pages::of(&bytes)).map_err(|error| StoreError::of(fresh, error))?;
    let from = Connection::open(copy).map_err(|error| StoreError::of(copy, error))?;
    // Lets SQLite read a file that is shorter than its header states.
    from.pragma_update(None, "writable_schema", true).map_err(|error| StoreError::of(copy, error))?;
    let mut store = Store::open(fresh)?;
    let path = store.path().to_owned();
    let transaction = store.write()?;
    let most = fs::metadata(copy).map_or(0, |file| file.len() / LEAST_ROW_BYTES);
    let copied = TABLES
        .iter()
        .map(|(name, parent)| {
            let mut table = copy_table(&from, &transaction, name, *parent, most)?;
            strays.bring_home(&transaction, &mut table, *parent)?;
            Ok(table)
        })
        .collect::<rusqlite::Result<Vec<SalvagedTable>>>()
        .and_then(|tables| {
            let ambiguous = strays.ambiguous(&transaction)?;
            transaction.commit().map(|()| Salvaged { tables, damage: None, ambiguous })
        });
    copied.map_err(|error| StoreError::of(&path, error))
}

/// Copies the rows of a table by number, from the first to the last that is found, or to number `most`. Fails only if the
/// new store does.
fn copy_table(
    from: &Connection,
    into: &Transaction<'_>,
    name: &'static str,
    parent: Option<Parent>,
    most: u64,
) -> rusqlite::Result<SalvagedTable> {
    let empty = SalvagedTable { name, rows: 0, lost: 0, stand_ins: 0 };
    // An older store has fewer columns, and names in a damaged one may be wrong.
    let known = columns_of(into, name);
    let columns: Vec<String> =
        columns_of(from, name).into_iter().filter(|column| known.contains(column)).collect();
    if columns.first().is_none_or(|first| first != "id") {
        return Ok(empty);
    }
    let (names, places) = (columns.join(", "), vec!["?"; columns.len()].join(", "));
    let select = format!("SELECT {names} FROM {name} NOT INDEXED WHERE id >= ?1 ORDER BY id");
    let Ok(select) = from.prepare(&select) else { return Ok(empty) };
    let insert = format!("INSERT INTO {name} ({names}) VALUES ({places})");
    let Ok(insert) = into.prepare(&insert) else { return Ok(empty) };
    let parent = parent.and_then(|parent| {
        let column = columns.iter().position(|column| column == parent.column)?;
        Some((parent, column))
    });
    let newest =
        from.query_row(&format!("SELECT max(id) FROM {name}"), [], |row| row.get::<_, Option<i64>>(0));
    let last = match &newest {
        Ok(newest) => newest.unwrap_or(0),
        Err(_) => i64::try_from(most).unwrap_or(i64::MAX),
    };

    let mut copy = TableCopy { select, columns, insert, into, parent, table: empty };
    let mut next = 1;
    let mut last_known = newest.ok().flatten().unwrap_or(0);
    while next <= last {
        let stretch = copy.copy_from(next)?;
        last_known = last_known.max(stretch.last_read.unwrap_or(0));
        if stretch.ended {
            break;
        }
        // The next row cannot be read: continue behind it, or behind all of its page.
        next = match stretch.last_read {
            Some(read) => read.saturating_add(1),
            None => copy.readable_after(next, last),
        };
    }
    copy.table.lost = u64::try_from(last_known).unwrap_or(0).saturating_sub(copy.table.rows);
    Ok(copy.table)
}

/// The columns of a table whose names can be read.
fn columns_of(connection: &Connection, table: &str) -> Vec<String> {
    let names = |connection: &Connection| {
        connection
            .prepare("SELECT name FROM pragma_table_info(?1)")?
            .query_map([table], |row| row.get(0))?
            .collect::<rusqlite::Result<Vec<String>>>()
    };
    names(connection).unwrap_or_default()
}

/// A table that is copied.
struct TableCopy<'a> {
    /// Reads the rows from a number on, in order.
    select: Statement<'a>,
    columns: Vec<String>,
    insert: Statement<'a>,
    into: &'a Transaction<'a>,
    /// The parent of its rows, and the column that refers to it.
    parent: Option<(Parent, usize)>,
    table: SalvagedTable,
}

/// How far rows were read.
struct Stretch {
    last_read: Option<i64>,
    /// Whether that was the last row of the table.
    ended: bool,
}

impl TableCopy<'_> {
    /// The first number after an unreadable one at which reading goes on, or the one after `last`: ever further ahead, then
    /// by halves. A page of readable rows between two damaged ones can be passed over; its rows are found as strays.
    fn readable_after(&mut self, unreadable: i64, last: i64) -> i64 {
        let (mut bad, mut step) = (unreadable, 1_i64);
        let mut good = loop {
            let probe = bad.saturating_add(step);
            if probe > last {
                return last.saturating_add(1);
            }
            if self.reads_at(probe) {
                break probe;
            }
            (bad, step) = (probe, step.saturating_mul(2));
        };
        while good - bad > 1 {
            let middle = bad + (good - bad) / 2;
            if self.reads_at(middle) { good = middle } else { bad = middle }
        }
        good
    }

    /// Whether a row from a number on can be read, or the end of the table.
    fn reads_at(&mut self, number: i64) -> bool {
        self.select.query([number]).is_ok_and(|mut rows| rows.next().is_ok())
    }

    /// Copies rows from number `first` on, until one cannot be read.
    fn copy_from(&mut self, first: i64) -> rusqlite::Result<Stretch> {
        let mut stretch = Stretch { last_read: None, ended: false };
        let Ok(mut rows) = self.select.query([first]) else { return Ok(stretch) };
        loop {
            let row = match rows.next() {
                Ok(Some(row)) => row,
                Ok(None) => {
                    stretch.ended = true;
                    return Ok(stretch);
                }
                Err(_) => return Ok(stretch),
            };
            let values: rusqlite::Result<Vec<Value>> =
                (0..self.columns.len()).map(|column| row.get(column)).collect();
            let Ok(values) = values else { return Ok(stretch) };
            let Some(Value::Integer(id)) = values.first() else { return Ok(stretch) };
            // Rows are in the order of their ids; damaged pages may lead round in a circle for ever.
            if stretch.last_read.is_some_and(|last| *id <= last) {
                return Ok(stretch);
            }
            stretch.last_read = Some(*id);
            // A row that was changed refers to a parent that perhaps never was.
            if !checksum::holds(self.table.name, &self.columns, &values) {
                continue;
            }
            if let Some((parent, column)) = self.parent
                && let Some(Value::Integer(key)) = values.get(column)
            {
                self.table.stand_ins += u64::from(stand_in(self.into, parent, *key)?);
            }
            self.table.rows += u64::from(accepted(&mut self.insert, &values)?);
        }
    }
}

/// Inserts a row if it is valid.
fn accepted(insert: &mut Statement<'_>, values: &[Value]) -> rusqlite::Result<bool> {
    match insert.execute(params_from_iter(values)) {
        Ok(_) => Ok(true),
        Err(error) if error.sqlite_error_code() == Some(rusqlite::ErrorCode::ConstraintViolation) => {
            Ok(false)
        }
        Err(error) => Err(error),
    }
}

/// Inserts the row `key` of the parent table if it is lost. Returns whether it did.
fn stand_in(into: &Transaction<'_>, parent: Parent, key: i64) -> rusqlite::Result<bool> {
    let there = format!("SELECT 1 FROM {} WHERE id = ?1", parent.table);
    if into.prepare_cached(&there)?.exists([key])? {
        return Ok(false);
    }
    if parent.table == "runs" {
        into.execute(RECORDING_OF_LOST_RUNS, [])?;
    }
    // An impossible number is a damaged row, which its own insertion refuses.
    Ok(into.execute(parent.stand_in, [key]).is_ok())
}
