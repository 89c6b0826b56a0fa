//! Three local filters and a master that fuses them, in the variants that the published text allows.
//!
//! The local filters follow the two wheelsets and the virtual sensor; the master has no measurement of its own. With
//! shares β_i that add up to 1 the published filter (after Carlson, 1990) resets, filters and fuses in every period:
//!
//! ```text
//! x_i = x_f   P_i = P_f/β_i   Q_i = Q/β_i       then each filter predicts and takes its measurement, and
//! P_f = (Σ P_i⁻¹)⁻¹           x_f = P_f Σ P_i⁻¹ x_i
//! ```
//!
//! Taken literally, the shares have no effect: the prior of filter i is P⁻/β_i, so the information of all of them
//! after their measurements is Σ β_i (P⁻)⁻¹ + Σ HᵀH/r_i, that of the one central filter whatever the shares. A
//! wheelset that slides by 2 m/s pulls the estimate along by half of it even at a share of 1e-6. The measurement has
//! to be coupled to the share; [`Fusion`] lists the variants.

use super::covariance::Covariance;
use super::local_filter::{Innovation, LocalFilter, MeasuredSpeed};
use super::motion_step::MotionStep;
use crate::odometry::sound::sound;

/// Shares below this count as this: a covariance is divided by them.
const LEAST_SHARE: f64 = 1e-12;

/// A free-running filter with a smaller share follows the train: far above any floor of shares that makes sense,
/// far below any share of a trusted wheelset.
const LEAST_SHARE_OF_ITS_OWN: f64 = 0.01;

/// How shares work.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fusion {
    /// As printed: only the prior is shared out, so that the shares have no effect.
    Literal,
    /// Prior and measurement: the variance of the measurement is divided by the share, too.
    Reset,
    /// Local filters run free, and their information is weighed by the shares. That is covariance intersection
    /// (Julier and Uhlmann, 1997): consistent however the errors of the filters hang together, as they do by the
    /// process noise they have in common.
    CovarianceIntersection,
}

/// The filter of a train with two measured wheelsets.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FederatedFilter {
    fusion: Fusion,
    locals: [LocalFilter; 3],
    master: LocalFilter,
}

impl FederatedFilter {
    /// A train that was met at this speed.
    #[must_use]
    pub fn starting_at(fusion: Fusion, measured: MeasuredSpeed) -> Self {
        let master = LocalFilter::starting_at(measured);
        Self { fusion, locals: [master; 3], master }
    }

    /// Speed and acceleration of the train, fused.
    #[must_use]
    pub fn master(&self) -> &LocalFilter {
        &self.master
    }

    /// What the filters of the two wheelsets and of the virtual sensor make of their own measurements.
    #[must_use]
    pub fn locals(&self) -> &[LocalFilter; 3] {
        &self.locals
    }

    /// Lets one period go by and folds in what was measured in it, each with its share; says how surprising each
    /// measurement was to its filter.
    pub fn step(
        &mut self,
        step: &MotionStep,
        measured: [MeasuredSpeed; 3],
        shares: [f64; 3],
    ) -> [Innovation; 3] {
        let shares = shares.map(|share| sound(share, LEAST_SHARE, 1.0));
        match self.fusion {
            Fusion::Literal => self.reset_and_fuse(step, measured, shares, [1.0; 3]),
            Fusion::Reset => self.reset_and_fuse(step, measured, shares, shares),
            Fusion::CovarianceIntersection => self.intersect(step, measured, shares),
        }
    }

    /// Begins again everywhere, at this speed.
    pub fn restart(&mut self, measured: MeasuredSpeed) {
        *self = Self::starting_at(self.fusion, measured);
    }

