//! Wheels that turn on rails: what a tachometer counts and what it means while the wheel slips or slides.
//!
//! A [`Vehicle`] says what is known beforehand (teeth, diameters and how well they are known, what the train can do),
//! a [`Period`] what was read in one odometry period. Everything that is learnt from them stands in
//! [`odometry`](crate::odometry).

mod count_windows;
mod period;
mod range;
mod reported_direction;
mod steady_gains;
mod tachometer;
mod thresholds;
mod vehicle;
mod wheel_tracker;
mod wheelset;

pub use count_windows::CountWindows;
pub use period::{Count, Direction, Period, WheelReading};
pub use range::{Range, larger, smaller};
pub use reported_direction::ReportedDirection;
pub use tachometer::{Expected, Heading, Quality, Tachometer, Turn, unwrapped};
pub use thresholds::Thresholds;
pub use vehicle::{BrakeCommand, SlideProtection, Vehicle, VehicleError};
pub use wheel_tracker::WheelTracker;
pub use wheelset::{Axle, Loss, Wheelset};
