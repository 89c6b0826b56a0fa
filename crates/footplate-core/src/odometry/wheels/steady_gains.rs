//! The gains to which a Kalman filter of place, speed and acceleration settles.

#![expect(clippy::indexing_slicing, reason = "3 x 3 matrices, indexed below 3")]

/// Gains of the innovation of a place measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct SteadyGains {
    /// Of the place.
    pub(super) place: f64,
    /// Of the speed (1/s).
    pub(super) speed: f64,
    /// Of the acceleration (1/s²).
    pub(super) acceleration: f64,
    /// Standard deviation of the acceleration after an innovation (m/s²).
    pub(super) acceleration_deviation: f64,
    /// The same of the speed (m/s).
    pub(super) speed_deviation: f64,
}

/// More rounds than any period and pitch in use need to settle.
const ROUNDS: usize = 400;
/// Start: nothing is known (m², m²/s², m²/s⁴).
const UNKNOWN: [f64; 3] = [1.0, 100.0, 100.0];

/// Gains for a white jerk of spectral density `q` (m²/s⁵), a place measured every `period` seconds with variance `r`
/// (m²): the fixed point of the Riccati recursion.
pub(super) fn steady_gains(period: f64, q: f64, r: f64) -> SteadyGains {
    let t = period;
    let noise = [
        [q * t * t * t * t * t / 20.0, q * t * t * t * t / 8.0, q * t * t * t / 6.0],
        [q * t * t * t * t / 8.0, q * t * t * t / 3.0, q * t * t / 2.0],
        [q * t * t * t / 6.0, q * t * t / 2.0, q * t],
    ];
    let f = [[1.0, t, 0.5 * t * t], [0.0, 1.0, t], [0.0, 0.0, 1.0]];
    let mut p = [[0.0; 3]; 3];
    for (i, variance) in UNKNOWN.into_iter().enumerate() {
        p[i][i] = variance;
    }
    let mut gain = [0.0; 3];
    for _ in 0..ROUNDS {
        let fp: [[f64; 3]; 3] =
            core::array::from_fn(|i| core::array::from_fn(|j| (0..3).map(|k| f[i][k] * p[k][j]).sum()));
        p = core::array::from_fn(|i| {
            core::array::from_fn(|j| (0..3).map(|k| fp[i][k] * f[j][k]).sum::<f64>() + noise[i][j])
        });
        let s = p[0][0] + r;
        gain = core::array::from_fn(|i| p[i][0] / s);
        let row = p[0];
        p = core::array::from_fn(|i| core::array::from_fn(|j| p[i][j] - gain[i] * row[j]));
    }
    let [place, speed, acceleration] = gain;
    SteadyGains {
        place,
        speed,
        acceleration,
        acceleration_deviation: libm::sqrt(p[2][2]),
        speed_deviation: libm::sqrt(p[1][1]),
    }
}
