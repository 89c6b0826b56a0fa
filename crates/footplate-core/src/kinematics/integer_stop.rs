//! A stop from a steady speed in whole numbers, for controllers without floating point.
//!
//! Lengths are whole tenths of a millimetre, times whole ticks of any length. The constants are made of a [`StoppingLaw`] once,
//! with floating point, on a computer or at start; everything asked of them later takes integers alone. Letters: `v` speed,
//! `τ` delay, `a` deceleration, `θ` time constant, `t` ticks since braking began.
//!
//! ```text
//! steady           x = v t
//! constant         x = v t − a t²/2
//! exponential      x = v θ (1 − 2^(−t log₂e/θ))
//! ```
//!
//! Constants are binary fractions of 64 bits, products have 128. Against the laws in floating point, no answer is off by more
//! than one unit.

use super::stopping_distance::FromCommand;
use super::stopping_law::{Braking, StoppingLaw};
use crate::time::TimeSpan;
use crate::units::{Length, Speed};

/// One metre in units of length.
const UNITS_PER_M: f64 = 1e4;
/// Binary digits behind the point of speed (units a tick), deceleration (units a tick squared) and the rate of an exponential
/// (powers of two a tick), lengths (units) and times (ticks).
const SPEED_BITS: u32 = 48;
const RATE_BITS: u32 = 56;
const LENGTH_BITS: u32 = 24;
const TIME_BITS: u32 = 20;
/// Constants stay below this, so that no product of them needs more than 128 bits.
const MOST: f64 = 9.0e18;
/// Distances stay below this many units (107 km).
const FARTHEST: f64 = 1_073_741_824.0;
/// Times of a stop stay below this many ticks (12 days of microseconds); four times as long after it every train rests.
const LONGEST: f64 = 1_099_511_627_776.0;
const AT_REST: i128 = 1 << (42 + TIME_BITS);

/// 2^(−2^−k) for k = 1 to 32, in units of 2^−62.
const ROOTS_OF_HALF: [u64; 32] = [
    3_260_954_456_333_195_553,
    3_877_950_241_171_266_237,
    4_228_934_724_888_366_668,
    4_416_165_660_797_809_419,
    4_512_867_096_753_504_463,
    4_562_008_997_483_360_349,
    4_586_780_255_215_411_731,
    4_599_216_278_082_138_665,
    4_605_446_927_862_164_404,
    4_608_565_417_332_308_035,
    4_610_125_453_837_388_245,
    4_610_905_670_110_601_999,
    4_611_295_827_762_151_833,
    4_611_490_918_967_884_501,
    4_611_588_467_665_893_036,
    4_611_637_242_788_701_951,
    4_611_661_630_543_559_956,
    4_611_673_824_469_352_645,
    4_611_679_921_444_339_948,
    4_611_682_969_934_856_344,
    4_611_684_494_180_870_228,
    4_611_685_256_304_066_092,
    4_611_685_637_365_711_255,
    4_611_685_827_896_545_643,
    4_611_685_923_161_965_790,
    4_611_685_970_794_676_601,
    4_611_685_994_611_032_191,
    4_611_686_006_519_210_032,
    4_611_686_012_473_298_964,
    4_611_686_015_450_343_433,
    4_611_686_016_938_865_668,
    4_611_686_017_683_126_786,
];
const ROOT_BITS: u32 = 62;

/// A train that runs steadily at one speed, and its stop, in tenths of a millimetre and ticks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct IntegerStop {
    /// Units a tick, with [`SPEED_BITS`] behind the point.
    speed: i64,
    /// From the command to braking and to rest, in ticks with [`TIME_BITS`] behind the point.
    delay: i64,
    time: i64,
    /// From the command to rest, in units with [`LENGTH_BITS`] behind the point.
    distance: i64,
    braking: IntegerBraking,
}

/// How speed goes to zero once braking has begun.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum IntegerBraking {
    /// Deceleration in units a tick squared, with [`RATE_BITS`] behind the point.
    Constant(i64),
    /// Powers of two a tick, with [`RATE_BITS`] behind the point.
    Exponential(i64),
}

