//! Calculates the constants of an integer stop: its only part with floating point.

use super::{BinaryFraction, IntegerStop, MANTISSA_BITS, RATE_POINTS, SPEED_POINTS, TIME_BITS};
use crate::kinematics::motion::Motion as _;
use crate::kinematics::ramped_lag::RampedLag;
use crate::kinematics::speed_change::Lag;
use crate::kinematics::stopping_distance::FromCommand;
use crate::kinematics::stopping_law::{Braking, StoppingLaw};
use crate::time::TimeSpan;
use crate::units::{Length, Speed};

/// Why a stop cannot be expressed in integers.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum IntegerStopError {
    /// A tick is longer than zero.
    Tick {
        /// What was given.
        found: TimeSpan,
    },
    /// The train does not run ahead, or runs too fast or too slowly for a tick.
    Speed {
        /// What was given.
        found: Speed,
    },
    /// The stop is too long, or its ramp too short for its lag.
    Stop {
        /// Its distance.
        distance: Length,
        /// Its duration.
        time: TimeSpan,
    },
}

impl core::fmt::Display for IntegerStopError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Tick { found } => {
                write!(f, "a tick should take some time, such as 1 µs or 10 ms, not {} ns", found.as_ns())
            }
            Self::Speed { found } => write!(
                f,
                "speed should be from 0.0000001 mm to 819 mm a tick; {} mm/s is not: choose another tick",
                found.as_mm_per_s()
            ),
            Self::Stop { distance, time } => write!(
                f,
                "a stop of {} m in {} s has no form in integers: it should take less than 107 km, its delay and ramp less than \
                 2^31 ticks, its lag less than 2^28; a ramp should be none or longer than the lag / 16384",
                distance.as_m(),
                time.as_s()
            ),
        }
    }
}

impl core::error::Error for IntegerStopError {}

/// A stop in seconds.
struct Shape {
    delay: f64,
    ramp: f64,
    lag: f64,
    /// From the command to rest.
    time: TimeSpan,
}

impl IntegerStop {
    /// One unit of length.
    pub const UNIT: Length = Length::from_mm(0.1);

    /// The constants of a train that runs at a speed and stops by a law, for ticks of a length.
    ///
    /// # Errors
    ///
    /// If the speed is not ahead, or speed or stop are beyond the range of the constants.
    pub fn new(
        speed: Speed,
        law: &StoppingLaw<FromCommand>,
        tick: TimeSpan,
    ) -> Result<Self, IntegerStopError> {
        let (ramp, lag) = match law.braking() {
            Braking::Constant(deceleration) => (speed.as_m_per_s() / deceleration.as_m_per_s2(), 0.0),
            Braking::Exponential(time_constant) => (0.0, time_constant.as_s()),
        };
        let time = law.delay() + law.change_from(speed).duration();
        Self::of_shape(speed, &Shape { delay: law.delay().as_s(), ramp, lag, time }, tick)
    }

    /// The constants of a train whose set speed falls linearly, a delay after the command, and which follows it with
    /// a lag. It counts as at rest below [`Lag::SETTLED_WITHIN`].
    ///
    /// # Errors
    ///
    /// As for [`new`](Self::new); also if the delay is negative.
    pub fn with_shape(
        speed: Speed,
        delay: TimeSpan,
        shape: &RampedLag,
        tick: TimeSpan,
    ) -> Result<Self, IntegerStopError> {
        let left = Lag::SETTLED_WITHIN.as_m_per_s() / speed.as_m_per_s();
        let time = delay + TimeSpan::from_s(shape.settled(left));
        let shape = Shape { delay: delay.as_s(), ramp: shape.ramp(), lag: shape.lag(), time };
        Self::of_shape(speed, &shape, tick)
    }

    fn of_shape(speed: Speed, shape: &Shape, tick: TimeSpan) -> Result<Self, IntegerStopError> {
        if tick <= TimeSpan::ZERO {
            return Err(IntegerStopError::Tick { found: tick });
        }
        let &Shape { delay, ramp, lag, time } = shape;
        let tick_s = tick.as_s();
        let fraction = BinaryFraction::of(speed.as_m_per_s() / Self::UNIT.as_m() * tick_s)
            .filter(|fraction| fraction.is_within(SPEED_POINTS))
            .ok_or(IntegerStopError::Speed { found: speed })?;
        let distance = Length::from_m(speed.as_m_per_s() * (delay + 0.5 * ramp + lag));
        let tail = if ramp > 0.0 { -lag * lag / ramp * libm::expm1(-ramp / lag) } else { lag };
        let rate = if lag > 0.0 { core::f64::consts::LOG2_E * tick_s / lag } else { 1.0 };
        let parts = [delay, ramp, lag, tail, time.as_s()];
        let [delay, ramp, lag, tail, rests] = parts.map(|seconds| fixed(seconds / tick_s));
        BinaryFraction::of(rate)
            .filter(|rate| rate.is_within(RATE_POINTS))
            .map(|rate| Self { speed: fraction, delay, ramp, lag, tail: tail.min(lag), rate, time: rests })
            .filter(Self::is_usable)
            .ok_or(IntegerStopError::Stop { distance, time })
    }
}

impl BinaryFraction {
    /// A number above zero, exactly; `None` for any other.
    fn of(number: f64) -> Option<Self> {
        let (part, exponent) = libm::frexp(number);
        let digits = libm::ldexp(part, MANTISSA_BITS as i32) as i64;
        let point = i64::from(MANTISSA_BITS) - i64::from(exponent);
        (number.is_finite() && digits > 0).then_some(Self { digits, point })
    }
}

/// Ticks with [`TIME_BITS`] behind the point, to the nearest; those beyond 64 bits become the largest, which no stop
/// has.
fn fixed(ticks: f64) -> i64 {
    libm::round(libm::ldexp(ticks, TIME_BITS as i32)) as i64
}
