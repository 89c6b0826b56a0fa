//! On-board odometry: two wheelsets that may slip and slide in, speed and distance with bounds that hold out.
//!
//! [`Odometer::step`] takes what was read in one [`Period`](crate::odometry::wheels::Period) and returns a [`MotionEstimate`].

mod accuracy_monitor;
mod balise_link;
mod command_watch;
pub mod diameter;
mod distance_bounds;
mod guaranteed_speed;
mod hypotheses;
mod implausible_claims;
mod inertia;
pub mod inertial;
mod motion_estimate;
mod observing;
mod odometer;
pub mod paper;
mod places;
mod recent;
mod reporting;
mod settings;
mod sound;
mod stated_places;
mod tolerance;
mod vote;
mod wheel_channel;
pub mod wheels;

pub use accuracy_monitor::{AccuracyMonitor, OdometerAccuracy, ReadingAmounts};
pub use balise_link::{BaliseLink, BaliseVerdict, DistanceInterval};
pub use hypotheses::{HYPOTHESES, Hypothesis};
pub use implausible_claims::ImplausibleClaims;
pub use motion_estimate::{Mode, MotionBounds, MotionEstimate, WheelState};
pub use odometer::Odometer;
pub use settings::{Carrier, OdometrySettings};
pub use stated_places::{MOST_PLACES, PlacedValue, StatedPlaces};
pub use tolerance::{distance_tolerance, speed_tolerance};
