//! Whether a wheel that slipped has been turned to the speed of the train.
//!
//! A wheel whose brake is let go is turned up by the rail at 10 m/s² and more. If it goes on level afterwards, it turns
//! with the train; if the brake takes hold of it before, it turns down again at once and is level for no time.

/// A wheel that is turned up accelerates by more than this (m/s²), beyond what the train does.
const TURNED_UP: f64 = 4.0;
/// It is level while it differs from the train by less (m/s²): noise of an acceleration by counts.
const LEVEL: f64 = 1.5;
/// For so long (s), which is as long as a followed speed looks back.
const LEVEL_FOR_S: f64 = 0.25;
/// How far its speed looks back (s).
const LOOKS_BACK_S: f64 = 0.1;
/// How long having been turned up counts (s).
const COUNTS_FOR_S: f64 = 1.0;

/// Follows one wheel.
#[derive(Debug, Clone, Copy)]
pub(super) struct Touch {
    /// Speed by the last counts (m/s), which never runs ahead of a wheel that is turned up.
    speed: f64,
    since_turned_up: f64,
    level_for: f64,
}

impl Touch {
    pub(super) const fn new() -> Self {
        Self { speed: 0.0, since_turned_up: f64::INFINITY, level_for: 0.0 }
    }

    /// Its speed by the count of `t` seconds, as a wheel that goes with a train of acceleration `a`.
    pub(super) fn follow(&mut self, counted: f64, a: f64, t: f64) -> f64 {
        self.speed += (counted - self.speed) * (t / (LOOKS_BACK_S + t));
        self.speed + a * LOOKS_BACK_S
    }

    /// Whether it has just reached the train: `beyond` is its acceleration less the train's, towards the train (m/s²).
    pub(super) fn reached(&mut self, beyond: f64, t: f64) -> bool {
        self.since_turned_up = if beyond > TURNED_UP {
            0.0
        } else if beyond < -TURNED_UP {
            // The brake has taken hold of it.
            f64::INFINITY
        } else {
            self.since_turned_up + t
        };
        self.level_for = if beyond.abs() < LEVEL { self.level_for + t } else { 0.0 };
        let reached = self.level_for >= LEVEL_FOR_S && self.since_turned_up < COUNTS_FOR_S;
        if reached {
            // Once for each time it is turned up.
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
        accelerations.iter().filter(|beyond| touch.reached(**beyond, 0.05)).count()
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
