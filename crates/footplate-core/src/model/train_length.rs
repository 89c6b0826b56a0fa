//! The length of a train, from when the blocks behind it become free.
//!
//! At a steady speed `v` a block is reported free when the front of the train is a distance `d` beyond its end:
//!
//! ```text
//! d = l + v·τ
//! ```
//!
//! with `l` the length of the train, from the first to the last part that detectors sense, and `τ` the release delay of the
//! detector. Speeds of several steps tell one from the other: a Kalman filter with these two states takes one scalar
//! measurement at a time. Letters as in the tracking filters: `p` covariance, `h` row, `r` variance, `s` innovation variance.

use crate::estimate::Estimate;
use crate::link::DetectionWindow;
use crate::time::{TimeSpan, Timestamp};
use crate::units::{Length, Speed};

/// Before a train was measured: from a locomotive to a long train (m).
const LENGTH: [f64; 2] = [0.4, 0.5];
/// Makers of detectors state delays of 0.3 to 2 s.
const DELAY: [f64; 2] = [1.0, 0.6];
/// One standard deviation (s) of single releases: detectors of one make differ by their capacitors, and from time to time.
const DELAY_SCATTER: f64 = 0.03;
/// One standard deviation (m) of where the rails are cut.
const BOUNDARY_SCATTER: f64 = 0.003;
/// An innovation beyond this many standard deviations is another train's, or a wheel on dirt.
const GATE: f64 = 4.0;
/// After this many of them in a row the train is another one: coaches were added or left behind.
const ANOTHER_TRAIN: u8 = 4;
/// A length counts as known from this standard deviation on (m).
const KNOWN: f64 = 0.05;

/// A block was reported free while a train ran on at a steady speed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BlockRelease {
    /// How far the front of the train was beyond the block in the middle of the window, and one standard deviation.
    pub beyond: [Length; 2],
    /// The speed of the train.
    pub speed: Speed,
    /// When the detector reported.
    pub window: DetectionWindow,
}

/// The length of a train and the release delay of the detectors.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct TrainLength {
    /// Length (m) and delay (s).
    x: [f64; 2],
    p: [[f64; 2]; 2],
    count: u32,
    /// Measurements in a row that were not accepted.
    rejected: u8,
    date: Timestamp,
    /// All measurements, those of earlier trains and those that were not accepted included.
    #[cfg_attr(feature = "serde", serde(default))]
    taken: u32,
}

impl Default for TrainLength {
    fn default() -> Self {
        Self {
            x: [LENGTH[0], DELAY[0]],
            p: [[LENGTH[1] * LENGTH[1], 0.0], [0.0, DELAY[1] * DELAY[1]]],
            count: 0,
            rejected: 0,
            date: Timestamp::ZERO,
            taken: 0,
        }
    }
}

impl TrainLength {
    /// Whether nothing was measured yet.
    pub const fn is_unknown(&self) -> bool {
        self.count == 0
    }

    /// From the first to the last part of the train that detectors sense; with a standard deviation of half a metre before the
    /// first measurement.
    pub fn length(&self) -> Estimate<Length> {
        self.estimate(0).scaled(Length::from_m)
    }

    /// The same where it is known to 5 cm.
    pub fn known(&self) -> Option<Estimate<Length>> {
        Some(self.length()).filter(|length| self.count > 0 && length.uncertainty.as_m() <= KNOWN)
    }

    /// How long detectors report a block occupied that the train has left.
    pub fn release_delay(&self) -> Estimate<TimeSpan> {
        self.estimate(1).scaled(TimeSpan::from_s)
    }

    /// The longest delay that is likely.
    pub fn longest_delay(&self) -> TimeSpan {
        let Estimate { value, uncertainty, .. } = self.estimate(1);
        TimeSpan::from_s(value + 2.0 * uncertainty)
    }

    fn estimate(&self, state: usize) -> Estimate {
        let variance = self.p.get(state).and_then(|row| row.get(state)).copied().unwrap_or_default();
        Estimate {
            value: self.x.get(state).copied().unwrap_or_default(),
            uncertainty: libm::sqrt(variance),
            count: self.count,
            date: self.date,
        }
    }

