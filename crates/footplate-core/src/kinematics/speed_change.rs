//! Six laws of how a train changes from one speed to another, with one interface.
//!
//! Fitting all of them to recorded runs shows which one a decoder follows. Distance and speed are continuous in every
//! law (except speed in the crudest), because no force is infinite.
//!
//! | law | speed at the share τ = t/Δ | where it fits |
//! |---|---|---|
//! | [`MidStep`] | v₁, then v₂ from τ = ½ on | where the course of the change does not matter |
//! | [`ConstantAcceleration`] | v₁ + (v₂ − v₁) τ | the schoolbook; infinite jerk at the ends |
//! | [`ConstantJerk`] | a parabola in, a parabola out | acceleration without a step |
//! | [`Smooth`] | v₁ + (v₂ − v₁)(3τ² − 2τ³) | what a decoder's programmer writes once |
//! | [`Lag`] | v₂ + (v₁ − v₂) e^(−t/θ) | decoders with load control |
//! | [`StepRamp`] | through the train's speed table, a fixed time per step | DCC momentum, CV 3 and CV 4 |
//!
//! Starts have v₁ = 0 and stops v₂ = 0. Before the change the train runs at v₁, after it at v₂, so a law is defined for
//! every time and every distance. A change between speeds of opposite signs can be evaluated but has no inverse: a
//! reversal is a stop and a start.

mod ends;
mod lag;
mod step_ramp;
mod symmetric;

pub use lag::Lag;
pub use step_ramp::{StepRamp, StepTable, StepTableError};
pub use symmetric::{ConstantAcceleration, ConstantJerk, MidStep, Smooth};

use super::motion::{Motion, MotionState};
use crate::time::TimeSpan;
use crate::units::{Length, Speed};

/// The laws that need only two speeds and one time, by name: the candidates of a fit.
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
    /// All laws, the crudest first.
    pub const ALL: [Self; 5] =
        [Self::MidStep, Self::ConstantAcceleration, Self::ConstantJerk, Self::Smooth, Self::Lag];

    /// The change from a speed to another by this law in its `time`.
    ///
    /// Any finite numbers are accepted. Distance, speed and acceleration are as smooth in the three arguments as
    /// the law is in time, down to the resolution of time, 1 ns.
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

/// A change of speed by the law that fits the train; distance is 0 at its start.
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
    /// Speed through the train's speed table.
    StepRamp(StepRamp<'t>),
}

/// The same call on the law of a change.
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
