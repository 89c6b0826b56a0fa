//! The speed while no wheel tells it: the corrected speed of the paper, and what the wheels still give away.
//!
//! Letters: `v` corrected speed, `a` how fast it is made to fall (or rise), `u` speeds of the wheels. In a slide
//! `v ← max(v + aT, u₁, u₂)`: a lower envelope that the wheels push up whenever they touch the speed of the train as
//! the anti-slide lets them go; in a spin the mirror image, which is the same with all speeds negated.
//!
//! The paper takes one `a` for good. But every touch is a measurement of the speed, and the line through the touches is
//! how fast the train really slows down ([`Envelope::Touches`]). The envelope follows that line a little too steeply, so
//! that the next touch can correct it. A wheel that was turned up hard and then goes on level *has* reached the train,
//! whether above the envelope or below it: nothing else stops it there.

use super::ground_touch::GroundTouch;
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
/// Slides are touched every 3 to 4 s where wheels are let go to find the ground speed; after so long without another
/// touch (s) the envelope may be too shallow ...
const TOUCH_DUE_S: f64 = 6.0;
/// ... and gets steeper by so much in a second (m/s³).
const STEEPENING: f64 = 0.05;
/// No train slides more gently (m/s²): the lowest adhesion measured, and level track.
const GENTLEST: f64 = 0.1;
/// A wheel touches only if it is above the envelope by more (m/s): the noise of its speed.
const ABOVE: f64 = 0.05;
/// How much of its difference to the envelope a level wheel takes away.
const LEVEL_GAIN: f64 = 0.5;
/// A level wheel is taken for one that turns with the train only if it is no further off (m/s) than the envelope can be:
/// so much at once ...
const OFF_AT_ONCE: f64 = 1.0;
/// ... and so much more for every second since the last touch (m/s²), up to so many.
const OFF_PER_S: f64 = 0.3;
const OFF_FOR_S: f64 = 15.0;
/// Of the deceleration while wheels slide and turn, what is left of it when they lock: their treads heat and smear.
const LOCKED: f64 = 0.85;
/// Of its limit, the acceleration at which a train starts whose wheels spin: more adhesion would not let them.
const SPINNING_START: f64 = 0.5;

/// How a slide or spin begins, in the direction of travel.
#[derive(Debug, Clone, Copy)]
pub(super) struct Beginning {
    /// Speed of the train (m/s).
    pub(super) speed: f64,
    /// By how much it would decelerate by its command (m/s²); infinite if there is none.
    pub(super) commanded: f64,
}

/// What one wheel shows while it slips or slides.
#[derive(Debug, Clone, Copy)]
pub(super) struct LostWheel {
    /// Its speed by its last counts (m/s), moved to now as if it went with the train.
    pub(super) speed: f64,
    /// Its acceleration (m/s²).
    pub(super) acceleration: f64,
}

/// What else tells how the train moves while its wheels do not.
#[derive(Debug, Clone, Copy)]
pub(super) struct Guides {
    /// By how much it would decelerate by its command (m/s²); infinite if there is none.
    pub(super) commanded: f64,
    /// How its speed changes by an inertial sensor (m/s²).
    pub(super) felt: Option<f64>,
    /// Neither wheel turns at all.
    pub(super) locked: bool,
}

/// Follows one slide or spin.
#[derive(Debug, Clone)]
pub(super) struct VirtualSensor {
    kind: Loss,
    envelope: Envelope,
    /// Of a train that slides; of one that spins, everything is negated.
    speed: f64,
    rate: f64,
    touches: TouchLine,
    wheels: [GroundTouch; 2],
    rising: bool,
    touched: bool,
    since_touch: f64,
    elapsed: f64,
    thresholds: Thresholds,
}

impl VirtualSensor {
    /// A slide or spin that begins as told; a spin rises by at most `limit` (m/s²).
    pub(super) fn new(
        kind: Loss,
        begins: Beginning,
        limit: f64,
        envelope: Envelope,
        thresholds: Thresholds,
    ) -> Self {
        let correction = thresholds.correction.as_m_per_s2();
        let rate = match (kind, envelope) {
            (Loss::Slide, Envelope::Fixed) => -correction,
            // Sliding wheels brake less than is asked of them.
            (Loss::Slide, Envelope::Touches) => -correction.min(begins.commanded),
            (Loss::Spin, Envelope::Fixed) => -limit,
            (Loss::Spin, Envelope::Touches) => -SPINNING_START * limit,
        };
        let speed = sign(kind) * begins.speed;
        Self {
            kind,
            envelope,
            speed,
            rate,
            touches: TouchLine::from(speed, rate),
            wheels: [GroundTouch::new(); 2],
            rising: false,
            touched: false,
            since_touch: 0.0,
            elapsed: 0.0,
            thresholds,
        }
    }

    /// How long nothing else has told the speed (s).
    pub(super) fn elapsed(&self) -> f64 {
        self.elapsed
    }

    /// How the corrected speed changes (m/s²).
    pub(super) fn rate(&self) -> f64 {
        sign(self.kind) * self.rate
    }