/// Why a law has no form in whole numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum IntegerStopError {
    /// A tick takes some time.
    Tick {
        /// What was given.
        found: TimeSpan,
    },
    /// The train does not run ahead, or runs too fast for a tick.
    Speed {
        /// What was given.
        found: Speed,
    },
    /// The stop is too long or too sudden for whole numbers of this size.
    Stop {
        /// How far it would take.
        distance: Length,
        /// How long it would take.
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
                "speed should be above zero and below 3 m a tick, not {} mm/s: choose a shorter tick",
                found.as_mm_per_s()
            ),
            Self::Stop { distance, time } => write!(
                f,
                "a stop of {} m in {} s has no form in tenths of a millimetre and ticks: it should take less than 107 km and \
                 2^40 ticks, and longer than a tick",
                distance.as_m(),
                time.as_s()
            ),
        }
    }
}

impl core::error::Error for IntegerStopError {}

impl IntegerStop {
    /// One unit of length.
    pub const UNIT: Length = Length::from_mm(0.1);

    /// The constants of a train that runs at a speed and stops by a law, for ticks of this length. The only part that calculates
    /// with floating point.
    ///
    /// # Errors
    ///
    /// If the speed is not ahead, or speed or stop are beyond what the constants can hold.
    pub fn new(
        speed: Speed,
        law: &StoppingLaw<FromCommand>,
        tick: TimeSpan,
    ) -> Result<Self, IntegerStopError> {
        let tick_s = tick.as_s();
        if tick <= TimeSpan::ZERO {
            return Err(IntegerStopError::Tick { found: tick });
        }
        let units = speed.as_m_per_s() * UNITS_PER_M * tick_s;
        let whole_speed = fixed(units, SPEED_BITS)
            .filter(|whole| *whole > 0)
            .ok_or(IntegerStopError::Speed { found: speed })?;
        let (distance, time) = (law.distance(speed).length(), law.time(speed));
        let too_long = IntegerStopError::Stop { distance, time };
        let rate = match law.braking() {
            Braking::Constant(deceleration) => deceleration.as_m_per_s2() * UNITS_PER_M * tick_s * tick_s,
            Braking::Exponential(time_constant) => core::f64::consts::LOG2_E * tick_s / time_constant.as_s(),
        };
        let rate = fixed(rate, RATE_BITS).filter(|rate| *rate > 0).ok_or(too_long)?;
        let units = distance.as_m() * UNITS_PER_M;
        let whole = fixed(units, LENGTH_BITS).filter(|_| units < FARTHEST).ok_or(too_long)?;
        let ticks = |span: TimeSpan| fixed(span.as_s() / tick_s, TIME_BITS);
        let (Some(delay), Some(rests), true) =
            (ticks(law.delay()), ticks(time), time.as_s() < LONGEST * tick_s)
        else {
            return Err(too_long);
        };
        let braking = match law.braking() {
            Braking::Constant(_) => IntegerBraking::Constant(rate),
            Braking::Exponential(_) => IntegerBraking::Exponential(rate),
        };
        Ok(Self { speed: whole_speed, delay, time: rests, distance: whole, braking })
    }

    /// How far the train runs steadily in so many ticks.
    #[must_use]
    pub fn run(&self, ticks: i64) -> i32 {
        rounded(product(self.speed, ticks), SPEED_BITS)
    }

    /// In how many ticks the train, running steadily, is so far ahead; negative if it has passed there.
    #[must_use]
    pub fn ticks_to(&self, distance: i32) -> i64 {
        self.ticks_over(i128::from(distance) << LENGTH_BITS)
    }

    /// How far the train still runs if it is commanded to stop now.
    #[must_use]
    pub fn stopping_distance(&self) -> i32 {
        rounded(i128::from(self.distance), LENGTH_BITS)
    }

    /// In how many ticks it rests if it is commanded to stop now.
    #[must_use]
    pub const fn stopping_time(&self) -> i64 {
        (self.time + (1 << (TIME_BITS - 1))) >> TIME_BITS
    }

