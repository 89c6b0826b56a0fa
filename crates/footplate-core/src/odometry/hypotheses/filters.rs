//! A Kalman filter for each hypothesis, all computed side by side.
//!
//! Letters: `r` distance of the train less that of the counter that the hypothesis trusts (m), `v` speed, `a` acceleration,
//! `pxy` covariances, `q` density of the jerk (m²/s⁵), `k` gain, `y` innovation.

use super::lanes::Lanes;

/// Limits of the variances, so that they stay positive and finite (m², m²/s², m²/s⁴).
const PLACE: (f64, f64) = (1e-10, 1e2);
const SPEED: (f64, f64) = (1e-8, 1e4);
const ACCELERATION: (f64, f64) = (1e-8, 4.0);
/// No train accelerates more (m/s²).
const STRONGEST: f64 = 10.0;

/// State and covariance of every hypothesis.
#[derive(Debug, Clone, Copy)]
pub(super) struct Filters {
    pub(super) r: Lanes,
    pub(super) v: Lanes,
    pub(super) a: Lanes,
    pub(super) prr: Lanes,
    pub(super) prv: Lanes,
    pub(super) pra: Lanes,
    pub(super) pvv: Lanes,
    pub(super) pva: Lanes,
    pub(super) paa: Lanes,
}

/// State and covariance of one hypothesis.
#[derive(Debug, Clone, Copy)]
pub(super) struct State {
    pub(super) r: f64,
    pub(super) v: f64,
    pub(super) a: f64,
    prr: f64,
    prv: f64,
    pra: f64,
    pub(super) pvv: f64,
    pva: f64,
    pub(super) paa: f64,
}

impl State {
    /// Corrects by an innovation `y` of the speed with this information (s²/m²); 0 for none.
    pub(super) fn speed(&mut self, y: f64, information: f64) {
        let per = information / (self.pvv * information + 1.0);
        let (kr, kv, ka) = (self.prv * per, self.pvv * per, self.pva * per);
        self.r += kr * y;
        self.v += kv * y;
        self.a += ka * y;
        self.prr -= kr * self.prv;
        self.pra -= kr * self.pva;
        self.paa -= ka * self.pva;
        let kept = 1.0 - kv;
        self.prv *= kept;
        self.pvv *= kept;
        self.pva *= kept;
    }

    /// Corrects by an innovation `y` of the acceleration with this information (s⁴/m²).
    pub(super) fn acceleration(&mut self, y: f64, information: f64) {
        let per = information / (self.paa * information + 1.0);
        let (kr, kv, ka) = (self.pra * per, self.pva * per, self.paa * per);
        self.r += kr * y;
        self.v += kv * y;
        self.a += ka * y;
        self.prr -= kr * self.pra;
        self.prv -= kr * self.pva;
        self.pvv -= kv * self.pva;
        let kept = 1.0 - ka;
        self.pra *= kept;
        self.pva *= kept;
        self.paa *= kept;
    }
}

impl Filters {
    /// The state of one hypothesis.
    #[inline]
    #[expect(clippy::indexing_slicing, reason = "below the width of all")]
    pub(super) fn state(&self, lane: usize) -> State {
        let of = |lanes: &Lanes| lanes.0[lane];
        State {
            r: of(&self.r),
            v: of(&self.v),
            a: of(&self.a),
            prr: of(&self.prr),
            prv: of(&self.prv),
            pra: of(&self.pra),
            pvv: of(&self.pvv),
            pva: of(&self.pva),
            paa: of(&self.paa),
        }
    }

    /// Sets the state of one hypothesis.
    #[inline]
    #[expect(clippy::indexing_slicing, reason = "below the width of all")]
    pub(super) fn set(&mut self, lane: usize, state: State) {
        let State { r, v, a, prr, prv, pra, pvv, pva, paa } = state;
        for (lanes, value) in [
            (&mut self.r, r),
            (&mut self.v, v),
            (&mut self.a, a),
            (&mut self.prr, prr),
            (&mut self.prv, prv),
            (&mut self.pra, pra),
            (&mut self.pvv, pvv),
            (&mut self.pva, pva),
            (&mut self.paa, paa),
        ] {
            lanes.0[lane] = value;
        }
    }

    /// All at one speed (m/s) with one variance (m²/s²).
    pub(super) fn new(speed: f64, variance: f64) -> Self {
        let zero = Lanes::all(0.0);
        Self {
            r: zero,
            v: Lanes::all(speed),
            a: zero,
            prr: Lanes::all(1e-4),
            prv: zero,
            pra: zero,
            pvv: Lanes::all(variance),
            pva: zero,
            paa: Lanes::all(0.25),
        }
    }

