//! The largest value of the last moments, in fixed memory.

use super::wheels::larger;

/// The extreme of a number within the last moments, from two halves that take turns.
#[derive(Debug, Clone, Copy)]
pub(super) struct Recent {
    now: f64,
    before: f64,
    age: f64,
    half: f64,
}

impl Recent {
    pub(super) const fn new(value: f64, half: f64) -> Self {
        Self { now: value, before: value, age: 0.0, half }
    }

    /// For how long a value counts at least (s).
    pub(super) const fn half(&self) -> f64 {
        self.half
    }

    pub(super) const fn largest(&self) -> f64 {
        larger(self.now, self.before)
    }

    /// Takes in a value, larger ones count.
    pub(super) fn push(&mut self, value: f64, t: f64) -> f64 {
        self.age += t;
        if self.age > self.half {
            self.before = self.now;
            self.now = value;
            self.age = 0.0;
        } else {
            self.now = larger(self.now, value);
        }
        self.largest()
    }
}
