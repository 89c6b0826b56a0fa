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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_counts_for_as_long_as_asked_and_no_more_than_twice_that() {
        // Whenever within the window of 1 s a peak comes, it counts for 1 to 2 s and the period in which it is dropped.
        for quiet in 0..9 {
            let mut recent = Recent::new(0.0, 1.0);
            (0..quiet).for_each(|_| assert_eq!(recent.push(1.0, 0.25), 1.0));
            assert_eq!(recent.push(5.0, 0.25), 5.0);
            let counts = (1..40).find(|_| recent.push(1.0, 0.25) < 5.0).map(|n| 0.25 * f64::from(n));
            assert!(counts.is_some_and(|counts| (1.0..=2.5).contains(&counts)), "after {quiet}: {counts:?}");
            assert_eq!((recent.largest(), recent.half()), (1.0, 1.0));
        }
        // What it begins with is forgotten likewise.
        let mut recent = Recent::new(9.0, 0.5);
        assert_eq!(recent.push(1.0, 0.25), 9.0);
        assert!((0..8).any(|_| recent.push(1.0, 0.25) < 9.0));
    }
}
