//! A calibration as people and programs read it: TOML or JSON, every number with unit, uncertainty and count.
//!
//! `docs/formats/calibration.md` describes it. The same form is kept in the store and taken over by a predictor.

mod export;
mod form;
mod prime;
mod read;

pub use form::{
    CalibrationFile, ComparedLawForm, HysteresisForm, LawForm, MODEL_VERSION, PollingForm, Quantity,
    SectionForm, SpeedForm, StopForm, StopLawForm, StopStepForm, SuspicionForm, TrainForm,
};
pub use read::CalibrationFileError;
