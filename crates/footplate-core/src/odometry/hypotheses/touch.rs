//! Detects a slipping wheel that has reached the speed of the train.
//!
//! The rail accelerates a wheel whose brake is released by 10 m/s² and more. If the wheel then keeps its speed, it turns with the
//! train. If the brake grips first, the wheel decelerates again at once.

/// A wheel that returns to the train accelerates by more than this (m/s²), relative to the train.
const TURNED_UP: f64 = 4.0;
/// It keeps its speed while its relative acceleration is smaller (m/s²): the noise of counts.
const LEVEL: f64 = 1.5;
/// It has to keep it for so long (s): the time constant of its tracker.
const LEVEL_FOR_S: f64 = 0.25;
/// Time constant of the speed (s).
const LOOKS_BACK_S: f64 = 0.1;
/// The wheel has to keep its speed within this time after it was accelerated (s).
const COUNTS_FOR_S: f64 = 1.0;
/// A wheel is turned up alone if the other accelerates by less than this meanwhile (m/s²), relative to the train. A converter that
/// feeds both turns up both at once, and to any creepage.
const OTHER_STAYS: f64 = 1.0;

/// One wheel.
#[derive(Debug, Clone, Copy)]
pub(super) struct Touch {
    /// Speed from the last counts (m/s). It never exceeds that of an accelerating wheel.
    speed: f64,
    since_turned_up: f64,
    level_for: f64,
    /// It was turned up while the other wheel was not.
    pub(super) alone: bool,
}

impl Touch {
    pub(super) const fn new() -> Self {
        Self { speed: 0.0, since_turned_up: f64::INFINITY, level_for: 0.0, alone: false }
    }

    /// Takes in the count of `t` seconds. Returns its speed if it turns with a train of acceleration `a`.
    pub(super) fn follow(&mut self, counted: f64, a: f64, t: f64) -> f64 {
        self.speed += (counted - self.speed) * (t / (LOOKS_BACK_S + t));
        self.speed + a * LOOKS_BACK_S
    }

    /// Whether it has just reached the train. `beyond` is its relative acceleration towards the train (m/s²), `other` that of the
    /// other wheel.
    pub(super) fn reached(&mut self, beyond: f64, other: f64, t: f64) -> bool {
        self.since_turned_up = if beyond > TURNED_UP {
            self.alone = other < OTHER_STAYS || self.alone && self.since_turned_up <= 0.0;
            0.0
        } else if beyond < -TURNED_UP {
            // The brake has gripped.
            f64::INFINITY
        } else {
            self.since_turned_up + t
        };
        self.level_for = if beyond.abs() < LEVEL { self.level_for + t } else { 0.0 };
        let reached = self.level_for >= LEVEL_FOR_S && self.since_turned_up < COUNTS_FOR_S;
        if reached {
            // Once for each acceleration.
            self.since_turned_up = f64::INFINITY;
        }
        reached
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn touches(accelerations: &[f64]) -> usize {
        let mut touch = Touch::new();
        accelerations.iter().filter(|beyond| touch.reached(**beyond, 0.0, 0.05)).count()
    }

    #[test]
    fn turned_up_and_level_is_a_touch_and_turned_down_again_is_none() {
        let level = [[12.0; 6], [0.3; 6], [-0.2; 6]].concat();
        assert_eq!(touches(&level), 1);
        let caught = [[12.0; 6], [-9.0; 6], [0.0; 6]].concat();
        assert_eq!(touches(&caught), 0, "the brake took hold of it");
        let never_up = [[-9.0; 6], [0.0; 6], [0.0; 6]].concat();
        assert_eq!(touches(&never_up), 0);
    }
}
