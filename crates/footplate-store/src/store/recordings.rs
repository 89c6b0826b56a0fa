//! Writes a store: recordings from files, once each, and the events of a live session as they happen.

use footplate_core::{Event, RunId, Timestamp};
use rusqlite::{Connection, OptionalExtension, ToSql, Transaction};

use super::checksum;
use super::error::StoreError;
use super::file::Store;
use super::keys::{RecordingKey, RunKey};
use super::row;
use crate::content_hash::ContentHash;
use crate::recording::{Recording, Run, TrainAtStart};

/// The form of the recording of a live session.
pub(super) const LIVE: &str = "live";

/// The result of an import.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Import {
    /// The recording was added.
    New {
        /// Its number.
        recording: RecordingKey,
    },
    /// The store has a recording of the same bytes; nothing was added.
    AlreadyThere {
        /// Its number.
        recording: RecordingKey,
        /// When it was imported.
        stored_at: Timestamp,
    },
}

impl Store {
    /// Adds a recording from a file with this content, with the sensors of `layout`.
    ///
    /// Adds all of it or nothing. A content that the store has already adds nothing.
    pub fn import(
        &mut self,
        recording: &Recording,
        content: ContentHash,
        layout: &str,
        now: Timestamp,
    ) -> Result<Import, StoreError> {
        let path = self.path().to_owned();
        let transaction = self.write()?;
        import(&transaction, recording, content, layout, now)
            .and_then(|outcome| transaction.commit().map(|()| outcome))
            .map_err(|error| StoreError::of(&path, error))
    }

    /// Begins the recording of a live session on `layout`.
    pub fn begin_recording(
        &mut self,
        name: &str,
        layout: &str,
        now: Timestamp,
    ) -> Result<RecordingKey, StoreError> {
        insert_recording(&self.connection, name, LIVE, layout, None, now)
            .map_err(|error| self.error(error))?;
        Ok(RecordingKey(self.connection.last_insert_rowid()))
    }

    /// Begins a run of a live session, with its clock and the state of its trains.
    pub fn begin_run(
        &mut self,
        recording: RecordingKey,
        id: RunId,
        began_at: Option<Timestamp>,
        trains: &[TrainAtStart],
    ) -> Result<RunKey, StoreError> {
        let path = self.path().to_owned();
        let transaction = self.write()?;
        let begun = insert_run(&transaction, recording, id, began_at, trains)
            .and_then(|run| transaction.commit().map(|()| run));
        begun.map_err(|error| match error.sqlite_error() {
            Some(sqlite) if sqlite.extended_code == rusqlite::ffi::SQLITE_CONSTRAINT_FOREIGNKEY => {
                StoreError::NoRecording(recording)
            }
            _ => StoreError::of(&path, error),
        })
    }

    /// Appends events to a run of a live session. They are on disk when this returns.
    ///
    /// Every call waits for the disk once: pass events together that arrived together.
    pub fn append(&mut self, run: RunKey, events: &[Event], now: Timestamp) -> Result<(), StoreError> {
        let path = self.path().to_owned();
        let transaction = self.write()?;
        let append = || {
            let mut statement = transaction.prepare_cached(row::INSERT)?;
            events.iter().try_for_each(|event| row::insert(&mut statement, run, None, now, *event))
        };
        append().and_then(|()| transaction.commit()).map_err(|error| StoreError::of(&path, error))
    }
}

fn import(
    transaction: &Transaction<'_>,
    recording: &Recording,
    content: ContentHash,
    layout: &str,
    now: Timestamp,
) -> rusqlite::Result<Import> {
    let content = content.to_string();
    let there = transaction
        .query_row("SELECT id, stored_at_ns FROM recordings WHERE content_sha256 = ?1", [&content], |row| {
            Ok((RecordingKey(row.get(0)?), Timestamp::from_ns(row.get(1)?)))
        })
        .optional()?;
    if let Some((recording, stored_at)) = there {
        return Ok(Import::AlreadyThere { recording, stored_at });
    }
    insert_recording(transaction, &recording.name, recording.form.name(), layout, Some(&content), now)?;
    let key = RecordingKey(transaction.last_insert_rowid());
    for run in &recording.runs {
        import_run(transaction, key, run, now)?;
    }
    Ok(Import::New { recording: key })
}

