//! Speed from an accelerometer, with what it reads too much learnt from the wheels and from standing still.
//!
//! Letters: `x` = (`v` speed, `b` bias, `l` leak of gravity on gradients), `p` its covariance, `z` what the accelerometer
//! reads = acceleration + `b` + `l` + noise, `h` which states a measurement sees, `y` innovation, `r` the measurement's variance,
//! `s` the innovation's, `g` gain, `t` the time of one reading.
//!
//! The bias is a random walk over time; the leak decays over distance, because gradients belong to the line, and stays
//! constant at standstill. Wheels that roll measure the sum; over distance the two separate, because only the bias
//! persists.

#![expect(clippy::indexing_slicing, reason = "3 × 3 matrices with constant bounds")]

use libm::sqrt;

use crate::time::TimeSpan;
use crate::units::{Acceleration, Length, Speed};

/// While nothing is read the train may do this (m/s², one standard deviation). Chosen: hard service braking.
const UNREAD_M_PER_S2: f64 = 1.0;
const MINUTE_S: f64 = 60.0;
/// A standing train moves by no more than this (m/s, one standard deviation). Chosen: sway of a body on its springs.
const STANDING_M_PER_S: f64 = 0.01;

/// How much an accelerometer reads wrongly. Standard deviations.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InertialNoise {
    /// Of one reading, vibration of the car included.
    pub reading: Acceleration,
    /// Of the bias when nothing was learnt, gravity on a sensor that is not level included.
    pub bias: Acceleration,
    /// Of what the bias wanders in a minute.
    pub bias_in_a_minute: Acceleration,
    /// Of what gravity adds on gradients: 0.1 m/s² for each 10 mm/m.
    pub leak: Acceleration,
    /// Correlation length of gradients along the line.
    pub leak_lasts: Length,
}

impl Default for InertialNoise {
    /// An industrial sensor in a fast train on a main line: 0.1 m/s² a reading, most of it vibration; a bias of 0.2 m/s², most
    /// of it one degree of misalignment; 0.005 m/s² a minute; gradients of 10 mm/m that last 500 m.
    fn default() -> Self {
        Self {
            reading: Acceleration::from_m_per_s2(0.1),
            bias: Acceleration::from_m_per_s2(0.2),
            bias_in_a_minute: Acceleration::from_m_per_s2(0.005),
            leak: Acceleration::from_m_per_s2(0.1),
            leak_lasts: Length::from_m(500.0),
        }
    }
}

/// How far a measured speed is from what the accelerometer predicted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpeedInnovation {
    /// Measured less predicted.
    pub value: Speed,
    /// Its standard deviation, if both are right.
    pub deviation: Speed,
}

impl SpeedInnovation {
    /// The innovation in standard deviations.
    #[must_use]
    pub fn standardised(&self) -> f64 {
        self.value / self.deviation
    }
}

/// Carries the speed from reading to reading.
#[derive(Debug, Clone, PartialEq)]
pub struct InertialFilter {
    noise: InertialNoise,
    x: [f64; 3],
    p: [[f64; 3]; 3],
    latest: f64,
}

impl InertialFilter {
    /// A standing train and a sensor of which nothing was learnt.
    #[must_use]
    pub fn new(noise: InertialNoise) -> Self {
        let variance = |deviation: f64| deviation * deviation;
        let mut p = [[0.0; 3]; 3];
        p[0][0] = variance(STANDING_M_PER_S);
        p[1][1] = variance(noise.bias.as_m_per_s2());
        p[2][2] = variance(noise.leak.as_m_per_s2());
        Self { noise, x: [0.0; 3], p, latest: 0.0 }
    }

    /// Begins anew from a speed that something else knows, as when it is switched on in a moving train. What was learnt of the
    /// sensor stays.
    pub fn begin(&mut self, speed: Speed, deviation: Speed) {
        let (speed, deviation) = (speed.as_m_per_s(), deviation.as_m_per_s());
        if speed.is_finite() && deviation.is_finite() {
            self.x[0] = speed;
            for other in 1..3 {
                self.p[0][other] = 0.0;
                self.p[other][0] = 0.0;
            }
            self.p[0][0] = deviation * deviation;
        }
    }

