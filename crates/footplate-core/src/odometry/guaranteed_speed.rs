//! The guaranteed interval of the speed, which holds as long as the claims of the vehicle file do.
//!
//! A set-membership observer: it shares nothing with the filters and uses no probability. Its bounds span all states of the
//! wheelsets that claims and counts do not contradict.
//!
//! - A wheel that is neither braked nor driven turns with the train; a braked one no faster, a driven one no slower.
//! - Until the brake must have released, it may act; without a recorded command, brake and traction may always act.
//! - While both wheelsets may slide, only the strongest acceleration that gradient and traction allow bounds the speed
//!   from above, or what the vehicle file claims of its slide protection.
//! - One sensor may be faulty: where both bound the same side, the looser bound counts, and a sensor that reports what no wheel
//!   can do is disregarded.

use super::command_watch::Allowed;
use super::recent::Recent;
use super::vote::Vote;
use super::wheels::{Axle, Range, SlideProtection, larger, smaller};

/// How long a sensor that reported what no wheel can do is disregarded (s).
const DISREGARDED_S: f64 = 3.0;

/// How the counts of one wheel bound its speed, in the direction of travel.
#[derive(Debug, Clone, Copy)]
pub(super) struct WheelBounds {
    /// Its speed; `Range::ANY` if nothing is known.
    pub(super) turns: Range,
    pub(super) axle: Axle,
}

/// Bounds of the speed in the direction of travel.
#[derive(Debug, Clone)]
pub(super) struct GuaranteedSpeed {
    speed: Range,
    top: f64,
    /// How long each sensor is still disregarded (s).
    wrong_for: [f64; 2],
    shown: Recent,
    shown_low: Recent,
    /// Periods in which the claims contradicted the counts.
    contradictions: u64,
}

impl GuaranteedSpeed {
    pub(super) const fn new(speed: Range, top: f64) -> Self {
        Self {
            speed,
            top,
            wrong_for: [0.0; 2],
            shown: Recent::new(f64::INFINITY, 0.0),
            shown_low: Recent::new(f64::INFINITY, 0.0),
            contradictions: 0,
        }
    }

    pub(super) fn speed(&self) -> Range {
        self.speed
    }

    /// Sets them: something else has narrowed them.
    pub(super) fn set(&mut self, speed: Range) {
        self.speed = speed;
    }

    /// Periods in which no speed agreed with the counts and the claims.
    pub(super) fn contradictions(&self) -> u64 {
        self.contradictions
    }

    /// Which sensors are disregarded.
    pub(super) fn wrong(&self) -> [bool; 2] {
        self.wrong_for.map(|left| left > 0.0)
    }

    /// Widens the bounds by what the train can do in `t` seconds, to no less than `least` (m/s), and narrows them by the
    /// wheels.
    pub(super) fn narrow(
        &mut self,
        wheels: &[WheelBounds; 2],
        allowed: &Allowed,
        protection: Option<SlideProtection>,
        least: f64,
        t: f64,
    ) -> Range {
        let possible = Range {
            low: larger(self.speed.low + allowed.acceleration.low * t, least),
            high: smaller(self.speed.high + allowed.acceleration.high * t, self.top),
        };
        self.watch(wheels, allowed, possible, t);
        let mut low = self.low(wheels, allowed);
        let mut high = self.high(wheels, allowed);
        if let Some(protection) = protection {
            let within = self.protected(wheels, protection, allowed, t);
            (low, high) = (larger(low, within.low), smaller(high, within.high));
        }
        let narrowed = possible.and(Range { low, high });
        self.speed = if narrowed.is_empty() {
            // A claim does not hold: only the limits of acceleration are left.
            self.contradictions += 1;
            possible.or(self.speed)
        } else {
            narrowed
        };
        self.speed
    }

    /// The same bounds in the opposite direction of travel.
    pub(super) fn reverse(&mut self) {
        let contradictions = self.contradictions;
        *self = Self { contradictions, ..Self::new(self.speed.reversed(), self.top) };
    }

    /// Finds sensors that report what no wheel can do. If both do so at once, neither is to blame.
    fn watch(&mut self, wheels: &[WheelBounds; 2], allowed: &Allowed, possible: Range, t: f64) {
        let impossible = |wheel: &WheelBounds| {
            let slides = allowed.slide && wheel.axle.may_slide();
            let slips = allowed.slip && wheel.axle.may_slip();
            (wheel.turns.high < possible.low && !slides) || (wheel.turns.low > possible.high && !slips)
        };
        let [first, second] = wheels;
        let said = [impossible(first), impossible(second)];
        for (left, impossible) in self.wrong_for.iter_mut().zip(said) {
            *left = if impossible && said != [true; 2] { DISREGARDED_S } else { *left - t };
        }
    }

