//! Calibrations: models of trains, with the date of the events that they follow from.

use footplate_core::{Timestamp, TrainId};
use rusqlite::{ErrorCode, Row, ToSql};
use serde::Deserialize;

use super::checksum;
use super::error::StoreError;
use super::file::Store;
use super::packed_body::PackedBody;

/// A calibration to store.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NewCalibration<'a> {
    /// The train.
    pub train: TrainId,
    /// The date of the events, without excluded ones, that it follows from: it can be made again.
    pub as_of: Timestamp,
    /// The version of the model that made it.
    pub model_version: &'a str,
    /// The model, as JSON.
    pub body: &'a str,
}

/// A stored calibration.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Calibration {
    /// The train.
    pub train: TrainId,
    /// When it was made.
    pub made_at: Timestamp,
    /// The date of the events, without excluded ones, that it follows from.
    pub as_of: Timestamp,
    /// The version of the model that made it.
    pub model_version: String,
    /// The model, as JSON.
    pub body: String,
}

impl Calibration {
    /// Whether its model is one of this layout.
    fn is_on(&self, layout: &str) -> bool {
        let on: Option<LayoutOfModel> = serde_json::from_str(&self.body).ok();
        on.is_some_and(|on| on.layout == layout)
    }
}

/// What a model says of the layout that it is of.
#[derive(Deserialize)]
struct LayoutOfModel {
    layout: String,
}

const COLUMNS: &str = "train, made_at_ns, as_of_ns, model_version, body, packed";
/// The value of the column `kind` for models. Older programs stored fits of another form as `recordings`: they stay in the
/// table and are not read as models.
const KIND: &str = "motion";

impl Store {
    /// Stores a calibration; earlier ones stay.
    pub fn keep_calibration(&mut self, new: NewCalibration<'_>, now: Timestamp) -> Result<(), StoreError> {
        let columns = ["train", "made_at_ns", "as_of_ns", "model_version", "body", "kind", "packed"];
        let PackedBody { body, packed } = PackedBody::of(new.body);
        let values: [&dyn ToSql; 7] =
            [&new.train.0, &now.as_ns(), &new.as_of.as_ns(), &new.model_version, &body, &KIND, &packed];
        match checksum::append(&self.connection, "calibrations", &columns, &values) {
            Ok(()) => Ok(()),
            // The only constraint that these types can violate.
            Err(error) if error.sqlite_error_code() == Some(ErrorCode::ConstraintViolation) => {
                Err(StoreError::NotJson(new.train))
            }
            Err(error) => Err(self.error(error)),
        }
    }

    /// The calibration in force for a train at a date: the last one made until then.
    pub fn calibration(&self, train: TrainId, at: Timestamp) -> Result<Option<Calibration>, StoreError> {
        let sql = format!(
            "SELECT {COLUMNS} FROM calibrations WHERE kind = ?1 AND train = ?2 AND made_at_ns <= ?3 \
             ORDER BY id DESC LIMIT 1"
        );
        Ok(self.rows(&sql, (KIND, train.0, at.as_ns()), read)?.pop())
    }

    /// The motion model in force for a train on a layout at a date: the last one made there until then. Models of other
    /// layouts do not count.
    pub fn calibration_on(
        &self,
        train: TrainId,
        layout: &str,
        at: Timestamp,
    ) -> Result<Option<Calibration>, StoreError> {
        let sql = format!(
            "SELECT {COLUMNS} FROM calibrations WHERE kind = ?1 AND train = ?2 AND made_at_ns <= ?3 \
             ORDER BY id DESC"
        );
        let newest = || {
            let mut statement = self.connection.prepare_cached(&sql)?;
            let mut rows = statement.query((KIND, train.0, at.as_ns()))?;
            while let Some(row) = rows.next()? {
                let calibration = read(row)?;
                if calibration.is_on(layout) {
                    return Ok(Some(calibration));
                }
            }
            Ok(None)
        };
        newest().map_err(|error| self.error(error))
    }

    /// All calibrations of a train in the order of their making, including older forms.
    pub fn calibrations(&self, train: TrainId) -> Result<Vec<Calibration>, StoreError> {
        let sql = format!("SELECT {COLUMNS} FROM calibrations WHERE train = ?1 ORDER BY id");
        self.rows(&sql, [train.0], read)
    }

    /// The trains with a calibration.
    pub fn calibrated_trains(&self) -> Result<Vec<TrainId>, StoreError> {
        self.rows("SELECT DISTINCT train FROM calibrations ORDER BY train", [], |row| {
            Ok(TrainId(row.get(0)?))
        })
    }
}

fn read(row: &Row<'_>) -> rusqlite::Result<Calibration> {
    Ok(Calibration {
        train: TrainId(row.get(0)?),
        made_at: Timestamp::from_ns(row.get(1)?),
        as_of: Timestamp::from_ns(row.get(2)?),
        model_version: row.get(3)?,
        body: PackedBody::text(row, 4)?,
    })
}
