//! The direction in which each decoder was commanded last: stations that lose their power forget it, decoders do not.

use std::collections::BTreeMap;

use footplate_core::{Timestamp, TrainId};
use rusqlite::Connection;

use super::checksum;
use super::error::StoreError;
use super::file::Store;

/// Whether a train runs forward from a command on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Direction {
    /// The train.
    pub train: TrainId,
    /// Whether its decoder was commanded to run forward.
    pub forward: bool,
}

/// Appends one.
pub(super) fn insert(connection: &Connection, direction: Direction, now: Timestamp) -> rusqlite::Result<()> {
    let Direction { train, forward } = direction;
    let columns = ["train", "forward", "stored_at_ns"];
    checksum::append(connection, "directions", &columns, &[&train.0, &forward, &now.as_ns()])
}

impl Store {
    /// The direction of each train that a session commanded over a station that forgets directions.
    ///
    /// # Errors
    /// The store cannot be read.
    pub fn directions(&self) -> Result<BTreeMap<TrainId, bool>, StoreError> {
        let sql = "SELECT train, forward FROM directions WHERE id IN (SELECT max(id) FROM directions GROUP BY train)";
        let rows = self.rows(sql, (), |row| Ok((TrainId(row.get(0)?), row.get(1)?)))?;
        Ok(rows.into_iter().collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::store::journal::{Journal, JournalEntry};

    #[test]
    fn the_newest_direction_of_a_train_counts() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("railway.db");
        let now = Timestamp::from_s(1.0);
        let store = Store::open_or_create(&path).expect("a store");
        assert_eq!(store.directions().expect("none"), BTreeMap::new());
        let mut journal = Journal::begin(store, "a session", "track-a", None, &[], now).expect("begun");
        let runs = |train, forward| JournalEntry::Direction(Direction { train: TrainId(train), forward });
        assert_eq!(journal.append_all(&[runs(24, true), runs(58, true)], now).expect("kept"), 0);
        journal.append_all(&[runs(24, false)], now).expect("kept");
        let kept = Store::open(&path).expect("a store").directions().expect("read");
        assert_eq!(kept, [(TrainId(24), false), (TrainId(58), true)].into());
    }
}
