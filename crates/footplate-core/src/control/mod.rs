//! State machines that turn reports into commands.
//!
//! - [`Machine`] is their common interface: events in, [`Output`]s out, and the time of the next call. None of them has a
//!   clock or a cable.
//! - [`Calibrator`] locates a train, plans experiments with it and learns how it moves.
//! - [`Driver`] carries out orders to trains, and stops them where they are ordered.
//! - [`Dispatcher`] sends trains to destinations and keeps them apart.
//! - [`Watchdog`] checks that trains behave as modelled, and recovers those that do not.

mod dispatch;
mod drive;
pub mod learn;
mod machine;
mod notice;
mod supervise;

pub use dispatch::{CLEARANCE, Dispatcher, Journey, Reservation, Span, TrainLengths, WAIT_LIMIT};
pub use drive::{Aim, ArrivalProfile, Driver, Gap, Order, OrderId, Refusal, StopOrder};
pub use learn::{CalibrationNotice, Calibrator, CalibratorSettings, Learning};
pub use machine::{Machine, Output};
pub use notice::{Achieved, Finished, Notice, Outcome, PacedLine, PlannedArrival, PlannedStop, Promise};
pub use supervise::{Alarm, LinkNews, Remeasured, Watchdog};
