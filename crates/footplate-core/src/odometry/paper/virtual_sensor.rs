//! The virtual sensor of the published algorithm: the speed while both wheelsets slip or slide.
//!
//! Letters: `v` corrected speed, `a` how fast it falls, `u` speeds of the wheels. In a slide `v ← max(v + aT, u₁, u₂)`: a
//! lower envelope that the wheels push up whenever they touch the speed of the train; with both locked a smaller `a`. In
//! a spin the mirror image.

use crate::odometry::wheels::{Loss, Thresholds};

/// Follows one slide or spin.
#[derive(Debug, Clone)]
pub(super) struct VirtualSensor {
    kind: Loss,
    speed: f64,
    elapsed: f64,
    thresholds: Thresholds,
    max_traction: f64,
}

impl VirtualSensor {
    /// A slide or spin that begins at `speed` (m/s); a spin rises by at most `max_traction` (m/s²).
    pub(super) fn new(kind: Loss, speed: f64, max_traction: f64, thresholds: Thresholds) -> Self {
        Self { kind, speed, elapsed: 0.0, thresholds, max_traction }
    }

    /// Time since another source measured the speed (s).
    pub(super) fn elapsed(&self) -> f64 {
        self.elapsed
    }

    /// Goes on for `t` seconds in which the wheels that are read turn so (m/s); `locked` if none turns.
    pub(super) fn next(&mut self, wheels: [Option<f64>; 2], locked: bool, t: f64) -> f64 {
        self.elapsed += t;
        let Thresholds { correction, lock_correction, .. } = self.thresholds;
        let wheels = wheels.into_iter().flatten();
        self.speed = match self.kind {
            Loss::Slide => {
                let falls = if locked { lock_correction } else { correction }.as_m_per_s2();
                wheels.fold((self.speed - falls * t).max(0.0), f64::max)
            }
            Loss::Spin => wheels.fold(self.speed + self.max_traction * t, f64::min).max(0.0),
        };
        self.speed
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::Acceleration;

    fn sensor(kind: Loss) -> VirtualSensor {
        let thresholds =
            Thresholds::derived(Acceleration::from_m_per_s2(1.2), Acceleration::from_m_per_s2(1.4));
        VirtualSensor::new(kind, 20.0, 1.0, thresholds)
    }

    #[test]
    fn it_falls_steadily_and_a_wheel_that_touches_it_pushes_it_up() {
        let mut slide = sensor(Loss::Slide);
        for _ in 0..20 {
            slide.next([Some(12.0), None], false, 0.05);
        }
        assert!((slide.next([Some(12.0), Some(14.0)], false, 0.05) - (20.0 - 0.6 * 1.05)).abs() < 1e-9);
        assert_eq!(slide.next([Some(19.8), Some(14.0)], false, 0.05), 19.8);
        assert!((slide.next([Some(0.0); 2], true, 1.0) - 19.5).abs() < 1e-9, "more gently when locked");
    }

    #[test]
    fn a_spin_is_the_mirror_image() {
        let mut spin = sensor(Loss::Spin);
        assert!((spin.next([Some(29.0), Some(25.0)], false, 0.5) - 20.5).abs() < 1e-9);
        assert_eq!(spin.next([Some(19.0), Some(25.0)], false, 0.5), 19.0);
    }
}
