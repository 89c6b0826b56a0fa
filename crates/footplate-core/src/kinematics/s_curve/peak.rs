//! The highest speed of a jerk-limited run that is too short to cruise.

use super::ramp::{holds_limit, way_and_slope};
use crate::kinematics::slow_end::cube_root;

/// Steps of Newton's method at most. Four or five are usual; the bound only keeps the loop finite.
const MOST_STEPS: u32 = 60;

/// A run that speeds up from one speed by a ramp and slows down to another by a second one.
#[derive(Debug, Clone, Copy)]
pub(super) struct Run {
    /// Speed at the lower end of the first ramp and of the second.
    pub(super) start: f64,
    pub(super) end: f64,
    pub(super) acceleration: f64,
    pub(super) deceleration: f64,
    pub(super) jerk: f64,
}

/// The speeds that the two ramps of a run gain.
#[derive(Debug, Clone, Copy)]
pub(super) struct Gains {
    pub(super) first: f64,
    pub(super) second: f64,
}

impl Run {
    /// What both ramps gain when the peak is `above` the higher of their lower ends.
    #[inline]
    fn gains(&self, above: f64) -> Gains {
        let base = self.start.max(self.end);
        Gains { first: base - self.start + above, second: base - self.end + above }
    }

    /// The gains to a peak speed.
    #[inline]
    pub(super) fn gains_to(&self, peak: f64) -> Gains {
        self.gains(peak - self.start.max(self.end))
    }

    /// The way of both ramps, and how it grows with the peak speed.
    #[inline]
    pub(super) fn way_and_slope(&self, gains: Gains) -> (f64, f64) {
        let (first, first_slope) = way_and_slope(self.start, gains.first, self.acceleration, self.jerk);
        let (second, second_slope) = way_and_slope(self.end, gains.second, self.deceleration, self.jerk);
        (first + second, first_slope + second_slope)
    }

    fn both_hold(&self, gains: Gains) -> bool {
        holds_limit(gains.first, self.acceleration, self.jerk)
            && holds_limit(gains.second, self.deceleration, self.jerk)
    }

    /// The gains, to a peak speed between `lowest` and `highest`, at which both ramps together take up a way or
    /// as much of it as they can.
    ///
    /// Closed where both ramps hold their limits (a quadratic), and where neither does and both begin from
    /// standstill (a cube root); by Newton's method in between.
    #[inline]
    pub(super) fn gains_for(&self, way: f64, lowest: f64, highest: f64) -> Gains {
        let Self { start, end, acceleration, deceleration, jerk } = *self;
        // (v² − v₁²)/2a + (v + v₁) a/2J + (v² − v₂²)/2b + (v + v₂) b/2J = d, multiplied by 2ab.
        let square = acceleration + deceleration;
        let linear = acceleration * deceleration * square / jerk;
        let constant = deceleration * start * (acceleration * acceleration / jerk - start)
            + acceleration * end * (deceleration * deceleration / jerk - end)
            - 2.0 * acceleration * deceleration * way;
        let root = libm::sqrt((linear * linear - 4.0 * square * constant).max(0.0));
        let peak = 0.5 * (root - linear) / square;
        if peak >= highest {
            // Ramps that need not hold their limits are shorter still.
            return self.gains_to(highest);
        }
        let gains = self.gains_to(peak);
        if self.both_hold(gains) {
            return gains;
        }
        // With v = J t², both ramps run v t: d = 2 J t³.
        let time = cube_root(0.5 * way / jerk);
        let peak_without_hold = jerk * time * time;
        let from_stand = start == 0.0 && end == 0.0;
        if from_stand && !holds_limit(peak_without_hold, acceleration.min(deceleration), jerk) {
            return self.gains_to(peak_without_hold.min(highest));
        }
        self.refine(way, peak, lowest, highest)
    }

    /// Newton's method in the root of what the peak is above the higher of both ends, in which the way is a
    /// convex function without a vertical start: once above the solution it comes down to it.
    fn refine(&self, way: f64, guess: f64, lowest: f64, highest: f64) -> Gains {
        let base = self.start.max(self.end);
        let (lowest, highest) = (lowest - base, highest - base);
        // At the base itself the curve has no slope to follow.
        let mut above = if guess > base { guess - base } else { highest };
        for _ in 0..MOST_STEPS {
            let (run, slope) = self.way_and_slope(self.gains(above));
            let old_root = libm::sqrt(above);
            let root = (old_root - (run - way) / (2.0 * old_root * slope)).max(0.0);
            let next = (root * root).max(lowest).min(highest);
            let settled = (next - above).abs() <= 4.0 * f64::EPSILON * next;
            above = next;
            if settled {
                break;
            }
        }
        self.gains(above)
    }
}
