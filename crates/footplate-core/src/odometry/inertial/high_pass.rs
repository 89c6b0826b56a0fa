//! What an accelerometer read before something took slow changes out of it.
//!
//! Phones and some sensors remove gravity with a high pass of the first order: the reading is `z = a − m` with
//! `m' = (a − m) / τ`, so a steady acceleration fades within τ. The same is undone by `a = z + ∫ z dt / τ`. What the filter
//! forgot for ever is the constant: the result drifts by as much as `z` is offset, over τ, and has to be set back at stops.

use crate::time::TimeSpan;
use crate::units::Acceleration;

/// Undoes a high pass of the first order. Fixed memory.
#[derive(Debug, Clone, PartialEq)]
pub struct HighPassRestorer {
    time_constant: f64,
    forgotten: f64,
    latest: f64,
}

impl HighPassRestorer {
    /// Undoes a high pass with this time constant; one that is not above zero is taken for none at all.
    #[must_use]
    pub fn new(time_constant: TimeSpan) -> Self {
        Self { time_constant: time_constant.as_s(), forgotten: 0.0, latest: 0.0 }
    }

    /// The acceleration behind a reading, a span after the one before. What is no number is taken for the reading before.
    pub fn restore(&mut self, span: TimeSpan, reading: Acceleration) -> Acceleration {
        let z = reading.as_m_per_s2();
        let z = if z.is_finite() { z } else { self.latest };
        if self.time_constant > 0.0 {
            // The trapezium is exact for a line between two readings.
            self.forgotten += 0.5 * (z + self.latest) * span.as_s().max(0.0) / self.time_constant;
        }
        self.latest = z;
        Acceleration::from_m_per_s2(z + self.forgotten)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What a high pass of the first order makes of an acceleration, in steps so small that they do not matter.
    fn high_passed(
        acceleration: impl Fn(f64) -> f64,
        time_constant: f64,
        at: impl Iterator<Item = f64>,
    ) -> std::vec::Vec<f64> {
        let (mut mean, mut time) = (0.0, 0.0);
        let step = 1e-4;
        at.map(|until| {
            while time < until {
                mean += (acceleration(time) - mean) * step / time_constant;
                time += step;
            }
            acceleration(until) - mean
        })
        .collect()
    }

    #[test]
    fn what_a_high_pass_removed_comes_back() {
        // Pulls, coasts, brakes, stands.
        let acceleration = |t: f64| match t {
            t if t < 2.0 => 0.0,
            t if t < 20.0 => 0.9,
            t if t < 35.0 => -0.1,
            t if t < 50.0 => -1.0,
            _ => 0.0,
        };
        let times = || (1..3000).map(|n| f64::from(n) * 0.02);
        let readings = high_passed(acceleration, 7.0, times());
        let mut restorer = HighPassRestorer::new(TimeSpan::from_s(7.0));
        for (time, reading) in times().zip(readings) {
            let restored = restorer.restore(TimeSpan::from_ms(20), Acceleration::from_m_per_s2(reading));
            // A jump between two readings is a line to the trapezium: half a reading's step over τ.
            let error = restored.as_m_per_s2() - acceleration(time);
            assert!(error.abs() < 0.01, "{error} at {time}");
        }
    }

    #[test]
    fn without_a_time_constant_nothing_changes() {
        let mut restorer = HighPassRestorer::new(TimeSpan::ZERO);
        for reading in [0.5, -0.25, 0.5] {
            let reading = Acceleration::from_m_per_s2(reading);
            assert_eq!(restorer.restore(TimeSpan::from_ms(20), reading), reading);
        }
    }
}
