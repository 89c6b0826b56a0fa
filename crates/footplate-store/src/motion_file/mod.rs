//! Motion models as files for people and programs: TOML or JSON, every number with unit, uncertainty, count and date.
//!
//! `docs/formats/motion-model.md` describes the format; the store uses the same. A model is enough to drive with. The
//! events that it was fitted to remain in the store, which can replay them.

mod export;
mod form;
mod read;

pub use form::{
    ExactForm, MOTION_MODEL_VERSION, MotionFile, MotionSectionForm, MotionStepForm, SensorScatterForm,
    StopOffsetForm, UseForm,
};
pub use read::{MotionFileError, StoredModel};
