//! A Kalman filter for each hypothesis, all computed side by side.
//!
//! Letters: `r` distance of the train less that of the counter that the hypothesis trusts (m), `v` speed, `a` acceleration,
//! `pxy` covariances, `q` density of the jerk (m²/s⁵), `k` gain, `y` innovation.

use super::lanes::Lanes;
use crate::odometry::wheels::{larger, smaller};

/// Limits of the variances, so that they stay positive and finite (m², m²/s², m²/s⁴).
const PLACE: (f64, f64) = (1e-10, 1e2);
const SPEED: (f64, f64) = (1e-8, 1e4);
const ACCELERATION: (f64, f64) = (1e-8, 4.0);
/// No train accelerates more (m/s²).
pub(super) const STRONGEST: f64 = 10.0;

/// Variance of the speed and acceleration at rest (m²/s², m²/s⁴): nothing but rounding.
const AT_REST: f64 = 1e-6;

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
    pub(super) pva: f64,
    pub(super) paa: f64,
}

impl State {
    /// That of a train at rest, after a period of `t` seconds.
    pub(super) fn at_rest(t: f64) -> Self {
        let pva = AT_REST * t;
        let (pvv, paa) = (AT_REST + pva * t, AT_REST);
        Self { r: 0.0, v: 0.0, a: 0.0, prr: PLACE.0, prv: 0.0, pra: 0.0, pvv, pva, paa }
    }