    fn reset_and_fuse(
        &mut self,
        step: &MotionStep,
        [z1, z2, z3]: [MeasuredSpeed; 3],
        [b1, b2, b3]: [f64; 3],
        [m1, m2, m3]: [f64; 3],
    ) -> [Innovation; 3] {
        // F (P_f/β) Fᵀ + Q/β is (F P_f Fᵀ + Q)/β.
        let mut prior = self.master;
        prior.predict(step);
        let mut sum = Sum::about(prior.state);
        let [first, second, third] = &mut self.locals;
        let mut one = |local: &mut LocalFilter, measured, share_of_prior: f64, share_of_measurement| {
            *local =
                LocalFilter { state: prior.state, covariance: prior.covariance.times(1.0 / share_of_prior) };
            let innovation = local.update_with_share(measured, share_of_measurement);
            sum.add(local, 1.0);
            innovation
        };
        let innovations = [one(first, z1, b1, m1), one(second, z2, b2, m2), one(third, z3, b3, m3)];
        self.master = sum.fused();
        innovations
    }

    fn intersect(
        &mut self,
        step: &MotionStep,
        [z1, z2, z3]: [MeasuredSpeed; 3],
        [b1, b2, b3]: [f64; 3],
    ) -> [Innovation; 3] {
        let mut sum = Sum::about(step.state(self.master.state));
        // Worked on as values and stored once: reading back a partly stored value stalls.
        let [mut first, mut second, mut third] = self.locals;
        let mut one = |local: &mut LocalFilter, measured, share| {
            local.predict(step);
            let innovation = local.update(measured);
            sum.add(local, share);
            innovation
        };
        let innovations = [one(&mut first, z1, b1), one(&mut second, z2, b2), one(&mut third, z3, b3)];
        self.master = sum.fused();
        self.locals = [first, second, third];
        // A filter without a reading or without trust follows the train: it is ready to begin
        // where the train is, and does not bring a slide back when its wheelset is trusted again.
        for ((local, innovation), share) in self.locals.iter_mut().zip(&innovations).zip([b1, b2, b3]) {
            if !innovation.taken || share < LEAST_SHARE_OF_ITS_OWN {
                follow(local, &self.master);
            }
        }
        innovations
    }
}

/// Apart from the rest, so that a filter on its own does not wait for the master.
#[cold]
#[inline(never)]
fn follow(local: &mut LocalFilter, master: &LocalFilter) {
    *local = *master;
}

/// Information that has been brought together so far, with states counted from a point near all of them, so that
/// filters that agree are fused to exactly that.
struct Sum {
    about: [f64; 2],
    information: Covariance,
    /// Σ P_i⁻¹ (x_i − about).
    weighed: [f64; 2],
}

impl Sum {
    fn about(about: [f64; 2]) -> Self {
        Self { about, information: Covariance::ZERO, weighed: [0.0; 2] }
    }

    fn add(&mut self, local: &LocalFilter, weight: f64) {
        let information = local.covariance.inverse().times(weight);
        let off = difference(local.state, self.about);
        self.information = self.information.plus(information);
        self.weighed = sum(self.weighed, information.applied(off));
    }

    fn fused(&self) -> LocalFilter {
        let covariance = self.information.inverse();
        LocalFilter { state: sum(self.about, covariance.applied(self.weighed)), covariance }
    }
}

fn sum([a1, a2]: [f64; 2], [b1, b2]: [f64; 2]) -> [f64; 2] {
    [a1 + b1, a2 + b2]
}

