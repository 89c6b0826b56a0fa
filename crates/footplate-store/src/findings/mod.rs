//! What recordings say of trains, as people and programs read it: the motion model of each, and its runs beside it.
//!
//! `docs/formats/calibration.md` describes it. The model alone, which is what programs drive with, is a
//! [`MotionFile`](crate::MotionFile).

mod export;
mod form;

pub use form::{
    ComparedLawForm, Findings, LawForm, PollingForm, SuspicionForm, TapedStopForm, TrainFindings,
};
