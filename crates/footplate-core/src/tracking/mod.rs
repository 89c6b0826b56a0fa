//! What the next report will be, learnt from the last.
//!
//! [`Predictor`] walks a recording entry by entry and never looks ahead. At every passage of a sensor it
//! compares what it had forecast with what happened ([`Hit`]), and learns: where the train is, how fast it runs and how
//! long the hops are (`arrival_filter`), how exactly each sensor trips, and, at the end of every run, how
//! the train answers its commands ([`MotionFit`](crate::model::MotionFit)). Each forecast is a distribution
//! ([`Forecast`]) whose intervals hold as often as they say.
//!
//! [`Locator`] follows a train that is driven: with a [`MotionModel`](crate::model::MotionModel) it knows
//! where the train is at any moment, and where it would come to rest if commanded to stop at another.

mod apart;
mod arrival;
mod arrival_filter;
mod block_release;
mod claim;
mod drift_test;
mod filter_state;
mod forecast;
mod late_start;
mod location;
mod locator;
mod motion_filter;
mod path_length;
mod polls;
mod predictor;
mod reachable_set;
mod rollout;
mod route_memory;
mod shown_length;
mod speed_measurement;
#[cfg(feature = "serde")]
mod square;
mod track_context;
mod train_forecaster;

pub use drift_test::{Drift, DriftTest};
pub use forecast::{Forecast, ForecastPhase};
pub use location::{DueSensor, Located, PassedSensor, PathPoint, Rest};
pub use locator::Locator;
pub(crate) use motion_filter::INTERRUPTED;
pub use path_length::{distance_to, distance_to_landmark, landmark_of, place_of};
pub use predictor::{Hit, Predictor, Verdict};
pub(crate) use reachable_set::ReachableSet;
pub(crate) use rollout::Rollout;
pub use track_context::TrackContext;
pub use train_forecaster::TrainForecaster;
