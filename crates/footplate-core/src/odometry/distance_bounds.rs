//! The guaranteed interval of the distance.
//!
//! The better of two bounds counts. The integrated bounds of the speed always hold and are always wide. The counts of a wheel that
//! cannot turn faster (or slower) than the train moves are off by a few pulses over any distance; they count from the moment
//! from which that is certain.

use super::vote::Vote;
use super::wheels::{Range, larger, smaller};

/// Error of a counted distance (pulses): one for the phase at start and end, one and a half for a row that was read too little
/// late to be noticed.
const PULSES_OFF: f64 = 2.5;

/// What a wheel has counted since it began to bound the distance from one side.
#[derive(Debug, Clone, Copy)]
struct Anchor {
    /// The bound at which it was anchored (m).
    bound: f64,
    /// Distance counted since (m).
    counted: f64,
    set: bool,
    /// At some time since, it could only loosen the bound.
    only_loosens: bool,
}

impl Anchor {
    const NONE: Self = Self { bound: 0.0, counted: 0.0, set: false, only_loosens: false };

    /// Gives up what lies beyond the bound on which both wheels agree. Otherwise a faulty sensor would set the bound alone as soon
    /// as the other wheel no longer bounds it.
    fn agree(&mut self, own: f64, agreed: f64, off: f64) {
        if self.set && (own - agreed).abs() > off {
            self.bound += agreed - own;
        }
    }

    /// The bound after `counted` more (m), if the wheel has bounded the distance all the time.
    fn bound(&mut self, holds: bool, loosens: bool, counted: f64, off: f64) -> Option<f64> {
        self.set &= holds;
        self.only_loosens |= loosens;
        self.counted += counted;
        self.set.then_some(self.bound + self.counted + off)
    }

    fn anchor(&mut self, holds: bool, loosens: bool, bound: f64) {
        if holds && (!self.set || (self.only_loosens && !loosens)) {
            *self = Self { bound, counted: 0.0, set: true, only_loosens: loosens };
        }
    }
}

/// What one wheel turned in a period, and which bounds of the distance it can set.
#[derive(Debug, Clone, Copy)]
pub(super) struct Counted {
    /// Signed pulses in the direction of travel.
    pub(super) pulses: f64,
    /// How many of them may be wrong.
    pub(super) uncertainty: f64,
    /// Traction may turn it faster than the train: it may loosen the lower bound but not set it.
    pub(super) may_slip: bool,
    /// The brake may turn it slower: the same of the upper bound.
    pub(super) may_slide: bool,
    /// Pitch (m).
    pub(super) pitch: Range,
    /// Nothing shows that its sensor is wrong.
    pub(super) sound: bool,
}

/// Bounds of the distance in the direction of travel, from the first period.
#[derive(Debug, Clone)]
pub(super) struct DistanceBounds {
    distance: Range,
    low: [Anchor; 2],
    high: [Anchor; 2],
}

impl DistanceBounds {
    pub(super) const fn new(distance: Range) -> Self {
        Self { distance, low: [Anchor::NONE; 2], high: [Anchor::NONE; 2] }
    }

    pub(super) fn distance(&self) -> Range {
        self.distance
    }

