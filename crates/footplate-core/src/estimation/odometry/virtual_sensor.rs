//! The speed while no wheel tells it: the corrected speed of the paper, and what the wheels still give away.
//!
//! Letters: `v` corrected speed, `a` how fast it is made to fall (or rise), `u` speeds of the wheels. In a slide
//! `v ← max(v + aT, u₁, u₂)`: a lower envelope that the wheels push up whenever they touch the speed of the train as
//! the anti-slide lets them go; in a spin the mirror image.
//!
//! The paper takes one `a` for good. But every touch is a measurement of the speed, and the line through the touches is
//! how fast the train really slows down (`Touches`). The envelope follows that line a little too steeply, so that the
//! next touch can correct it; one that is too shallow is never touched again. If none comes for long, it gets steeper.

use super::touch_line::TouchLine;
use crate::wheels::{Loss, Thresholds};

/// How the corrected speed falls.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Envelope {
    /// Always by [`Thresholds::correction`], as printed.
    Fixed,
    /// By what the touches of the wheels show.
    Touches,
}

/// By how much steeper than the line through the touches the envelope falls (m/s²).
const STEEPER: f64 = 0.06;
/// Slides are touched every 3 to 4 s where wheels are let go to find the ground speed; after so long without a touch (s)
/// the envelope may be too shallow ...
const TOUCH_DUE_S: f64 = 5.0;
/// ... and gets steeper by so much in a second (m/s³).
const STEEPENING: f64 = 0.1;
/// No train slides more gently (m/s²): the lowest adhesion measured, and level track.
const GENTLEST: f64 = 0.1;
/// A wheel touches only if it is above the envelope by more (m/s): the noise of its speed.
const ABOVE: f64 = 0.05;

/// Follows one slide or spin.
#[derive(Debug, Clone)]
pub(super) struct VirtualSensor {
    kind: Loss,
    envelope: Envelope,
    speed: f64,
    rate: f64,
    touches: TouchLine,
    rising: bool,
    since_touch: f64,
    elapsed: f64,
    thresholds: Thresholds,
}

impl VirtualSensor {
    /// A slide or spin that begins at `speed` (m/s in the direction of travel); a spin rises by at most `limit` (m/s²).
    pub(super) fn new(kind: Loss, speed: f64, limit: f64, envelope: Envelope, thresholds: Thresholds) -> Self {
        let rate = match kind {
            Loss::Slide => -thresholds.correction.as_m_per_s2(),
            Loss::Spin => limit,
        };
        let touches = TouchLine::from(speed, rate);
        Self { kind, envelope, speed, rate, touches, rising: false, since_touch: 0.0, elapsed: 0.0, thresholds }
    }

    /// How long nothing else has told the speed (s).
    pub(super) fn elapsed(&self) -> f64 {
        self.elapsed
    }

    /// The rate of the envelope (m/s²).
    pub(super) fn rate(&self) -> f64 {
        self.rate
    }

    /// Goes on for `t` seconds in which the wheels turn so fast; `locked` if neither turns at all.
    pub(super) fn next(&mut self, wheels: [f64; 2], locked: bool, t: f64) -> f64 {
        self.elapsed += t;
        self.since_touch += t;
        let [first, second] = wheels;
        match self.kind {
            Loss::Slide => self.slide(first.max(second), locked, t),
            Loss::Spin => self.speed = (self.speed + self.rate * t).min(first).min(second).max(0.0),
        }
        self.speed
    }

    fn slide(&mut self, fastest: f64, locked: bool, t: f64) {
        self.rate = match (self.envelope, locked) {
            (Envelope::Fixed, false) => -self.thresholds.correction.as_m_per_s2(),
            (Envelope::Fixed, true) => -self.thresholds.lock_correction.as_m_per_s2(),
            (Envelope::Touches, _) => self.learnt(locked),
        };
        let fallen = self.speed + self.rate * t;
        self.speed = fallen.max(fastest).max(0.0);
        if fastest > fallen + ABOVE {
            self.rising = true;
            self.since_touch = 0.0;
        } else if self.rising {
            // A wheel has just left the envelope.
            self.rising = false;
            self.touches.touched(self.elapsed, self.speed);
        }
    }

    fn learnt(&self, locked: bool) -> f64 {
        let steepest = -self.thresholds.slide_deceleration.as_m_per_s2();
        if locked {
            // Nothing can touch any more: the best guess, not one that asks to be corrected.
            let lock = -self.thresholds.lock_correction.as_m_per_s2();
            return self.touches.slope().max(lock).min(-GENTLEST);
        }
        let overdue = (self.since_touch - TOUCH_DUE_S).max(0.0);
        (self.touches.slope() - STEEPER - STEEPENING * overdue).clamp(steepest, -GENTLEST)
    }
}
