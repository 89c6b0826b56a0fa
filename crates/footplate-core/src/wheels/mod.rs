//! Wheels that turn on rails: what a tachometer counts and what it means while the wheel slips or slides.
//!
//! A [`Vehicle`] says what is known beforehand (teeth, diameters and how well they are known, what the train can do),
//! a [`Period`] what was read in one odometry period. Everything that is learnt from them stands in
//! [`estimation::odometry`](crate::estimation::odometry).

mod period;
mod thresholds;
mod vehicle;
mod wheelset;

pub use period::{Count, Direction, Period, WheelReading};
pub use thresholds::Thresholds;
pub use vehicle::{BrakeCommand, Vehicle, VehicleError};
pub use wheelset::{Axle, Wheelset};
