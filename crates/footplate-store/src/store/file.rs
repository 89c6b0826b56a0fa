//! The file of a store: opens, creates and migrates it, and grants write access.

use std::ffi::OsStr;
use std::fs::{self, OpenOptions};
use std::path::{Path, PathBuf};
use std::time::Duration;

use rusqlite::{Connection, OpenFlags, Transaction, TransactionBehavior};
use tempfile::TempDir;

use super::checksum;
use super::error::StoreError;
use super::write_ahead_log::{self, UnreadLog};

/// Marks the file as a store for other tools: `Foot` in ASCII (`PRAGMA application_id`).
const APPLICATION_ID: i64 = 0x466F_6F74;

/// Migrations: an empty file to version 1, version 1 to version 2 and so on. Entries are appended and never changed,
/// because published programs made files with them. `testdata/compat` keeps a file of every version.
const MIGRATIONS: &[&str] = &[
    include_str!("migrations/1_begin.sql"),
    include_str!("migrations/2_motion.sql"),
    include_str!("migrations/3_decisions.sql"),
    include_str!("migrations/4_replays.sql"),
    include_str!("migrations/5_checksums.sql"),
    include_str!("migrations/6_profiles.sql"),
    include_str!("migrations/7_schedules.sql"),
    include_str!("migrations/8_archives.sql"),
    include_str!("migrations/9_directions.sql"),
    include_str!("migrations/10_checksums_of_all.sql"),
];

/// The longest wait for another process to finish writing (chosen: an import of a million events takes less).
const PATIENCE: Duration = Duration::from_secs(5);

/// An open store.
///
/// Several processes may have it open. Readers see the state at their beginning. One process writes at a time; the
/// others wait, and then fail with an error that names the cause.
#[derive(Debug)]
pub struct Store {
    path: PathBuf,
    pub(super) connection: Connection,
    /// What of the log is not read, when the store was opened to be read.
    unread_log: Option<UnreadLog>,
    /// The folder of the copy that is read in place of the file at `path`.
    _copy: Option<TempDir>,
}

impl Store {
    /// Opens the store at `path`, and migrates it if an older Footplate made it.
    pub fn open(path: &Path) -> Result<Self, StoreError> {
        if !path.try_exists().unwrap_or(true) {
            return Err(StoreError::Missing(path.to_owned()));
        }
        Self::open_with(path, OpenFlags::SQLITE_OPEN_READ_WRITE, MIGRATIONS)
    }

    /// Opens the store at `path` read-only, in a folder that cannot be written, too. One of an older version is read from a migrated
    /// copy in a temporary folder.
    pub fn open_to_read(path: &Path) -> Result<Self, StoreError> {
        if !path.try_exists().unwrap_or(true) {
            return Err(StoreError::Missing(path.to_owned()));
        }
        let unread_log = UnreadLog::beside(path)?;
        let has_log = fs::metadata(write_ahead_log::path_of(path)).is_ok_and(|log| log.len() > 0);
        // A store that has no log and may only be read is not being written.
        let is_fixed = !has_log && OpenOptions::new().write(true).open(path).is_err();
        let opened = if is_fixed { Self::open_fixed(path) } else { Self::open_shared(path) };
        let opened = match opened {
            // SQLite shares a log through a file that it cannot make here.
            Err(StoreError::ReadOnly(_)) if has_log => Self::open_copy(path, |copy| {
                let copied = fs::copy(path, copy)
                    .and_then(|_| fs::copy(write_ahead_log::path_of(path), write_ahead_log::path_of(copy)));
                let doing = "make a copy, to read it, of";
                copied.map(drop).map_err(|source| StoreError::System { file: path.to_owned(), doing, source })
            }),
            Err(StoreError::ReadOnly(_)) if !is_fixed => Self::open_fixed(path),
            other => other,
        };
        let known = MIGRATIONS.len() as i64;
        let mut store = opened?;
        if store.version(known)? != known {
            store = Self::open_copy(path, |copy| {
                let copy = copy.to_string_lossy();
                store
                    .connection
                    .execute("VACUUM INTO ?1", [copy])
                    .map(drop)
                    .map_err(|error| store.error(error))
            })?;
        }
        store.unread_log = unread_log;
        Ok(store)
    }

