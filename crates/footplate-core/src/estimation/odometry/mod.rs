//! On-board odometry: two wheelsets that may slip and slide in, speed and distance with bounds that hold out.
//!
//! [`Odometer::step`] takes what was read in one [`Period`](crate::wheels::Period) and returns a [`MotionEstimate`].

mod accuracy_monitor;
mod balise_link;
mod motion_estimate;
mod odometer;
mod reading_amounts;
mod settings;
mod tolerance;

pub use accuracy_monitor::{AccuracyMonitor, OdometerAccuracy};
pub use balise_link::{BaliseLink, BaliseVerdict, DistanceInterval, MissedBalise};
pub use motion_estimate::{Mode, MotionEstimate, WheelState};
pub use odometer::Odometer;
pub use reading_amounts::ReadingAmounts;
pub use settings::OdometrySettings;
pub use tolerance::{distance_tolerance, speed_tolerance};
