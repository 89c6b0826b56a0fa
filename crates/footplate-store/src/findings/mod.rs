//! Calibrations from recordings, for people and programs: the motion model of each train, and its runs.
//!
//! `docs/formats/calibration.md` describes the format. The model alone, which is enough to drive with, is a
//! [`MotionFile`](crate::MotionFile).

mod export;
mod form;

pub use form::{
    ComparedLawForm, Findings, LawForm, PollingForm, SuspicionForm, TapedStopForm, TrainFindings,
};