    /// Predicts by `t` seconds with jerk of spectral density `q`. Returns the distance run.
    #[inline(always)]
    pub(super) fn run(&mut self, t: f64, q: f64) -> f64 {
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

    /// Corrects by the measurement `r` = 0 with this variance, if `trusted` is 1. Returns by how much the place moved, and the
    /// squared innovation over its variance.
    #[inline(always)]
    pub(super) fn place(&mut self, variance: f64, trusted: f64) -> (f64, f64) {
        let per = 1.0 / (self.prr + variance) * trusted;
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
        let kept = 1.0 - kr;
        self.prr *= kept;
        self.prv *= kept;
        self.pra *= kept;
        (moved, surprise)
    }

    /// Mixes a share of `pool` into it.
    #[inline(always)]
    pub(super) fn mix(&mut self, pool: &Pool, share: f64) {
        let kept = 1.0 - share;
        let (dv, da) = (pool.v - self.v, pool.a - self.a);
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

    /// Keeps the state finite and the variances positive, of a train no faster than `top` (m/s) that accelerates by no more than
    /// `strongest` (m/s²).
    #[inline(always)]
    pub(super) fn limit(&mut self, top: f64, strongest: f64) {
        self.v = larger(smaller(self.v, top), -top);
        self.a = larger(smaller(self.a, strongest), -strongest);
        self.prr = larger(self.prr, PLACE.0);
        self.pvv = larger(self.pvv, SPEED.0);
        self.paa = larger(self.paa, ACCELERATION.0);
    }

    /// Its sign bit is set if a variance exceeds its largest: positive numbers are in the order of their bits.
    #[inline(always)]
    pub(super) fn exceeds(&self) -> u64 {
        let over = |variance: f64, (_, most): (f64, f64)| most.to_bits().wrapping_sub(variance.to_bits());
        over(self.prr, PLACE) | over(self.pvv, SPEED) | over(self.paa, ACCELERATION)
    }

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

    /// Cuts variances to their largest, and their covariances by the same factor. If a variance were cut alone, gains would change
    /// sign and the filter would diverge. Few periods need this.
    #[cold]
    #[inline(never)]
    pub(super) fn cut(&mut self) {
        let limits = [(self.prr, PLACE), (self.pvv, SPEED), (self.paa, ACCELERATION)];
        let [of_r, of_v, of_a] =
            limits.map(|(lanes, (_, most))| (lanes.at_least(most).inverse() * most).at_most(1.0));
        self.prv *= of_r * of_v;
        self.pra *= of_r * of_a;
        self.pva *= of_v * of_a;
        self.prr = self.prr.at_most(PLACE.1);
        self.pvv = self.pvv.at_most(SPEED.1);
        self.paa = self.paa.at_most(ACCELERATION.1);
    }

    /// Reverses everything: the train has reversed.
    pub(super) fn reverse(&mut self) {
        self.r = -self.r;
        self.v = -self.v;
        self.a = -self.a;
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

impl Pool {
    /// First and second moments of a state about a speed and an acceleration near it: of speed and acceleration, of the square of
    /// the speed, of their product, and of the square of the acceleration.
    #[inline(always)]
    pub(super) fn moments(
        [v, a]: [f64; 2],
        [pvv, pva, paa]: [f64; 3],
        [about_v, about_a]: [f64; 2],
    ) -> [f64; 5] {
        let (dv, da) = (v - about_v, a - about_a);
        [dv, da, pvv + dv * dv, pva + dv * da, paa + da * da]
    }

    /// Mean and covariance of hypotheses whose mean moments these are, with a variance of the place.
    pub(super) fn of([dv, da, vv, va, aa]: [f64; 5], [about_v, about_a]: [f64; 2], prr: f64) -> Self {
        let (v, a) = (about_v + dv, about_a + da);
        Self { v, a, pvv: vv - dv * dv, pva: va - dv * da, paa: aa - da * da, prr }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    type Matrix = [[f64; 3]; 3];

    const MEAN: [f64; 3] = [0.3, 12.0, -0.7];
    /// Positive definite, and no two entries alike.
    const COVARIANCE: Matrix = [[0.09, 0.031, -0.012], [0.031, 0.25, 0.047], [-0.012, 0.047, 0.16]];

    fn product(a: &Matrix, b: &Matrix) -> Matrix {
        core::array::from_fn(|i| core::array::from_fn(|j| (0..3).map(|k| a[i][k] * b[k][j]).sum()))
    }

    /// The filter of every hypothesis with this mean and covariance.
    fn filters() -> Filters {
        let [[prr, prv, pra], [_, pvv, pva], [_, _, paa]] = COVARIANCE.map(|row| row.map(Lanes::all));
        let [r, v, a] = MEAN.map(Lanes::all);
        Filters { r, v, a, prr, prv, pra, pvv, pva, paa }
    }

    fn assert_is(state: State, mean: [f64; 3], covariance: &Matrix) {
        let State { r, v, a, prr, prv, pra, pvv, pva, paa } = state;
        for (found, expected) in [r, v, a].into_iter().zip(mean) {
            assert!((found - expected).abs() < 1e-12, "{found} {expected}");
        }
        let found = [[prr, prv, pra], [prv, pvv, pva], [pra, pva, paa]];
        for (found, expected) in found.iter().flatten().zip(covariance.iter().flatten()) {
            assert!((found - expected).abs() < 1e-12, "{found} {expected}");
        }
    }

    /// The textbook update by a measurement of one element with a variance: mean, covariance, and how far the elements move.
    fn updated(element: usize, y: f64, variance: f64) -> ([f64; 3], Matrix) {
        let p = COVARIANCE;
        let s = p[element][element] + variance;
        let mean = core::array::from_fn(|i| MEAN[i] + p[i][element] / s * y);
        let after =
            core::array::from_fn(|i| core::array::from_fn(|j| p[i][j] - p[i][element] * p[element][j] / s));
        (mean, after)
    }

    #[test]
    fn a_prediction_is_the_transition_matrix_on_both_sides_and_integrated_white_jerk() {
        let (t, q) = (0.4, 0.3);
        let filters = filters();
        let mut state = filters.state(5);
        let ran = state.run(t, q);
        let f = [[1.0, t, t * t / 2.0], [0.0, 1.0, t], [0.0, 0.0, 1.0]];
        let transposed = core::array::from_fn(|i| core::array::from_fn(|j| f[j][i]));
        let mut expected = product(&product(&f, &COVARIANCE), &transposed);
        // ∫ g gᵀ dt with g = (t²/2, t, 1).
        let powers = [(2, 2.0), (1, 1.0), (0, 1.0)];
        for (i, (one, under)) in powers.into_iter().enumerate() {
            for (j, (other, beneath)) in powers.into_iter().enumerate() {
                let power = one + other + 1;
                expected[i][j] += q * t.powi(power) / (f64::from(power) * under * beneath);
            }
        }
        // The place is counted from that of the counter, which the caller subtracts.
        assert_is(state, [0.3, 12.0 - 0.7 * 0.4, -0.7], &expected);
        assert!((ran - (12.0 * 0.4 - 0.7 * 0.08)).abs() < 1e-12);
    }

    #[test]
    fn corrections_are_those_of_a_kalman_filter() {
        let variance = 0.04;
        let mut state = filters().state(2);
        state.speed(0.5, 1.0 / variance);
        let (mean, covariance) = updated(1, 0.5, variance);
        assert_is(state, mean, &covariance);

        let mut state = filters().state(2);
        state.acceleration(-0.6, 1.0 / variance);
        let (mean, covariance) = updated(2, -0.6, variance);
        assert_is(state, mean, &covariance);

        // The counter says r = 0; a hypothesis that does not trust it stays as it is.
        let mut trusting = filters().state(2);
        let (moved, surprise) = trusting.place(variance, 1.0);
        let (mean, covariance) = updated(0, -0.3, variance);
        assert_is(trusting, mean, &covariance);
        assert!((moved - (mean[0] - 0.3)).abs() < 1e-12);
        assert!((surprise - 0.09 / 0.13).abs() < 1e-12);
        let mut other = filters().state(3);
        assert_eq!(other.place(variance, 0.0), (0.0, 0.0));
        assert_is(other, MEAN, &COVARIANCE);
    }

    #[test]
    fn without_information_nothing_changes() {
        let mut state = filters().state(0);
        state.speed(5.0, 0.0);
        state.acceleration(5.0, 0.0);
        assert_is(state, MEAN, &COVARIANCE);
    }

    #[test]
    fn a_mixture_has_the_moments_of_a_mixture() {
        let pool = Pool { v: 11.0, a: 0.2, pvv: 0.5, pva: -0.1, paa: 0.3, prr: 0.02 };
        let (share, kept) = (0.3, 0.7);
        let mut mixed = filters().state(7);
        mixed.mix(&pool, share);
        let [_, [_, pvv, pva], [_, _, paa]] = COVARIANCE;
        let [r, v, a] = MEAN;
        // E x = Σ w x and E x y = Σ w (cov + x y).
        let mean = |one: f64, other: f64| kept * one + share * other;
        let covariance = |own: f64, of_pool: f64, [x, y]: [f64; 2], [of_x, of_y]: [f64; 2]| {
            mean(own + x * y, of_pool + of_x * of_y) - mean(x, of_x) * mean(y, of_y)
        };
        let pvv = covariance(pvv, pool.pvv, [v, v], [pool.v, pool.v]);
        let pva = covariance(pva, pool.pva, [v, a], [pool.v, pool.a]);
        let paa = covariance(paa, pool.paa, [a, a], [pool.a, pool.a]);
        // The place of what begins is 0, and of the variance of the pool; it says nothing of speed and acceleration.
        let (prr, prv, pra) = (mean(0.09, 0.02), kept * 0.031, kept * -0.012);
        let expected = [[prr, prv, pra], [prv, pvv, pva], [pra, pva, paa]];
        assert_is(mixed, [kept * r, mean(v, pool.v), mean(a, pool.a)], &expected);
    }

    #[test]
    fn pooled_hypotheses_have_the_moments_of_all() {
        // Two hypotheses, three to one.
        let about = [10.0, 0.3];
        let one = Pool::moments([8.0, 1.0], [0.4, 0.1, 0.2], about);
        let other = Pool::moments([12.0, -1.0], [0.8, 0.3, 0.6], about);
        let pool = Pool::of(core::array::from_fn(|k| 0.75 * one[k] + 0.25 * other[k]), about, 0.07);
        // Means 9 and 0.5; about them ¾ of 1 and ¼ of 9, ¾ of −0.5 and ¼ of −4.5, ¾ of 0.25 and ¼ of 2.25.
        let found = [pool.v, pool.a, pool.pvv, pool.pva, pool.paa, pool.prr];
        for (found, expected) in found.into_iter().zip([9.0, 0.5, 0.5 + 3.0, 0.15 - 1.5, 0.3 + 0.75, 0.07]) {
            assert!((found - expected).abs() < 1e-12, "{found} {expected}");
        }
    }

    #[test]
    fn a_variance_beyond_its_largest_sets_the_sign_bit() {
        // The largest are 100 m², 10⁴ (m/s)² and 4 (m/s²)².
        let exceeds =
            |[prr, pvv, paa]: [f64; 3]| State { prr, pvv, paa, ..filters().state(0) }.exceeds() >> 63 == 1;
        assert!(!exceeds([100.0, 1e4, 4.0]) && !exceeds([1.0, 1.0, 1.0]));
        assert!(exceeds([101.0, 1.0, 1.0]) && exceeds([1.0, 1.1e4, 1.0]) && exceeds([1.0, 1.0, 4.1]));
    }

    #[test]
    fn reversed_means_change_their_signs_and_covariances_stay() {
        let mut reversed = filters();
        reversed.reverse();
        assert_is(reversed.state(4), [-0.3, -12.0, 0.7], &COVARIANCE);
    }

    #[test]
    fn a_variance_that_is_cut_takes_its_covariances_with_it() {
        let mut filters = Filters::new(10.0, 5e4);
        filters.paa = Lanes::all(40.0);
        filters.pva = Lanes::all(1400.0);
        filters.prr = Lanes::all(400.0);
        (filters.prv, filters.pra) = (Lanes::all(1000.0), Lanes::all(20.0));
        assert_eq!(filters.state(0).exceeds() >> 63, 1);
        filters.cut();
        let State { prr, prv, pra, pvv, pva, paa, .. } = filters.state(0);
        assert_eq!((prr, pvv, paa), (1e2, 1e4, 4.0));
        // A quarter, a fifth and a tenth are left of the variances.
        for (found, expected) in [(prv, 1000.0 / 20.0), (pra, 20.0 / 40.0), (pva, 1400.0 / 50.0)] {
            assert!((found - expected).abs() < 1e-9, "{found} {expected}");
        }
    }

    #[test]
    fn what_is_within_its_limits_is_not_touched_and_what_is_below_is_raised() {
        let mut sound = filters();
        assert_eq!(sound.state(1).exceeds() >> 63, 0);
        sound.cut();
        let mut state = sound.state(1);
        state.limit(40.0, STRONGEST);
        assert_is(state, MEAN, &COVARIANCE);
        (state.prr, state.pvv, state.paa) = (0.0, -1.0, 1e-9);
        (state.v, state.a) = (41.0, 11.0);
        state.limit(40.0, STRONGEST);
        assert_eq!((state.v, state.a, state.prr, state.pvv, state.paa), (40.0, 10.0, 1e-10, 1e-8, 1e-8));
        (state.v, state.a) = (-41.0, -11.0);
        state.limit(40.0, STRONGEST);
        assert_eq!((state.v, state.a), (-40.0, -10.0));
    }
}
