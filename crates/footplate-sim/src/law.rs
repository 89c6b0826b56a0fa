//! The laws by which a decoder changes the speed of its motor, with their rates.
//!
//! A law here is a process with a few settings, integrated in small steps by [`motor`](crate::motor). There is no
//! closed form of speed over time, and none is shared with the estimator under test.

use footplate_core::{Acceleration, SpeedStep, TimeSpan};

use crate::draws::Draws;
use crate::speed_table::Shape;

/// A law without its settings.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum LawFamily {
    /// The set speed moves at a constant rate.
    Constant,
    /// The rate rises and falls again as a parabola over the change.
    Smooth,
    /// The set speed moves at a constant rate and is averaged over a window: constant jerk at both ends.
    SCurve,
    /// The set speed jumps, and the motor follows with its inertia.
    Lag,
    /// A counter goes through the decoder's internal steps, one at a time (momentum, CV 3 and 4).
    Momentum,
    /// Accelerates at a limited rate with a lag, decelerates by inertia alone.
    Mixed,
}

impl LawFamily {
    /// Every law, in the order of its definition.
    pub const ALL: [Self; 6] =
        [Self::Constant, Self::Smooth, Self::SCurve, Self::Lag, Self::Momentum, Self::Mixed];

    /// The name on the command line and in truth files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Constant => "constant",
            Self::Smooth => "smooth",
            Self::SCurve => "s-curve",
            Self::Lag => "lag",
            Self::Momentum => "momentum",
            Self::Mixed => "mixed",
        }
    }
}

impl core::fmt::Display for LawFamily {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.pad(self.name())
    }
}

/// A law with its settings; `up` accelerates, `down` decelerates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Law {
    /// See [`LawFamily::Constant`].
    Constant {
        /// Rate of acceleration.
        up: Acceleration,
        /// Rate of deceleration, as a positive number.
        down: Acceleration,
    },
    /// See [`LawFamily::Smooth`]; a change takes `shortest` plus its size divided by the rate.
    Smooth {
        /// Mean rate of a large change upwards.
        up: Acceleration,
        /// Mean rate of a large change downwards, as a positive number.
        down: Acceleration,
        /// Duration of the smallest change.
        shortest: TimeSpan,
    },
    /// See [`LawFamily::SCurve`].
    SCurve {
        /// Rate in the middle of a large acceleration.
        up: Acceleration,
        /// Rate in the middle of a large deceleration, as a positive number.
        down: Acceleration,
        /// The averaging window.
        rounding: TimeSpan,
    },
    /// See [`LawFamily::Lag`].
    Lag {
        /// Time constant of acceleration.
        up: TimeSpan,
        /// Time constant of deceleration.
        down: TimeSpan,
    },
    /// See [`LawFamily::Momentum`].
    Momentum {
        /// Time per internal step upwards.
        up_per_count: TimeSpan,
        /// Time per internal step downwards.
        down_per_count: TimeSpan,
    },
    /// See [`LawFamily::Mixed`].
    Mixed {
        /// Limit of the acceleration.
        up: Acceleration,
        /// Time constant behind that limit.
        up_lag: TimeSpan,
        /// Time constant of deceleration.
        down: TimeSpan,
    },
}

/// Internal steps of a decoder between two throttle steps: 126 speeds over 14 steps (NMRA S-9.2.1).
pub(crate) const COUNTS_PER_STEP: u16 = 9;

/// The same for a decoder with this highest step: finer throttle steps are fewer internal steps apart.
pub(crate) fn counts_per_step(highest: SpeedStep) -> f64 {
    f64::from(COUNTS_PER_STEP) * 14.0 / f64::from(highest.get().max(14))
}
/// Seconds per internal step for each unit of CV 3 or 4: 0.896 s over 128 steps (NMRA S-9.2.2).
const MOMENTUM_UNIT_S: f64 = 0.896 / 128.0;

impl Law {
    /// Which law this is.
    pub const fn family(&self) -> LawFamily {
        match self {
            Self::Constant { .. } => LawFamily::Constant,
            Self::Smooth { .. } => LawFamily::Smooth,
            Self::SCurve { .. } => LawFamily::SCurve,
            Self::Lag { .. } => LawFamily::Lag,
            Self::Momentum { .. } => LawFamily::Momentum,
            Self::Mixed { .. } => LawFamily::Mixed,
        }
    }

    /// Settings that give starts and stops like those of real locomotives of a shape (stopping distances at top
    /// speed: 820 to 970 mm even, 1210 to 1590 mm steep; even locomotives take 3 s to reach top speed, steep ones
    /// less).
    pub(crate) fn draw(family: LawFamily, shape: Shape, draws: &mut Draws) -> Self {
        let rate = |mm_per_s2: f64| Acceleration::from_mm_per_s2(mm_per_s2);
        // Ranges chosen so that the stopping distances of drawn trains cover the measured ones.
        let (up, down) = match shape {
            Shape::Even => (draws.uniform(130.0..230.0), draws.uniform(190.0..300.0)),
            Shape::Steep => (draws.uniform(170.0..300.0), draws.uniform(130.0..200.0)),
        };
        let span = TimeSpan::from_s;
        match family {
            LawFamily::Constant => Self::Constant { up: rate(up), down: rate(down) },
            LawFamily::Smooth => {
                Self::Smooth { up: rate(up), down: rate(down), shortest: span(draws.uniform(0.3..0.8)) }
            }
            LawFamily::SCurve => {
                Self::SCurve { up: rate(up), down: rate(down), rounding: span(draws.uniform(0.3..0.9)) }
            }
            // Measured on trains 45, 47 and 49: 1.1 to 1.3 s down.
            LawFamily::Lag => {
                Self::Lag { up: span(draws.uniform(0.8..1.5)), down: span(draws.uniform(1.1..1.3)) }
            }
            LawFamily::Momentum => {
                let mut setting =
                    |range: core::ops::Range<f64>| draws.uniform(range).round() * MOMENTUM_UNIT_S;
                Self::Momentum {
                    up_per_count: span(setting(1.5..5.5)),
                    down_per_count: span(setting(2.5..5.5)),
                }
            }
            LawFamily::Mixed => Self::Mixed {
                up: rate(up),
                up_lag: span(draws.uniform(0.2..0.5)),
                down: span(draws.uniform(1.0..1.5)),
            },
        }
    }
}
