//! How one train answers its commands: speeds, changes of speed, stops and path lengths, with their uncertainty.
//!
//! [`MotionModel`] holds all of it, with the covariance between any two of its numbers. Experiments are planned and stops
//! are predicted from that. [`MotionFit`] makes it from everything the train did so far: not from experiments of a set
//! form, but from the one chain of commands and reports that any driving is.
//!
//! ```text
//! motion_model  parameters  priors     what is known of a train, and before it ran
//! segment  decoder_kind                how it moves after one command
//! scatter  spread  variation           how single stops, runs and sessions differ
//! sensor_scatter                       how exactly sensors trip
//! expected_information  objective      what an experiment would teach
//! train_length                         how long it is, where blocks report that it has left
//! passage                              reports of a run, judged one by one
//! fit/                                 from trips to a model
//! report/                              runs beside the model, laws compared: for people
//! survey/                              lengths of the layout, and whether it is the right one
//! ```

mod change_deviations;
mod decoder_kind;
mod expected_information;
mod fit;
mod motion_model;
mod numbers;
mod objective;
mod parameters;
mod passage;
mod priors;
pub mod report;
mod rescaled;
mod scatter;
mod segment;
mod sensor_scatter;
mod short_moves;
mod spread;
mod standing_times;
mod stop_offset;
pub mod survey;
mod train_length;
mod variation;

pub(crate) use change_deviations::OTHER_SHAPES;
pub use expected_information::ExpectedInformation;
pub use fit::{MotionFit, Refit, StatedFit, StatedMotion, StatedSpeed, StepChanges};
pub use motion_model::{MotionModel, StepUse, StopForecast};
pub use numbers::{MotionNumbers, NumbersError};
pub use objective::Objective;
pub use passage::{Drive, Passage, PassageTracker, STALE_WITHIN, Sighting};
pub(crate) use priors::{
    PATH_LENGTH_SPREAD, TRIP_DEVIATION, WANDER, change_error, run_variance, section_variance,
};
pub use rescaled::{ChangedNumbers, MeasuredRatio, Rescaling};
pub(crate) use segment::{Pace, Segment, SpeedCommand};
pub(crate) use sensor_scatter::SensorScatter;
pub use short_moves::ShortMoveForecast;
pub(crate) use standing_times::StandingTimes;
pub(crate) use stop_offset::StopEffect;
pub use train_length::{BlockRelease, TrainLength};