fn import_run(
    transaction: &Transaction<'_>,
    recording: RecordingKey,
    run: &Run,
    now: Timestamp,
) -> rusqlite::Result<()> {
    let key = insert_run(transaction, recording, run.id, run.began_at, &run.trains)?;
    let mut statement = transaction.prepare_cached(row::INSERT)?;
    for raw in &run.events {
        row::insert(&mut statement, key, Some(raw.line), now, raw.event)?;
    }
    for pass in &run.gates {
        let values: [&dyn ToSql; 4] =
            [&key.0, &i64::try_from(pass.line).ok(), &pass.gate, &pass.time.as_ns()];
        checksum::append(transaction, "gate_passes", &["run", "line", "gate", "time_ns"], &values)?;
    }
    Ok(())
}

/// Appends a recording; one of a live session has no content.
fn insert_recording(
    connection: &Connection,
    name: &str,
    form: &str,
    layout: &str,
    content: Option<&str>,
    now: Timestamp,
) -> rusqlite::Result<()> {
    let columns = ["name", "form", "layout", "content_sha256", "stored_at_ns"];
    checksum::append(connection, "recordings", &columns, &[&name, &form, &layout, &content, &now.as_ns()])
}

fn insert_run(
    transaction: &Transaction<'_>,
    recording: RecordingKey,
    id: RunId,
    began_at: Option<Timestamp>,
    trains: &[TrainAtStart],
) -> rusqlite::Result<RunKey> {
    let values: [&dyn ToSql; 3] = [&recording.0, &id.0, &began_at.map(Timestamp::as_ns)];
    checksum::append(transaction, "runs", &["recording", "number", "began_at_ns"], &values)?;
    let run = RunKey(transaction.last_insert_rowid());
    for at_start in trains {
        let values: [&dyn ToSql; 3] = [&run.0, &at_start.train.0, &at_start.step.get()];
        checksum::append(transaction, "starts", &["run", "train", "step"], &values)?;
    }
    Ok(run)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use footplate_core::{EventKind, TrainId};
    use rusqlite::ErrorCode;

    use super::*;
    use crate::recording::Form;
    use crate::store::EventKey;

    fn store(folder: &Path) -> Store {
        Store::open_or_create(&folder.join("railway.db")).unwrap()
    }

    fn reverse(number: i64) -> Event {
        Event { time: Timestamp::from_ns(number), kind: EventKind::Reverse { train: TrainId(24) } }
    }

    fn long_recording(events: i64) -> Recording {
        let raw = |number| crate::RawEvent { line: 1, event: reverse(number) };
        let run = Run {
            id: RunId(1),
            began_at: None,
            trains: Vec::new(),
            events: (0..events).map(raw).collect(),
            gates: Vec::new(),
        };
        Recording { name: "long".to_owned(), form: Form::SensorLog, runs: vec![run], notes: Vec::new() }
    }

    fn count(store: &Store, table: &str) -> i64 {
        store.connection.query_row(&format!("SELECT count(*) FROM {table}"), [], |row| row.get(0)).unwrap()
    }

    #[test]
    fn a_full_disk_stores_nothing_of_what_did_not_fit() {
        let folder = tempfile::tempdir().unwrap();
        let mut store = store(folder.path());
        let recording = store.begin_recording("live", "track-a", Timestamp::ZERO).unwrap();
        let run = store.begin_run(recording, RunId(1), None, &[]).unwrap();
        store.append(run, &[reverse(1)], Timestamp::ZERO).unwrap();
        // A file that may not grow gives the same error of SQLite as a full disk.
        let pages: i64 = store.connection.pragma_query_value(None, "page_count", |row| row.get(0)).unwrap();
        let limit: i64 = store
            .connection
            .query_row(&format!("PRAGMA max_page_count = {}", pages + 4), [], |row| row.get(0))
            .unwrap();
        assert_eq!(limit, pages + 4);

        let many: Vec<Event> = (0..10_000).map(reverse).collect();
        let error = store.append(run, &many, Timestamp::ZERO).unwrap_err();
        assert!(matches!(error, StoreError::DiskFull(_)), "{error}");
        let content = ContentHash::of(b"long");
        let error = store.import(&long_recording(10_000), content, "track-a", Timestamp::ZERO).unwrap_err();
        assert!(error.to_string().starts_with("no space is left for the store "), "{error}");
        assert_eq!((count(&store, "recordings"), count(&store, "runs"), count(&store, "events")), (1, 1, 1));
        store.check().unwrap();
        // Events that fit are still taken.
        store.append(run, &[reverse(2)], Timestamp::ZERO).unwrap();
        assert_eq!(count(&store, "events"), 2);
    }

    #[test]
    fn a_run_of_no_recording_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let mut store = store(folder.path());
        let error = store.begin_run(RecordingKey(7), RunId(1), None, &[]).unwrap_err();
        assert!(matches!(error, StoreError::NoRecording(RecordingKey(7))), "{error}");
        assert!(store.append(RunKey(7), &[reverse(1)], Timestamp::ZERO).is_err());
        assert_eq!((count(&store, "runs"), count(&store, "events")), (0, 0));
    }

    #[test]
    fn nothing_is_changed_replaced_or_deleted_by_anybody() {
        let folder = tempfile::tempdir().unwrap();
        let mut store = store(folder.path());
        let content = ContentHash::of(b"long");
        let mut recording = long_recording(3);
        let standing = TrainAtStart { train: TrainId(24), step: footplate_core::SpeedStep::STAND };
        recording.runs[0].trains.push(standing);
        recording.runs[0].gates.push(crate::GatePass { line: 9, gate: 1, time: Timestamp::ZERO });
        store.import(&recording, content, "track-a", Timestamp::ZERO).unwrap();
        store.exclude(&[EventKey(1)], "lifted", Timestamp::ZERO).unwrap();
        let sql = "INSERT INTO calibrations (train, made_at_ns, as_of_ns, model_version, body) \
                   VALUES (24, 0, 0, '1', '{}')";
        store.connection.execute(sql, []).unwrap();

        let new = crate::NewMachine { kind: "drive", program: "1", body: "{}" };
        let machine = store.begin_machine(RecordingKey(1), new, Timestamp::ZERO).unwrap();
        let transaction = store.write().unwrap();
        for side in [crate::Side::Input, crate::Side::Decision] {
            let traced = crate::Traced {
                number: 0,
                time: Timestamp::ZERO,
                side,
                kind: "any".into(),
                text: String::new(),
            };
            crate::store::decisions::insert(&transaction, machine, &traced).unwrap();
        }
        transaction.commit().unwrap();

        let tables = [
            "recordings",
            "runs",
            "starts",
            "events",
            "gate_passes",
            "marks",
            "calibrations",
            "machines",
            "inputs",
            "decisions",
        ];
        for table in tables {
            assert!(count(&store, table) > 0, "{table}");
            // Each table has another column to change.
            for sql in [
                format!("UPDATE {table} SET id = id + 1"),
                format!("DELETE FROM {table}"),
                format!("INSERT OR REPLACE INTO {table} SELECT * FROM {table} WHERE id = 1"),
                format!("UPDATE OR REPLACE {table} SET rowid = 2"),
            ] {
                let error = store.connection.execute(&sql, []).unwrap_err();
                assert_eq!(error.sqlite_error_code(), Some(ErrorCode::ConstraintViolation), "{sql}: {error}");
                assert!(error.to_string().starts_with(&format!("{table} are kept ")), "{sql}: {error}");
            }
        }
        // Nor by replacing a row through another unique column.
        let same_content = "INSERT OR REPLACE INTO recordings (name, form, layout, content_sha256, stored_at_ns) \
                            SELECT 'forged', form, layout, content_sha256, 0 FROM recordings";
        let error = store.connection.execute(same_content, []).unwrap_err();
        assert!(error.to_string().starts_with("recordings are kept "), "{error}");
    }
}