    fn low(&self, wheels: &[WheelBounds; 2], allowed: &Allowed) -> f64 {
        let mut rolling = Vote::NONE;
        let mut driven = f64::INFINITY;
        for (wheel, wrong) in wheels.iter().zip(self.wrong()) {
            if allowed.slip && wheel.axle.may_slip() {
                // A driven wheel turns no slower than the train: it shows only that the other turns too fast.
                driven = if wheel.turns.low.is_finite() && !wrong {
                    smaller(driven, wheel.turns.low)
                } else {
                    driven
                };
            } else if !wrong {
                rolling = rolling.also(wheel.turns.low, false, smaller);
            }
        }
        rolling.outcome().map_or(f64::NEG_INFINITY, |bound| smaller(bound, driven))
    }

    fn high(&self, wheels: &[WheelBounds; 2], allowed: &Allowed) -> f64 {
        let mut rolling = Vote::NONE;
        for (wheel, wrong) in wheels.iter().zip(self.wrong()) {
            if !(wrong || allowed.slide && wheel.axle.may_slide()) {
                rolling = rolling.also(wheel.turns.high, false, larger);
            }
        }
        rolling.outcome().unwrap_or(f64::INFINITY)
    }

    /// The claim of the slide protection: except for a stated time, one wheelset turns nearly with the train.
    fn protected(
        &mut self,
        wheels: &[WheelBounds; 2],
        protection: SlideProtection,
        allowed: &Allowed,
        t: f64,
    ) -> Range {
        let lasts = larger(protection.longest.as_s(), t);
        if self.shown.half() != lasts {
            self.shown = Recent::new(f64::INFINITY, lasts);
            self.shown_low = Recent::new(f64::INFINITY, lasts);
        }
        let [first, second] = wheels;
        let fastest = larger(first.turns.high, second.turns.high) / (1.0 - protection.creepage);
        let slowest = smaller(first.turns.low, second.turns.low) * (1.0 - protection.creepage);
        let sound = self.wrong() == [false; 2];
        let high = self.shown.push(if sound { fastest } else { f64::INFINITY }, t);
        let low = -self.shown_low.push(if sound { -slowest } else { f64::INFINITY }, t);
        let since = 2.0 * lasts;
        Range {
            low: low + smaller(allowed.acceleration.low, 0.0) * since,
            high: high + larger(allowed.acceleration.high, 0.0) * since,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::time::TimeSpan;

    fn wheel(axle: Axle, low: f64, high: f64) -> WheelBounds {
        WheelBounds { turns: Range { low, high }, axle }
    }

    fn allowed(slide: bool, slip: bool) -> Allowed {
        let acceleration = Range { low: -1.0, high: 0.5 };
        let (traction, brake) = (0.0, 0.0);
        Allowed { slide, slip, acceleration, rolling: acceleration, commanded: None, traction, brake }
    }

    fn narrowed(
        bounds: &mut GuaranteedSpeed,
        wheels: [WheelBounds; 2],
        allowed: &Allowed,
        t: f64,
    ) -> [f64; 2] {
        let Range { low, high } = bounds.narrow(&wheels, allowed, None, 0.0, t);
        [low, high]
    }

    fn assert_near(found: [f64; 2], expected: [f64; 2]) {
        assert!(
            found.iter().zip(expected).all(|(one, other)| (one - other).abs() < 1e-9),
            "{found:?}, not {expected:?}"
        );
    }

    #[test]
    fn the_looser_bound_of_wheels_that_may_set_it_counts() {
        let found = |wheels, allowed: &Allowed| {
            narrowed(&mut GuaranteedSpeed::new(Range { low: 0.0, high: 40.0 }, 40.0), wheels, allowed, 0.05)
        };
        let rolling = [wheel(Axle::Powered, 19.9, 20.1), wheel(Axle::Trailing, 19.5, 19.8)];
        assert_near(found(rolling, &allowed(false, false)), [19.5, 20.1]);
        // Braked wheels may all slide: what the train can do is left, 40 m/s and no more.
        assert_near(found(rolling, &allowed(true, false)), [19.5, 40.0]);
        // One that is not braked bounds it from above.
        let one_slides = [wheel(Axle::Powered, 15.0, 15.2), wheel(Axle::Unbraked, 20.0, 20.2)];
        assert_near(found(one_slides, &allowed(true, true)), [15.0, 20.2]);
        // One that is driven spins: the other bounds it from below.
        let one_spins = [wheel(Axle::Powered, 25.0, 25.2), wheel(Axle::Trailing, 20.0, 20.2)];
        assert_near(found(one_spins, &allowed(false, true)), [20.0, 25.2]);
        // Where both are driven, neither does.
        let both_spin = [wheel(Axle::Powered, 25.0, 25.2), wheel(Axle::Powered, 20.0, 20.2)];
        assert_near(found(both_spin, &allowed(false, true)), [0.0, 25.2]);
    }

    #[test]
    fn without_wheels_it_widens_by_what_the_train_can_do() {
        let mut bounds = GuaranteedSpeed::new(Range { low: 10.0, high: 12.0 }, 12.8);
        let unknown = [Axle::Powered, Axle::Trailing].map(|axle| WheelBounds { turns: Range::ANY, axle });
        assert_near(narrowed(&mut bounds, unknown, &allowed(false, false), 1.0), [9.0, 12.5]);
        assert_near(narrowed(&mut bounds, unknown, &allowed(false, false), 1.0), [8.0, 12.8]);
        let Range { low, high } = bounds.narrow(&unknown, &allowed(true, true), None, 7.5, 1.0);
        assert_near([low, high], [7.5, 12.8]);
        bounds.reverse();
        assert_near([bounds.speed().low, bounds.speed().high], [-12.8, -7.5]);
    }

    #[test]
    fn a_sensor_that_reports_what_no_wheel_can_do_is_disregarded_for_three_seconds() {
        let mut bounds = GuaranteedSpeed::new(Range { low: 19.8, high: 20.2 }, 40.0);
        let (sound, rolls) = (wheel(Axle::Trailing, 19.9, 20.1), allowed(false, false));
        for wrong in [wheel(Axle::Powered, 10.0, 10.1), wheel(Axle::Powered, 30.0, 30.1)] {
            assert_near(narrowed(&mut bounds, [wrong, sound], &rolls, 0.5), [19.9, 20.1]);
            assert_eq!(bounds.wrong(), [true, false]);
            // It is right again, and counts after three seconds.
            let right = wheel(Axle::Powered, 19.7, 20.3);
            for _ in 0..5 {
                assert_near(narrowed(&mut bounds, [right, sound], &rolls, 0.5), [19.9, 20.1]);
                assert_eq!(bounds.wrong(), [true, false]);
            }
            narrowed(&mut bounds, [right, sound], &rolls, 0.5);
            assert_eq!(bounds.wrong(), [false, false]);
        }
        // If the brake may act, the slow one slides, and the fast one of a driven axle spins.
        let mut sliding = bounds.clone();
        narrowed(&mut sliding, [wheel(Axle::Powered, 10.0, 10.1), sound], &allowed(true, false), 0.5);
        narrowed(&mut sliding, [wheel(Axle::Powered, 30.0, 30.1), sound], &allowed(false, true), 0.5);
        assert_eq!((sliding.wrong(), sliding.contradictions()), ([false, false], 0));
        // If both are wrong at once, neither is to blame: a claim does not hold, and its limits of acceleration are left.
        let before = bounds.speed();
        let both = [wheel(Axle::Powered, 10.0, 10.1), wheel(Axle::Trailing, 10.0, 10.1)];
        assert_near(narrowed(&mut bounds, both, &rolls, 0.5), [before.low - 0.5, before.high + 0.25]);
        assert_eq!((bounds.wrong(), bounds.contradictions()), ([false, false], 1));
    }

    #[test]
    fn slide_protection_bounds_it_by_one_wheel_within_its_creepage_and_what_happens_meanwhile() {
        let protection = SlideProtection { creepage: 0.1, longest: TimeSpan::from_s(0.8) };
        let mut bounds = GuaranteedSpeed::new(Range { low: 0.0, high: 40.0 }, 40.0);
        let wheels = [wheel(Axle::Powered, 17.9, 18.1), wheel(Axle::Powered, 19.9, 20.1)];
        let mut found = Range::ANY;
        for _ in 0..10 {
            found = bounds.narrow(&wheels, &allowed(true, true), Some(protection), 0.0, 0.5);
        }
        // The faster within a tenth of the train, and twice 0.8 s of 0.5 m/s²; the slower likewise, and of −1 m/s².
        assert_near([found.low, found.high], [17.9 * 0.9 - 1.6, 20.1 / 0.9 + 0.8]);
        // A wheel that locks for half a second loosens it from below only.
        let locked = [wheel(Axle::Powered, 0.0, 0.1), wheel(Axle::Powered, 19.9, 20.1)];
        let found = bounds.narrow(&locked, &allowed(true, true), Some(protection), 0.0, 0.5);
        assert_near([found.low, found.high], [17.9 * 0.9 - 2.1, 20.1 / 0.9 + 0.8]);
        // Without the claim nothing bounds it but the train itself.
        let mut without = GuaranteedSpeed::new(Range { low: 0.0, high: 40.0 }, 40.0);
        assert_near(narrowed(&mut without, wheels, &allowed(true, true), 0.5), [0.0, 40.0]);
    }
}
