//! The stored motion model of a train, if this version can use it.

use footplate_core::model::MotionModel;
use footplate_core::track::Layout;
use footplate_core::{Timestamp, TrainId};

use super::form::MotionFile;
use super::read::MotionFileError;
use crate::store::Store;

/// A stored motion model.
#[derive(Debug, Clone, PartialEq)]
pub enum StoredModel {
    /// There is none.
    Nothing,
    /// A usable model.
    Model(Box<MotionModel>),
    /// A model of another version of the formulas. It can be fitted again from the stored events.
    Outdated,
}

impl StoredModel {
    /// The model of a train on a layout as of a date.
    ///
    /// # Errors
    /// The store cannot be read, or its content is not a model.
    pub fn of_store(
        layout: &Layout,
        store: &Store,
        train: TrainId,
        at: Timestamp,
    ) -> Result<Self, MotionFileError> {
        let file = match MotionFile::of_store(store, train, at) {
            Ok(file) => file.filter(|file| file.layout == layout.name()),
            Err(MotionFileError::OtherModel { .. }) => return Ok(Self::Outdated),
            Err(error) => return Err(error),
        };
        Ok(match file.map(|file| file.model(layout)) {
            None => Self::Nothing,
            Some(Ok(model)) => Self::Model(Box::new(model)),
            // Numbers that are not a model today may have been one in their own version.
            Some(Err(_)) => Self::Outdated,
        })
    }
}
