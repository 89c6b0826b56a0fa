//! The session that was running when the program, or the computer, died.

use std::collections::BTreeSet;

use footplate_core::TrainId;
use rusqlite::params;
use serde_json::Value;

use super::error::StoreError;
use super::file::Store;
use super::packed_body::PackedBody;

/// Machines, the newest first, with the session of each.
const MACHINES: &str = "SELECT machines.id, recordings.name, machines.body, machines.packed FROM machines \
     JOIN recordings ON recordings.id = machines.recording ORDER BY machines.id DESC";

/// Whether the machine `?1` has an end.
const HAS_END: &str = "SELECT EXISTS (SELECT 1 FROM inputs WHERE machine = ?1 AND kind = 'end') \
     OR EXISTS (SELECT 1 FROM archives WHERE machine = ?1 AND has_end)";

/// The trains of each part of a store, each read by itself so that damage of one leaves the others.
const TRAINS: [&str; 3] = [
    "SELECT DISTINCT train FROM events WHERE train IS NOT NULL",
    "SELECT DISTINCT train FROM calibrations",
    "SELECT DISTINCT train FROM directions",
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

/// The newest machine that decided over a real line. What a simulated railway left running ended with its program, so a
/// simulated session does not hide a real one that has no end.
struct NewestMachine {
    id: i64,
    session: String,
    body: Value,
}

impl Store {
    /// The newest session with a machine over a real line, if it has no end.
    ///
    /// # Errors
    /// The store cannot be read.
    pub fn unfinished_session(&self) -> Result<Option<UnfinishedSession>, StoreError> {
        let read = || {
            let Some(machine) = self.newest_machine()? else { return Ok(None) };
            let has_end: bool = self.connection.query_row(HAS_END, params![machine.id], |row| row.get(0))?;
            Ok((!has_end).then_some(machine))
        };
        let newest = read().map_err(|error| self.error(error))?;
        Ok(newest.map(|machine| UnfinishedSession {
            trains: self.trains_with(Some(&machine)),
            name: machine.session,
        }))
    }

    /// Every train that the store names, by number. Of a damaged store those that can be read: trains are stopped with them,
    /// and some are better than none.
    pub fn known_trains(&self) -> Vec<TrainId> {
        self.trains_with(self.newest_machine().ok().flatten().as_ref())
    }

    /// The trains of a machine, and those of all other parts that can be read.
    fn trains_with(&self, machine: Option<&NewestMachine>) -> Vec<TrainId> {
        let mut trains = BTreeSet::new();
        for of_part in TRAINS {
            let Ok(mut statement) = self.connection.prepare(of_part) else { continue };
            let Ok(mut rows) = statement.query([]) else { continue };
            while let Ok(Some(row)) = rows.next() {
                trains.extend(row.get(0).ok().map(TrainId));
            }
        }
        if let Some(machine) = machine {
            add_trains(&machine.body, &mut trains);
        }
        trains.into_iter().collect()
    }

    fn newest_machine(&self) -> rusqlite::Result<Option<NewestMachine>> {
        let mut statement = self.connection.prepare(MACHINES)?;
        let mut rows = statement.query([])?;
        while let Some(row) = rows.next()? {
            // What cannot be read as JSON is checked elsewhere; here it is a machine whose trains are not known.
            let body: Value = serde_json::from_str(&PackedBody::text(row, 2)?).unwrap_or_default();
            if body.get("is_simulated").and_then(Value::as_bool) != Some(true) {
                return Ok(Some(NewestMachine { id: row.get(0)?, session: row.get(1)?, body }));
            }
        }
        Ok(None)
    }
}

/// Adds the trains that a value names, at any depth.
fn add_trains(value: &Value, trains: &mut BTreeSet<TrainId>) {
    match value {
        Value::Array(parts) => parts.iter().for_each(|part| add_trains(part, trains)),
        Value::Object(parts) => {
            for (key, part) in parts {
                let number = part.as_u64().filter(|_| key == "train");
                trains.extend(number.and_then(|number| u16::try_from(number).ok()).map(TrainId));
                add_trains(part, trains);
            }
        }
        _ => {}
    }
}