    /// Carries the speed over a span in which this was read in the mean; without a reading, or with one that is no number,
    /// the speed stays and becomes uncertain.
    pub fn predict(&mut self, span: TimeSpan, reading: Option<Acceleration>) {
        let t = span.as_s();
        if t <= 0.0 {
            return;
        }
        let [v, b, l] = self.x;
        let lasts = self.noise.leak_lasts.as_m();
        let forgets = 1.0 / (1.0 + v.abs() * t / lasts);
        let f = match reading.map(Acceleration::as_m_per_s2).filter(|z| z.is_finite()) {
            Some(z) => {
                self.latest = z;
                self.x = [v + (z - b - l) * t, b, l * forgets];
                [[1.0, -t, -t], [0.0, 1.0, 0.0], [0.0, 0.0, forgets]]
            }
            None => {
                self.latest = b + l;
                self.x[2] = l * forgets;
                self.p[0][0] += UNREAD_M_PER_S2 * t * (UNREAD_M_PER_S2 * t + 2.0 * sqrt(self.p[0][0]));
                [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, forgets]]
            }
        };
        let read = self.noise.reading.as_m_per_s2() * t;
        let walk = self.noise.bias_in_a_minute.as_m_per_s2();
        let leak = self.noise.leak.as_m_per_s2();
        let q = [read * read, walk * walk * t / MINUTE_S, leak * leak * (1.0 - forgets * forgets)];
        let fp = product(&f, &self.p);
        let mut p = [[0.0; 3]; 3];
        for row in 0..3 {
            for column in 0..=row {
                let mut sum = if row == column { q[row] } else { 0.0 };
                for inner in 0..3 {
                    sum += fp[row][inner] * f[column][inner];
                }
                p[row][column] = sum;
                p[column][row] = sum;
            }
        }
        self.p = p;
    }

    /// What wheels that may roll say, held against the accelerometer. Changes nothing.
    #[must_use]
    pub fn innovation(&self, wheels: Speed, deviation: Speed) -> SpeedInnovation {
        let r = deviation.as_m_per_s() * deviation.as_m_per_s();
        SpeedInnovation {
            value: wheels - Speed::from_m_per_s(self.x[0]),
            deviation: Speed::from_m_per_s(sqrt(self.p[0][0] + r)),
        }
    }

    /// Learns from wheels that roll for certain. What is no number teaches nothing.
    pub fn align(&mut self, wheels: Speed, deviation: Speed) {
        self.update([1.0, 0.0, 0.0], wheels.as_m_per_s(), deviation.as_m_per_s());
    }

    /// Learns from standing still: the speed is zero (zero-velocity update), and so is the acceleration, so that
    /// everything that was read last is bias and leak.
    pub fn stand(&mut self) {
        self.update([1.0, 0.0, 0.0], 0.0, STANDING_M_PER_S);
        self.update([0.0, 1.0, 1.0], self.latest, self.noise.reading.as_m_per_s2());
    }

    /// The speed.
    #[must_use]
    pub fn speed(&self) -> Speed {
        Speed::from_m_per_s(self.x[0])
    }

    /// Its standard deviation.
    #[must_use]
    pub fn speed_deviation(&self) -> Speed {
        Speed::from_m_per_s(sqrt(self.p[0][0]))
    }

    /// The acceleration: what was read last, without bias and leak.
    #[must_use]
    pub fn acceleration(&self) -> Acceleration {
        let [_, b, l] = self.x;
        Acceleration::from_m_per_s2(self.latest - b - l)
    }

    /// What is read too much, and its standard deviation.
    #[must_use]
    pub fn excess(&self) -> [Acceleration; 2] {
        let variance = self.p[1][1] + 2.0 * self.p[1][2] + self.p[2][2];
        [self.x[1] + self.x[2], sqrt(variance.max(0.0))].map(Acceleration::from_m_per_s2)
    }

    /// Joseph form: the covariance stays positive whatever the rounding (Bucy and Joseph, 1968).
    fn update(&mut self, h: [f64; 3], measured: f64, deviation: f64) {
        if !measured.is_finite() || !deviation.is_finite() {
            return;
        }
        let r = deviation * deviation;
        let ph: [f64; 3] = core::array::from_fn(|i| dot(&self.p[i], &h));
        let s = dot(&ph, &h) + r;
        if s <= 0.0 {
            return;
        }
        let g = ph.map(|ph| ph / s);
        let y = measured - dot(&self.x, &h);
        let a: [[f64; 3]; 3] = core::array::from_fn(|i| {
            core::array::from_fn(|j| if i == j { 1.0 - g[i] * h[j] } else { -g[i] * h[j] })
        });
        let ap = product(&a, &self.p);
        let mut p = [[0.0; 3]; 3];
        for row in 0..3 {
            self.x[row] += g[row] * y;
            for column in 0..=row {
                let value = dot(&ap[row], &a[column]) + r * g[row] * g[column];
                p[row][column] = value;
                p[column][row] = value;
            }
        }
        self.p = p;
    }
}

