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
