//! Limits of speed, acceleration and jerk, and why no profile within them reaches a target.

use super::motion::MotionState;
use crate::units::{Acceleration, Jerk, Length, Speed};

/// Upper limits of a profile; each is a magnitude above zero.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Limits {
    /// Speed.
    pub speed: Speed,
    /// Rate at which the train speeds up.
    pub acceleration: Acceleration,
    /// Rate at which it slows down.
    pub deceleration: Acceleration,
    /// Rate of change of both accelerations; profiles of constant acceleration do not use it.
    pub jerk: Jerk,
}

/// Why there is no profile from the current state to the target.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum ProfileError {
    /// A limit is zero, negative or not a number.
    NoLimit {
        /// The name of its field in [`Limits`].
        limit: &'static str,
        /// The value given, in SI units.
        found: f64,
    },
    /// A distance, speed or acceleration is not finite.
    NotFinite {
        /// The state that contains it.
        found: MotionState,
    },
    /// The target's speed is above the limit, or points back to the current position.
    TargetSpeed {
        /// The speed requested.
        found: Speed,
        /// The limit.
        highest: Speed,
    },
    /// The target has an acceleration, but a jerk-limited profile ends without one.
    TargetAcceleration {
        /// The acceleration requested.
        found: Acceleration,
    },
    /// The train moves away from the target and has to stop first.
    MovesAway {
        /// Its speed.
        found: Speed,
    },
    /// The train already speeds up or slows down more than the limits allow.
    BeyondLimits {
        /// Its acceleration.
        found: Acceleration,
    },
    /// The train brakes so hard that it is at rest before the jerk limit allows it to ease off.
    AtRestFirst {
        /// Its acceleration.
        found: Acceleration,
    },
    /// The target is too near for the train to reach its speed.
    TooNear {
        /// The remaining distance.
        found: Length,
        /// The shortest distance in which the target's speed can be reached.
        shortest: Length,
    },
}

impl core::fmt::Display for ProfileError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::NoLimit { limit, found } => {
                write!(f, "the limit of {limit} should be a number above zero, not {found}")
            }
            Self::NotFinite { found } => {
                write!(f, "distance, speed and acceleration should be finite numbers, not {found:?}")
            }
            Self::TargetSpeed { found, highest } => {
                let (found, highest) = (found.as_m_per_s(), highest.as_m_per_s());
                write!(
                    f,
                    "the speed at the target should lead ahead with at most {highest} m/s, not be {found} m/s"
                )
            }
            Self::TargetAcceleration { found } => {
                let found = found.as_m_per_s2();
                write!(f, "the acceleration at the target should be zero, not {found} m/s²")
            }
            Self::MovesAway { found } => {
                let found = found.as_m_per_s();
                write!(f, "the train moves away from the target at {found} m/s: stop it first")
            }
            Self::BeyondLimits { found } => {
                let found = found.as_m_per_s2();
                write!(
                    f,
                    "the train's acceleration of {found} m/s² is beyond the limits already: wait, or widen them"
                )
            }
            Self::AtRestFirst { found } => {
                let found = found.as_m_per_s2();
                write!(
                    f,
                    "at {found} m/s² the train is at rest before the jerk limit lets it ease off: start \
                     from standstill instead"
                )
            }
            Self::TooNear { found, shortest } => {
                let (found, shortest) = (found.as_m(), shortest.as_m());
                write!(f, "the target is {found} m ahead, and it takes {shortest} m to get to its speed")
            }
        }
    }
}

impl core::error::Error for ProfileError {}
