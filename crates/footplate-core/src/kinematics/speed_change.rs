//! How a train goes from one speed to another: six laws with one set of questions.
//!
//! Which of them a decoder follows is found out by fitting all of them to what a train did. Distance and speed
//! have no step in any law (but the crudest, in speed), because no train teleports and no force is infinite.
//!
//! | law | speed at the share τ = t/Δ | where it fits |
//! |---|---|---|
//! | [`MidStep`] | v₁, then v₂ from τ = ½ on | where it does not matter what happens meanwhile |
//! | [`ConstantAcceleration`] | v₁ + (v₂ − v₁) τ | the schoolbook; infinite jerk at the ends |
//! | [`ConstantJerk`] | a parabola in, a parabola out | acceleration without a step |
//! | [`Smooth`] | v₁ + (v₂ − v₁)(3τ² − 2τ³) | what a decoder's programmer writes once |
//! | [`Lag`] | v₂ + (v₁ − v₂) e^(−t/θ) | decoders with load control |
//! | [`StepRamp`] | through the train's speed table, so many ms per step | DCC momentum, CV 3 and CV 4 |
//!
//! Starts have v₁ = 0 and stops v₂ = 0. Before the change the train runs at v₁, after it at v₂, so that a law
//! may be asked about any time and any distance. A change whose two speeds have opposite signs is evaluated,
//! but has no inverse: a reversal is a stop and a start.

mod constant_acceleration;
mod constant_jerk;
mod ends;
mod lag;
mod mid_step;
mod smooth;
mod step_ramp;
mod step_table;

pub use constant_acceleration::ConstantAcceleration;
pub use constant_jerk::ConstantJerk;
pub use lag::Lag;
pub use mid_step::MidStep;
pub use smooth::Smooth;
pub use step_ramp::StepRamp;
pub use step_table::{StepTable, StepTableError};

use super::motion::{Motion, MotionState};
use crate::time::TimeSpan;
use crate::units::{Length, Speed};

/// The laws that need nothing but two speeds and one time, by name: what a fit tries one after the other.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum SpeedLaw {
    /// [`MidStep`]; its time is the duration.
    MidStep,
    /// [`ConstantAcceleration`]; its time is the duration.
    ConstantAcceleration,
    /// [`ConstantJerk`]; its time is the duration.
    ConstantJerk,
    /// [`Smooth`]; its time is the duration.
    Smooth,
    /// [`Lag`]; its time is the time constant, its tolerance [`Lag::SETTLED_WITHIN`].
    Lag,
}

impl SpeedLaw {
    /// Every one of them, the crudest first.
    pub const ALL: [Self; 5] =
        [Self::MidStep, Self::ConstantAcceleration, Self::ConstantJerk, Self::Smooth, Self::Lag];

    /// The change from a speed to another by this law in its `time`.
    ///
    /// Any finite numbers are accepted. Distance, speed and acceleration are as smooth in the three arguments as
    /// the law is in time, down to the nanosecond in which time is counted.
    #[must_use]
    pub fn between(self, from: Speed, to: Speed, time: TimeSpan) -> SpeedChange<'static> {
        match self {
            Self::MidStep => SpeedChange::MidStep(MidStep::new(from, to, time)),
            Self::ConstantAcceleration => {
                SpeedChange::ConstantAcceleration(ConstantAcceleration::new(from, to, time))
            }
            Self::ConstantJerk => SpeedChange::ConstantJerk(ConstantJerk::new(from, to, time)),
            Self::Smooth => SpeedChange::Smooth(Smooth::new(from, to, time)),
            Self::Lag => SpeedChange::Lag(Lag::new(from, to, time, Lag::SETTLED_WITHIN)),
        }
    }
}

/// A change of speed by whichever law fits the train; distance counts from 0 at its start.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SpeedChange<'t> {
    /// A step at the middle of the interval.
    MidStep(MidStep),
    /// Speed as a straight line.
    ConstantAcceleration(ConstantAcceleration),
    /// Speed as two parabolas.
    ConstantJerk(ConstantJerk),
    /// Speed as a cubic.
    Smooth(Smooth),
    /// Speed as an exponential.
    Lag(Lag),
    /// Speed as the train's table has it.
    StepRamp(StepRamp<'t>),
}

/// The same question to whichever law it is.
macro_rules! ask {
    ($change:expr, $law:ident => $question:expr) => {
        match $change {
            SpeedChange::MidStep($law) => $question,
            SpeedChange::ConstantAcceleration($law) => $question,
            SpeedChange::ConstantJerk($law) => $question,
            SpeedChange::Smooth($law) => $question,
            SpeedChange::Lag($law) => $question,
            SpeedChange::StepRamp($law) => $question,
        }
    };
}

impl Motion for SpeedChange<'_> {
    #[inline]
    fn state_at(&self, time: TimeSpan) -> MotionState {
        ask!(self, law => law.state_at(time))
    }

    #[inline]
    fn time_at(&self, distance: Length) -> Option<TimeSpan> {
        ask!(self, law => law.time_at(distance))
    }

    fn duration(&self) -> TimeSpan {
        ask!(self, law => law.duration())
    }

    fn distance(&self) -> Length {
        ask!(self, law => law.distance())
    }
}