    /// What the last commit in the log beside a store that was opened to be read lacks: the power was cut in it, or it was damaged later,
    /// which look alike. Without it the store is sound.
    pub fn cut_commit(&self) -> Option<String> {
        self.unread_log.as_ref().filter(|unread| !unread.is_loss()).map(ToString::to_string)
    }

    /// Opens a file that others may be writing to.
    fn open_shared(path: &Path) -> Result<Self, StoreError> {
        Self::open_read_only(path, path.as_os_str(), OpenFlags::empty())
    }

    /// Opens a file that is not being written, without the files that SQLite makes beside one.
    fn open_fixed(path: &Path) -> Result<Self, StoreError> {
        let mut address = String::from("file:");
        for byte in path.as_os_str().as_encoded_bytes() {
            match byte {
                b'/' | b'.' | b'-' | b'_' => address.push(char::from(*byte)),
                byte if byte.is_ascii_alphanumeric() => address.push(char::from(*byte)),
                byte => address.push_str(&format!("%{byte:02X}")),
            }
        }
        address.push_str("?immutable=1");
        Self::open_read_only(path, OsStr::new(&address), OpenFlags::SQLITE_OPEN_URI)
    }

    fn open_read_only(path: &Path, name: &OsStr, more: OpenFlags) -> Result<Self, StoreError> {
        let flags = OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_NO_MUTEX | more;
        let connection =
            Connection::open_with_flags(name, flags).map_err(|error| StoreError::of(path, error))?;
        let store = Self { path: path.to_owned(), connection, unread_log: None, _copy: None };
        store.set_up().map_err(|error| store.error(error))?;
        store.version(MIGRATIONS.len() as i64)?;
        Ok(store)
    }

    /// Opens a copy of the file at `path`, which `make` makes, migrated and to be read only.
    fn open_copy(
        path: &Path,
        make: impl FnOnce(&Path) -> Result<(), StoreError>,
    ) -> Result<Self, StoreError> {
        let doing = "make a temporary folder to read";
        let folder = tempfile::tempdir().map_err(|source| StoreError::System {
            file: path.to_owned(),
            doing,
            source,
        })?;
        let copy = folder.path().join("copy.db");
        make(&copy)?;
        let mut store = Self::open_with(&copy, OpenFlags::SQLITE_OPEN_READ_WRITE, MIGRATIONS)?;
        store.connection.pragma_update(None, "query_only", true).map_err(|error| store.error(error))?;
        (store.path, store._copy) = (path.to_owned(), Some(folder));
        Ok(store)
    }

    /// Opens the store at `path`, or creates an empty one.
    pub fn open_or_create(path: &Path) -> Result<Self, StoreError> {
        let flags = OpenFlags::SQLITE_OPEN_READ_WRITE | OpenFlags::SQLITE_OPEN_CREATE;
        Self::open_with(path, flags, MIGRATIONS)
    }

    /// Sets how long the store waits for other processes to finish writing.
    pub fn with_patience(self, patience: Duration) -> Result<Self, StoreError> {
        self.connection.busy_timeout(patience).map_err(|error| self.error(error))?;
        Ok(self)
    }