    /// Takes a release. Returns whether it agrees with those before.
    pub fn take(&mut self, release: &BlockRelease) -> bool {
        let BlockRelease { beyond: [beyond, deviation], speed, window } = release;
        self.taken = self.all_taken().saturating_add(1);
        let (v, deviation) = (speed.as_m_per_s(), deviation.as_m());
        let late = DELAY_SCATTER * DELAY_SCATTER + window.variance_s2();
        let r = deviation * deviation + BOUNDARY_SCATTER * BOUNDARY_SCATTER + v * v * late;
        // The front is ahead of the block by the length, and by what the train runs during the delay: h = [1 v].
        let [[p00, p01], [p10, p11]] = self.p;
        let ph = [p00 + p01 * v, p10 + p11 * v];
        let s = ph[0] + v * ph[1] + r;
        let innovation = beyond.as_m() - (self.x[0] + v * self.x[1]);
        if innovation * innovation > GATE * GATE * s {
            self.rejected += 1;
            if self.rejected >= ANOTHER_TRAIN {
                let [_, delay] = self.x;
                *self = Self { x: [LENGTH[0], delay], taken: self.taken, ..Self::default() };
            }
            return false;
        }
        let k = [ph[0] / s, ph[1] / s];
        self.x = [self.x[0] + k[0] * innovation, self.x[1] + k[1] * innovation];
        // (I − k h) p (I − k h)ᵀ + k r kᵀ, which stays positive with a rounded gain (Bucy and Joseph, 1968).
        let a = [[1.0 - k[0], -k[0] * v], [-k[1], 1.0 - k[1] * v]];
        let ap = |i: usize, j: usize| -> f64 {
            let row: [f64; 2] = if i == 0 { a[0] } else { a[1] };
            let column = if j == 0 { [p00, p10] } else { [p01, p11] };
            row[0] * column[0] + row[1] * column[1]
        };
        let apa = |i: usize, j: usize| -> f64 {
            let other: [f64; 2] = if j == 0 { a[0] } else { a[1] };
            let gains = if i == 0 { k[0] } else { k[1] } * if j == 0 { k[0] } else { k[1] };
            ap(i, 0) * other[0] + ap(i, 1) * other[1] + gains * r
        };
        self.p = [[apa(0, 0), apa(0, 1)], [apa(1, 0), apa(1, 1)]];
        self.count = self.count.saturating_add(1);
        self.rejected = 0;
        self.date = window.until;
        true
    }

    /// The newer of two: one was learnt while another copy of the model was in use. It may count fewer measurements: of a train that
    /// became longer or shorter, those before do not count.
    #[must_use]
    pub const fn or_newer(self, other: Self) -> Self {
        if other.all_taken() > self.all_taken() { other } else { self }
    }

