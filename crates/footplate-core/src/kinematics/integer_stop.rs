//! A stop from a steady speed in integers, for controllers without floating point.
//!
//! Lengths are whole units of 0.1 mm, times whole ticks of any length. [`IntegerStop::new`] and
//! [`IntegerStop::with_shape`] calculate the constants once, with floating point, on a computer or at start; a
//! controller without floating point reads them with [`IntegerStop::from_constants`]. Everything else, and all of
//! this file, uses integers. Letters: `v` speed, `q` delay, `T` ramp, `θ` lag, `t` time since braking began, `h` and
//! `H` as of [`RampedLag`](super::RampedLag).
//!
//! ```text
//! x = v (q + g(t))        distance, counted from the command
//! g = t − H(t)/T          while the set speed falls (t ≤ T), with  H = t²/2 − θ h,  h = t − θ (1 − e^(−t/θ))
//! g = T/2 + θ − w e^(−(t−T)/θ)      after it, with  w = (θ²/T)(1 − e^(−T/θ))
//! ```
//!
//! Constant deceleration is a ramp without a lag, an exponential a lag without a ramp. `g` is the time in which the
//! train covers the same distance at constant speed. At the end of the stop, with the delay, it is q + T/2 + θ:
//! stopping distance and command time need only this.

mod constants;
mod power_of_half;

pub use constants::IntegerStopError;
use power_of_half::{EXPONENT_BITS, POWER_BITS, power_of_half};

/// Binary digits behind the point of times in ticks.
const TIME_BITS: u32 = 30;
/// Digits kept behind the point of a length in units when a target is taken from it.
const LENGTH_BITS: u32 = 24;

/// Delay and ramp are shorter than 2³¹ ticks, the lag is shorter than 2²⁸ ticks: products fit 128 bits.
const LONGEST: i64 = 1 << (31 + TIME_BITS);
const LONGEST_LAG: i64 = 1 << (28 + TIME_BITS);
/// Shortest ramp as a share of the lag, as a power of two: dividing by a shorter one would magnify rounding.
const SHORTEST_RAMP_BITS: u32 = 14;
/// No stop is longer than this many units (107 km).
const FARTHEST: i128 = 1 << 30;
/// Every train is at rest this long after it began to brake (2³⁴ ticks).
const AT_REST: i128 = 1 << (34 + TIME_BITS);
/// Digits behind the point of a speed: from 2⁻²⁰ to 2¹³ units a tick; and of the rate of a lag.
const SPEED_POINTS: [i64; 2] = [40, 72];
const RATE_POINTS: [i64; 2] = [27, 100];
/// A binary fraction has as many digits as a number in floating point: 53.
const MANTISSA_BITS: u32 = 53;

/// A train at constant speed, and its stop, in tenths of a millimetre and ticks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct IntegerStop {
    /// Units a tick.
    speed: BinaryFraction,
    /// `q`, `T`, `θ` and `w` in ticks, with [`TIME_BITS`] behind the point.
    delay: i64,
    ramp: i64,
    lag: i64,
    tail: i64,
    /// log₂e/θ: powers of one half a tick.
    rate: BinaryFraction,
    /// From the command to rest in ticks, with [`TIME_BITS`] behind the point.
    time: i64,
}

/// `digits` / 2^`point`, exactly the value of a floating-point number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct BinaryFraction {
    digits: i64,
    point: i64,
}

impl BinaryFraction {
    const fn is_within(self, points: [i64; 2]) -> bool {
        let [fewest, most] = points;
        let is_full = self.digits >> (MANTISSA_BITS - 1) == 1;
        is_full && fewest <= self.point && self.point <= most
    }

    /// The product with a number that has `bits` digits behind its point, rounded to `kept` digits behind the point.
    fn times(self, other: i128, bits: u32, kept: u32) -> i128 {
        let shift = self.point as u32 + bits - kept;
        (i128::from(self.digits) * other + (1 << (shift - 1))) >> shift
    }
}

/// These constants describe no stop, or one beyond the range of these integers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct UnusableConstants;

impl core::fmt::Display for UnusableConstants {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(
            "these are not the constants of a stop: pass all nine, in order, as \
                     IntegerStop::constants returns them",
        )
    }
}

impl core::error::Error for UnusableConstants {}

impl IntegerStop {
    /// The constants of the stop: print them on a computer, and pass them to [`from_constants`](Self::from_constants)
    /// on the controller. In order: digits and point of the speed, delay, ramp, lag, tail, digits and point of the
    /// rate, time.
    pub const fn constants(&self) -> [i64; 9] {
        let Self { speed, delay, ramp, lag, tail, rate, time } = *self;
        [speed.digits, speed.point, delay, ramp, lag, tail, rate.digits, rate.point, time]
    }

    /// The stop with constants calculated elsewhere; `const`, for constants known when the controller's program is
    /// built.
    ///
    /// # Errors
    ///
    /// If a constant is out of range. No later call can overflow.
    pub const fn from_constants(constants: [i64; 9]) -> Result<Self, UnusableConstants> {
        let [speed, speed_point, delay, ramp, lag, tail, rate, rate_point, time] = constants;
        let speed = BinaryFraction { digits: speed, point: speed_point };
        let rate = BinaryFraction { digits: rate, point: rate_point };
        let stop = Self { speed, delay, ramp, lag, tail, rate, time };
        if stop.is_usable() { Ok(stop) } else { Err(UnusableConstants) }
    }