fn dot(x: &[f64; 3], y: &[f64; 3]) -> f64 {
    x[0] * y[0] + x[1] * y[1] + x[2] * y[2]
}

fn product(x: &[[f64; 3]; 3], y: &[[f64; 3]; 3]) -> [[f64; 3]; 3] {
    core::array::from_fn(|i| {
        core::array::from_fn(|j| x[i][0] * y[0][j] + x[i][1] * y[1][j] + x[i][2] * y[2][j])
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// At 10 m/s, known to 0.5 m/s, with a bias and a leak of which nothing was learnt.
    fn moving() -> InertialFilter {
        let mut filter = InertialFilter::new(InertialNoise::default());
        filter.begin(Speed::from_m_per_s(10.0), Speed::from_m_per_s(0.5));
        filter
    }

    fn assert_is(filter: &InertialFilter, x: [f64; 3], p: [[f64; 3]; 3]) {
        for (found, expected) in
            filter.x.iter().chain(filter.p.iter().flatten()).zip(x.iter().chain(p.iter().flatten()))
        {
            assert!((found - expected).abs() < 1e-12, "{found} {expected} {filter:?}");
        }
    }

    fn second() -> TimeSpan {
        TimeSpan::from_s(1.0)
    }

    #[test]
    fn a_reading_changes_the_speed_less_bias_and_leak() {
        let mut filter = moving();
        (filter.x[1], filter.x[2]) = (0.1, 0.05);
        filter.predict(second(), Some(Acceleration::from_m_per_s2(0.3)));
        // 10 m of 500 m: a fiftieth of the leak is forgotten, and comes anew.
        let keeps = 1.0 / 1.02;
        let bias = 0.04 + 0.005 * 0.005 / 60.0;
        let p = [
            [0.25 + 0.04 + 0.01 + 0.01, -0.04, -0.01 * keeps],
            [-0.04, bias, 0.0],
            [-0.01 * keeps, 0.0, 0.01],
        ];
        assert_is(&filter, [10.15, 0.1, 0.05 * keeps], p);
        assert!((filter.speed_deviation().as_m_per_s() - 0.31_f64.sqrt()).abs() < 1e-12);
        assert!((filter.acceleration().as_m_per_s2() - (0.3 - 0.1 - 0.05 * keeps)).abs() < 1e-12);
        let [excess, deviation] = filter.excess();
        assert!((excess.as_m_per_s2() - 0.1 - 0.05 * keeps).abs() < 1e-12);
        assert!((deviation.as_m_per_s2() - (bias + 0.01).sqrt()).abs() < 1e-12);
        // Its time has to go on.
        let before = filter.clone();
        filter.predict(TimeSpan::ZERO, Some(Acceleration::from_m_per_s2(0.3)));
        assert_eq!(filter, before);
    }

    #[test]
    fn without_a_reading_the_speed_stays_and_may_change_by_a_metre_a_second() {
        for reading in [None, Some(Acceleration::from_m_per_s2(f64::NAN))] {
            let mut filter = moving();
            (filter.x[1], filter.x[2]) = (0.1, 0.05);
            filter.predict(second(), reading);
            // (0.5 + 1)² m²/s².
            let keeps = 1.0 / 1.02;
            let bias = 0.04 + 0.005 * 0.005 / 60.0;
            let p = [[2.25 + 0.01, 0.0, 0.0], [0.0, bias, 0.0], [0.0, 0.0, 0.01]];
            assert_is(&filter, [10.0, 0.1, 0.05 * keeps], p);
            assert!(filter.acceleration().as_m_per_s2().abs() < 2e-3);
        }
    }

    #[test]
    fn wheels_and_standing_still_are_measurements() {
        const P: [[f64; 3]; 3] = [[0.31, -0.04, -0.02], [-0.04, 0.05, 0.01], [-0.02, 0.01, 0.03]];
        let mut filter = moving();
        (filter.p, filter.x, filter.latest) = (P, [10.0, 0.1, 0.05], 0.4);
        let innovation = filter.innovation(Speed::from_m_per_s(10.9), Speed::from_m_per_s(0.3));
        let deviation = (0.31_f64 + 0.09).sqrt();
        assert!((innovation.value.as_m_per_s() - 0.9).abs() < 1e-12);
        assert!((innovation.standardised() - 0.9 / deviation).abs() < 1e-12);
        // The gain is a column of the covariance over 0.4.
        let gain = P.map(|row| row[0] / 0.4);
        let updated = core::array::from_fn(|i| core::array::from_fn(|j| P[i][j] - gain[i] * P[0][j]));
        filter.align(Speed::from_m_per_s(10.9), Speed::from_m_per_s(0.3));
        assert_is(&filter, [10.0 + 0.9 * gain[0], 0.1 + 0.9 * gain[1], 0.05 + 0.9 * gain[2]], updated);
        let before = filter.clone();
        filter.align(Speed::from_m_per_s(f64::NAN), Speed::from_m_per_s(0.3));
        filter.align(Speed::from_m_per_s(9.0), Speed::from_m_per_s(f64::INFINITY));
        filter.begin(Speed::from_m_per_s(f64::NAN), Speed::from_m_per_s(0.3));
        filter.begin(Speed::from_m_per_s(9.0), Speed::from_m_per_s(f64::NAN));
        assert_eq!(filter, before);

        // At rest: the speed is zero to 0.01 m/s, and what was read, 0.4 m/s² to 0.1 m/s², is bias and leak.
        let mut standing = moving();
        (standing.p, standing.x, standing.latest) = ([[1e-4, 0.0, 0.0], P[1], P[2]], [0.02, 0.1, 0.05], 0.4);
        (standing.p[1][0], standing.p[2][0]) = (0.0, 0.0);
        standing.stand();
        assert!((standing.x[0] - 0.01).abs() < 1e-12, "as sure as before");
        let (of_bias, of_leak) = (0.06, 0.04);
        let s = of_bias + of_leak + 0.01;
        assert!((standing.x[1] - (0.1 + of_bias / s * 0.25)).abs() < 1e-12);
        assert!((standing.x[2] - (0.05 + of_leak / s * 0.25)).abs() < 1e-12);
        let [_, deviation] = standing.excess();
        assert!((deviation.as_m_per_s2() - (0.1 - 0.01 / s).sqrt()).abs() < 1e-9);
    }

    #[test]
    fn a_speed_from_elsewhere_leaves_the_sensor_as_it_is_known() {
        let mut filter = moving();
        filter.predict(second(), Some(Acceleration::from_m_per_s2(0.3)));
        let bias = filter.p[1][1];
        filter.begin(Speed::from_m_per_s(4.0), Speed::from_m_per_s(0.2));
        let p = [[0.04, 0.0, 0.0], [0.0, bias, 0.0], [0.0, 0.0, 0.01]];
        assert_is(&filter, [4.0, 0.0, 0.0], p);
        let new = InertialFilter::new(InertialNoise::default());
        assert_is(&new, [0.0; 3], [[1e-4, 0.0, 0.0], [0.0, 0.04, 0.0], [0.0, 0.0, 0.01]]);
    }
}