    /// Its path.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The migrations that make the tables of a store.
    pub(super) const fn migrations() -> &'static [&'static str] {
        MIGRATIONS
    }

    /// The size of its tables and indices with what the write-ahead log holds of them, in bytes.
    pub fn size(&self) -> Result<u64, StoreError> {
        let read = |name| self.connection.pragma_query_value(None, name, |row| row.get::<_, u64>(0));
        let size = || Ok(read("page_count")? * read("page_size")?);
        size().map_err(|error| self.error(error))
    }

    /// Checks every page, every reference and the checksum of every row. Takes as long as reading the file.
    pub fn check(&self) -> Result<(), StoreError> {
        if let Some(what) =
            self.unread_log.as_ref().filter(|unread| unread.is_loss()).map(ToString::to_string)
        {
            return Err(StoreError::Damaged { file: self.path.clone(), what });
        }
        let check = || {
            let mut statement = self.connection.prepare("PRAGMA integrity_check(1)")?;
            let found: String = statement.query_row([], |row| row.get(0))?;
            let mut orphans = self.connection.prepare("PRAGMA foreign_key_check")?;
            let orphan = orphans.query([])?.next()?.map(|row| row.get::<_, String>(0)).transpose()?;
            Ok((found, orphan))
        };
        let (found, orphan) = check().map_err(|error| self.error(error))?;
        let what = match orphan {
            _ if found != "ok" => found.replace('\n', ", "),
            Some(table) => format!("rows of {table} belong to nothing"),
            None => {
                let changed = checksum::TABLES.iter().find_map(|table| {
                    let row = checksum::changed_row(&self.connection, table).transpose()?;
                    Some(row.map(|row| (table, row)))
                });
                let Some((table, row)) = changed.transpose().map_err(|error| self.error(error))? else {
                    return Ok(());
                };
                format!("row {row} of {table} is not as it was written: its checksum differs")
            }
        };
        Err(StoreError::Damaged { file: self.path.clone(), what })
    }

    fn open_with(path: &Path, flags: OpenFlags, migrations: &[&str]) -> Result<Self, StoreError> {
        let unread = UnreadLog::beside(path)?;
        // What is written next would take the place of what can still be salvaged.
        if let Some(lost) = unread.as_ref().filter(|unread| unread.is_loss()) {
            return Err(StoreError::Damaged { file: path.to_owned(), what: lost.to_string() });
        }
        let connection = Connection::open_with_flags(path, flags | OpenFlags::SQLITE_OPEN_NO_MUTEX)
            .map_err(|error| StoreError::of(path, error))?;
        let mut store = Self { path: path.to_owned(), connection, unread_log: None, _copy: None };
        store.set_up().map_err(|error| store.error(error))?;
        store.migrate(migrations)?;
        // Only a file of ours is switched to a write-ahead log, a setting that stays in the file.
        let journal: Result<String, _> =
            store.connection.query_row("PRAGMA journal_mode = WAL", [], |row| row.get(0));
        journal.map_err(|error| store.error(error))?;
        if unread.is_some() {
            // Begins the log again, so that no rest of a commit that was cut off stays behind new ones.
            let _ = store.connection.execute_batch("PRAGMA wal_checkpoint(TRUNCATE)");
        }
        Ok(store)
    }

    /// Sets what belongs to a connection and not to the file.
    fn set_up(&self) -> rusqlite::Result<()> {
        self.connection.busy_timeout(PATIENCE)?;
        // A commit is on disk before it is acknowledged.
        self.connection.pragma_update(None, "synchronous", "FULL")?;
        self.connection.pragma_update(None, "foreign_keys", true)?;
        // Zeros over what has moved into an archive, so that a salvage does not find it a second time.
        self.connection.pragma_update(None, "secure_delete", true)?;
        // No code in a foreign file runs with our rights, and damaged pages are detected early.
        self.connection.pragma_update(None, "trusted_schema", false)?;
        self.connection.pragma_update(None, "cell_size_check", true)
    }

    /// Migrates the file in one transaction: it has the old version or the newest.
    fn migrate(&mut self, migrations: &[&str]) -> Result<(), StoreError> {
        let known = migrations.len() as i64;
        if self.version(known)? == known {
            return Ok(());
        }
        let path = self.path.clone();
        let transaction = self.write()?;
        // Another process may have migrated it meanwhile.
        let from = version_of(&transaction).map_err(|error| StoreError::of(&path, error))?;
        let pending = migrations.iter().skip(usize::try_from(from).unwrap_or(usize::MAX));
        let migrated = pending
            .map(|migration| transaction.execute_batch(migration))
            .collect::<rusqlite::Result<Vec<()>>>()
            .and_then(|_| transaction.pragma_update(None, "application_id", APPLICATION_ID))
            .and_then(|()| transaction.pragma_update(None, "user_version", known))
            .and_then(|()| transaction.commit());
        migrated.map_err(|error| self.error(error))
    }

    /// The version of the file, if it is a store and not newer than this program; 0 if it is empty.
    fn version(&self, known: i64) -> Result<i64, StoreError> {
        let read = || {
            let application: i64 =
                self.connection.pragma_query_value(None, "application_id", |row| row.get(0))?;
            let tables: i64 =
                self.connection.query_row("SELECT count(*) FROM sqlite_schema", [], |row| row.get(0))?;
            Ok((application, tables, version_of(&self.connection)?))
        };
        let file = || self.path.clone();
        match read().map_err(|error| self.error(error))? {
            (0, 0, 0) => Ok(0),
            (APPLICATION_ID, _, found) if found > known => {
                Err(StoreError::Newer { file: file(), found, known })
            }
            (APPLICATION_ID, _, found) if found > 0 => Ok(found),
            _ => Err(StoreError::NotAStore(file())),
        }
    }

    /// A transaction that may write: no other process writes until it ends. It is undone unless committed.
    pub(super) fn write(&mut self) -> Result<Transaction<'_>, StoreError> {
        let begun = self.connection.transaction_with_behavior(TransactionBehavior::Immediate);
        begun.map_err(|error| StoreError::of(&self.path, error))
    }

    /// An error of SQLite as an error of the store.
    pub(super) fn error(&self, source: rusqlite::Error) -> StoreError {
        StoreError::of(&self.path, source)
    }
}

