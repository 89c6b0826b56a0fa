//! States of replays of all sessions of a train, which follow from the events; the next replay replaces them.

use footplate_core::TrainId;
use rusqlite::Row;

use super::error::StoreError;
use super::file::Store;
use crate::content_hash::ContentHash;

/// The state of a replay.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct KeptReplay {
    /// The fingerprint of its inputs, as text.
    pub(crate) of: String,
    /// Its state, as JSON.
    pub(crate) body: String,
}

impl Store {
    /// The state of the last replay of a train; `None` without one, or if its bytes have changed.
    pub(crate) fn kept_replay(&self, train: TrainId, layout: &str) -> Result<Option<KeptReplay>, StoreError> {
        let sql = "SELECT of_sha256, body, body_sha256 FROM replays WHERE train = ?1 AND layout = ?2";
        let read = |row: &Row<'_>| {
            let kept = KeptReplay { of: row.get(0)?, body: row.get(1)? };
            let is_whole = row.get::<_, String>(2)? == ContentHash::of(kept.body.as_bytes()).to_string();
            Ok(is_whole.then_some(kept))
        };
        Ok(self.rows(sql, (train.0, layout), read)?.pop().flatten())
    }

    /// Stores the state of a replay, in place of the one before it.
    pub(crate) fn keep_replay(
        &mut self,
        train: TrainId,
        layout: &str,
        kept: &KeptReplay,
    ) -> Result<(), StoreError> {
        let sql = "INSERT INTO replays (train, layout, of_sha256, body, body_sha256) VALUES (?1, ?2, ?3, ?4, ?5) \
                   ON CONFLICT (train, layout) DO UPDATE SET of_sha256 = ?3, body = ?4, body_sha256 = ?5";
        let hash = ContentHash::of(kept.body.as_bytes()).to_string();
        let row = (train.0, layout, &kept.of, &kept.body, hash);
        self.connection.execute(sql, row).map_err(|error| self.error(error))?;
        Ok(())
    }
}
