//! How fast the train runs and how that changes, from the accumulated counts of the wheels that are trusted.
//!
//! Letters: `v` speed, `a` acceleration, `pxy` covariances of place (`s`), speed and acceleration, `q` spectral density
//! of the jerk (m²/s⁵), `r` variance of a place by counts, `s` that of an innovation, `k` gain. A count is a *place*
//! within one pitch: its error is white and bounded, while the error of a count per period is taken back by the next.
//! The place is kept as the origin of the state, so that no digit is lost on a long way.
//!
//! With a variance divided by the share of each wheel this one filter is the federated filter with fusion-reset and
//! `R/β`: information adds up, so it does not matter where the prior is parked (shown in `docs/theory`).

use super::sound::sound;

/// Variances that the diagonal keeps within, so that it stays positive and finite whatever comes (m²/s², m²/s⁴).
const SPEED_VARIANCE: (f64, f64) = (1e-8, 1e4);
const ACCELERATION_VARIANCE: (f64, f64) = (1e-8, 1e2);
const PLACE_VARIANCE: (f64, f64) = (1e-10, 1e4);

/// Speed and acceleration with their covariance; the place is the origin.
#[derive(Debug, Clone, Copy)]
pub(super) struct TrainFilter {
    pub(super) v: f64,
    pub(super) a: f64,
    pss: f64,
    psv: f64,
    psa: f64,
    pvv: f64,
    pva: f64,
    paa: f64,
}

/// What one measured place did to the state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Correction {
    /// By how much the place moved (m).
    pub(super) moved: f64,
    /// Square of the innovation over its variance.
    pub(super) nis: f64,
}

impl TrainFilter {
    /// A train of which only a speed is known, with a variance.
    pub(super) const fn new(v: f64, variance: f64) -> Self {
        Self { v, a: 0.0, pss: 1e-4, psv: 0.0, psa: 0.0, pvv: variance, pva: 0.0, paa: 0.25 }
    }

    /// Runs on for `t` seconds and says how far.
    #[inline]
    pub(super) fn run(&mut self, t: f64, q: f64) -> f64 {
        let half = 0.5 * t * t;
        let way = self.v * t + self.a * half;
        self.v += self.a * t;
        let psv = self.psv + t * self.pvv + half * self.pva;
        let psa = self.psa + t * self.pva + half * self.paa;
        let pva = self.pva + t * self.paa;
        self.pss =
            self.pss + t * (self.psv + psv) + half * (self.psa + psa) + q * t * t * t * t * t * (1.0 / 20.0);
        self.psv = psv + t * psa + q * t * t * t * t * 0.125;
        self.psa = psa + q * t * t * t * (1.0 / 6.0);
        self.pvv = self.pvv + t * (self.pva + pva) + q * t * t * t * (1.0 / 3.0);
        self.pva = pva + q * t * t * 0.5;
        self.paa += q * t;
        way
    }

    /// A wheel says that the train is `y` metres ahead of where it was believed, with variance `r`.
    #[inline]
    pub(super) fn place(&mut self, y: f64, r: f64) -> Correction {
        let per_s = 1.0 / (self.pss + r);
        let (ks, kv, ka) = (self.pss * per_s, self.psv * per_s, self.psa * per_s);
        self.v += kv * y;
        self.a += ka * y;
        // Schur complements and products of positive numbers: nothing is subtracted from what it is a part of.
        self.pvv -= kv * self.psv;
        self.pva -= kv * self.psa;
        self.paa -= ka * self.psa;
        let kept = r * per_s;
        self.pss *= kept;
        self.psv *= kept;
        self.psa *= kept;
        self.keep_positive();
        Correction { moved: ks * y, nis: y * y * per_s }
    }

    /// Something else has carried the speed.
    pub(super) fn set(&mut self, v: f64, a: f64, variance: f64) {
        self.v = v;
        self.a = a;
        self.pvv = variance;
        self.keep_positive();
    }

    /// The train has turned round.
    pub(super) fn reverse(&mut self) {
        self.v = -self.v;
        self.a = -self.a;
    }

    /// Standard deviation of the speed (m/s).
    pub(super) fn speed_deviation(&self) -> f64 {
        libm::sqrt(self.pvv)
    }

    #[inline]
    fn keep_positive(&mut self) {
        self.pss = sound(self.pss, PLACE_VARIANCE.0, PLACE_VARIANCE.1);
        self.pvv = sound(self.pvv, SPEED_VARIANCE.0, SPEED_VARIANCE.1);
        self.paa = sound(self.paa, ACCELERATION_VARIANCE.0, ACCELERATION_VARIANCE.1);
    }
}
