//! A moving maximum in constant memory.

use super::wheels::larger;

/// The maximum over the current and the previous half of a moving window.
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

    /// The least time for which a value counts (s).
    pub(super) const fn half(&self) -> f64 {
        self.half
    }

    pub(super) const fn largest(&self) -> f64 {
        larger(self.now, self.before)
    }

    /// Adds the value of a period of `t` seconds. Returns the maximum.
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
