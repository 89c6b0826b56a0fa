//! Stopping distance and stopping time as functions of speed.
//!
//! Every law is a delay, in which the train keeps its speed, and a kind of braking after it:
//!
//! ```text
//! constant deceleration    d = v²/2a                 with no delay
//! two terms                d = v τ + v²/2a           the best simple law on real stops of model trains
//! exponential              d = v t₀ + v θ            decoders with load control; never quite at rest
//! ```
//!
//! Letters: `v` speed, `d` stopping distance, `a` deceleration, `τ` and `t₀` delay, `θ` time constant.

use core::marker::PhantomData;

use super::motion::Motion;
use super::speed_change::{ConstantAcceleration, Lag, SpeedChange};
use super::stopping_distance::{FromBraking, FromCommand, FromReport, StoppingDistance, mean_report_delay};
use crate::time::TimeSpan;
use crate::units::{Acceleration, Length, Speed};

/// How the speed falls to zero once braking has begun.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum Braking {
    /// With this constant deceleration.
    Constant(Acceleration),
    /// Exponentially, with this time constant; the train counts as at rest below [`Lag::SETTLED_WITHIN`], although the
    /// full distance takes infinite time.
    Exponential(TimeSpan),
}

/// A stopping law; the type states from when its distances and times are counted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StoppingLaw<From> {
    delay: TimeSpan,
    braking: Braking,
    counted_from: PhantomData<From>,
}

/// Why a stopping law is invalid.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum StoppingError {
    /// A train that does not slow down does not stop.
    NoDeceleration {
        /// What was given.
        found: Acceleration,
    },
    /// An exponential needs a time constant above zero.
    NoTimeConstant {
        /// What was given.
        found: TimeSpan,
    },
    /// Braking cannot begin before the moment from which it is counted.
    NegativeDelay {
        /// The delay given, or the delay that would be left.
        found: TimeSpan,
    },
}

impl core::fmt::Display for StoppingError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::NoDeceleration { found } => {
                write!(f, "deceleration should be above zero, not {} mm/s²", found.as_mm_per_s2())
            }
            Self::NoTimeConstant { found } => {
                write!(f, "the time constant of a stop should be above zero, not {} ms", found.as_ms())
            }
            Self::NegativeDelay { found } => {
                write!(f, "the delay before braking should be zero or more, not {} ms", found.as_ms())
            }
        }
    }
}

impl core::error::Error for StoppingError {}

impl<From> StoppingLaw<From> {
    /// A law that keeps the speed for a delay and then brakes.
    ///
    /// # Errors
    ///
    /// If the delay is negative, or the braking would never bring the train to rest.
    pub fn new(delay: TimeSpan, braking: Braking) -> Result<Self, StoppingError> {
        if delay < TimeSpan::ZERO {
            return Err(StoppingError::NegativeDelay { found: delay });
        }
        match braking {
            Braking::Constant(found) if !(found.is_finite() && found > Acceleration::ZERO) => {
                Err(StoppingError::NoDeceleration { found })
            }
            Braking::Exponential(found) if found <= TimeSpan::ZERO => {
                Err(StoppingError::NoTimeConstant { found })
            }
            _ => Ok(Self { delay, braking, counted_from: PhantomData }),
        }
    }

    /// How long the train keeps its speed.
    pub const fn delay(&self) -> TimeSpan {
        self.delay
    }

    /// The braking after the delay.
    pub const fn braking(&self) -> Braking {
        self.braking
    }

    /// Distance until rest, from a speed in either direction.
    pub fn distance(&self, speed: Speed) -> StoppingDistance<From> {
        let speed = speed.abs().as_m_per_s();
        // In plain numbers: the time that a quotient of quantities gives would be rounded to nanoseconds.
        let braking = match self.braking {
            Braking::Constant(deceleration) => 0.5 * speed * (speed / deceleration.as_m_per_s2()),
            Braking::Exponential(time_constant) => speed * time_constant.as_s(),
        };
        StoppingDistance::new(Length::from_m(speed * self.delay.as_s() + braking))
    }

    /// Time until rest; an exponential stop ends at [`Lag::SETTLED_WITHIN`].
    pub fn time(&self, speed: Speed) -> TimeSpan {
        self.delay + self.change_from(speed).duration()
    }

    /// The highest speed from which the train stops within a distance; zero if the distance is not ahead.
    pub fn speed_for(&self, distance: StoppingDistance<From>) -> Speed {
        let distance = distance.length().max(Length::ZERO).as_m();
        let delay = self.delay.as_s();
        let speed = match self.braking {
            // The root of v²/2a + τ v − d = 0, without the difference of two large numbers.
            Braking::Constant(deceleration) => {
                let twice = 2.0 * distance;
                let sum = delay + libm::sqrt(delay * delay + twice / deceleration.as_m_per_s2());
                if distance > 0.0 { twice / sum } else { 0.0 }
            }
            Braking::Exponential(time_constant) => distance / (delay + time_constant.as_s()),
        };
        Speed::from_m_per_s(speed)
    }

    /// The braking itself as a motion; it begins a [`delay`](Self::delay) after the moment from which the law
    /// counts.
    pub fn change_from(&self, speed: Speed) -> SpeedChange<'static> {
        match self.braking {
            Braking::Constant(deceleration) => SpeedChange::ConstantAcceleration(
                ConstantAcceleration::with_acceleration(speed, Speed::ZERO, deceleration),
            ),
            Braking::Exponential(time_constant) => {
                SpeedChange::Lag(Lag::new(speed, Speed::ZERO, time_constant, Lag::SETTLED_WITHIN))
            }
        }
    }

    /// The same stop seen from a moment that lies `delay` earlier.
    fn earlier<Other>(&self, delay: TimeSpan) -> Result<StoppingLaw<Other>, StoppingError> {
        StoppingLaw::new(self.delay + delay, self.braking)
    }
}

impl StoppingLaw<FromBraking> {
    /// Of a train that starts to brake `command_delay` (τ₂) after the command.
    ///
    /// # Errors
    ///
    /// If that delay is negative.
    pub fn counted_from_command(
        &self,
        command_delay: TimeSpan,
    ) -> Result<StoppingLaw<FromCommand>, StoppingError> {
        self.earlier(command_delay)
    }
}

impl StoppingLaw<FromCommand> {
    /// On average, if the command follows at once on a report that is stamped `to_stamp` (φ) after a reading, and
    /// `poll_interval` (π) lies between that reading and the previous one.
    ///
    /// # Errors
    ///
    /// If that mean is negative.
    pub fn counted_from_report(
        &self,
        to_stamp: TimeSpan,
        poll_interval: TimeSpan,
    ) -> Result<StoppingLaw<FromReport>, StoppingError> {
        self.earlier(mean_report_delay(to_stamp, poll_interval))
    }
}
