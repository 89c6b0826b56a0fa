//! On-board odometry: two wheelsets that may slip and slide in, speed and distance with bounds that hold out.
//!
//! [`Odometer::step`] takes what was read in one [`Period`](crate::wheels::Period) and returns a [`MotionEstimate`].

mod motion_estimate;
mod odometer;
mod settings;

pub use motion_estimate::{Mode, MotionEstimate, WheelState};
pub use odometer::Odometer;
pub use settings::OdometrySettings;
