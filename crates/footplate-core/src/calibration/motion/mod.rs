//! How one train answers its commands: speeds, ways of changing speed, stops, and lengths as it feels them.
//!
//! [`MotionModel`] is all of it with its uncertainty, and the covariance between any two of its numbers, from which
//! experiments are planned and stops are promised. It is made by [`MotionFit`] from everything the train did so far:
//! not from experiments of a set form, but from the one chain of commands and contacts that any driving is.

mod apart;
mod arrival;
#[cfg(feature = "serde")]
mod bits;
mod chain;
mod decoder_kind;
mod doubts;
mod expected_information;
mod filter_state;
mod fit;
mod foreseen;
mod hindsight;
mod learn;
mod marginal_prior;
mod model;
mod motion_filter;
mod numbers;
mod objective;
mod parameters;
mod position_series;
mod priors;
mod rescaled;
mod robust;
mod rows;
mod scatter;
mod segment;
mod short_moves;
mod spread;
#[cfg(feature = "serde")]
mod square;
mod standing_times;
mod stop_offset;
mod trip;
mod unknowns;
mod variation;

pub(crate) use arrival::Arrival;
pub use expected_information::ExpectedInformation;
pub(crate) use filter_state::{FilterState, N as MOTION_LETTERS};
pub use fit::{MotionFit, Refit};
pub use model::{MotionModel, StepUse, StopForecast};
pub(crate) use motion_filter::{Gaussian, INTERRUPTED, MotionFilter};
pub use numbers::{MotionNumbers, NumbersError};
pub use objective::Objective;
pub use position_series::{PositionPoint, SeriesChange, SeriesError, SeriesFit};
pub(crate) use priors::{FELT, TRIP_DEVIATION, section_variance};
pub use rescaled::{MeasuredRatio, Rescaling};
pub use short_moves::ShortMoveForecast;
pub(crate) use standing_times::StandingTimes;
