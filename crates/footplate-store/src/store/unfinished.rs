//! The session that was running when the program, or the computer, died.

use footplate_core::TrainId;
use rusqlite::OptionalExtension;

use super::error::StoreError;
use super::file::Store;

/// A session whose last machine was never told the end: its trains may still be running.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct UnfinishedSession {
    /// What the session is called.
    pub name: String,
    /// Every train that was commanded to run in it, by number.
    pub trains: Vec<TrainId>,
}

impl Store {
    /// The newest session with a machine, if that has no end.
    ///
    /// # Errors
    /// The store cannot be read.
    pub fn unfinished_session(&self) -> Result<Option<UnfinishedSession>, StoreError> {
        let newest = "SELECT recordings.id, recordings.name FROM machines \
                      JOIN recordings ON recordings.id = machines.recording \
                      WHERE machines.id = (SELECT max(id) FROM machines) AND NOT EXISTS \
                      (SELECT 1 FROM inputs WHERE machine = machines.id AND kind = 'end')";
        let commanded = "SELECT DISTINCT events.train FROM events JOIN runs ON runs.id = events.run \
                         WHERE runs.recording = ?1 AND events.kind = 'speed' AND events.step > 0 ORDER BY 1";
        let read = || {
            let columns = |row: &rusqlite::Row<'_>| Ok((row.get::<_, i64>(0)?, row.get(1)?));
            let Some((recording, name)) = self.connection.query_row(newest, [], columns).optional()? else {
                return Ok(None);
            };
            let mut statement = self.connection.prepare(commanded)?;
            let trains = statement.query_map([recording], |row| Ok(TrainId(row.get(0)?)))?;
            Ok(Some(UnfinishedSession { name, trains: trains.collect::<rusqlite::Result<_>>()? }))
        };
        read().map_err(|error| self.error(error))
    }
}
