//! On-board odometry: two wheelsets that may slip and slide in, speed and distance with bounds that hold out.
//!
//! [`Odometer::step`] takes what was read in one [`Period`](crate::wheels::Period) and returns a [`MotionEstimate`].

mod accuracy_monitor;
mod balise_link;
mod carrying;
mod command_watch;
mod covariance;
mod current_statistical;
mod distance_bounds;
mod federated_filter;
mod ground_touch;
mod inertia;
pub mod inertial;
mod judging;
mod local_filter;
mod manoeuvre;
mod motion_estimate;
mod motion_step;
mod odometer;
mod past;
mod places;
mod published;
mod reading_amounts;
mod recent;
mod reporting;
mod settings;
mod sharing;
mod sound;
mod speed_bounds;
mod tolerance;
mod touch_line;
mod train_filter;
mod virtual_sensor;
mod vote;
mod wheel_channel;

pub use accuracy_monitor::{AccuracyMonitor, OdometerAccuracy};
pub use balise_link::{BaliseLink, BaliseVerdict, DistanceInterval, MissedBalise};
pub use covariance::Covariance;
pub use current_statistical::CurrentStatistical;
pub use federated_filter::{FederatedFilter, Fusion};
pub use local_filter::{Innovation, LocalFilter, MeasuredSpeed};
pub use manoeuvre::{ErrorGrowth, Liveliness, Manoeuvre, ManoeuvreSettings};
pub use motion_estimate::{Mode, MotionEstimate, WheelState};
pub use motion_step::MotionStep;
pub use odometer::Odometer;
pub use reading_amounts::ReadingAmounts;
pub use settings::{Carrier, OdometrySettings};
pub use sharing::Sharing;
pub use tolerance::{distance_tolerance, speed_tolerance};
pub use virtual_sensor::Envelope;
