//! Restricts transitions to hypotheses with a rolling wheel to trains that have the speed of that wheel.
//!
//! Without this, probability leaks to "both roll" from a train at 20 m/s with locked wheels: a filter that rolls is
//! already at 0 m/s there, explains the silence and never pays for the leap of speed.

use super::evidence::{Compared, SILENT};
use super::filters::{Filters, Pool};
use super::lanes::{Lanes, WIDTH, likelihood};
use super::scene::Scene;
use crate::odometry::wheels::{larger, smaller};

/// Standard deviation of the speed of a wheel that rolls again, relative to the train (m/s).
const MEETS: f64 = 0.1;
/// Limit of the squared difference over its variance, for a wheel that turns and for a silent one, so that a lost train is found
/// again within seconds. Tuned on seeds 301 to 306 of the families.
const MEETS_NOT: (f64, f64) = (4.0, 7.0);

const BOTH_ROLL: Lanes = Lanes([1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);

/// The hypotheses of which a part ends in a period.
pub(super) struct Ending<'a> {
    pub(super) filters: &'a Filters,
    pub(super) probability: &'a Lanes,
    /// By how much each puts the train ahead of the estimate (m).
    pub(super) ahead: &'a Lanes,
    /// The part of each that ends, and in what proportions the others follow.
    pub(super) ends: &'a Lanes,
    pub(super) follows: &'a Lanes,
    /// The probability of "both roll" that ends.
    pub(super) of_rolling: f64,
    /// The estimate: speed (m/s) and acceleration (m/s²).
    pub(super) about: [f64; 2],
}

/// The probability of hypotheses that end.
pub(super) struct Arrivals {
    /// What leaves each hypothesis. The rest of what ends stays, because the wheels do not meet its train.
    pub(super) leaves: Lanes,
    /// The probability, other than of "both roll", that each hypothesis may take its part of.
    pub(super) others: Lanes,
    /// The state of what leaves, and how far it puts the train ahead of the estimate (m).
    pub(super) pool: Pool,
    pub(super) ahead: f64,
}

/// Distributes the probability of hypotheses that end; `prr` is the variance of the place with which others begin (m²).
#[inline(never)]
#[expect(clippy::indexing_slicing, reason = "below the width of all")]
pub(super) fn arrivals(scene: &Scene, wheels: &[Compared; 2], ending: &Ending, prr: f64) -> Arrivals {
    let Ending { filters, probability, ahead, ends, follows, of_rolling, about } = *ending;
    let [first, second] = &scene.wheels;
    let [one, other] = wheels;
    let (one, other) = (Rolling::new(first.read, one), Rolling::new(second.read, other));
    let [rolls, first_slips, second_slips, ..] = follows.0;
    let all = follows.sum();
    let zero = Lanes::all(0.0);
    let (mut leaves, mut moments, mut weighted) = (zero, [zero; 5], zero);
    let [mut rest, mut no_roll, mut no_first, mut no_second] = [zero; 4];
    for lane in 0..WIDTH {
        let (v, a, pvv) = (filters.v.0[lane], filters.a.0[lane], filters.pvv.0[lane]);
        let (first, second) = (one.meets(v, pvv), other.meets(v, pvv));
        let (miss_both, miss_first, miss_second) = (1.0 - first * second, 1.0 - first, 1.0 - second);
        let own = probability.0[lane] * ends.0[lane];
        rest.0[lane] = own;
        no_roll.0[lane] = own * miss_both;
        no_first.0[lane] = own * miss_second;
        no_second.0[lane] = own * miss_first;
        let stays_lost = miss_both * rolls + miss_second * first_slips + miss_first * second_slips;
        let leaving = own * (all - stays_lost) + BOTH_ROLL.0[lane] * of_rolling;
        leaves.0[lane] = leaving;
        weighted.0[lane] = leaving * ahead.0[lane];
        let own = Pool::moments([v, a], [pvv, filters.pva.0[lane], filters.paa.0[lane]], about);
        let [m0, m1, m2, m3, m4] = own;
        moments[0].0[lane] = leaving * m0;
        moments[1].0[lane] = leaving * m1;
        moments[2].0[lane] = leaving * m2;
        moments[3].0[lane] = leaving * m3;
        moments[4].0[lane] = leaving * m4;
    }
    let mut others = Lanes::all(rest.sum());
    let [rolls, first_slips, second_slips, ..] = &mut others.0;
    *rolls -= no_roll.sum();
    *first_slips -= no_first.sum();
    *second_slips -= no_second.sum();
    let per = 1.0 / leaves.sum();
    let pool = Pool::of(moments.map(|moment| moment.sum() * per), about, prr);
    Arrivals { leaves, others, pool, ahead: weighted.sum() * per }
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
        Self {
            read: f64::from(u8::from(read)),
            speed: wheel.speed,
            variance: wheel.variance + MEETS * MEETS,
            most,
        }
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