    /// All measurements; models of earlier versions have counted only those that were accepted.
    const fn all_taken(&self) -> u32 {
        if self.taken > self.count { self.taken } else { self.count }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::time::TimeSpan;

    fn release(mm: f64, mm_per_s: f64) -> BlockRelease {
        let until = Timestamp::from_s(100.0);
        BlockRelease {
            beyond: [mm, 3.0].map(Length::from_mm),
            speed: Speed::from_mm_per_s(mm_per_s),
            window: DetectionWindow { after: until - TimeSpan::from_ms(60), until },
        }
    }

    /// Releases of a train of 500 mm, 0.7 s late, with errors that cancel out.
    fn measured() -> TrainLength {
        let mut length = TrainLength::default();
        for round in 0..8 {
            for speed in [100.0, 200.0, 300.0, 500.0] {
                let error = if round % 2 == 0 { 6.0 } else { -6.0 };
                assert!(length.take(&release(500.0 + 0.7 * speed + error, speed)));
            }
        }
        length
    }

    #[test]
    fn several_speeds_tell_length_from_delay() {
        let length = measured();
        let (found, delay) = (length.known().unwrap(), length.release_delay());
        assert!((found.value.as_mm() - 500.0).abs() < 3.0 * found.uncertainty.as_mm().max(2.0), "{found:?}");
        assert!(found.uncertainty.as_mm() < 8.0 && found.count == 32, "{found:?}");
        assert!((delay.value.as_s() - 0.7).abs() < 0.03, "{delay:?}");
    }

    #[test]
    fn the_first_release_divides_its_innovation_between_length_and_delay() {
        // Of 0.4 m ± 0.5 m and 1.0 s ± 0.6 s at 0.3 m/s 0.7 m are expected. Calculated by hand:
        // r = 2 · 0.003² + 0.3² · (0.03² + 0.06²/12) = 0.000126, s = 0.25 + 0.3² · 0.36 + r = 0.282526,
        // gains 0.25 / s = 0.884874 and 0.3 · 0.36 / s = 0.382266.
        let mut length = TrainLength::default();
        assert!(length.take(&release(600.0, 300.0)));
        assert!((length.length().value.as_mm() - 311.5126).abs() < 1e-3, "{length:?}");
        assert!((length.release_delay().value.as_s() - 0.961_773_4).abs() < 1e-6, "{length:?}");
        // p₀₀ = 0.25 · (1 − 0.884874), by any form of the update.
        let deviation = length.length().uncertainty.as_m();
        assert!((deviation * deviation - 0.028_781_5).abs() < 1e-6, "{length:?}");
    }

    #[test]
    fn one_speed_does_not() {
        let mut length = TrainLength::default();
        (0..20).for_each(|_| assert!(length.take(&release(710.0, 300.0))));
        assert_eq!(length.known(), None, "{length:?}");
        assert!(length.length().uncertainty.as_mm() > 100.0);
    }

    #[test]
    fn a_flicker_is_left_out_and_a_longer_train_is_measured_anew() {
        let mut length = measured();
        let before = length.length();
        assert!(!length.take(&release(150.0, 300.0)));
        assert_eq!(length.length(), before);
        assert!(length.take(&release(712.0, 300.0)));
        (0..4).for_each(|_| assert!(!length.take(&release(1_300.0, 300.0))));
        assert!(length.is_unknown());
        assert!(length.take(&release(1_300.0, 300.0)));
    }

    #[test]
    fn a_longer_train_is_measured_although_a_copy_of_its_model_is_fitted_again_meanwhile() {
        let (mut driven, fitted) = (measured(), measured());
        for _ in 0..12 {
            driven.take(&release(1_300.0 + 0.7 * 300.0, 300.0));
            driven.take(&release(1_300.0 + 0.7 * 100.0, 100.0));
            // A fit puts its model in place of the driven one.
            driven = fitted.or_newer(driven);
        }
        let length = driven.known().expect("it was measured");
        assert!((length.value.as_mm() - 1_300.0).abs() < 20.0, "{length:?}");
    }

    /// Least squares over all releases at once, by information (inverse covariance): no gain, no recursion.
    #[test]
    fn releases_one_by_one_give_what_least_squares_over_all_of_them_give() {
        let releases = [(565.0, 90.0), (645.0, 210.0), (712.0, 300.0), (834.0, 480.0), (585.0, 120.0)];
        // Prior of 0.4 m ± 0.5 m and 1.0 s ± 0.6 s.
        let ([mut a, mut b, mut c], mut y) = ([1.0 / 0.25, 0.0, 1.0 / 0.36], [0.4 / 0.25, 1.0 / 0.36]);
        let mut length = TrainLength::default();
        for (mm, mm_per_s) in releases {
            assert!(length.take(&release(mm, mm_per_s)), "{mm} mm at {mm_per_s} mm/s");
            let (v, beyond) = (mm_per_s / 1e3, mm / 1e3);
            // 3 mm of the place and of the boundary, 30 ms of the detector and a window of 60 ms.
            let weight = 1.0 / (2.0 * 0.003 * 0.003 + v * v * (0.03 * 0.03 + 0.06 * 0.06 / 12.0));
            (a, b, c) = (a + weight, b + weight * v, c + weight * v * v);
            y = [y[0] + weight * beyond, y[1] + weight * v * beyond];
            let determinant = a * c - b * b;
            let (metres, seconds) =
                ((c * y[0] - b * y[1]) / determinant, (a * y[1] - b * y[0]) / determinant);
            let (found, delay) = (length.length(), length.release_delay());
            assert!((found.value.as_m() - metres).abs() < 1e-9, "{found:?}, not {metres}");
            assert!((delay.value.as_s() - seconds).abs() < 1e-9, "{delay:?}, not {seconds}");
            assert!((found.uncertainty.as_m() - libm::sqrt(c / determinant)).abs() < 1e-9, "{found:?}");
            assert!((delay.uncertainty.as_s() - libm::sqrt(a / determinant)).abs() < 1e-9, "{delay:?}");
        }
    }
}
