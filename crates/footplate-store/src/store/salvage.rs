//! Copies the readable rows of a damaged store into a new one.
//!
//! The damaged file is not changed: a copy of it is read row by row, by number, without the rows of damaged pages. Then
//! every page is searched by itself for rows that no tree reaches any more, in the file and in what SQLite does not read of its
//! write-ahead log. Events whose run or recording is lost get a placeholder, so that no readable row is dropped. Lost rows are
//! counted by gaps in the numbers, and at the end of a table by the numbers in its indices.

mod index_entries;
mod leaf_pages;
mod strays;
mod table_copy;
mod tables;

use std::fs;
use std::path::{Path, PathBuf};

use rusqlite::{Connection, Transaction};

use self::leaf_pages::Pages;
use self::strays::Strays;
use self::table_copy::{TableCopy, columns_of};
pub use self::tables::SalvagedTable;
use self::tables::{RENUMBERED, TABLES};
use super::error::StoreError;
use super::file::Store;
use super::write_ahead_log::{self, UnreadLog};

/// The rows that were copied and lost.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Salvaged {
    /// The tables in the order of their dependences.
    pub tables: Vec<SalvagedTable>,
    /// The damage of the file; `None` if it has none.
    pub damage: Option<String>,
    /// What was not read of the write-ahead log beside it, so that the newest rows of any table may be lost.
    pub unread_log: Option<String>,
    /// Rows found in pages by themselves that could belong to more than one table; they were not copied.
    pub ambiguous: u64,
}

impl Salvaged {
    /// Whether all rows were copied, as far as pages and numbers show: damage that turns a value into another possible one is
    /// not visible there.
    pub fn is_all(&self) -> bool {
        let is_lost = |table: &SalvagedTable| table.lost + table.stand_ins > 0 || !table.is_end_known;
        self.damage.is_none()
            && self.unread_log.is_none()
            && self.ambiguous == 0
            && !self.tables.iter().any(is_lost)
    }
}

/// The smallest size of a row in the file: header and key of a cell (SQLite file format, section 1.6).
const LEAST_ROW_BYTES: u64 = 4;
/// The offset of the size of the file in pages in its header; with zero SQLite counts them (SQLite file format, 1.3).
const SIZE_IN_HEADER: std::ops::Range<usize> = 28..32;
/// The largest file that pages of a log may make, in bytes: a damaged number of a page may be any.
const MOST_BYTES: usize = 1 << 34;

/// Copies the readable rows of the store at `damaged` into a new store at `into`, where no file may exist.
pub fn salvage(damaged: &Path, into: &Path) -> Result<Salvaged, StoreError> {
    let exists = |path: &Path| path.try_exists().unwrap_or(true);
    if !exists(damaged) {
        return Err(StoreError::Missing(damaged.to_owned()));
    }
    if exists(into) {
        return Err(StoreError::Exists(into.to_owned()));
    }
    let beside = into.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let folder = tempfile::tempdir_in(beside).map_err(system(into, "write beside"))?;
    let fresh = folder.path().join("new.db");
    drop(Store::open_or_create(&fresh)?);

    let copy = copy_of(damaged, folder.path())?;
    let bytes = fs::read(&copy).map_err(system(&copy, "read"))?;
    let with_log = with_log(damaged, &bytes)?;
    let images = [bytes.as_slice(), with_log.as_slice()];
    let images = if with_log == bytes { &images[..1] } else { &images[..] };
    let strays = || Strays::new(images.iter().map(|image| Pages::of(image)).collect());

    let as_it_is =
        || copy_rows(&copy, &fresh, &strays().map_err(|error| StoreError::of(&fresh, error))?, false);
    let mut salvaged = as_it_is().unwrap_or_default();
    let mut best = fresh.clone();
    if !is_list_whole(&copy) {
        // Without its first pages a file has lost the list of its tables; a new store has the same list.
        let other = folder.path().join("other.db");
        drop(Store::open_or_create(&other)?);
        let listed = folder.path().join("listed.db");
        fs::copy(&copy, &listed).map_err(system(&copy, "read"))?;
        replace_list_of_tables(&listed, &other)?;
        let strays = strays().map_err(|error| StoreError::of(&other, error))?;
        let again = copy_rows(&listed, &other, &strays, true)?;
        if again.found() > salvaged.found() {
            (salvaged, best) = (again, other);
        }
    }
    if salvaged.rows() == 0 {
        return Err(StoreError::NothingReadable(damaged.to_owned()));
    }
    salvaged.damage = damage_of(&copy);
    salvaged.unread_log = UnreadLog::beside(damaged)?.map(|unread| unread.to_string());
    fs::rename(&best, into).map_err(system(into, "write"))?;
    Ok(salvaged)
}

