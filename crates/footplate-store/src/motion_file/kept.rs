//! The motion model that a store holds of a train, if this program can use it.

use footplate_core::model::MotionModel;
use footplate_core::track::Layout;
use footplate_core::{Timestamp, TrainId};

use super::form::MotionFile;
use super::read::MotionFileError;
use crate::store::Store;

/// What a store holds of how a train moves on a layout.
#[derive(Debug, Clone, PartialEq)]
pub enum KeptModel {
    /// Nothing.
    Nothing,
    /// A model.
    Model(Box<MotionModel>),
    /// A model whose formulas were others. The events it was learnt from are there, so it can be learnt anew.
    OfOtherFormulas,
}

impl KeptModel {
    /// The model of a train on a layout that was in force at a date.
    ///
    /// # Errors
    /// The store cannot be read, or what it holds is no model at all.
    pub fn of_store(
        layout: &Layout,
        store: &Store,
        train: TrainId,
        at: Timestamp,
    ) -> Result<Self, MotionFileError> {
        let file = match MotionFile::of_store(store, train, at) {
            Ok(file) => file.filter(|file| file.layout == layout.name()),
            Err(MotionFileError::OtherModel { .. }) => return Ok(Self::OfOtherFormulas),
            Err(error) => return Err(error),
        };
        Ok(match file.map(|file| file.model(layout)) {
            None => Self::Nothing,
            Some(Ok(model)) => Self::Model(Box::new(model)),
            // Numbers that make no model of today made one of their own day.
            Some(Err(_)) => Self::OfOtherFormulas,
        })
    }
}
