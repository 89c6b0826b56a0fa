//! The speed while no wheel tells it: the corrected speed of the paper, and what the wheels still give away.
//!
//! Letters: `v` corrected speed, `a` how fast it is made to fall (or rise), `u` speeds of the wheels. In a slide
//! `v ← max(v + aT, u₁, u₂)`: a lower envelope that the wheels push up whenever they touch the speed of the train as
//! the anti-slide lets them go; in a spin the mirror image.
//!
//! The paper takes one `a` for good. A touch is a measurement of the speed, though: the line from the touch (or the
//! beginning) before to this one is how fast the train really slows down, and the envelope follows it from then on.

use crate::wheels::{Loss, Thresholds};

/// How the corrected speed falls.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Envelope {
    /// Always by [`Thresholds::correction`], as printed.
    Fixed,
    /// By what the touches of the wheels show, once they show something.
    Touches,
}

/// Shortest time between two touches from which a deceleration is learnt (s): wheels know their speed to 0.1 m/s, so
/// that it is known to 0.1 m/s².
const APART_S: f64 = 1.2;
/// Weight of what was learnt last (standard: the last three touches).
const LEARNT: f64 = 0.5;
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
    /// Time and speed of the last touch that counted, or of the beginning.
    touch: (f64, f64),
    rising: bool,
    elapsed: f64,
    locked: bool,
    thresholds: Thresholds,
}

impl VirtualSensor {
    /// A slide or spin that begins at `speed` (m/s in the direction of travel), up to `limit` (m/s²) in a spin.
    pub(super) fn new(
        kind: Loss,
        speed: f64,
        limit: f64,
        envelope: Envelope,
        thresholds: Thresholds,
    ) -> Self {
        let rate = match kind {
            Loss::Slide => -thresholds.correction.as_m_per_s2(),
            Loss::Spin => limit,
        };
        Self {
            kind,
            envelope,
            speed,
            rate,
            touch: (0.0, speed),
            rising: false,
            elapsed: 0.0,
            locked: false,
            thresholds,
        }
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
        let [first, second] = wheels;
        match self.kind {
            Loss::Slide => {
                if locked && !self.locked {
                    let lock = -self.thresholds.lock_correction.as_m_per_s2();
                    self.rate = match self.envelope {
                        Envelope::Fixed => lock,
                        Envelope::Touches => self.rate.max(lock).min(-GENTLEST),
                    };
                    self.locked = true;
                }
                let fallen = self.speed + self.rate * t;
                let fastest = first.max(second);
                if fastest > fallen + ABOVE {
                    self.speed = fastest;
                    self.rising = true;
                } else {
                    if self.rising {
                        self.touched(fallen);
                    }
                    self.rising = false;
                    self.speed = fallen.max(fastest);
                }
                self.speed = self.speed.max(0.0);
            }
            Loss::Spin => {
                self.speed = (self.speed + self.rate * t).min(first).min(second).max(0.0);
            }
        }
        self.speed
    }

    /// A wheel has just left the envelope at `speed`.
    fn touched(&mut self, speed: f64) {
        let (then, before) = self.touch;
        let apart = self.elapsed - then;
        if apart < APART_S {
            return;
        }
        self.touch = (self.elapsed, speed);
        if self.envelope == Envelope::Touches {
            let shown = ((speed - before) / apart)
                .clamp(-self.thresholds.slide_deceleration.as_m_per_s2(), -GENTLEST);
            self.rate += LEARNT * (shown - self.rate);
            self.locked = false;
        }
    }
}
