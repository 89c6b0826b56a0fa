//! Acceleration from two sensors: the change of speed is commanded at the first sensor or soon after it, and the time
//! to the second shows how long the change took.
//!
//! Letters: `b` from the first sensor to the command, `d` from the train's position at the command to the second
//! sensor, which is v₁ b less than the distance between the two, `t` the time from the command to the second sensor,
//! `v₁` and `v₂` the speeds before and after the change, `vₐ` their mean, `τ₂` from the command until the change
//! begins, `a` the acceleration. During the change the mean speed is vₐ, so either
//!
//! ```text
//! the change was over before the second sensor     a = (v₂ − v₁)² / 2g    g = v₂ (t − τ₂) + v₁ τ₂ − d
//! or it was not                                    a = 2h / (t − τ₂)²     h = d − v₁ t
//! ```
//!
//! `g` is the distance lost against an instantaneous change, `h` the distance gained over no change. The sign of
//! q = d − v₁ τ₂ − vₐ (t − τ₂) decides which formula applies: a train that speeds up has covered more than the mean
//! speed gives if its change was over. Slowing down mirrors that. At q = 0 both give the same acceleration.

use crate::estimate::Estimate;
use crate::time::TimeSpan;
use crate::units::{Acceleration, Length, Speed};

/// Least size of a decisive difference in standard deviations: 95 % of normal errors are smaller.
const DECISIVE: f64 = 2.0;

/// One change of speed between two sensors, or the mean of several alike.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TwoSensorRun {
    /// From the first sensor to the second.
    pub distance: Estimate<Length>,
    /// From the first sensor to the command; zero if the change was commanded at the first.
    pub before_command: Estimate<TimeSpan>,
    /// From the command to the second sensor.
    pub time: Estimate<TimeSpan>,
    /// Steady speed before.
    pub from: Estimate<Speed>,
    /// Steady speed long after.
    pub to: Estimate<Speed>,
    /// From the command until the speed begins to change.
    pub command_delay: Estimate<TimeSpan>,
}

/// The result of a measurement with two sensors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum TwoSensorVerdict {
    /// It was over before the second sensor.
    Completed {
        /// Its acceleration, negative for slowing down.
        acceleration: Estimate<Acceleration>,
        /// How long it took.
        duration: TimeSpan,
    },
    /// It was still going on at the second sensor.
    Unfinished {
        /// Its acceleration, negative for slowing down.
        acceleration: Estimate<Acceleration>,
        /// The speed over the second sensor.
        speed: Speed,
    },
    /// It ended so close to the second sensor that the data do not show on which side.
    Undecided {
        /// Its acceleration if it was over.
        if_completed: Estimate<Acceleration>,
        /// Its acceleration if it was not.
        if_unfinished: Estimate<Acceleration>,
    },
    /// It was too short to be distinguished from an instantaneous change: use sensors that are closer together.
    TooQuick,
    /// The speed had not noticeably changed by the second sensor: use sensors that are farther apart. Over so short a
    /// distance even an instantaneous change may not show.
    NotNoticed,
}

/// Why a run gives no result.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum TwoSensorError {
    /// A value or an uncertainty is not a finite number, or an uncertainty is negative.
    NotFinite,
    /// The train is at rest or changes its direction: its time between two sensors is then meaningless.
    NotForwards {
        /// Speed before.
        from: Speed,
        /// Speed after.
        to: Speed,
    },
    /// The two speeds do not differ by more than their uncertainty.
    SameSpeed {
        /// Speed before.
        from: Speed,
        /// Speed after.
        to: Speed,
    },
    /// The second sensor came before the change can have begun.
    BeforeTheChange {
        /// Time from the command to the second sensor.
        time: TimeSpan,
        /// Delay of the command.
        command_delay: TimeSpan,
    },
}

impl core::fmt::Display for TwoSensorError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::NotFinite => {
                write!(f, "every value should be a finite number, and no uncertainty negative")
            }
            Self::NotForwards { from, to } => {
                let (from, to) = (from.as_mm_per_s(), to.as_mm_per_s());
                write!(f, "the train should run forwards over both sensors, not go from {from} to {to} mm/s")
            }
            Self::SameSpeed { from, to } => {
                let (from, to) = (from.as_mm_per_s(), to.as_mm_per_s());
                write!(
                    f,
                    "{from} and {to} mm/s do not differ by more than their uncertainty: change the speed by more"
                )
            }
            Self::BeforeTheChange { time, command_delay } => {
                let (time, delay) = (time.as_ms(), command_delay.as_ms());
                write!(
                    f,
                    "the second sensor came {time} ms after the command, which takes effect after {delay} ms: take sensors farther apart"
                )
            }
        }
    }
}

impl core::error::Error for TwoSensorError {}

/// Derivatives of a quantity with respect to what was measured.
#[derive(Debug, Clone, Copy)]
struct Slopes {
    distance: f64,
    time: f64,
    from: f64,
    to: f64,
    command_delay: f64,
}

impl Slopes {
    fn map(self, other: Self, f: impl Fn(f64, f64) -> f64) -> Self {
        Self {
            distance: f(self.distance, other.distance),
            time: f(self.time, other.time),
            from: f(self.from, other.from),
            to: f(self.to, other.to),
            command_delay: f(self.command_delay, other.command_delay),
        }
    }
}

