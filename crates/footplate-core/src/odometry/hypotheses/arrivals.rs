//! Restricts transitions to hypotheses with a rolling wheel to trains that have the speed of that wheel.
//!
//! Without this, probability leaks to "both roll" from a train at 20 m/s with locked wheels: a filter that rolls is
//! already at 0 m/s there, explains the silence and never pays for the leap of speed.

use super::evidence::{Compared, SILENT};
use super::filters::Filters;
use super::lanes::Lanes;
use super::scene::Scene;

/// Standard deviation of the speed of a wheel that rolls again, relative to the train (m/s).
const MEETS: f64 = 0.1;
/// Limit of the squared difference over its variance, for a wheel that turns and for a silent one, so that a lost train is found
/// again within seconds. Tuned on seeds 301 to 306 of the families.
const MEETS_NOT: (f64, f64) = (4.0, 7.0);
const BOTH_ROLL: Lanes = Lanes([1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
const FIRST_SLIPS: Lanes = Lanes([0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
const SECOND_SLIPS: Lanes = Lanes([0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0]);

/// The probability of hypotheses that end, other than "both roll".
pub(super) struct Arrivals {
    /// The part of each that stays, because the wheels do not meet its train.
    pub(super) stays_lost: Lanes,
    /// The probability that each hypothesis may take its part of.
    pub(super) others: Lanes,
}

/// Distributes the probability `ending` of hypotheses that end, in the proportions `follows`.
pub(super) fn arrivals(
    scene: &Scene,
    wheels: &[Compared; 2],
    filters: &Filters,
    ending: Lanes,
    follows: Lanes,
) -> Arrivals {
    let [first, second] = &scene.wheels;
    let [one, other] = wheels;
    let (first, second) = (meets(first.read, one, filters), meets(second.read, other, filters));
    let both = first * second;
    let [rolls, first_slips, second_slips, ..] = follows.0;
    let not = |meets: Lanes| Lanes::all(1.0) - meets;
    let missing = |meets: Lanes| (ending * not(meets)).sum();
    Arrivals {
        stays_lost: not(both) * rolls + not(second) * first_slips + not(first) * second_slips,
        others: Lanes::all(ending.sum())
            - BOTH_ROLL * missing(both)
            - FIRST_SLIPS * missing(second)
            - SECOND_SLIPS * missing(first),
    }
}

/// How well the speed of a wheel meets that of the train by each hypothesis, 0 to 1.
fn meets(read: bool, wheel: &Compared, filters: &Filters) -> Lanes {
    if !read {
        return Lanes::all(1.0);
    }
    let y = Lanes::all(wheel.speed) - filters.v;
    let variance = filters.pvv + (wheel.variance + MEETS * MEETS);
    let most = if wheel.speed.abs() > SILENT { MEETS_NOT.0 } else { MEETS_NOT.1 };
    let off = (y * y * variance.inverse() - Lanes::all(1.0)).at_least(0.0).at_most(most);
    (off * -0.5).likelihoods()
}