fn difference([a1, a2]: [f64; 2], [b1, b2]: [f64; 2]) -> [f64; 2] {
    [a1 - b1, a2 - b2]
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const PERIOD: f64 = 0.05;

    fn at(speed: f64) -> MeasuredSpeed {
        MeasuredSpeed { speed, variance: 0.05 }
    }

    /// The central Kalman filter: two measurements, one after the other, in the textbook's form.
    struct Central {
        x: [f64; 2],
        p: [[f64; 2]; 2],
    }

    impl Central {
        fn step(&mut self, q: f64, measured: [MeasuredSpeed; 2]) {
            let ([v, a], t) = (self.x, PERIOD);
            let [[p11, p12], [_, p22]] = self.p;
            let [q11, q12, q22] = [q * t * t * t / 3.0, q * t * t / 2.0, q * t];
            self.x = [v + t * a, a];
            let mixed = p12 + t * p22 + q12;
            self.p = [[p11 + 2.0 * t * p12 + t * t * p22 + q11, mixed], [mixed, p22 + q22]];
            for MeasuredSpeed { speed, variance } in measured {
                let [[p11, p12], [_, p22]] = self.p;
                let (k1, k2) = (p11 / (p11 + variance), p12 / (p11 + variance));
                let innovation = speed - self.x[0];
                self.x = [self.x[0] + k1 * innovation, self.x[1] + k2 * innovation];
                self.p = [[(1.0 - k1) * p11, (1.0 - k1) * p12], [(1.0 - k1) * p12, p22 - k2 * p12]];
            }
        }
    }

    /// Thirty seconds at 20 m/s; from the tenth on the second wheelset turns 2 m/s too slowly. Returns the
    /// filter, and by how much the speed is off at the end.
    fn slide(fusion: Fusion, shares: [f64; 3]) -> (FederatedFilter, f64) {
        let mut filter = FederatedFilter::starting_at(fusion, at(20.0));
        let step = MotionStep::wandering(0.02, PERIOD);
        for period in 0..600 {
            let second = if period < 200 { 20.0 } else { 18.0 };
            filter.step(&step, [at(20.0), at(second), MeasuredSpeed::MISSING], shares);
        }
        (filter, filter.master().state[0] - 20.0)
    }

    #[test]
    fn as_printed_the_shares_have_no_effect() {
        let q = 0.02;
        for share in [0.498, 0.1, 1e-3, 1e-6] {
            let shares = [1.0 - share - 1e-6, share, 1e-6];
            let mut filter = FederatedFilter::starting_at(Fusion::Literal, at(20.0));
            let mut central = Central { x: [20.0, 0.0], p: [[0.05, 0.0], [0.0, 1.0]] };
            for period in 0..600 {
                let measured =
                    [at(20.0 + 0.1 * f64::from(period % 3)), at(if period < 200 { 20.0 } else { 18.0 })];
                let [first, second] = measured;
                filter.step(
                    &MotionStep::wandering(q, PERIOD),
                    [first, second, MeasuredSpeed::MISSING],
                    shares,
                );
                central.step(q, measured);
                let off = difference(filter.master().state, central.x);
                assert!(off.iter().all(|off| off.abs() < 1e-10), "share {share}, period {period}: {off:?}");
                assert!((filter.master().covariance.speed - central.p[0][0]).abs() < 1e-12);
            }
        }
        for share in [0.498, 1e-6] {
            let (_, bias) = slide(Fusion::Literal, [1.0 - share - 1e-3, share, 1e-3]);
            assert!((-1.02..-0.95).contains(&bias), "half of the slide at a share of {share}: {bias}");
        }
    }

    #[test]
    fn coupled_to_its_share_a_sliding_wheelset_pulls_nothing_along() {
        for fusion in [Fusion::Reset, Fusion::CovarianceIntersection] {
            let (_, bias) = slide(fusion, [0.998, 1e-3, 1e-3]);
            assert!(bias.abs() < 0.05, "{fusion:?}: {bias}");
            let (_, trusted) = slide(fusion, [0.4995, 0.4995, 1e-3]);
            assert!((trusted + 1.0).abs() < 0.05, "{fusion:?}: trusted, it pulls by a half: {trusted}");
        }
    }

    #[test]
    fn information_is_neither_won_nor_lost() {
        // Without measurements the shared-out priors, fused, are the one that was shared out.
        let shares = [0.6, 0.399, 1e-3];
        for fusion in [Fusion::Literal, Fusion::Reset] {
            let (mut filter, _) = slide(fusion, shares);
            let step = MotionStep::wandering(0.02, PERIOD);
            let mut prior = *filter.master();
            prior.predict(&step);
            filter.step(&step, [MeasuredSpeed::MISSING; 3], shares);
            let sum =
                filter.locals().iter().fold(Covariance::ZERO, |sum, l| sum.plus(l.covariance.inverse()));
            let off = |a: f64, b: f64| (a / b - 1.0).abs();
            assert!(off(sum.speed, prior.covariance.inverse().speed) < 1e-12);
            assert!(off(filter.master().covariance.acceleration, prior.covariance.acceleration) < 1e-12);
            assert!(difference(filter.master().state, prior.state).iter().all(|off| off.abs() < 1e-12));
        }
        // Covariance intersection claims no more than the weighed mean of what its filters know.
        let (filter, _) = slide(Fusion::CovarianceIntersection, shares);
        let [first, second, _] = filter.locals();
        let best = first.covariance.speed.min(second.covariance.speed);
        assert!(filter.master().covariance.speed > 0.99 * best);
    }

    #[test]
    fn a_virtual_sensor_that_takes_over_begins_where_the_train_is() {
        for fusion in [Fusion::Reset, Fusion::CovarianceIntersection] {
            let (mut filter, _) = slide(fusion, [0.998, 1e-3, 1e-3]);
            let before = filter.master().state[0];
            let virtual_sensor = MeasuredSpeed { speed: before - 0.03, variance: 0.05 };
            filter.step(
                &MotionStep::wandering(0.02, PERIOD),
                [at(12.0), at(9.0), virtual_sensor],
                [1e-3, 1e-3, 0.998],
            );
            assert!((filter.master().state[0] - before).abs() < 0.05, "{fusion:?}");
        }
    }

    #[test]
    fn filters_that_agree_are_fused_to_exactly_that() {
        let filter = FederatedFilter::starting_at(Fusion::CovarianceIntersection, at(31.0));
        let mut sum = Sum::about(filter.master().state);
        for local in filter.locals() {
            sum.add(local, 0.3);
        }
        assert_eq!(sum.fused().state, [31.0, 0.0]);
    }

    fn anything() -> impl Strategy<Value = f64> {
        prop_oneof![3 => -100.0..100.0_f64, 1 => proptest::num::f64::ANY, 1 => Just(1e308), 1 => Just(f64::NAN)]
    }

    fn a_fusion() -> impl Strategy<Value = Fusion> {
        prop_oneof![Just(Fusion::Literal), Just(Fusion::Reset), Just(Fusion::CovarianceIntersection)]
    }

    proptest! {
        #[test]
        fn no_input_poisons_it(
            fusion in a_fusion(),
            periods in proptest::collection::vec(
                (proptest::array::uniform3((anything(), anything())), proptest::array::uniform3(anything()), anything()),
                1..100,
            ),
        ) {
            let mut filter = FederatedFilter::starting_at(fusion, at(20.0));
            for (measured, shares, period) in periods {
                let measured = measured.map(|(speed, variance)| MeasuredSpeed { speed, variance });
                let innovations = filter.step(&MotionStep::wandering(0.02, period), measured, shares);
                for (innovation, measured) in innovations.iter().zip(measured) {
                    prop_assert_eq!(innovation.taken, measured.is_usable());
                }
                for one in filter.locals().iter().chain([filter.master()]) {
                    prop_assert!(one.state.iter().all(|x| x.is_finite()), "{one:?}");
                    prop_assert!(one.covariance.speed > 0.0 && one.covariance.acceleration > 0.0, "{one:?}");
                }
            }
            for _ in 0..1200 {
                let step = MotionStep::wandering(0.02, PERIOD);
                filter.step(&step, [at(12.0), at(12.0), MeasuredSpeed::MISSING], [0.4995, 0.4995, 1e-3]);
            }
            prop_assert!((filter.master().state[0] - 12.0).abs() < 0.05, "{filter:?}");
        }
    }
}
