//! Everything between two numbers, both included.

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
    #[must_use]
    pub const fn exactly(value: f64) -> Self {
        Self { low: value, high: value }
    }

    /// A number known to within a part of it, either way.
    #[must_use]
    pub const fn around(value: f64, part: f64) -> Self {
        Self { low: value * (1.0 - part), high: value * (1.0 + part) }
    }

    /// What lies in both.
    #[must_use]
    pub const fn and(self, other: Self) -> Self {
        Self { low: self.low.max(other.low), high: self.high.min(other.high) }
    }

    /// The shortest that holds both.
    #[must_use]
    pub const fn or(self, other: Self) -> Self {
        Self { low: self.low.min(other.low), high: self.high.max(other.high) }
    }

    /// How far apart the ends are; negative if it is empty.
    #[must_use]
    pub const fn width(self) -> f64 {
        self.high - self.low
    }

    /// Whether nothing lies in it.
    #[must_use]
    pub fn is_empty(self) -> bool {
        self.low > self.high
    }

    /// The nearest number that lies in it.
    #[must_use]
    pub const fn nearest(self, value: f64) -> f64 {
        value.min(self.high).max(self.low)
    }

    /// Seen in the opposite direction.
    #[must_use]
    pub const fn reversed(self) -> Self {
        Self { low: -self.high, high: -self.low }
    }
}