    /// Moves on by `t` seconds, with the speed in `before` at first and in `now` at the end and the acceleration in
    /// `acceleration`. Returns the distance.
    pub(super) fn moved(
        &mut self,
        before: Range,
        now: Range,
        acceleration: Range,
        wheels: &[Counted; 2],
        t: f64,
    ) -> Range {
        // With bounded acceleration, the mean speed differs from the mean of both ends by at most (b - a) t / 8.
        let bend = acceleration.width() * t * t * 0.125;
        let mut low = self.distance.low + 0.5 * (before.low + now.low) * t - bend;
        let mut high = self.distance.high + 0.5 * (before.high + now.high) * t + bend;
        // Where both wheels bound the same side, the looser bound counts, so that no single sensor can break it.
        let (mut by_low, mut by_high) = (Vote::NONE, Vote::NONE);
        let mut own = [[None; 2]; 2];
        for (((wheel, low_anchor), high_anchor), own) in
            wheels.iter().zip(&mut self.low).zip(&mut self.high).zip(&mut own)
        {
            let (short, long) = if wheel.pulses < 0.0 {
                (wheel.pitch.high, wheel.pitch.low)
            } else {
                (wheel.pitch.low, wheel.pitch.high)
            };
            let off = PULSES_OFF * wheel.pitch.high;
            let uncertainty = wheel.uncertainty * wheel.pitch.high;
            if let Some(bound) =
                low_anchor.bound(wheel.sound, wheel.may_slip, wheel.pulses * short - uncertainty, -off)
            {
                by_low = by_low.also(bound, low_anchor.only_loosens, smaller);
                own[0] = Some(bound);
            }
            if let Some(bound) =
                high_anchor.bound(wheel.sound, wheel.may_slide, wheel.pulses * long + uncertainty, off)
            {
                by_high = by_high.also(bound, high_anchor.only_loosens, larger);
                own[1] = Some(bound);
            }
        }
        for ((anchors, vote), side) in
            [(&mut self.low, by_low), (&mut self.high, by_high)].into_iter().zip([0, 1])
        {
            let Some(agreed) = vote.outcome() else { continue };
            for ((anchor, own), wheel) in anchors.iter_mut().zip(&own).zip(wheels) {
                if let Some(Some(own)) = own.get(side) {
                    anchor.agree(*own, agreed, PULSES_OFF * wheel.pitch.high);
                }
            }
        }
        low = by_low.outcome().map_or(low, |bound| larger(low, bound));
        high = by_high.outcome().map_or(high, |bound| smaller(high, bound));
        if low > high {
            // A claim does not hold: only the speeds are left.
            (low, high) = (
                (self.distance.low + before.low.min(now.low) * t).min(low),
                (self.distance.high + before.high.max(now.high) * t).max(low),
            );
            self.low = [Anchor::NONE; 2];
            self.high = [Anchor::NONE; 2];
        }
        self.distance = Range { low, high };
        for ((wheel, low_anchor), high_anchor) in wheels.iter().zip(&mut self.low).zip(&mut self.high) {
            low_anchor.anchor(wheel.sound, wheel.may_slip, low);
            high_anchor.anchor(wheel.sound, wheel.may_slide, high);
        }
        self.distance
    }

    /// Sets the interval (m from the start, in the direction of travel).
    pub(super) fn relocate(&mut self, place: Range) {
        *self = Self::new(place);
    }

