//! Between which speeds the train must run, whatever the filters believe.
//!
//! A set-membership observer. It shares nothing with the Kalman channel: no covariance, no fused speed. What it takes
//! for granted is small and stated by the vehicle: the train cannot accelerate or brake harder than it can; a wheel
//! that is braked turns no faster than the train moves, one that is driven no slower, and one that is neither turns
//! with it; the pitch of each wheel lies within its tolerance.
//!
//! While the brake is on, no braked wheel bounds the speed from above: both may be held back, slowly and alike. Then the
//! bound comes down as the *command* promises, never below what the wheels show; and once both were seen to slide, which
//! disproves the command, not at all (or by what the vehicle states for sliding wheels) until the brake is let go.
//! Only wheelsets that are braked independently and have kept up with each other for seconds bound it together: two
//! slides are never alike.

use super::command_watch::Allowed;
use super::recent::Recent;
use super::vote::Vote;
use crate::wheels::{Axle, Loss, Range, Thresholds, larger, smaller};

/// How far back the bound goes for one that is still sound when a slide or slip is seen (s): longer than any
/// detection takes.
const LOOK_BACK_S: f64 = 0.8;
/// How long two independent wheelsets have to keep up with each other ...
const TOGETHER_S: f64 = 2.0;
/// After both slid, for so long.
const ROLL_AGAIN_S: f64 = 6.0;
/// ... and how closely (m/s, part of the speed): what diameters and creep explain.
const TOGETHER: (f64, f64) = (0.15, 0.006);
/// Time over which their difference is smoothed (s): a followed speed is noisy by 0.1 m/s at 80 pulses a turn.
const SMOOTHED_S: f64 = 0.5;
/// By how much more a wheel may creep unseen beside one that slides.
const SLIPPERY: f64 = 1.5;
/// How far back a bound by braked wheels is taken from (s): a slide is seen earlier.
const SLIDE_SEEN_S: f64 = 0.35;
/// Share of full traction at which a powered wheel may creep by all that goes unseen; proportionally below.
const FULL_CREEP_EFFORT: f64 = 0.2;

/// What the counts of one wheel say, in the direction of travel.
#[derive(Debug, Clone, Copy)]
pub(super) struct WheelBounds {
    /// Between which speeds it turns; `Range::ANY` if nothing is known.
    pub(super) turns: Range,
    /// Its sensor is in doubt: it may loosen a bound, but not set one.
    pub(super) doubted: bool,
    /// The speed it is followed at.
    pub(super) speed: f64,
    pub(super) axle: Axle,
    pub(super) lost: Option<Loss>,
}

/// What the vehicle states about its wheels.
#[derive(Debug, Clone, Copy)]
pub(super) struct Limits {
    pub(super) thresholds: Thresholds,
    pub(super) independent: bool,
}

/// Follows the bounds of the speed, in the direction of travel.
#[derive(Debug, Clone)]
pub(super) struct SpeedBounds {
    speed: Range,
    highest: Recent,
    /// Of the negated lower bound, and of the negated lower bound that powered wheels alone would give.
    lowest: Recent,
    by_powered: Recent,
    /// Of the upper bounds by braked wheels.
    by_braked: Recent,
    apart: f64,
    sliding: i32,
    together_for: f64,
    all_slid: bool,
    any_spun: bool,
}

impl WheelBounds {
    fn is_asked(&self) -> bool {
        self.turns.high.is_finite() && !self.doubted
    }
}

impl SpeedBounds {
    pub(super) const fn new(speed: Range) -> Self {
        Self {
            speed,
            highest: Recent::new(speed.high, LOOK_BACK_S),
            lowest: Recent::new(-speed.low, LOOK_BACK_S),
            by_powered: Recent::new(-speed.low, LOOK_BACK_S),
            by_braked: Recent::new(speed.high, SLIDE_SEEN_S),
            apart: 0.0,
            sliding: 0,
            together_for: 0.0,
            all_slid: false,
            any_spun: false,
        }
    }

    pub(super) fn speed(&self) -> Range {
        self.speed
    }

    /// Something else knows it better.
    pub(super) fn set(&mut self, speed: Range) {
        self.speed = speed;
    }

