//! Restricts transitions to hypotheses with a rolling wheel to trains that have the speed of that wheel.
//!
//! Without this, probability leaks to "both roll" from a train at 20 m/s with locked wheels: a filter that rolls is
//! already at 0 m/s there, explains the silence and never pays for the leap of speed.

use super::evidence::{Compared, SILENT};
use super::filters::Filters;
use super::lanes::{Lanes, WIDTH, likelihood};
use super::scene::Scene;
use crate::odometry::wheels::{larger, smaller};

/// Standard deviation of the speed of a wheel that rolls again, relative to the train (m/s).
const MEETS: f64 = 0.1;
/// Limit of the squared difference over its variance, for a wheel that turns and for a silent one, so that a lost train is found
/// again within seconds. Tuned on seeds 301 to 306 of the families.
const MEETS_NOT: (f64, f64) = (4.0, 7.0);

/// The probability of hypotheses that end, other than "both roll".
pub(super) struct Arrivals {
    /// The part of each that stays, because the wheels do not meet its train.
    pub(super) stays_lost: Lanes,
    /// The probability that each hypothesis may take its part of.
    pub(super) others: Lanes,
}

/// Distributes the probability `ending` of hypotheses that end, in the proportions `follows`.
#[inline(never)]
#[expect(clippy::indexing_slicing, reason = "below the width of all")]
pub(super) fn arrivals(
    scene: &Scene,
    wheels: &[Compared; 2],
    filters: &Filters,
    ending: &Lanes,
    follows: &Lanes,
) -> Arrivals {
    let [first, second] = &scene.wheels;
    let [one, other] = wheels;
    let (one, other) = (Rolling::new(first.read, one), Rolling::new(second.read, other));
    let [rolls, first_slips, second_slips, ..] = follows.0;
    let mut stays_lost = Lanes::all(0.0);
    let [mut no_roll, mut no_first, mut no_second] = [stays_lost; 3];
    for lane in 0..WIDTH {
        let (v, pvv, ends) = (filters.v.0[lane], filters.pvv.0[lane], ending.0[lane]);
        let (first, second) = (one.meets(v, pvv), other.meets(v, pvv));
        let (miss_both, miss_first, miss_second) = (1.0 - first * second, 1.0 - first, 1.0 - second);
        stays_lost.0[lane] = miss_both * rolls + miss_second * first_slips + miss_first * second_slips;
        no_roll.0[lane] = ends * miss_both;
        no_first.0[lane] = ends * miss_second;
        no_second.0[lane] = ends * miss_first;
    }
    let mut others = Lanes::all(ending.sum());
    let [rolls, first_slips, second_slips, ..] = &mut others.0;
    *rolls -= no_roll.sum();
    *first_slips -= no_first.sum();
    *second_slips -= no_second.sum();
    Arrivals { stays_lost, others }
}

/// A wheel that may roll.
struct Rolling {
    /// 1 if it was read, otherwise 0.
    read: f64,
    speed: f64,
    /// Variance of its speed relative to the train (m²/s²).
    variance: f64,
    most: f64,
}

impl Rolling {
    fn new(read: bool, wheel: &Compared) -> Self {
        let most = if wheel.speed.abs() > SILENT { MEETS_NOT.0 } else { MEETS_NOT.1 };
        Self { read: f64::from(u8::from(read)), speed: wheel.speed, variance: wheel.variance + MEETS * MEETS, most }
    }

    /// How well its speed meets that of a train, 0 to 1.
    #[inline(always)]
    fn meets(&self, v: f64, pvv: f64) -> f64 {
        let y = self.speed - v;
        let variance = pvv + self.variance;
        let off = smaller(larger(y * y * (1.0 / variance) - 1.0, 0.0), self.most);
        // A wheel that was not read meets every train.
        likelihood(off * -0.5) * self.read + (1.0 - self.read)
    }
}
