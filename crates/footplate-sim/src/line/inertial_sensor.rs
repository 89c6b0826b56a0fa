//! An inertial sensor along the track, with all that it confuses with acceleration.

use super::resistance::GRAVITY;
use crate::draws::Draws;

/// White noise at 50 readings a second (m/s²): drawn from these.
const WHITE_M_PER_S2: (f64, f64) = (0.02, 0.05);
const WHITE_AT_HZ: f64 = 50.0;
/// Bias when it is switched on, and what its random walk adds over the time it takes to become another.
const BIAS_M_PER_S2: f64 = 0.02;
const WALK_M_PER_S2: f64 = 0.02;
const WALK_S: f64 = 900.0;
/// Vibration that is left after its filter, at this speed (m/s², m/s); it grows in proportion.
const VIBRATION_M_PER_S2: f64 = 0.15;
const VIBRATION_AT_M_PER_S: f64 = 50.0;
/// How far it is turned against the track (rad, one standard deviation of pitch): one degree.
const MISALIGNED: f64 = core::f64::consts::PI / 180.0;

/// One sensor on one run.
#[derive(Debug, Clone)]
pub(crate) struct InertialSensor {
    white: f64,
    bias: f64,
    pitch: f64,
    draws: Draws,
}

impl InertialSensor {
    pub(crate) fn draw(draws: &mut Draws) -> Self {
        let mut draws = draws.split();
        Self {
            white: draws.uniform(WHITE_M_PER_S2.0..WHITE_M_PER_S2.1),
            bias: draws.normal_within(0.0, BIAS_M_PER_S2, 2.5),
            pitch: draws.normal_within(0.0, MISALIGNED, 2.5),
            draws,
        }
    }

    /// The mean over a period (s) in which the train gained `acceleration` (m/s²) at a speed (m/s) on a gradient.
    pub(crate) fn read(&mut self, period: f64, acceleration: f64, speed: f64, gradient: f64) -> f64 {
        self.bias += self.draws.normal(0.0, WALK_M_PER_S2 * libm::sqrt(period / WALK_S));
        let readings = libm::sqrt(period * WHITE_AT_HZ);
        let shaken = VIBRATION_M_PER_S2 * speed.abs() / VIBRATION_AT_M_PER_S;
        let noise = self.draws.normal(0.0, libm::sqrt(self.white * self.white + shaken * shaken) / readings);
        acceleration * libm::cos(self.pitch)
            + GRAVITY * (gradient + libm::sin(self.pitch))
            + self.bias
            + noise
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::draws::Purpose;

    #[test]
    fn a_gradient_reads_like_acceleration() {
        let mut draws = Draws::new(1, Purpose::Line);
        let (mut level, mut slope) = (0.0, 0.0);
        let mut sensor = InertialSensor::draw(&mut draws);
        let mut twin = sensor.clone();
        for _ in 0..2000 {
            level += sensor.read(0.05, 0.0, 0.0, 0.0) / 2000.0;
            slope += twin.read(0.05, 0.0, 0.0, 0.01) / 2000.0;
        }
        assert!((slope - level - 0.0980665).abs() < 1e-9, "0.1 m/s² for 10 mm/m");
    }
}
