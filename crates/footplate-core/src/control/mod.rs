//! When to tell the trains what: state machines that turn reports into commands.
//!
//! - [`Machine`] is what all of them have in common: entries of the recording in, [`Output`]s out, and a time to be
//!   asked again. None of them knows a clock or a cable.
//! - [`Calibrator`] finds a train, plans experiments with it and learns how it moves.
//! - [`Driver`] drives trains where they are ordered, and stops them there.

pub mod calibrate;
mod drive;
mod machine;

pub use calibrate::{CalibrationNotice, Calibrator, CalibratorSettings};
pub use drive::{
    Achieved, Aim, DriveNotice, Driver, Finished, Gap, Order, OrderId, PacedLine, PlannedStop, Promise,
    Refusal, StopOrder,
};
pub use machine::{Machine, Output};