    /// The same bounds in the opposite direction of travel.
    pub(super) fn reverse(&mut self) {
        *self = Self::new(self.distance.reversed());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn counted(pulses: f64) -> Counted {
        Counted {
            pulses,
            uncertainty: 0.0,
            may_slip: false,
            may_slide: false,
            pitch: Range::around(0.027, 0.001),
            sound: true,
        }
    }

    fn after(wheels: [Counted; 2], periods: usize) -> Range {
        let mut bounds = DistanceBounds::new(Range::exactly(0.0));
        let speed = Range { low: 19.0, high: 21.0 };
        for _ in 0..periods {
            bounds.moved(speed, speed, Range { low: -1.0, high: 1.0 }, &wheels, 0.05);
        }
        bounds.distance()
    }

    #[test]
    fn counts_bound_a_long_distance_by_their_pitch_and_a_pulse() {
        // 37 pulses of 27 mm in 50 ms: 19.98 m/s.
        let distance = after([counted(37.0), counted(37.0)], 2000);
        let truth = 2000.0 * 37.0 * 0.027;
        assert!(distance.low < truth && truth < distance.high);
        assert!(distance.width() < truth * 0.002 + 0.3, "{distance:?}: the speeds alone leave 200 m");
    }

    #[test]
    fn a_sensor_that_loses_pulses_does_not_break_the_bounds() {
        let distance = after([counted(36.0), counted(37.0)], 2000);
        assert!(distance.high > 2000.0 * 37.0 * 0.027, "{distance:?}");
    }

    #[test]
    fn an_uncertain_wheel_loosens_and_does_not_set() {
        let uncertain = Counted { may_slip: true, may_slide: true, ..counted(37.0) };
        let alone = after([uncertain, Counted { sound: false, ..counted(0.0) }], 2000);
        assert!(alone.width() > 190.0, "the speeds alone: {alone:?}");
    }

    #[test]
    fn a_sensor_that_counts_at_rest_does_not_decide_once_the_other_is_not_asked() {
        let mut bounds = DistanceBounds::new(Range::exactly(0.0));
        let (speed, limits) = (Range { low: -0.3, high: 30.0 }, Range { low: -1.0, high: 1.0 });
        let high = |pulses| Counted { may_slide: true, ..counted(pulses) };
        for _ in 0..200 {
            bounds.moved(speed, speed, limits, &[high(0.0), high(24.0)], 0.05);
        }
        // Traction begins: the first wheel may slip and no longer bounds from below.
        let slips = Counted { may_slip: true, ..high(0.0) };
        let distance = bounds.moved(speed, speed, limits, &[slips, high(24.0)], 0.05);
        assert!(distance.low < 1.0, "{distance:?}: the train is at rest");
    }

    #[test]
    fn a_stuck_sensor_does_not_decide_beside_a_driven_wheel_that_turns_slower() {
        // World 2909163: the trailing sensor repeats 14 pulses of 27.02 mm in 20 ms for ten seconds, and traction may turn the first
        // wheel faster than the train. The train runs at 18.52 m/s, so the first wheel counts 13.71 pulses on average.
        let mut bounds = DistanceBounds::new(Range::exactly(0.0));
        let (speed, limits) = (Range { low: 18.3, high: 26.8 }, Range { low: -1.4, high: 1.2 });
        let pitch = Range::around(0.02702, 0.0045);
        let mut counted_before = 0.0;
        for period in 1..=500 {
            let sum = libm::floor(f64::from(period) * 18.52 * 0.02 / 0.02702);
            let driven = Counted { may_slip: true, pitch, ..counted(sum - counted_before) };
            counted_before = sum;
            bounds.moved(speed, speed, limits, &[driven, Counted { pitch, ..counted(14.0) }], 0.02);
        }
        let distance = bounds.distance();
        assert!(distance.low < 185.2 && 185.2 < distance.high, "{distance:?}: the train ran 185.2 m");
        assert!(
            distance.low > 184.0,
            "{distance:?}: the driven wheel bounds it within its tolerance of 0.9 m"
        );
    }

    /// One period of half a second, from 1 … 3 m/s to 2 … 4 m/s, with an acceleration of ±2 m/s².
    fn one_period(wheels: [Counted; 2]) -> Range {
        let mut bounds = DistanceBounds::new(Range { low: 9.0, high: 11.0 });
        let (before, now) = (Range { low: 1.0, high: 3.0 }, Range { low: 2.0, high: 4.0 });
        bounds.moved(before, now, Range { low: -2.0, high: 2.0 }, &wheels, 0.5)
    }

    fn assert_range(found: Range, low: f64, high: f64) {
        assert!((found.low - low).abs() < 1e-12 && (found.high - high).abs() < 1e-12, "{found:?}");
    }

    #[test]
    fn speeds_bound_the_distance_by_their_mean_and_the_greatest_bend() {
        // (b − a) t² / 8 = 4 · 0.25 / 8 = 0.125; 9 + 1.5 · 0.5 − 0.125 and 11 + 3.5 · 0.5 + 0.125.
        let faulty = Counted { sound: false, ..counted(0.0) };
        assert_range(one_period([faulty; 2]), 9.625, 12.875);
    }

    #[test]
    fn a_wheel_bounds_the_distance_by_its_counts_a_phase_and_its_tolerance() {
        let faulty = Counted { sound: false, ..counted(0.0) };
        let wheel = Counted { pitch: Range { low: 0.02, high: 0.03 }, uncertainty: 2.0, ..counted(50.0) };
        let mut bounds = DistanceBounds::new(Range { low: 9.0, high: 11.0 });
        let (speed, limits) = (Range { low: 0.0, high: 10.0 }, Range { low: -1.0, high: 1.0 });
        // The first period sets the anchor, at bounds that come from the speeds: bend 2 · 0.25 / 8 = 0.0625.
        assert_range(bounds.moved(speed, speed, limits, &[wheel, faulty], 0.5), 8.9375, 16.0625);
        // From 8.9375: 50 of the shortest, less two and two and a half of the longest. From 16.0625: 50 and 2 and 2.5 of the longest.
        assert_range(bounds.moved(speed, speed, limits, &[wheel, faulty], 0.5), 9.8025, 17.6975);
        // Backward the longest pitch bounds from below and the shortest from above: 9.8025 − 0.6 − 0.06, 17.6975 − 0.4 + 0.06.
        let back = Counted { pulses: -20.0, ..wheel };
        let slow = Range { low: -9.0, high: 9.0 };
        assert_range(bounds.moved(slow, slow, limits, &[back, faulty], 0.5), 9.1425, 17.3575);
    }

    /// Claims that contradict each other: the counts say more than any speed allows.
    #[test]
    fn speeds_alone_are_left_where_counts_contradict_each_other() {
        let (speed, limits) = (Range { low: 1.0, high: 2.0 }, Range { low: 0.0, high: 0.0 });
        let mut bounds = DistanceBounds::new(Range::exactly(0.0));
        let wheels = [counted(37.0), counted(1.0)];
        let mut last = Range::exactly(0.0);
        for _ in 0..40 {
            let before = last;
            last = bounds.moved(speed, speed, limits, &wheels, 0.05);
            assert!(last.low <= last.high, "{last:?}");
            assert!(last.low >= before.low && last.high >= last.low, "{last:?} after {before:?}");
        }
        // One metre in a second at least, and two at most.
        assert!(last.low <= 4.0 && last.high >= 2.0, "{last:?}");
    }
}