    /// Where the train can have got to within `t` seconds, before any wheel is asked.
    pub(super) fn possible(&self, allowed: &Allowed, t: f64) -> Range {
        Range {
            low: self.speed.low + allowed.acceleration.low * t,
            high: self.speed.high + allowed.acceleration.high * t,
        }
    }

    /// Narrows what is `possible` by what the wheels say.
    pub(super) fn narrow(
        &mut self,
        possible: Range,
        wheels: &[WheelBounds; 2],
        allowed: &Allowed,
        limits: &Limits,
        t: f64,
    ) -> Range {
        let low = self.low(possible.low, wheels, allowed, limits, t);
        let high = self.high(possible.high, wheels, allowed, limits, t);
        let mut speed = Range { low, high };
        if speed.is_empty() {
            // Something that was taken for granted is not so: only what the train can do is left.
            speed = possible.or(self.speed);
        }
        self.highest.push(speed.high, t);
        self.lowest.push(-speed.low, t);
        self.speed = speed;
        speed
    }

    /// The bounds seen in the opposite direction, as the train turns round.
    pub(super) fn reverse(&mut self) {
        *self = Self::new(self.speed.reversed());
    }

    fn low(
        &mut self,
        free: f64,
        wheels: &[WheelBounds; 2],
        allowed: &Allowed,
        limits: &Limits,
        t: f64,
    ) -> f64 {
        let creep = limits.thresholds.creepage * smaller(allowed.traction_effort / FULL_CREEP_EFFORT, 1.0);
        let mut rolling = Vote::NONE;
        let mut powered = f64::NEG_INFINITY;
        let mut driven_too = None;
        let mut spun = false;
        for wheel in wheels {
            let driven = allowed.slip && wheel.axle.may_slip();
            spun |= wheel.lost == Some(Loss::Spin);
            if !driven {
                rolling = rolling.also(wheel.turns.low, wheel.doubted, smaller);
            } else if wheel.lost != Some(Loss::Spin) && !wheel.doubted {
                powered = larger(powered, wheel.turns.low * (1.0 - creep));
                driven_too = Some(wheel.turns.low).filter(|low| low.is_finite());
            }
        }
        // A driven wheel turns no slower than the train: it can only show that the others turn too fast.
        let rolling = rolling.outcome().map_or(f64::NEG_INFINITY, |bound| {
            driven_too.map_or(bound, |driven: f64| smaller(driven, bound))
        });
        // A wheel that starts to spin is seen a little late.
        let powered = -self.by_powered.push(-powered, t);
        let free = if spun && !self.any_spun { smaller(free, -self.lowest.largest()) } else { free };
        self.any_spun = spun;
        larger(larger(free, rolling), powered)
    }

    fn high(
        &mut self,
        free: f64,
        wheels: &[WheelBounds; 2],
        allowed: &Allowed,
        limits: &Limits,
        t: f64,
    ) -> f64 {
        let mut trusted = Vote::NONE;
        let mut shown = f64::NEG_INFINITY;
        let mut sliding = 0;
        let mut braked = 0;
        for wheel in wheels {
            let slides = wheel.lost == Some(Loss::Slide);
            if allowed.slide && wheel.axle.may_slide() {
                braked += 1;
                sliding += i32::from(slides);
                if !slides && wheel.is_asked() {
                    shown = larger(shown, wheel.turns.high);
                }
            } else {
                trusted = trusted.also(wheel.turns.high, wheel.doubted, larger);
            }
        }
        let together = self.together(wheels, sliding, t) && limits.independent;
        let kept_up = self.by_braked.push(if together { shown } else { f64::INFINITY }, t);
        if let Some(trusted) = trusted.outcome() {
            self.all_slid = false;
            return smaller(free, trusted);
        }
        if sliding == braked && braked > 0 && !self.all_slid {
            // All slide now: the bound goes back to one from before the slide began.
            self.all_slid = true;
            return self.highest.largest();
        }
        // Two slides are never alike: independent wheelsets that keep up with each other for so long roll again.
        let roll_again = limits.independent && sliding == 0 && self.together_for >= ROLL_AGAIN_S;
        self.all_slid &= allowed.slide && !roll_again;
        let by_command = self.speed.high + allowed.at_most_by_command * t;
        if self.all_slid {
            return smaller(free, by_command);
        }
        // Below the peak of adhesion a wheel creeps without being seen, but that far only where adhesion is poor.
        let creep = if sliding > 0 { limits.thresholds.rolling_creepage * SLIPPERY } else { 0.0 };
        let not_below = shown / (1.0 - creep);
        let creep =
            limits.thresholds.rolling_creepage * if sliding > 0 { SLIPPERY } else { allowed.brake_effort };
        let not_above = kept_up / (1.0 - creep);
        smaller(smaller(free, larger(by_command, not_below)), not_above)
    }

