//! Imported speed profiles of trains: the newest one of a train is in force, and all of them stay.

use footplate_core::{Timestamp, TrainId};
use rusqlite::Row;
use rusqlite::types::Type;

use super::checksum;
use super::error::StoreError;
use super::file::Store;
use crate::speed_profile::SpeedProfile;

impl Store {
    /// Stores a profile, which is in force for a train from now on. `None` withdraws earlier ones: the train begins with
    /// the prior of an unknown train.
    pub fn keep_profile(
        &mut self,
        train: TrainId,
        profile: Option<&SpeedProfile>,
        now: Timestamp,
    ) -> Result<(), StoreError> {
        let body = profile.map(serde_json::to_string).transpose().map_err(|_| StoreError::NotJson(train))?;
        let source = profile.map_or("withdrawn", |profile| profile.source.as_str());
        let columns = ["train", "stored_at_ns", "source", "body"];
        checksum::append(&self.connection, "profiles", &columns, &[&train.0, &now.as_ns(), &source, &body])
            .map_err(|error| self.error(error))
    }

    /// The profile in force for a train at a date.
    pub fn profile(&self, train: TrainId, at: Timestamp) -> Result<Option<SpeedProfile>, StoreError> {
        let sql =
            "SELECT body FROM profiles WHERE train = ?1 AND stored_at_ns <= ?2 ORDER BY id DESC LIMIT 1";
        let read = |row: &Row<'_>| {
            let body: Option<String> = row.get(0)?;
            body.map(|body| serde_json::from_str(&body))
                .transpose()
                .map_err(|error| rusqlite::Error::FromSqlConversionFailure(0, Type::Text, Box::new(error)))
        };
        Ok(self.rows(sql, (train.0, at.as_ns()), read)?.pop().flatten())
    }
}
