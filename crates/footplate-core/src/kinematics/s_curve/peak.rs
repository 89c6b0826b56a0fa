//! The highest speed of a jerk-limited run that is too short to cruise.

use super::ramp::Rate;
use crate::kinematics::phase::{SlowEnd, cube_root};

/// Most steps of Newton's method. Two or three are usual; the bound only keeps the loop finite.
const MOST_STEPS: u32 = 30;

/// Newton's method ends after a relative step of this size: the remaining error is about its square.
const SETTLED: f64 = 2e-8;

/// The peak speed, not above `highest`, of a run from standstill to standstill.
///
/// In closed form where both ramps hold their limits (a quadratic) and where neither does (a cube root).
#[inline(always)]
pub(super) fn peak_from_rest_to_rest(distance: f64, highest: f64, speeding: &Rate, braking: &Rate) -> f64 {
    let (a, b) = (speeding.limit, braking.limit);
    // v²/2a + v a/2J + v²/2b + v b/2J = d, multiplied by 2ab.
    let (square, double) = (a + b, 2.0 * a * b);
    let linear = 0.5 * double * square * speeding.per_jerk;
    let constant = double * distance;
    let root = libm::sqrt(linear * linear + 4.0 * square * constant);
    let peak = 2.0 * constant / (linear + root);
    if speeding.is_reached_by(peak) && braking.is_reached_by(peak) {
        return if peak < highest { peak } else { highest };
    }
    // With v = J t², both ramps run v t: d = 2 J t³.
    let time = cube_root(0.5 * distance * speeding.per_jerk);
    let without_hold = speeding.jerk * time * time;
    if !speeding.is_reached_by(without_hold) && !braking.is_reached_by(without_hold) {
        return if without_hold < highest { without_hold } else { highest };
    }
    let run = Run { start: 0.0, end: 0.0, speeding: *speeding, braking: *braking };
    run.refine(distance, 0.0, highest).first
}

/// A run that speeds up from one speed by a ramp and slows down to another by a second one.
#[derive(Debug, Clone, Copy)]
pub(super) struct Run {
    /// Speed at the lower end of the first ramp and of the second.
    pub(super) start: f64,
    pub(super) end: f64,
    pub(super) speeding: Rate,
    pub(super) braking: Rate,
}

/// The speeds that the two ramps of a run gain.
#[derive(Debug, Clone, Copy)]
pub(super) struct Gains {
    pub(super) first: f64,
    pub(super) second: f64,
}

impl Run {
    /// The gains of both ramps if the peak is `above` the higher of their lower ends.
    #[inline(always)]
    fn gains(&self, above: f64) -> Gains {
        let base = self.start.max(self.end);
        Gains { first: base - self.start + above, second: base - self.end + above }
    }

    /// The gains to a peak speed.
    #[inline(always)]
    pub(super) fn gains_to(&self, peak: f64) -> Gains {
        self.gains(peak - self.start.max(self.end))
    }

    /// The distance of both ramps, and its derivative with respect to the peak speed.
    #[inline(always)]
    pub(super) fn distance_and_slope(&self, gains: Gains) -> (f64, f64) {
        let (first, first_slope) = self.speeding.distance_and_slope(self.start, gains.first);
        let (second, second_slope) = self.braking.distance_and_slope(self.end, gains.second);
        (first + second, first_slope + second_slope)
    }

    #[inline(always)]
    fn both_hold(&self, gains: Gains) -> bool {
        self.speeding.is_reached_by(gains.first) && self.braking.is_reached_by(gains.second)
    }

    /// The gains, to a peak speed between `lowest` and `highest`, with which both ramps cover a distance, or as much
    /// of it as possible: in closed form where both hold their limits, otherwise by Newton's method.
    #[inline(always)]
    pub(super) fn gains_for(&self, distance: f64, lowest: f64, highest: f64) -> Gains {
        let Self { start, end, speeding, braking } = *self;
        let (a, b, per_jerk) = (speeding.limit, braking.limit, speeding.per_jerk);
        // (v² − v₁²)/2a + (v + v₁) a/2J + (v² − v₂²)/2b + (v + v₂) b/2J = d, multiplied by 2ab.
        let square = a + b;
        let linear = a * b * square * per_jerk;
        let constant = 2.0 * a * b * distance
            - b * start * (a * a * per_jerk - start)
            - a * end * (b * b * per_jerk - end);
        let peak = 2.0 * constant / (linear + libm::sqrt(linear * linear + 4.0 * square * constant));
        if peak >= highest {
            // Ramps that do not reach their limits are shorter still.
            return self.gains_to(highest);
        }
        let gains = self.gains_to(peak);
        if self.both_hold(gains) {
            return gains;
        }
        self.refine(distance, lowest, highest)
    }

    /// Newton's method in the root u of the peak's excess over the higher end, in which the distance is a convex
    /// function without a vertical start: from above the solution it descends to it.
    #[inline(never)]
    fn refine(self, distance: f64, lowest: f64, highest: f64) -> Gains {
        let base = self.start.max(self.end);
        let (lowest, highest) = (lowest - base, highest - base);
        let mut above = self.initial_excess(distance, base).max(lowest).min(highest);
        for _ in 0..MOST_STEPS {
            let (run, slope) = self.distance_and_slope(self.gains(above));
            let old_root = libm::sqrt(above);
            let root = (old_root - (run - distance) / (2.0 * old_root * slope)).max(0.0);
            let next = (root * root).max(lowest).min(highest);
            let settled = (next - above).abs() <= SETTLED * next;
            above = next;
            if settled {
                break;
            }
        }
        self.gains(above)
    }

    /// The peak's excess over the higher end if the ramp from there does not hold its limit, and the other one only
    /// grows by its slope: b u + s u² + k u³ is the remaining distance, solved like a phase of a profile.
    fn initial_excess(&self, distance: f64, base: f64) -> f64 {
        let (low, other) =
            if self.start < self.end { (self.start, self.speeding) } else { (self.end, self.braking) };
        // A ramp of gain u² takes 2u/√J at a mean of v + u²/2.
        let cubic = libm::sqrt(other.per_jerk);
        let linear = 2.0 * base * cubic;
        let (left, speed, half_acceleration, sixth_jerk) = if low < base {
            let (distance_to_base, slope) = other.distance_and_slope(low, base - low);
            (distance - distance_to_base, linear, slope, cubic)
        } else {
            (distance, 2.0 * linear, 0.0, 2.0 * cubic)
        };
        let root = SlowEnd { speed, half_acceleration, sixth_jerk, quartic: 0.0 }.rough_time_to_cover(left);
        root * root
    }
}
