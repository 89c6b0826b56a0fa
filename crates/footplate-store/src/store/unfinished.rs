//! The session that was running when the program, or the computer, died.

use footplate_core::TrainId;
use rusqlite::OptionalExtension;

use super::error::StoreError;
use super::file::Store;

/// A session whose last machine has no end: its trains may still be running.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct UnfinishedSession {
    /// The name of the session.
    pub name: String,
    /// Every train that may be running, by number: those of its machine's initial state, and all others in this store. A
    /// command may have been sent before it was recorded, so recorded commands are not enough.
    pub trains: Vec<TrainId>,
}

impl Store {
    /// The newest session with a machine, if it has no end.
    ///
    /// # Errors
    /// The store cannot be read.
    pub fn unfinished_session(&self) -> Result<Option<UnfinishedSession>, StoreError> {
        let newest = "SELECT recordings.name FROM machines \
                      JOIN recordings ON recordings.id = machines.recording \
                      WHERE machines.id = (SELECT max(id) FROM machines) AND NOT EXISTS \
                      (SELECT 1 FROM inputs WHERE machine = machines.id AND kind = 'end') AND NOT EXISTS \
                      (SELECT 1 FROM archives WHERE machine = machines.id AND has_end)";
        let known = "SELECT train FROM events WHERE train IS NOT NULL UNION SELECT train FROM calibrations \
                     UNION SELECT part.value FROM machines, json_tree(machines.body) AS part \
                     WHERE machines.id = (SELECT max(id) FROM machines) AND part.key = 'train' \
                     AND part.type = 'integer' AND part.value BETWEEN 0 AND 65535 ORDER BY 1";
        let read = || {
            let Some(name) = self.connection.query_row(newest, [], |row| row.get(0)).optional()? else {
                return Ok(None);
            };
            let mut statement = self.connection.prepare(known)?;
            let trains = statement.query_map([], |row| Ok(TrainId(row.get(0)?)))?;
            Ok(Some(UnfinishedSession { name, trains: trains.collect::<rusqlite::Result<_>>()? }))
        };
        read().map_err(|error| self.error(error))
    }
}
