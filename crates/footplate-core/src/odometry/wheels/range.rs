//! Everything between two numbers, both included.

/// The larger of two numbers; the second if one is no number. One instruction, where [`f64::max`] takes six to return
/// the one that is a number: nothing that is none gets as far as the filters, and a period asks this fifty times.
#[inline]
#[must_use]
pub const fn larger(one: f64, other: f64) -> f64 {
    if one > other { one } else { other }
}

/// The smaller of two numbers; the second if one is no number.
#[inline]
#[must_use]
pub const fn smaller(one: f64, other: f64) -> f64 {
    if one < other { one } else { other }
}

/// A closed interval; empty if `low` exceeds `high`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Range {
    /// The least it can be.
    pub low: f64,
    /// The most it can be.
    pub high: f64,
}

impl Range {
    /// Nothing is known.
    pub const ANY: Self = Self { low: f64::NEG_INFINITY, high: f64::INFINITY };

    /// One number.
    #[inline]
    #[must_use]
    pub const fn exactly(value: f64) -> Self {
        Self { low: value, high: value }
    }

    /// A number with a relative tolerance.
    #[inline]
    #[must_use]
    pub const fn around(value: f64, part: f64) -> Self {
        Self { low: value * (1.0 - part), high: value * (1.0 + part) }
    }

    /// What lies in both.
    #[inline]
    #[must_use]
    pub const fn and(self, other: Self) -> Self {
        Self { low: larger(self.low, other.low), high: smaller(self.high, other.high) }
    }

    /// The shortest range that contains both.
    #[inline]
    #[must_use]
    pub const fn or(self, other: Self) -> Self {
        Self { low: smaller(self.low, other.low), high: larger(self.high, other.high) }
    }

    /// How far apart the ends are; negative if it is empty.
    #[inline]
    #[must_use]
    pub const fn width(self) -> f64 {
        self.high - self.low
    }

    /// Whether nothing lies in it.
    #[inline]
    #[must_use]
    pub fn is_empty(self) -> bool {
        self.low > self.high
    }

    /// The nearest number that lies in it.
    #[inline]
    #[must_use]
    pub const fn nearest(self, value: f64) -> f64 {
        larger(smaller(value, self.high), self.low)
    }

    /// Seen in the opposite direction.
    #[inline]
    #[must_use]
    pub const fn reversed(self) -> Self {
        Self { low: -self.high, high: -self.low }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_range_of_one_number_is_not_empty_and_one_with_its_ends_swapped_is() {
        assert!(!Range { low: 1.5, high: 1.5 }.is_empty());
        assert!(Range { low: 1.5, high: 1.4 }.is_empty());
    }
}