fn version_of(connection: &Connection) -> rusqlite::Result<i64> {
    connection.pragma_query_value(None, "user_version", |row| row.get(0))
}

#[cfg(test)]
mod tests {
    use super::*;

    const FLAGS: OpenFlags = OpenFlags::SQLITE_OPEN_READ_WRITE.union(OpenFlags::SQLITE_OPEN_CREATE);
    const ONE: &str = "CREATE TABLE ledger (entry TEXT);";
    const TWO: &str = "ALTER TABLE ledger ADD COLUMN amount INTEGER DEFAULT 7;";

    fn folder() -> tempfile::TempDir {
        tempfile::tempdir().unwrap()
    }

    #[test]
    fn a_file_of_an_older_version_keeps_what_it_has() {
        let folder = folder();
        let path = folder.path().join("railway.db");
        let old = Store::open_with(&path, FLAGS, &[ONE]).unwrap();
        old.connection.execute("INSERT INTO ledger VALUES ('kept')", []).unwrap();
        drop(old);
        let new = Store::open_with(&path, FLAGS, &[ONE, TWO]).unwrap();
        let row = new.connection.query_row("SELECT entry, amount FROM ledger", [], |row| {
            Ok((row.get::<_, String>(0)?, row.get::<_, i64>(1)?))
        });
        assert_eq!(row.unwrap(), ("kept".to_owned(), 7));
        assert_eq!(version_of(&new.connection).unwrap(), 2);
    }

    #[test]
    fn a_migration_that_fails_leaves_the_old_version() {
        let folder = folder();
        let path = folder.path().join("railway.db");
        drop(Store::open_with(&path, FLAGS, &[ONE]).unwrap());
        let broken = Store::open_with(&path, FLAGS, &[ONE, TWO, "CREATE TABLE ledger (again TEXT);"]);
        assert!(matches!(broken, Err(StoreError::Refused { .. })));
        let old = Store::open_with(&path, FLAGS, &[ONE]).unwrap();
        assert_eq!(version_of(&old.connection).unwrap(), 1);
        assert!(old.connection.prepare("SELECT amount FROM ledger").is_err());
    }

