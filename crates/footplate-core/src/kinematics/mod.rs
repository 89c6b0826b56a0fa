//! Motion in closed form: what a train does between two moments, and when it is where.
//!
//! - [`Motion`] is what can be asked of all of it: the state at a time, and the time at a distance.
//! - [`Trapezoid`] and [`SCurve`] are planned: built from the current state, the target and the [`Limits`].
//! - [`MinimumJerk`] and [`Transit`] cover a given way in a given time.
//! - [`SpeedChange`] is what a decoder makes of a new throttle step.
//! - [`RampedLag`] is one shape for all of them, where a fit has to be quick and none is known to be the right one.
//! - [`TwoSensorRun`] is how an acceleration is measured.
//! - [`StoppingLaw`] tells the [`StoppingDistance`], and its type since when that is counted.
//! - [`IntegerStop`] is a stop in integers, for controllers without floating point.
//! - [`ShortMove`] puts a start and a stop together: "go, wait, stop".

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
mod slow_end;
mod speed_change;
mod stopping_distance;
mod stopping_law;
mod stretch;
mod transit;
mod trapezoid;
mod two_sensor;

pub use integer_stop::{IntegerStop, IntegerStopError, UnusableConstants};
pub use limits::{Limits, ProfileError};
pub use minimum_jerk::MinimumJerk;
pub use motion::{Motion, MotionState};
pub use ramped_lag::RampedLag;
pub use s_curve::{Playback, SCurve};
pub use short_move::{ShortMove, ShortMoveError};
pub use speed_change::{
    ConstantAcceleration, ConstantJerk, Lag, MidStep, Smooth, SpeedChange, SpeedLaw, StepRamp, StepTable,
    StepTableError,
};
pub use stopping_distance::{FromBraking, FromCommand, FromReport, StoppingDistance};
pub use stopping_law::{Braking, StoppingError, StoppingLaw};
pub use stretch::{Running, Stretch};
pub use transit::Transit;
pub use trapezoid::Trapezoid;
pub use two_sensor::{TwoSensorError, TwoSensorRun, TwoSensorVerdict};
