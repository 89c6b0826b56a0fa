//! One period of the filters of all hypotheses: what begins, the prediction, and the counters that are trusted.

use super::arrivals::Arrivals;
use super::filters::{Filters, STRONGEST, State};
use super::lanes::{Lanes, WIDTH};
use crate::odometry::wheels::larger;

/// 1 for hypotheses in which the train moves.
pub(super) const MOVES: Lanes = Lanes([1.0, 1.0, 1.0, 1.0, 1.0, 0.0, 1.0, 1.0]);
/// The hypothesis in which it does not.
const STANDS: usize = 5;
/// Infinite for hypotheses that are corrected later, and limited then: those that trust no counter, and all but the one at rest
/// where there is an inertial sensor.
const LATER: Lanes = Lanes([0.0, 0.0, 0.0, f64::INFINITY, f64::INFINITY, 0.0, 0.0, 0.0]);
const LATER_INERTIAL: Lanes = {
    let infinite = f64::INFINITY;
    Lanes([infinite, infinite, infinite, infinite, infinite, 0.0, infinite, infinite])
};
/// Least probability: far below the risk of any interval.
pub(super) const LEAST: f64 = 1e-30;

/// What each hypothesis begins with.
#[derive(Debug, Clone, Copy)]
pub(super) struct Begins {
    /// The parts that each takes of what ends, and of "both roll", of this probability.
    pub(super) follows: Lanes,
    pub(super) after_rolling: Lanes,
    pub(super) rolling: f64,
    /// Variance of the speed that it begins with in addition (m²/s²).
    pub(super) lost: Lanes,
}

/// What the counters and the command say to each hypothesis.
#[derive(Debug, Clone, Copy)]
pub(super) struct Counts {
    /// How far the counter turned that each hypothesis trusts (m), the variance of that (m²), and 1 for those that trust one at all.
    pub(super) counted: Lanes,
    pub(super) variance: Lanes,
    pub(super) trusted: Lanes,
    /// What is added to each acceleration (m/s²), and the spectral density of the jerk (m²/s⁵).
    pub(super) added: Lanes,
    pub(super) jerk: &'static Lanes,
    /// The highest speed of the train (m/s).
    pub(super) top: f64,
    /// There is an inertial sensor.
    pub(super) inertial: bool,
}

/// The distance that each hypothesis ran (m), and its squared innovation over the variance.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ran {
    pub(super) distances: Lanes,
    pub(super) surprise: Lanes,
    /// A variance exceeds its largest.
    pub(super) exceeds: bool,
}

impl Filters {
    /// Advances every filter by `t` seconds, `ahead`, by how much each puts the train ahead of the estimate (m), and the
    /// probabilities, which then do not add up to 1.
    ///
    /// One loop from the mixture to the counters, so that a processor keeps a state in its registers and calculates as many
    /// hypotheses at a time as these are wide.
    #[inline(never)]
    #[expect(clippy::indexing_slicing, reason = "below the width of all")]
    pub(super) fn advance(
        &mut self,
        begins: &Begins,
        arrivals: &Arrivals,
        counts: &Counts,
        probability: &mut Lanes,
        ahead: &mut Lanes,
        t: f64,
    ) -> Ran {
        let Begins { follows, after_rolling, rolling, lost } = begins;
        let Arrivals { leaves, others, pool, ahead: pooled_ahead } = arrivals;
        let Counts { counted, variance, trusted, added, jerk, top, inertial } = counts;
        let later = if *inertial { &LATER_INERTIAL } else { &LATER };
        let mut ran = Ran { distances: Lanes::all(0.0), surprise: Lanes::all(0.0), exceeds: false };
        let mut exceeds = 0;
        for lane in 0..WIDTH {
            let arrives = after_rolling.0[lane] * rolling + follows.0[lane] * others.0[lane];
            let next = larger(probability.0[lane] - leaves.0[lane] + arrives, LEAST);
            probability.0[lane] = next;
            let share = arrives * (1.0 / next);
            let mut state = self.state(lane);
            state.mix(pool, share);
            state.pvv += share * lost.0[lane];
            let own_ahead = ahead.0[lane];
            let own_ahead = own_ahead + share * (*pooled_ahead - own_ahead);
            state.a += added.0[lane];
            let distance = state.run(t, jerk.0[lane]);
            let trusted = trusted.0[lane];
            state.r += (distance - counted.0[lane]) * trusted;
            let (moved, surprise) = state.place(variance.0[lane], trusted);
            let distance = distance + moved;
            state.limit(larger(*top, later.0[lane]), larger(STRONGEST, later.0[lane]));
            exceeds |= state.exceeds();
            self.set(lane, state);
            ahead.0[lane] = own_ahead + distance;
            ran.distances.0[lane] = distance;
            ran.surprise.0[lane] = surprise;
        }
        // A train at rest stays there.
        self.set(STANDS, State::at_rest(t));
        ahead.0[STANDS] -= ran.distances.0[STANDS];
        ran.distances.0[STANDS] = 0.0;
        ran.exceeds = exceeds >> (u64::BITS - 1) != 0;
        ran
    }
}