    /// In how many ticks to send the command to stop, so that the train rests so far ahead of where it is now; negative if it
    /// is late by as many.
    #[must_use]
    pub fn command_in(&self, distance: i32) -> i64 {
        self.ticks_over((i128::from(distance) << LENGTH_BITS) - i128::from(self.distance))
    }

    /// By how much the train runs beyond a place so far ahead if it is commanded to stop now; negative if it rests before it.
    #[must_use]
    pub fn overrun(&self, distance: i32) -> i32 {
        rounded(i128::from(self.distance) - (i128::from(distance) << LENGTH_BITS), LENGTH_BITS)
    }

    /// How far it has run so many ticks after the command to stop left.
    #[must_use]
    pub fn run_since_command(&self, ticks: i64) -> i32 {
        let since = i128::from(ticks) << TIME_BITS;
        let braking = (since - i128::from(self.delay)).min(AT_REST);
        if braking <= 0 {
            return self.run(ticks);
        }
        let before = product(self.speed, self.delay) >> TIME_BITS;
        let whole = (i128::from(self.distance) << (SPEED_BITS - LENGTH_BITS)) - before;
        let braked = match self.braking {
            IntegerBraking::Constant(_) if since >= i128::from(self.time) => whole,
            IntegerBraking::Constant(rate) => {
                let slower = (i128::from(rate) * braking) >> TIME_BITS;
                let lost = (slower * braking) >> (TIME_BITS + RATE_BITS - SPEED_BITS + 1);
                ((i128::from(self.speed) * braking) >> TIME_BITS) - lost
            }
            IntegerBraking::Exponential(rate) => {
                let left = power_of_half((i128::from(rate) * braking) >> TIME_BITS);
                whole - part_of(whole, left)
            }
        };
        rounded(before + braked, SPEED_BITS)
    }

    /// Ticks for a length with [`LENGTH_BITS`] behind the point.
    fn ticks_over(&self, length: i128) -> i64 {
        let speed = i128::from(self.speed.max(1));
        let numerator = length << (SPEED_BITS - LENGTH_BITS);
        let half = speed / 2;
        let away = if numerator < 0 { numerator - half } else { numerator + half };
        whole(away / speed)
    }
}

/// A constant with so many binary digits behind the point; `None` beyond 64 bits.
fn fixed(value: f64, bits: u32) -> Option<i64> {
    let scaled = libm::round(libm::ldexp(value, bits as i32));
    (scaled.abs() < MOST).then_some(scaled as i64)
}

fn product(one: i64, other: i64) -> i128 {
    i128::from(one) * i128::from(other)
}

/// A length of up to 80 bits times a part of one with [`ROOT_BITS`]: the upper and the lower half apart.
fn part_of(length: i128, part: u64) -> i128 {
    const HALF: u32 = 40;
    let (upper, lower) = (length >> HALF, length & ((1 << HALF) - 1));
    let part = i128::from(part);
    ((upper * part) >> (ROOT_BITS - HALF)) + ((lower * part) >> ROOT_BITS)
}

/// 2^−x for x of [`RATE_BITS`] behind the point, in units of 2^−62: a root of one half for each binary digit that is set.
fn power_of_half(x: i128) -> u64 {
    let halvings = x >> RATE_BITS;
    if halvings >= i128::from(ROOT_BITS) {
        return 0;
    }
    let mut power = 1_u64 << ROOT_BITS;
    for (digit, root) in (1..).zip(ROOTS_OF_HALF) {
        if (x >> (RATE_BITS - digit)) & 1 == 1 {
            power = ((u128::from(power) * u128::from(root)) >> ROOT_BITS) as u64;
        }
    }
    power >> halvings
}

/// A length in whole units, to the nearest; at the ends of its range beyond them.
fn rounded(length: i128, bits: u32) -> i32 {
    let nearest = (length + (1 << (bits - 1))) >> bits;
    i32::try_from(nearest).unwrap_or(if nearest < 0 { i32::MIN } else { i32::MAX })
}

/// Ticks; at the ends of their range beyond them.
fn whole(ticks: i128) -> i64 {
    i64::try_from(ticks).unwrap_or(if ticks < 0 { i64::MIN } else { i64::MAX })
}