    #[test]
    fn a_file_of_a_newer_version_is_refused_with_both_versions() {
        let folder = folder();
        let path = folder.path().join("railway.db");
        drop(Store::open_with(&path, FLAGS, &[ONE, TWO]).unwrap());
        let refused = Store::open_with(&path, FLAGS, &[ONE]).unwrap_err();
        assert!(matches!(refused, StoreError::Newer { found: 2, known: 1, .. }), "{refused}");
        assert!(
            refused
                .to_string()
                .contains("has version 2 of the store, and this Footplate knows versions up to 1")
        );
    }

    #[test]
    fn a_file_of_somebody_else_is_left_alone() {
        let folder = folder();
        let path = folder.path().join("railway.db");
        Connection::open(&path).unwrap().execute_batch("CREATE TABLE theirs (x)").unwrap();
        let before = std::fs::read(&path).unwrap();
        assert!(matches!(Store::open_or_create(&path), Err(StoreError::NotAStore(_))));
        assert_eq!(std::fs::read(&path).unwrap(), before);
        std::fs::write(
            &path,
            "This is a letter, and a long one, with more than the hundred bytes a header has, \
            so that it is not taken for an empty file.",
        )
        .unwrap();
        assert!(matches!(Store::open_or_create(&path), Err(StoreError::NotAStore(_))));
    }

    #[test]
    fn a_store_that_is_read_is_not_changed() {
        let folder = folder();
        let path = folder.path().join("railway.db");
        assert!(matches!(Store::open_to_read(&path), Err(StoreError::Missing(_))));
        drop(Store::open_or_create(&path).unwrap());
        let before = std::fs::read(&path).unwrap();
        let mut store = Store::open_to_read(&path).unwrap();
        store.check().unwrap();
        assert!(store.write().is_err() || store.connection.execute("DELETE FROM replays", []).is_err());
        drop(store);
        assert_eq!(std::fs::read(&path).unwrap(), before);
        // One of an older version is not migrated where it is.
        let old = folder.path().join("old.db");
        drop(Store::open_with(&old, FLAGS, &MIGRATIONS[..2]).unwrap());
        let before = std::fs::read(&old).unwrap();
        let mut store = Store::open_to_read(&old).unwrap();
        store.check().unwrap();
        assert_eq!((store.path(), version_of(&store.connection).unwrap()), (&*old, MIGRATIONS.len() as i64));
        assert!(store.write().is_err() || store.connection.execute("DELETE FROM replays", []).is_err());
        drop(store);
        assert_eq!(std::fs::read(&old).unwrap(), before);
    }

    #[test]
    fn a_file_that_is_not_being_written_is_read_without_one_beside_it() {
        let folder = folder();
        let path = folder.path().join("evening 100%?.db");
        drop(Store::open_or_create(&path).unwrap());
        let store = Store::open_fixed(&path).unwrap();
        store.check().unwrap();
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn opening_makes_no_file_where_there_is_none() {
        let folder = folder();
        let path = folder.path().join("railway.db");
        assert!(matches!(Store::open(&path), Err(StoreError::Missing(_))));
        assert!(!path.exists());
        let nowhere = folder.path().join("no folder/railway.db");
        assert!(matches!(Store::open_or_create(&nowhere), Err(StoreError::ReadOnly(_))));
    }

    #[test]
    fn measurements_are_on_the_disk_before_they_are_acknowledged() {
        let folder = folder();
        let store = Store::open_or_create(&folder.path().join("railway.db")).unwrap();
        let pragma = |name: &str| -> String {
            store
                .connection
                .query_row(&format!("SELECT CAST({name} AS TEXT) FROM pragma_{name}"), [], |row| row.get(0))
                .unwrap()
        };
        assert_eq!(pragma("journal_mode"), "wal");
        assert_eq!(pragma("synchronous"), "2", "FULL");
        assert_eq!(pragma("foreign_keys"), "1");
    }
}
