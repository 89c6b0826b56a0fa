//! What is known of how a train moves, as people and programs read it: TOML or JSON, every number with unit, uncertainty,
//! count and date.
//!
//! `docs/formats/motion-model.md` describes it. The store keeps the same form. It is what is needed to drive without
//! learning again; the truth are the events it was learnt from, and the store can replay them.

mod export;
mod form;
mod kept;
mod read;

pub use form::{
    ExactForm, MOTION_MODEL_VERSION, MotionFile, MotionSectionForm, MotionStepForm, StopOffsetForm, UseForm,
};
pub use kept::KeptModel;
pub use read::MotionFileError;