impl TwoSensorRun {
    /// The acceleration, and whether the change was over at the second sensor, as far as the data can tell.
    ///
    /// Errors of the five measured values are taken as independent and small (first order).
    ///
    /// # Errors
    ///
    /// If no readings of the sensors in this run could contain information.
    pub fn verdict(&self) -> Result<TwoSensorVerdict, TwoSensorError> {
        self.check()?;
        let (t, delay) = (self.time.value.as_s(), self.command_delay.value.as_s());
        let d = (self.distance.value - self.from.value * self.before_command.value).as_m();
        let (v1, v2) = (self.from.value.as_m_per_s(), self.to.value.as_m_per_s());
        let (gain, mean, changing) = (v2 - v1, 0.5 * (v1 + v2), t - delay);
        // From here on every distance is counted in the direction of the change: decelerating needs no mirrored
        // formulas.
        let sense = gain.signum();

        let lost = v2 * changing + v1 * delay - d;
        let lost_slopes =
            Slopes { distance: -1.0, time: v2, from: delay, to: changing, command_delay: v1 - v2 };
        let won = d - v1 * t;
        let won_slopes = Slopes { distance: 1.0, time: -v1, from: -t, to: 0.0, command_delay: 0.0 };
        // Nothing is noticeable right behind the command: neither what was won over the old speed nor what was lost to
        // the new one. Only a train that is seen to have changed its speed can have done so too quickly.
        if sense * won <= DECISIVE * self.deviation(won_slopes) {
            return Ok(TwoSensorVerdict::NotNoticed);
        }
        if sense * lost <= DECISIVE * self.deviation(lost_slopes) {
            return Ok(TwoSensorVerdict::TooQuick);
        }

        // a = gain²/2g, and da/a = 2 d(gain)/gain − dg/g
        let completed = 0.5 * gain * gain / lost;
        let gain_slopes = Slopes { distance: 0.0, time: 0.0, from: -1.0, to: 1.0, command_delay: 0.0 };
        let completed_slopes = gain_slopes
            .map(lost_slopes, |gained, lost_by| completed * (2.0 * gained / gain - lost_by / lost));
        // a = 2h/(t − τ₂)², and da/a = dh/h − 2 d(t − τ₂)/(t − τ₂)
        let unfinished = 2.0 * won / (changing * changing);
        let changing_slopes = Slopes { distance: 0.0, time: 1.0, from: 0.0, to: 0.0, command_delay: -1.0 };
        let unfinished_slopes = won_slopes
            .map(changing_slopes, |won_by, longer| unfinished * (won_by / won - 2.0 * longer / changing));
        let (if_completed, if_unfinished) = (
            self.acceleration(completed, completed_slopes),
            self.acceleration(unfinished, unfinished_slopes),
        );

        let beyond = sense * (d - v1 * delay - mean * changing);
        let beyond_slopes = Slopes {
            distance: 1.0,
            time: -mean,
            from: -delay - 0.5 * changing,
            to: -0.5 * changing,
            command_delay: mean - v1,
        };
        let margin = DECISIVE * self.deviation(beyond_slopes);
        Ok(if beyond > margin {
            TwoSensorVerdict::Completed {
                acceleration: if_completed,
                duration: TimeSpan::from_s(2.0 * lost / gain),
            }
        } else if beyond < -margin {
            let speed = Speed::from_m_per_s(v1 + unfinished * changing);
            TwoSensorVerdict::Unfinished { acceleration: if_unfinished, speed }
        } else {
            TwoSensorVerdict::Undecided { if_completed, if_unfinished }
        })
    }

    fn check(&self) -> Result<(), TwoSensorError> {
        let (from, to) = (self.from.value, self.to.value);
        let known =
            |value: f64, uncertainty: f64| value.is_finite() && uncertainty.is_finite() && uncertainty >= 0.0;
        let lengths = known(self.distance.value.as_m(), self.distance.uncertainty.as_m());
        let speeds = [self.from, self.to]
            .iter()
            .all(|speed| known(speed.value.as_m_per_s(), speed.uncertainty.as_m_per_s()));
        let spans = [self.before_command, self.time, self.command_delay]
            .iter()
            .all(|span| span.uncertainty >= TimeSpan::ZERO);
        if !(lengths && speeds && spans) {
            return Err(TwoSensorError::NotFinite);
        }
        if from < Speed::ZERO || to < Speed::ZERO {
            return Err(TwoSensorError::NotForwards { from, to });
        }
        let gain_slopes = Slopes { distance: 0.0, time: 0.0, from: -1.0, to: 1.0, command_delay: 0.0 };
        if (to - from).abs().as_m_per_s() <= DECISIVE * self.deviation(gain_slopes) {
            return Err(TwoSensorError::SameSpeed { from, to });
        }
        if self.time.value <= self.command_delay.value {
            let (time, command_delay) = (self.time.value, self.command_delay.value);
            return Err(TwoSensorError::BeforeTheChange { time, command_delay });
        }
        Ok(())
    }

    /// Standard deviation of a quantity with these slopes. That of `d` counts for the time before the command, too,
    /// which the train ran at its old speed.
    fn deviation(&self, slopes: Slopes) -> f64 {
        let before = self.before_command.value.as_s();
        let parts = [
            slopes.distance * self.from.value.as_m_per_s() * self.before_command.uncertainty.as_s(),
            slopes.distance * self.distance.uncertainty.as_m(),
            slopes.time * self.time.uncertainty.as_s(),
            (slopes.from - slopes.distance * before) * self.from.uncertainty.as_m_per_s(),
            slopes.to * self.to.uncertainty.as_m_per_s(),
            slopes.command_delay * self.command_delay.uncertainty.as_s(),
        ];
        libm::sqrt(parts.iter().map(|part| part * part).sum())
    }

    fn acceleration(&self, value: f64, slopes: Slopes) -> Estimate<Acceleration> {
        Estimate {
            value: Acceleration::from_m_per_s2(value),
            uncertainty: Acceleration::from_m_per_s2(self.deviation(slopes)),
            count: self.time.count,
            date: self.time.date,
        }
    }
}
