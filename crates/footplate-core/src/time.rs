//! Timestamps and time spans in integer nanoseconds.
//!
//! A test writes `Timestamp::ZERO` and never waits; only the app's runtime reads a clock. Sums saturate at the ends
//! of the range (292 years): no input can overflow them.

use core::ops::{Add, AddAssign, Neg, Sub, SubAssign};

const NS_PER_S: f64 = 1e9;
const NS_PER_MS: i64 = 1_000_000;
const NS_PER_US: i64 = 1_000;

/// A point in time on the host's clock, in nanoseconds since an origin that each recording chooses.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(transparent))]
pub struct Timestamp(i64);

/// A signed span of time in nanoseconds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(transparent))]
pub struct TimeSpan(i64);

impl Timestamp {
    /// The origin.
    pub const ZERO: Self = Self(0);

    /// From whole nanoseconds since the origin.
    #[inline]
    pub const fn from_ns(ns: i64) -> Self {
        Self(ns)
    }

    /// Whole nanoseconds since the origin.
    #[inline]
    #[must_use]
    pub const fn as_ns(self) -> i64 {
        self.0
    }

    /// From seconds since the origin, to the nearest nanosecond.
    #[inline]
    pub const fn from_s(seconds: f64) -> Self {
        Self(TimeSpan::from_s(seconds).0)
    }

    /// Seconds since the origin. Differences of near times are exact only as `a - b`.
    #[inline]
    #[must_use]
    pub const fn as_s(self) -> f64 {
        self.0 as f64 / NS_PER_S
    }
}

impl TimeSpan {
    /// A span of zero.
    pub const ZERO: Self = Self(0);

    /// From whole nanoseconds.
    #[inline]
    pub const fn from_ns(ns: i64) -> Self {
        Self(ns)
    }

    /// Whole nanoseconds.
    #[inline]
    #[must_use]
    pub const fn as_ns(self) -> i64 {
        self.0
    }

    /// From whole microseconds.
    #[inline]
    pub const fn from_us(us: i64) -> Self {
        Self(us.saturating_mul(NS_PER_US))
    }

    /// From whole milliseconds.
    #[inline]
    pub const fn from_ms(ms: i64) -> Self {
        Self(ms.saturating_mul(NS_PER_MS))
    }

    /// From seconds, to the nearest nanosecond; NaN becomes zero, infinities saturate.
    #[inline]
    pub const fn from_s(seconds: f64) -> Self {
        let ns = seconds * NS_PER_S;
        Self((ns + if ns < 0.0 { -0.5 } else { 0.5 }) as i64)
    }

    /// Seconds.
    #[inline]
    #[must_use]
    pub const fn as_s(self) -> f64 {
        self.0 as f64 / NS_PER_S
    }

    /// Milliseconds.
    #[inline]
    #[must_use]
    pub const fn as_ms(self) -> f64 {
        self.0 as f64 / NS_PER_MS as f64
    }

    /// The absolute value.
    #[inline]
    #[must_use]
    pub const fn abs(self) -> Self {
        Self(self.0.saturating_abs())
    }
}

impl Sub for Timestamp {
    type Output = TimeSpan;
    #[inline]
    fn sub(self, earlier: Self) -> TimeSpan {
        TimeSpan(self.0.saturating_sub(earlier.0))
    }
}
impl Add<TimeSpan> for Timestamp {
    type Output = Self;
    #[inline]
    fn add(self, span: TimeSpan) -> Self {
        Self(self.0.saturating_add(span.0))
    }
}
impl Sub<TimeSpan> for Timestamp {
    type Output = Self;
    #[inline]
    fn sub(self, span: TimeSpan) -> Self {
        Self(self.0.saturating_sub(span.0))
    }
}
impl AddAssign<TimeSpan> for Timestamp {
    #[inline]
    fn add_assign(&mut self, span: TimeSpan) {
        *self = *self + span;
    }
}
impl Add for TimeSpan {
    type Output = Self;
    #[inline]
    fn add(self, other: Self) -> Self {
        Self(self.0.saturating_add(other.0))
    }
}
impl Sub for TimeSpan {
    type Output = Self;
    #[inline]
    fn sub(self, other: Self) -> Self {
        Self(self.0.saturating_sub(other.0))
    }
}
impl AddAssign for TimeSpan {
    #[inline]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}
impl SubAssign for TimeSpan {
    #[inline]
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}
impl Neg for TimeSpan {
    type Output = Self;
    #[inline]
    fn neg(self) -> Self {
        Self(self.0.saturating_neg())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seconds_round_to_the_nearest_nanosecond() {
        assert_eq!(TimeSpan::from_s(1.914_390), TimeSpan::from_ns(1_914_390_000));
        assert_eq!(TimeSpan::from_s(-0.3), TimeSpan::from_ms(-300));
    }

    #[test]
    fn extremes_saturate_instead_of_overflowing() {
        let end = Timestamp::from_ns(i64::MAX);
        assert_eq!(end + TimeSpan::from_ns(1), end);
        assert_eq!(TimeSpan::from_s(f64::NAN), TimeSpan::ZERO);
        assert_eq!(TimeSpan::from_s(f64::INFINITY).as_ns(), i64::MAX);
        assert_eq!((Timestamp::from_ns(i64::MIN) - end).as_ns(), i64::MIN);
    }
}