    const fn is_usable(&self) -> bool {
        let Self { speed, delay, ramp, lag, tail, rate, time } = *self;
        let spans =
            delay >= 0 && delay < LONGEST && ramp >= 0 && ramp < LONGEST && lag >= 0 && lag < LONGEST_LAG;
        let is_long_enough = ramp == 0 || ramp >= lag >> SHORTEST_RAMP_BITS;
        let parts = tail >= 0 && tail <= lag && time >= delay && time <= i64::MAX >> 1;
        if !(spans && is_long_enough && parts && speed.is_within(SPEED_POINTS) && rate.is_within(RATE_POINTS))
        {
            return false;
        }
        let stop = speed.digits as i128 * self.steady_time() as i128;
        stop >> (speed.point as u32 + TIME_BITS) < FARTHEST
    }

    /// Distance at constant speed in a number of ticks.
    pub fn run(&self, ticks: i64) -> i32 {
        whole_units(self.speed.times(i128::from(ticks), 0, 0))
    }

    /// Ticks until the train, at constant speed, has covered `distance`; negative for a distance behind it.
    pub fn ticks_to(&self, distance: i32) -> i64 {
        whole_ticks(self.time_over(distance))
    }

    /// Stopping distance if the stop is commanded now.
    pub fn stopping_distance(&self) -> i32 {
        whole_units(self.speed.times(i128::from(self.steady_time()), TIME_BITS, 0))
    }

    /// Ticks until rest if the stop is commanded now.
    pub const fn stopping_time(&self) -> i64 {
        (self.time + (1 << (TIME_BITS - 1))) >> TIME_BITS
    }

    /// Ticks until the stop command for which the train comes to rest `distance` ahead of its present position;
    /// negative if that time has passed.
    pub fn command_in(&self, distance: i32) -> i64 {
        whole_ticks(self.time_over(distance) - i128::from(self.steady_time()))
    }

    /// Overrun of a target `distance` ahead if the stop is commanded now; negative if the train comes to rest before
    /// it.
    pub fn overrun(&self, distance: i32) -> i32 {
        let stop = self.speed.times(i128::from(self.steady_time()), TIME_BITS, LENGTH_BITS);
        let beyond = stop - (i128::from(distance) << LENGTH_BITS);
        whole_units((beyond + (1 << (LENGTH_BITS - 1))) >> LENGTH_BITS)
    }

    /// Distance covered a number of ticks after the stop command was sent.
    pub fn run_since_command(&self, ticks: i64) -> i32 {
        let braking = (i128::from(ticks) << TIME_BITS) - i128::from(self.delay);
        if braking <= 0 {
            return self.run(ticks);
        }
        let steady = i128::from(self.delay) + self.steady_time_of(braking.min(AT_REST));
        whole_units(self.speed.times(steady, TIME_BITS, 0))
    }

    /// Time in which the train covers its stopping distance at constant speed: q + T/2 + θ.
    const fn steady_time(&self) -> i64 {
        self.delay + (self.ramp >> 1) + self.lag
    }

    /// `g`: time in which the train covers, at constant speed, its distance since it began to brake, at most
    /// [`AT_REST`] ago.
    fn steady_time_of(&self, braking: i128) -> i128 {
        let (ramp, lag) = (i128::from(self.ramp), i128::from(self.lag));
        let whole = i128::from(self.steady_time() - self.delay);
        let steady = if braking < ramp {
            let behind = braking - part(lag, (1 << POWER_BITS) - self.left(braking));
            braking - (braking * braking / 2 - lag * behind) / ramp.max(1)
        } else {
            whole - part(i128::from(self.tail), self.left(braking - ramp))
        };
        // No `clamp` and no divisor that may be zero: a controller does not need the code of their panics.
        steady.min(whole).max(0)
    }

    /// e^(−t/θ), with [`POWER_BITS`] behind the point.
    fn left(&self, time: i128) -> u64 {
        if self.lag == 0 && time > 0 {
            return 0;
        }
        power_of_half(self.rate.times(time, TIME_BITS, EXPONENT_BITS))
    }

    /// Ticks for a distance at constant speed, with [`TIME_BITS`] behind the point.
    fn time_over(&self, distance: i32) -> i128 {
        let digits = i128::from(self.speed.digits.max(1));
        let shifted = i128::from(distance) << self.speed.point;
        (shifted.div_euclid(digits) << TIME_BITS) + (shifted.rem_euclid(digits) << TIME_BITS) / digits
    }
}

/// A time times a share with [`POWER_BITS`] behind the point.
fn part(time: i128, share: u64) -> i128 {
    (time * i128::from(share)) >> POWER_BITS
}

/// Saturates at the ends of the range.
fn whole_units(length: i128) -> i32 {
    i32::try_from(length).unwrap_or(if length < 0 { i32::MIN } else { i32::MAX })
}

/// A time with [`TIME_BITS`] behind the point, rounded to whole ticks; saturates at the ends of the range.
fn whole_ticks(time: i128) -> i64 {
    let nearest = (time + (1 << (TIME_BITS - 1))) >> TIME_BITS;
    i64::try_from(nearest).unwrap_or(if nearest < 0 { i64::MIN } else { i64::MAX })
}
