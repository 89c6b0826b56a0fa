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
