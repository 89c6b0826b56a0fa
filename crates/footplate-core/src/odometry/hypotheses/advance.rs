//! One period of the filters of all hypotheses: what begins, the prediction, and the counters that are trusted.

use super::filters::{Filters, Pool, STRONGEST};
use super::lanes::{Lanes, WIDTH};
use crate::odometry::wheels::larger;

/// 1 for hypotheses in which the train moves, and for the one in which it does not.
pub(super) const MOVES: Lanes = Lanes([1.0, 1.0, 1.0, 1.0, 1.0, 0.0, 1.0, 1.0]);
const STANDS: Lanes = Lanes([0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0]);
/// Variance of the speed and acceleration at rest (m²/s², m²/s⁴): nothing but rounding.
const AT_REST: f64 = 1e-6;
/// Infinite for hypotheses that are corrected later, and limited then: those that trust no counter, and all but the one at rest
/// where there is an inertial sensor.
const LATER: Lanes = Lanes([0.0, 0.0, 0.0, f64::INFINITY, f64::INFINITY, 0.0, 0.0, 0.0]);
const LATER_INERTIAL: Lanes = {
    let infinite = f64::INFINITY;
    Lanes([infinite, infinite, infinite, infinite, infinite, 0.0, infinite, infinite])
};
/// Least probability: far below the risk of any interval.
pub(super) const LEAST: f64 = 1e-30;

/// What each hypothesis takes over from those that end.
#[derive(Debug, Clone, Copy)]
pub(super) struct Begins {
    /// The state of those that end, and how far they put the train ahead of the estimate (m).
    pub(super) pool: Pool,
    pub(super) ahead: f64,
    /// What leaves each hypothesis, and the parts of that and of "both roll" that each begins with.
    pub(super) leaves: Lanes,
    pub(super) others: Lanes,
    pub(super) follows: Lanes,
    pub(super) after_rolling: Lanes,
    pub(super) rolling: f64,
    /// Variance of the speed that it begins with in addition (m²/s²).
    pub(super) lost: Lanes,
    /// How much less often it begins then.
    pub(super) found: Lanes,
}

/// What the counters and the command say to each hypothesis.
#[derive(Debug, Clone, Copy)]
pub(super) struct Counts {
    /// Weight of each counter in the place of each hypothesis, and 1 for those that trust one at all.
    pub(super) weights: [Lanes; 2],
    pub(super) trusted: Lanes,
    /// How far each wheel turned (m), and the distance of a pulse (m).
    pub(super) counted: [f64; 2],
    pub(super) pitches: [f64; 2],
    /// What is added to each acceleration (m/s²), and the spectral density of the jerk (m²/s⁵).
    pub(super) added: Lanes,
    pub(super) jerk: Lanes,
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
        counts: &Counts,
        probability: &mut Lanes,
        ahead: &mut Lanes,
        t: f64,
    ) -> Ran {
        let Begins { pool, ahead: pooled_ahead, leaves, others, follows, .. } = *begins;
        let Begins { after_rolling, rolling, lost, found, .. } = *begins;
        let Counts { weights: [alpha, beta], trusted, counted, pitches, .. } = *counts;
        let Counts { added, jerk, top, inertial, .. } = *counts;
        let later = if inertial { LATER_INERTIAL } else { LATER };
        let ([counted_1, counted_2], [pitch_1, pitch_2]) = (counted, pitches);
        let (white_1, white_2) = (pitch_1 * (1.0 / 12.0_f64), pitch_2 * (1.0 / 12.0_f64));
        let mut ran = Ran { distances: Lanes::all(0.0), surprise: Lanes::all(0.0), exceeds: false };
        let mut exceeds = 0;
        for lane in 0..WIDTH {
            let arrives =
                after_rolling.0[lane] * rolling + follows.0[lane] * others.0[lane] * found.0[lane];
            let next = larger(probability.0[lane] - leaves.0[lane] + arrives, LEAST);
            probability.0[lane] = next;
            let share = arrives * (1.0 / next);
            let mut state = self.state(lane);
            state.mix(&pool, share);
            state.pvv += share * lost.0[lane];
            let own_ahead = ahead.0[lane];
            let own_ahead = own_ahead + share * (pooled_ahead - own_ahead);
            // A train at rest stays there.
            let (moves, rests) = (MOVES.0[lane], STANDS.0[lane] * AT_REST);
            state.v *= moves;
            state.a *= moves;
            state.pva *= moves;
            state.pvv = state.pvv * moves + rests;
            state.paa = state.paa * moves + rests;

            state.a += added.0[lane];
            let distance = state.run(t, jerk.0[lane]);
            let (one, other) = (alpha.0[lane], beta.0[lane]);
            let trusted = trusted.0[lane];
            state.r += (distance - one * counted_1 - other * counted_2) * trusted;
            let (off_1, off_2) = (one * white_1 * one * pitch_1, other * white_2 * other * pitch_2);
            let (moved, surprise) = state.place(off_1 + off_2 + 1e-9, trusted);
            let distance = distance + moved;
            state.limit(larger(top, later.0[lane]), larger(STRONGEST, later.0[lane]));
            exceeds |= state.exceeds();
            self.set(lane, state);
            ahead.0[lane] = own_ahead + distance;
            ran.distances.0[lane] = distance;
            ran.surprise.0[lane] = surprise;
        }
        ran.exceeds = exceeds >> (u64::BITS - 1) != 0;
        ran
    }
}