    /// Whether the wheels that do not slide have kept up with each other, or with nobody because the other is not
    /// believed or slides, for long enough.
    fn together(&mut self, [first, second]: &[WheelBounds; 2], sliding: i32, t: f64) -> bool {
        let (least, part) = TOGETHER;
        let (one, both) = (first.is_asked() || second.is_asked(), first.is_asked() && second.is_asked());
        self.apart += (first.speed - second.speed - self.apart) * smaller(t / SMOOTHED_S, 1.0);
        let alike = !both || sliding > 0 || self.apart.abs() < larger(least, part * first.speed);
        // Each wheel that begins or ceases to slide begins the time anew.
        let same = sliding == self.sliding;
        self.sliding = sliding;
        self.together_for = if one && alike && same { self.together_for + t } else { 0.0 };
        self.together_for >= TOGETHER_S
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::Acceleration;

    const T: f64 = 0.05;

    fn limits(independent: bool) -> Limits {
        let most = Acceleration::from_m_per_s2(1.2);
        Limits { thresholds: Thresholds::derived(most, most), independent }
    }

    fn braking() -> Allowed {
        Allowed {
            slide: true,
            slip: false,
            acceleration: Range { low: -1.3, high: 0.1 },
            at_most_by_command: -0.5,
            traction_effort: 0.0,
            commanded: 0.7,
            brake_effort: 0.7,
        }
    }

    fn wheel(speed: f64, lost: Option<Loss>) -> WheelBounds {
        let turns = Range { low: speed - 0.1, high: speed + 0.1 };
        WheelBounds { turns, doubted: false, speed, axle: Axle::Trailing, lost }
    }

    /// The upper bound after so many seconds in which both wheels slow down by `a`, `lost` from the fourth second on.
    fn upper(independent: bool, a: f64, lost: Option<Loss>, seconds: f64) -> (f64, f64) {
        let mut bounds = SpeedBounds::new(Range { low: 19.8, high: 20.2 });
        let mut speed = 20.0;
        for period in 0..libm::round(seconds / T) as i32 {
            speed += a * T;
            let lost = lost.filter(|_| period > 80);
            // A slide disproves the command.
            let at_most_by_command = if lost.is_some() { 0.0 } else { -0.5 };
            let allowed = Allowed { at_most_by_command, ..braking() };
            let possible = bounds.possible(&allowed, T);
            let wheels = [wheel(speed, lost), wheel(speed, lost)];
            bounds.narrow(possible, &wheels, &allowed, &limits(independent), T);
        }
        (bounds.speed().high, speed)
    }

    #[test]
    fn braked_wheels_that_hang_together_leave_the_upper_bound_to_the_command() {
        // Both drawn away by 0.7 m/s² beyond the train: nothing shows it, and the bound must not follow them.
        let (high, wheels) = upper(false, -1.2, None, 10.0);
        assert!((high - (20.2 - 0.5 * 10.0)).abs() < 0.1, "{high}");
        assert!(wheels < 8.5);
    }

    #[test]
    fn independent_wheels_that_keep_up_with_each_other_bound_it_together() {
        let (high, wheels) = upper(true, -0.7, None, 10.0);
        assert!(high > wheels && high < wheels + 1.0, "{high} above {wheels}");
    }

    #[test]
    fn the_bound_stays_while_both_slide() {
        let (high, _) = upper(true, -0.7, Some(Loss::Slide), 10.0);
        assert!(high > 20.0 - 0.7 * 4.2, "not below where the slide was seen: {high}");
        assert!(high < 20.3);
    }
}