/// The bytes of a store with all whole commits of the write-ahead log beside it, those that SQLite does not read among them.
fn with_log(damaged: &Path, bytes: &[u8]) -> Result<Vec<u8>, StoreError> {
    let mut bytes = bytes.to_vec();
    for (number, page) in UnreadLog::committed_pages(damaged)? {
        let Some(begin) = usize::try_from(number).ok().and_then(|number| number.checked_sub(1)) else {
            continue;
        };
        let range = begin * page.len()..(begin + 1) * page.len();
        if range.end > MOST_BYTES {
            continue;
        }
        bytes.resize(bytes.len().max(range.end), 0);
        if let Some(bytes) = bytes.get_mut(range) {
            bytes.copy_from_slice(&page);
        }
    }
    Ok(bytes)
}

/// Whether the list of tables can be read, and every table in it.
fn is_list_whole(copy: &Path) -> bool {
    let read = || -> rusqlite::Result<bool> {
        let copy = Connection::open(copy)?;
        copy.pragma_update(None, "writable_schema", true)?;
        let names = "SELECT name FROM sqlite_schema WHERE type = 'table'";
        let mut names = copy.prepare(names)?;
        let names = names.query_map([], |row| row.get(0))?.collect::<rusqlite::Result<Vec<String>>>()?;
        Ok(!names.is_empty() && names.iter().all(|name| !columns_of(&copy, name).is_empty()))
    };
    read().unwrap_or(false)
}

/// The damage of a store; `None` if it is whole.
fn damage_of(copy: &Path) -> Option<String> {
    let checked = Store::open(copy).and_then(|store| store.check());
    checked.err().map(|error| match error {
        StoreError::Damaged { what, .. } => what,
        StoreError::NotAStore(_) => "it does not begin as a store does".to_owned(),
        other => other.to_string(),
    })
}

impl Salvaged {
    /// What two attempts are compared by: the rows that were found, and the tables whose ends are known.
    fn found(&self) -> (u64, usize) {
        (self.rows(), self.tables.iter().filter(|table| table.is_end_known).count())
    }

    fn rows(&self) -> u64 {
        self.tables.iter().map(|table| table.rows).sum()
    }
}

fn system(file: &Path, doing: &'static str) -> impl FnOnce(std::io::Error) -> StoreError {
    let file = file.to_owned();
    move |source| StoreError::System { file, doing, source }
}

/// A copy of a store, with what SQLite reads of its write-ahead log moved into the file.
fn copy_of(damaged: &Path, folder: &Path) -> Result<PathBuf, StoreError> {
    let copy = folder.join("damaged.db");
    fs::copy(damaged, &copy).map_err(system(damaged, "read"))?;
    let log = write_ahead_log::path_of(damaged);
    if log.exists() {
        let copied = write_ahead_log::path_of(&copy);
        fs::copy(&log, &copied).map_err(system(&log, "read"))?;
        drop(Connection::open(&copy).and_then(|copy| copy.execute_batch("PRAGMA wal_checkpoint(TRUNCATE)")));
        let _ = fs::remove_file(copied);
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

/// Copies the rows of `copy` into `fresh`. If its list of tables was replaced, trees may belong to other tables than it says.
fn copy_rows(
    copy: &Path,
    fresh: &Path,
    strays: &Strays<'_>,
    is_list_replaced: bool,
) -> Result<Salvaged, StoreError> {
    let from = Connection::open(copy).map_err(|error| StoreError::of(copy, error))?;
    // Lets SQLite read a file that is shorter than its header states.
    from.pragma_update(None, "writable_schema", true).map_err(|error| StoreError::of(copy, error))?;
    let mut store = Store::open(fresh)?;
    let path = store.path().to_owned();
    let transaction = store.write()?;
    let most = fs::metadata(copy).map_or(0, |file| file.len() / LEAST_ROW_BYTES);
    let other_homes = is_list_replaced.then_some(strays);
    let copied = TABLES
        .iter()
        .map(|(name, parent)| {
            let mut found = TableCopy::copy(&from, &transaction, name, *parent, most, other_homes)?;
            strays.bring_home(&transaction, &mut found, *parent)?;
            found.count_in_indices(&from, &transaction)?;
            Ok(found.table)
        })
        .collect::<rusqlite::Result<Vec<SalvagedTable>>>()
        .and_then(|mut tables| {
            for table in &mut tables {
                table.rows -= without_archived(&transaction, table.name)?;
            }
            let ambiguous = strays.ambiguous(&transaction)?;
            transaction.commit()?;
            Ok(Salvaged { tables, damage: None, unread_log: None, ambiguous })
        });
    copied.map_err(|error| StoreError::of(&path, error))
}

/// Removes the inputs or decisions that are in an archive, too: pages of different times have both. Returns their number.
fn without_archived(into: &Transaction<'_>, table: &str) -> rusqlite::Result<u64> {
    if !RENUMBERED.contains(&table) {
        return Ok(0);
    }
    let delete = format!(
        "DELETE FROM {table} WHERE EXISTS (SELECT 1 FROM archives WHERE archives.machine = {table}.machine \
         AND {table}.number BETWEEN first AND last)"
    );
    Ok(into.execute(&delete, [])? as u64)
}