    /// Goes on for `t` seconds in which the wheels that are read turn so.
    pub(super) fn next(&mut self, wheels: [Option<LostWheel>; 2], guides: Guides, t: f64) -> f64 {
        self.elapsed += t;
        self.since_touch += t;
        if self.envelope == Envelope::Touches {
            self.rate = self.learnt(guides);
        } else if self.kind == Loss::Slide {
            let Thresholds { correction, lock_correction, .. } = self.thresholds;
            self.rate = -if guides.locked { lock_correction } else { correction }.as_m_per_s2();
        }
        let toward = sign(self.kind);
        let fallen = self.speed + self.rate * t;
        let mut fastest = f64::NEG_INFINITY;
        let mut level = None;
        for (wheel, ground) in wheels.iter().zip(&mut self.wheels) {
            let Some(wheel) = wheel else { continue };
            let speed = toward * wheel.speed;
            fastest = fastest.max(speed);
            if ground.reached(toward * wheel.acceleration - self.rate, t) {
                level = Some(level.map_or(speed, |other: f64| other.max(speed)));
            }
        }
        self.speed = fallen.max(fastest);
        if fastest > fallen + ABOVE {
            self.rising = true;
            self.since_touch = 0.0;
        } else if self.rising {
            // A wheel has just left the envelope.
            self.rising = false;
            self.touch(self.speed);
        }
        let furthest = OFF_AT_ONCE + OFF_PER_S * self.since_touch.min(OFF_FOR_S);
        let level = level.filter(|level| (level - self.speed).abs() < furthest);
        if let (Some(level), Envelope::Touches) = (level, self.envelope) {
            self.speed += LEVEL_GAIN * (level - self.speed);
            self.touch(level);
        }
        let corrected = (toward * self.speed).max(0.0);
        self.speed = toward * corrected;
        corrected
    }

    fn touch(&mut self, speed: f64) {
        self.touches.touched(self.elapsed, speed);
        self.since_touch = 0.0;
        self.touched = true;
    }

    fn learnt(&self, Guides { commanded, felt, locked }: Guides) -> f64 {
        if let Some(felt) = felt {
            // What is felt needs no guess of how much the rail gives.
            return sign(self.kind) * felt;
        }
        if locked && self.kind == Loss::Slide {
            // Nothing can touch any more: the best guess, not one that asks to be corrected.
            return (LOCKED * self.touches.slope()).max(-commanded).min(-GENTLEST);
        }
        let steepest = match self.kind {
            Loss::Slide => self.thresholds.slide_deceleration.as_m_per_s2().min(commanded + STEEPER),
            Loss::Spin => self.thresholds.slip_acceleration.as_m_per_s2(),
        };
        let overdue = if self.touched { (self.since_touch - TOUCH_DUE_S).max(0.0) } else { 0.0 };
        let rate = self.touches.slope() - STEEPER - STEEPENING * overdue;
        rate.max(-steepest).min(-GENTLEST)
    }
}

/// A spin is a slide seen in the mirror.
fn sign(kind: Loss) -> f64 {
    match kind {
        Loss::Slide => 1.0,
        Loss::Spin => -1.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::Acceleration;

    const T: f64 = 0.05;

    fn sensor(commanded: f64) -> VirtualSensor {
        let thresholds =
            Thresholds::derived(Acceleration::from_m_per_s2(1.2), Acceleration::from_m_per_s2(1.4));
        let begins = Beginning { speed: 20.0, commanded };
        VirtualSensor::new(Loss::Slide, begins, 1.2, Envelope::Touches, thresholds)
    }

    fn guides(commanded: f64) -> Guides {
        Guides { commanded, felt: None, locked: false }
    }

    #[test]
    fn a_train_slides_no_harder_than_it_is_told_to_brake() {
        let mut sensor = sensor(0.33);
        let mut speed = 20.0;
        for _ in 0..200 {
            speed = sensor.next([None; 2], guides(0.33), T);
        }
        assert!((speed - (20.0 - 0.39 * 10.0)).abs() < 0.1, "{speed}");
    }

    #[test]
    fn touches_teach_it_how_fast_the_train_slows_down() {
        let mut sensor = sensor(1.0);
        let (mut speed, mut truth) = (20.0, 20.0);
        for period in 0..400 {
            truth -= 0.4 * T;
            // Every four seconds a wheel is turned up and goes with the train for half a second.
            let phase = period % 80;
            let wheel = match phase {
                60..70 => LostWheel { speed: truth - 2.0, acceleration: 12.0 },
                70..80 => LostWheel { speed: truth, acceleration: -0.4 },
                _ => LostWheel { speed: truth - 2.0, acceleration: -0.4 },
            };
            speed = sensor.next([Some(wheel), None], guides(1.0), T);
        }
        assert!((speed - truth).abs() < 0.1, "{speed} {truth}");
        assert!((-0.55..-0.4).contains(&sensor.rate()), "{}", sensor.rate());
    }

    #[test]
    fn a_spin_is_the_mirror_image() {
        let thresholds =
            Thresholds::derived(Acceleration::from_m_per_s2(1.2), Acceleration::from_m_per_s2(1.4));
        let begins = Beginning { speed: 2.0, commanded: f64::INFINITY };
        let mut sensor = VirtualSensor::new(Loss::Spin, begins, 1.0, Envelope::Touches, thresholds);
        let wheel = Some(LostWheel { speed: 9.0, acceleration: 0.0 });
        let mut speed = 0.0;
        for _ in 0..20 {
            speed = sensor.next([wheel, wheel], guides(f64::INFINITY), T);
        }
        assert!((2.4..3.0).contains(&speed), "half of what the train can do: {speed}");
        let slower = Some(LostWheel { speed: 2.2, acceleration: 0.0 });
        assert!(sensor.next([slower, wheel], guides(f64::INFINITY), T) <= 2.2);
    }
}
