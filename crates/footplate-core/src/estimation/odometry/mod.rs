//! On-board odometry: two wheelsets that may slip and slide in, speed and distance with bounds that hold out.
//!
//! [`Odometer::step`] takes what was read in one [`Period`](crate::wheels::Period) and returns a [`MotionEstimate`].

mod accuracy_monitor;
mod balise_link;
mod command_watch;
mod covariance;
mod current_statistical;
mod distance_bounds;
mod doubtful_claims;
mod federated_filter;
mod guaranteed_speed;
mod hypotheses;
mod inertia;
pub mod inertial;
mod local_filter;
mod manoeuvre;
mod motion_estimate;
mod motion_step;
mod observing;
mod odometer;
mod places;
mod published;
mod published_flags;
mod reading_amounts;
mod recent;
mod reporting;
mod settings;
mod sharing;
mod sound;
mod stated_places;
mod tolerance;
mod virtual_sensor;
mod vote;
mod wheel_channel;

pub use accuracy_monitor::{AccuracyMonitor, OdometerAccuracy};
pub use balise_link::{BaliseLink, BaliseVerdict, DistanceInterval, MissedBalise};
pub use covariance::Covariance;
pub use current_statistical::CurrentStatistical;
pub use doubtful_claims::DoubtfulClaims;
pub use federated_filter::{FederatedFilter, Fusion};
pub use hypotheses::{HYPOTHESES, Hypothesis};
pub use local_filter::{Innovation, LocalFilter, MeasuredSpeed};
pub use manoeuvre::{ErrorGrowth, Liveliness, Manoeuvre, ManoeuvreSettings};
pub use motion_estimate::{Mode, MotionBounds, MotionEstimate, WheelState};
pub use motion_step::MotionStep;
pub use odometer::Odometer;
pub use published_flags::Reading;
pub use reading_amounts::ReadingAmounts;
pub use settings::{Carrier, OdometrySettings};
pub use sharing::Sharing;
pub use stated_places::{MOST_PLACES, PlacedValue, StatedPlaces};
pub use tolerance::{distance_tolerance, speed_tolerance};
