//! The session that was running when the program, or the computer, died.

use std::collections::BTreeSet;

use footplate_core::TrainId;
use rusqlite::{OptionalExtension, params};

use super::error::StoreError;
use super::file::Store;

/// The newest machine that decided over a real line. What a simulated railway left running ended with its program, so a
/// simulated session does not hide a real one that has no end.
const NEWEST: &str = "SELECT machines.id, recordings.name FROM machines \
     JOIN recordings ON recordings.id = machines.recording \
     WHERE coalesce(json_extract(machines.body, '$.is_simulated'), 0) = 0 \
     ORDER BY machines.id DESC LIMIT 1";

/// Whether the machine `?1` has an end.
const HAS_END: &str = "SELECT EXISTS (SELECT 1 FROM inputs WHERE machine = ?1 AND kind = 'end') \
     OR EXISTS (SELECT 1 FROM archives WHERE machine = ?1 AND has_end)";

/// The trains of each part of a store, each read by itself so that damage of one leaves the others.
const TRAINS: [&str; 4] = [
    "SELECT DISTINCT train FROM events WHERE train IS NOT NULL",
    "SELECT DISTINCT train FROM calibrations",
    "SELECT DISTINCT train FROM directions",
    "SELECT part.value FROM json_tree((SELECT body FROM machines \
     WHERE coalesce(json_extract(body, '$.is_simulated'), 0) = 0 ORDER BY id DESC LIMIT 1)) AS part \
     WHERE part.key = 'train' AND part.type = 'integer' AND part.value BETWEEN 0 AND 65535",
];

/// A session over a real line whose last machine has no end: its trains may still be running.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct UnfinishedSession {
    /// The name of the session.
    pub name: String,
    /// Every train that may be running, by number: those of its machine's initial state, and all others in this store. A
    /// command may have been sent before it was recorded, so recorded commands are not enough.
    pub trains: Vec<TrainId>,
}

impl Store {
    /// The newest session with a machine over a real line, if it has no end.
    ///
    /// # Errors
    /// The store cannot be read.
    pub fn unfinished_session(&self) -> Result<Option<UnfinishedSession>, StoreError> {
        let read = || {
            let row = |row: &rusqlite::Row<'_>| Ok((row.get(0)?, row.get(1)?));
            let newest: Option<(i64, String)> = self.connection.query_row(NEWEST, [], row).optional()?;
            let Some((machine, name)) = newest else { return Ok(None) };
            let has_end: bool = self.connection.query_row(HAS_END, params![machine], |row| row.get(0))?;
            Ok((!has_end).then_some(name))
        };
        let name = read().map_err(|error| self.error(error))?;
        Ok(name.map(|name| UnfinishedSession { name, trains: self.known_trains() }))
    }

    /// Every train that the store names, by number. Of a damaged store those that can be read: trains are stopped with them,
    /// and some are better than none.
    #[must_use]
    pub fn known_trains(&self) -> Vec<TrainId> {
        let mut trains = BTreeSet::new();
        for of_part in TRAINS {
            let Ok(mut statement) = self.connection.prepare(of_part) else { continue };
            let Ok(mut rows) = statement.query([]) else { continue };
            while let Ok(Some(row)) = rows.next() {
                trains.extend(row.get(0).ok().map(TrainId));
            }
        }
        trains.into_iter().collect()
    }
}
