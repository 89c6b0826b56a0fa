//! Estimates the scales of two wheelsets from known distances and from each other.
//!
//! Letters: `k` the natural logarithms of the two scales, `p` their covariance, `h` which of them a measurement sees,
//! `y` innovation, `r` the measurement's variance, `s` the innovation's, `g` gain.
//!
//! Logarithms, because a ratio of two scales is then a difference, and what is measured between the axles is linear.

use libm::{exp, log, sqrt};

/// The scales wander by so much per square root of a kilometre: wear, temperature, load, the running surface. Chosen; wear
/// alone is 0.1 to 0.3 mm in 10 000 km.
const WANDERS_PER_SQRT_KM: f64 = 1e-5;
/// Creepage of a wheel that rolls and its cone in curves leave so much of the scale open, however much is measured.
/// Chosen: a tenth of the creepage in normal running (0.1 %).
const NEVER_BETTER_THAN: f64 = 1e-4;
/// No single measurement moves a scale by more than this. Chosen: the usual error of a configured diameter (1.5 %) is gone
/// after two, and the odometer makes no leap.
const LONGEST_STEP: f64 = 0.0075;

/// Both scales and what is known of them together.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ScaleFilter {
    k: [f64; 2],
    p: [[f64; 2]; 2],
}

impl ScaleFilter {
    /// Two scales with their relative standard deviations, which have nothing to do with each other.
    pub(super) fn new(scales: [f64; 2], [first, second]: [f64; 2]) -> Self {
        Self { k: scales.map(log), p: [[first * first, 0.0], [0.0, second * second]] }
    }

    /// Scales and their standard deviations.
    pub(super) fn scales(&self) -> [(f64, f64); 2] {
        let [[p00, _], [_, p11]] = self.p;
        let [k0, k1] = self.k;
        [(k0, p00), (k1, p11)].map(|(k, p)| {
            let scale = exp(k);
            (scale, scale * sqrt(p + NEVER_BETTER_THAN * NEVER_BETTER_THAN))
        })
    }

    /// What running so many kilometres makes less certain.
    pub(super) fn wander(&mut self, km: f64) {
        let q = WANDERS_PER_SQRT_KM * WANDERS_PER_SQRT_KM * km;
        let [[p00, p01], [p10, p11]] = self.p;
        self.p = [[p00 + q, p01], [p10, p11 + q]];
    }

    /// Takes in the logarithm of a scale (`h` = [1, 0] or [0, 1]), of their mean ([½, ½]) or their ratio ([1, −1]).
    ///
    /// The covariance is right for any gain (Joseph form: Bucy and Joseph, 1968), so also for one that is held back: what a
    /// measurement was not allowed to move, it does not make certain.
    pub(super) fn measure(&mut self, h: [f64; 2], measured: f64, r: f64) {
        let [h0, h1] = h;
        let [k0, k1] = self.k;
        let [[p00, p01], [p10, p11]] = self.p;
        let [ph0, ph1] = [p00 * h0 + p01 * h1, p10 * h0 + p11 * h1];
        let y = measured - (h0 * k0 + h1 * k1);
        let s = h0 * ph0 + h1 * ph1 + r;
        let step = (ph0.abs().max(ph1.abs()) * y / s).abs();
        let held_back = if step > LONGEST_STEP { LONGEST_STEP / step } else { 1.0 };
        let [g0, g1] = [ph0, ph1].map(|ph| held_back * ph / s);

        self.k = [k0 + g0 * y, k1 + g1 * y];
        // a = 1 − g h, p = a p aᵀ + r g gᵀ
        let a = [[1.0 - g0 * h0, -g0 * h1], [-g1 * h0, 1.0 - g1 * h1]];
        let ap = a.map(|[a0, a1]| [a0 * p00 + a1 * p10, a0 * p01 + a1 * p11]);
        let product = |[x0, x1]: [f64; 2], [z0, z1]: [f64; 2]| x0 * z0 + x1 * z1;
        let [row0, row1] = ap;
        let [a0, a1] = a;
        let p01 = product(row0, a1) + r * g0 * g1;
        self.p = [[product(row0, a0) + r * g0 * g0, p01], [p01, product(row1, a1) + r * g1 * g1]];
    }

    /// Moves the scales into what is possible, however far.
    pub(super) fn hold_within(&mut self, bounds: [(f64, f64); 2]) {
        let [k0, k1] = self.k;
        let [(low0, high0), (low1, high1)] = bounds;
        self.k = [k0.max(log(low0)).min(log(high0)), k1.max(log(low1)).min(log(high1))];
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn two_equal_measurements_are_averaged() {
        let mut filter = ScaleFilter::new([1.0, 1.0], [1e6, 1e6]);
        // A prior so wide that the step would be held back; start where the first measurement is.
        filter.k = [0.004, 0.0];
        filter.measure([1.0, 0.0], 0.004, 1e-6);
        filter.measure([1.0, 0.0], 0.008, 1e-6);
        assert!((filter.k[0] - 0.006).abs() < 1e-9);
        assert!((filter.p[0][0] - 0.5e-6).abs() < 1e-12);
    }

    #[test]
    fn what_is_learnt_of_one_reaches_the_other_through_their_ratio() {
        let mut filter = ScaleFilter::new([1.0, 1.0], [0.01, 0.01]);
        filter.measure([1.0, -1.0], 0.005, 1e-12);
        filter.measure([1.0, 0.0], 0.006, 1e-12);
        assert!((filter.k[0] - 0.006).abs() < 1e-6);
        assert!((filter.k[1] - 0.001).abs() < 1e-6);
    }

    #[test]
    fn a_step_that_is_held_back_leaves_the_rest_uncertain() {
        let mut filter = ScaleFilter::new([1.0, 1.0], [0.02, 0.02]);
        filter.measure([1.0, 0.0], 0.03, 1e-8);
        assert!((filter.k[0] - LONGEST_STEP).abs() < 1e-12);
        // A quarter of the step: three quarters of the deviation are left.
        assert!((sqrt(filter.p[0][0]) - 0.015).abs() < 1e-5);
    }

    proptest! {
        #[test]
        fn the_covariance_stays_symmetric_and_positive(
            measurements in prop::collection::vec((0..4usize, -1.0..1.0_f64, 1e-12..1e-2_f64, 0.0..1e3_f64), 0..200),
        ) {
            let mut filter = ScaleFilter::new([1.0, 1.0], [0.01, 0.02]);
            for (which, measured, r, km) in measurements {
                filter.wander(km);
                filter.measure([[1.0, 0.0], [0.0, 1.0], [0.5, 0.5], [1.0, -1.0]][which], measured, r);
                let [[p00, p01], [p10, p11]] = filter.p;
                prop_assert_eq!(p01.to_bits(), p10.to_bits());
                prop_assert!(p00 > 0.0 && p11 > 0.0 && p00 * p11 - p01 * p10 > 0.0);
            }
        }
    }
}
