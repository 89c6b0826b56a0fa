//! When to tell the trains what: state machines that turn reports into commands.
//!
//! - [`Machine`] is what all of them have in common: entries of the recording in, [`Output`]s out, and a time to be
//!   asked again. None of them knows a clock or a cable.
//! - [`Driver`] drives trains where they are ordered, and stops them there.

mod drive;
mod machine;

pub use drive::{
    Achieved, Aim, DriveNotice, Driver, Finished, Order, OrderId, PlannedStop, Promise, Refusal, StopOrder,
};
pub use machine::{Machine, Output};
