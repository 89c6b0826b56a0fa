//! Motion in closed form: the state of a train at any time, and the time at any distance.
//!
//! - [`Motion`] is the interface of all of them.
//! - [`Trapezoid`] and [`SCurve`] are planned: built from the current state, the target and the [`Limits`].
//! - [`MinimumJerk`] and [`Transit`] cover a given distance in a given time.
//! - [`SpeedChange`] is the response of a decoder to a new throttle step.
//! - [`RampedLag`] approximates all of these laws, for a quick fit when the law is unknown.
//! - [`TwoSensorRun`] measures an acceleration with two sensors.
//! - [`StoppingLaw`] gives the [`StoppingDistance`]; its type states the moment from which the distance is counted.
//! - [`IntegerStop`] is a stop in integers, for controllers without floating point.
//! - [`ShortMove`] combines a start and a stop: "go, wait, stop".

mod ahead;
mod bracket;
mod integer_stop;
mod limits;
mod minimum_jerk;
mod motion;
mod phase;
mod ramped_lag;
mod s_curve;
mod short_move;
mod speed_change;
mod stopping_distance;
mod stopping_law;
mod transit;
mod trapezoid;
mod two_sensor;

pub use integer_stop::{IntegerStop, IntegerStopError, UnusableConstants};
pub use limits::{Limits, ProfileError};
pub use minimum_jerk::MinimumJerk;
pub use motion::{Motion, MotionState, Running, Stretch};
pub(crate) use ramped_lag::ChangeAt;
pub use ramped_lag::RampedLag;
pub use s_curve::{Playback, SCurve};
pub use short_move::{ShortMove, ShortMoveError};
pub use speed_change::{
    ConstantAcceleration, ConstantJerk, Lag, MidStep, Smooth, SpeedChange, SpeedLaw, StepRamp, StepTable,
    StepTableError,
};
pub use stopping_distance::{FromBraking, FromCommand, FromReport, StoppingDistance};
pub use stopping_law::{Braking, StoppingError, StoppingLaw};
pub use transit::Transit;
pub use trapezoid::Trapezoid;
pub use two_sensor::{TwoSensorError, TwoSensorRun, TwoSensorVerdict};