    /// Predicts by `t` seconds with jerk of spectral density `q`. Returns the distances run.
    #[inline]
    pub(super) fn run(&mut self, t: f64, q: Lanes) -> Lanes {
        let half = 0.5 * t * t;
        let distance = self.v * t + self.a * half;
        self.v += self.a * t;
        let prv = self.prv + self.pvv * t + self.pva * half;
        let pra = self.pra + self.pva * t + self.paa * half;
        let pva = self.pva + self.paa * t;
        self.prr += (self.prv + prv) * t + (self.pra + pra) * half + q * (t * t * t * t * t / 20.0);
        self.prv = prv + pra * t + q * (t * t * t * t * 0.125);
        self.pra = pra + q * (t * t * t / 6.0);
        self.pvv += (self.pva + pva) * t + q * (t * t * t / 3.0);
        self.pva = pva + q * (t * t * 0.5);
        self.paa += q * t;
        distance
    }

    /// Corrects by the measurement `r` = 0 with this variance, where `trusted` is 1. Returns by how much the place moved, and the
    /// squared innovation over its variance.
    #[inline]
    pub(super) fn place(&mut self, variance: Lanes, trusted: Lanes) -> (Lanes, Lanes) {
        let per = (self.prr + variance).inverse() * trusted;
        let surprise = self.r * self.r * per;
        let (kr, kv, ka) = (self.prr * per, self.prv * per, self.pra * per);
        let y = -self.r;
        let moved = kr * y;
        self.r += moved;
        self.v += kv * y;
        self.a += ka * y;
        self.pvv -= kv * self.prv;
        self.pva -= kv * self.pra;
        self.paa -= ka * self.pra;
        let kept = Lanes::all(1.0) - kr;
        self.prr *= kept;
        self.prv *= kept;
        self.pra *= kept;
        (moved, surprise)
    }

    /// Mixes a share of `pool` into each filter.
    #[inline]
    pub(super) fn mix(&mut self, pool: &Pool, share: Lanes) {
        let one = Lanes::all(1.0);
        let kept = one - share;
        let (dv, da) = (Lanes::all(pool.v) - self.v, Lanes::all(pool.a) - self.a);
        let spread = share * kept;
        self.v += share * dv;
        self.a += share * da;
        self.pvv = self.pvv * kept + share * pool.pvv + spread * dv * dv;
        self.pva = self.pva * kept + share * pool.pva + spread * dv * da;
        self.paa = self.paa * kept + share * pool.paa + spread * da * da;
        // A hypothesis that begins does not know its counter yet.
        self.r *= kept;
        self.prr = self.prr * kept + share * pool.prr;
        self.prv *= kept;
        self.pra *= kept;
    }

    /// Keeps every covariance matrix finite and positive definite.
    ///
    /// The covariances of a variance that is cut to its limit are cut by the same factor. If the variance were cut alone, gains would
    /// change sign and the filter would diverge.
    #[inline]
    pub(super) fn keep_sound(&mut self) {
        let within = |lanes: Lanes, (least, most)| lanes.at_least(least).at_most(most);
        let limits = [(self.prr, PLACE), (self.pvv, SPEED), (self.paa, ACCELERATION)];
        // Few periods need these divisions. In the others they would multiply by 1.
        if limits.iter().any(|(lanes, (_, most))| lanes.largest() > *most) {
            let [of_r, of_v, of_a] =
                limits.map(|(lanes, (_, most))| (lanes.at_least(most).inverse() * most).at_most(1.0));
            self.prv *= of_r * of_v;
            self.pra *= of_r * of_a;
            self.pva *= of_v * of_a;
        }
        self.prr = within(self.prr, PLACE);
        self.pvv = within(self.pvv, SPEED);
        self.paa = within(self.paa, ACCELERATION);
        self.a = self.a.at_least(-STRONGEST).at_most(STRONGEST);
    }

    /// Reverses everything: the train has reversed.
    pub(super) fn reverse(&mut self) {
        self.r = -self.r;
        self.v = -self.v;
        self.a = -self.a;
    }

    /// Mean and covariance over all hypotheses with these weights, which need not add up to 1.
    #[inline]
    pub(super) fn pooled(&self, weights: Lanes, prr: f64) -> Pool {
        let total = weights.sum();
        let share = weights * (1.0 / total);
        let (v, a) = ((share * self.v).sum(), (share * self.a).sum());
        let (dv, da) = (self.v - Lanes::all(v), self.a - Lanes::all(a));
        Pool {
            v,
            a,
            pvv: (share * (self.pvv + dv * dv)).sum(),
            pva: (share * (self.pva + dv * da)).sum(),
            paa: (share * (self.paa + da * da)).sum(),
            prr,
        }
    }
}

/// The state of several hypotheses together.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pool {
    pub(super) v: f64,
    pub(super) a: f64,
    pub(super) pvv: f64,
    pub(super) pva: f64,
    pub(super) paa: f64,
    pub(super) prr: f64,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_variance_that_is_cut_takes_its_covariances_with_it() {
        let mut filters = Filters::new(10.0, 5e4);
        filters.paa = Lanes::all(40.0);
        filters.pva = Lanes::all(1400.0);
        filters.keep_sound();
        let State { pvv, pva, paa, .. } = filters.state(0);
        assert_eq!((pvv, paa), (1e4, 4.0));
        assert!(pva > 0.0 && pva * pva <= pvv * paa, "{pva}");
    }
}
