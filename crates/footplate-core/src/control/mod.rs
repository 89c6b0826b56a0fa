//! When to tell the trains what: state machines that turn reports into commands.
//!
//! - [`Machine`] is what all of them have in common: entries of the recording in, [`Output`]s out, and a time to be
//!   asked again. None of them knows a clock or a cable.
//! - [`Calibrator`] finds a train, plans experiments with it and learns how it moves.
//! - [`Driver`] drives trains where they are ordered, and stops them there.
//! - [`Dispatcher`] sends trains where they are asked to go, and keeps them apart.
//! - [`Watchdog`] watches over that, and begins from the beginning when the future is no longer like the past.

mod dispatch;
mod drive;
pub mod learn;
mod machine;
mod notice;
mod supervise;

pub use dispatch::{CLEARANCE, Dispatcher, Journey, Reservation, Span, TrainLengths};
pub use drive::{Aim, ArrivalProfile, Driver, Gap, Order, OrderId, Refusal, StopOrder};
pub use learn::{CalibrationNotice, Calibrator, CalibratorSettings};
pub use machine::{Machine, Output};
pub use notice::{Achieved, Finished, Notice, Outcome, PacedLine, PlannedArrival, PlannedStop, Promise};
pub use supervise::{Alarm, LinkNews, Watchdog};
