//! What tells the speed while both wheels slip: a prior of the train's acceleration, and wheels that touch its speed.
//!
//! Letters as in `filters`; `y` innovation.

use super::bank::Bank;
use super::evidence::{CREEP, Compared, SILENT};
use super::filters::{STRONGEST, State};
use super::scene::{Scene, WheelScene};
use crate::odometry::wheels::{Range, larger, smaller};

/// The hypotheses that both wheels slip, independently and alike.
const SLIPS: usize = 3;
const CREEPS: usize = 4;
/// Those in which the train moves.
const MOVES: [usize; 7] = [0, 1, 2, SLIPS, CREEPS, 6, 7];
/// A train in which both wheelsets slide decelerates by this much, or as commanded if that is less (m/s²), and within
/// this deviation (m/s², part of it); adhesion of 0.02 to 0.08 and the brakes of the other wheelsets.
const SLIDES_BY: f64 = 0.5;
/// A train whose wheels spin accelerates by this much, or as commanded if that is less (m/s²). With 0.5 the rms while both slip is
/// 2.8 to 3.5 m/s on sixty random worlds, with 0.3 2.3 to 2.8.
const SPINS_BY: f64 = 0.3;
const SLIDES_WITHIN: (f64, f64) = (0.1, 0.3);
/// Correlation time of that deceleration (s). Longer times are truer on long ice and worse in every family of scenarios.
const SLIDES_FOR_S: f64 = 2.0;
/// How closely wheels that creep alike accelerate with the train (m/s²), and for how long (s).
const CREEPS_WITHIN: f64 = 0.5;
const CREEPS_FOR_S: f64 = 3.0;
/// Standard deviation of the acceleration of an inertial sensor (m/s²), with the same correlation time.
const INERTIAL_WITHIN: f64 = 0.06;
/// Softness of the limits of steady creep (part of the speed).
const CREEP_EDGE: f64 = 0.03;
/// Standard deviation of the bound that a wheel sets which is faster than a sliding train (m/s).
const PUSHES: f64 = 0.2;
/// Standard deviation of the speed from a wheel that has reached the train (m/s): in a slide and in a spin.
const REACHED: [f64; 2] = [0.35, 0.1];
/// Squared innovation over its variance at which such a wheel has reached the train in half of the cases.
const REACHES_WITHIN: f64 = 2.0;
/// How long the error of a followed wheel lasts (s).
const FOLLOWED_S: f64 = 0.15;

impl Bank {
    /// Corrects the filters that trust no counter.
    pub(super) fn correct_slips(&mut self, scene: &Scene, wheels: &[Compared; 2], t: f64) {
        let side = self.side;
        // How fast the train can change its speed with both wheelsets slipping.
        let wanted = scene.commanded.unwrap_or(-side * SLIDES_BY);
        // Wheels that spun and are braked carry less than those that roll, but they brake.
        let slides = larger(smaller(wanted, SPINS_BY), -SLIDES_BY);
        let usual = lasting(slides_within(slides.abs()), SLIDES_FOR_S, t);
        let mut slip = self.filters.state(SLIPS);
        slip.acceleration(slides - slip.a, usual);
        self.touch(&mut slip, scene, t);
        let mut creep = self.filters.state(CREEPS);
        creep.acceleration(slides - creep.a, usual);
        creep_alike(&mut creep, scene, wheels, side, t);
        // A sliding train does not run backwards, and it accelerates within its limits.
        let Range { low, high } = scene.acceleration;
        for (lane, mut state) in [(SLIPS, slip), (CREEPS, creep)] {
            state.v = larger(state.v, 0.0);
            state.a = larger(smaller(state.a, high), low);
            state.limit(scene.top_speed, STRONGEST);
            self.filters.set(lane, state);
        }
        if let Some(inertial) = scene.inertial {
            for lane in MOVES {
                let mut state = self.filters.state(lane);
                state.acceleration(inertial - state.a, lasting(INERTIAL_WITHIN, SLIDES_FOR_S, t));
                state.limit(scene.top_speed, STRONGEST);
                self.filters.set(lane, state);
            }
        }
    }

    /// Corrects the speed by wheels that touch it.
    ///
    /// In a slide no wheel is faster than the train, so that a faster wheel raises the estimate. A wheel that was accelerated
    /// towards the train and then keeps its speed has reached the train, unless its slide control stopped it: that measures the
    /// speed from both sides.
    fn touch(&mut self, train: &mut State, scene: &Scene, t: f64) {
        let [in_a_slide, in_a_spin] = REACHED;
        let reached = if self.side > 0.0 { in_a_slide } else { in_a_spin };
        let reached = reached * reached;
        let scales = self.scales();
        self.since_touch += t;
        self.since_lone_touch += t;
        let [a, b] = scene.wheels.map(|wheel| {
            let beyond = self.side * (wheel.acceleration - train.a);
            // What a stuck count hides may be as much.
            (beyond, if wheel.read && !wheel.stuck { beyond } else { f64::INFINITY })
        });
        let beyond = [(a.0, b.1), (b.0, a.1)];
        for (((touch, wheel), scale), (own, other)) in
            self.touches.iter_mut().zip(&scene.wheels).zip(scales).zip(beyond)
        {
            let speed = touch.follow((wheel.counted - wheel.late) * scale / t, train.a, t);
            let has_reached = touch.reached(own, other, t);
            if !wheel.read || wheel.stuck || speed.abs() < SILENT {
                continue;
            }
            // A wheel that spun and was braked may have passed the train.
            if has_reached && self.side > 0.0 {
                self.since_touch = 0.0;
                if touch.alone {
                    self.since_lone_touch = 0.0;
                }
            }
            let y = speed - train.v;
            let pushes = if self.side * y > 0.0 { t / (FOLLOWED_S * PUSHES * PUSHES) } else { 0.0 };
            // A wheel that is too far off was stopped by its slide control.
            let off = y * y / ((train.pvv + reached) * REACHES_WITHIN);
            let tells = if has_reached { 1.0 / (reached * (1.0 + off * off)) } else { 0.0 };
            if pushes + tells > 0.0 {
                train.speed(y, pushes + tells);
            }
        }
    }
}

/// Wheels that creep alike keep a possible creepage and accelerate with the train.
fn creep_alike(train: &mut State, scene: &Scene, [a, b]: &[Compared; 2], side: f64, t: f64) {
    let [first, second] = &scene.wheels;
    let tells = |wheel: &WheelScene| wheel.read && !wheel.stuck;
    let nearest = match (tells(first), tells(second)) {
        (true, true) => side * larger(side * a.speed, side * b.speed),
        (false, true) => b.speed,
        (true, false) => a.speed,
        (false, false) => return,
    };
    let wheels = 0.5 * (first.acceleration + second.acceleration);
    let own = lasting(first.acceleration_deviation, FOLLOWED_S, t);
    let alike = lasting(CREEPS_WITHIN, CREEPS_FOR_S, t);
    train.acceleration(wheels - train.a, own * alike / (own + alike));
    let v = larger(train.v, 1.0);
    let u = (train.v - nearest) * side;
    let [(least, least_part), (most, most_part)] = CREEP;
    let out = smaller(u - least_part * v - least, 0.0) + larger(u - most_part * v - most, 0.0);
    if out != 0.0 {
        train.speed(-out * side, lasting(CREEP_EDGE * v, CREEPS_FOR_S, t));
    }
}

/// Standard deviation of that deceleration (m/s²).
fn slides_within(by: f64) -> f64 {
    SLIDES_WITHIN.0 + SLIDES_WITHIN.1 * by
}

/// By how much the variance of the speed grows in a second of a slide that is commanded to decelerate `by` so much (m/s²).
pub(super) fn slides_spread(by: f64) -> f64 {
    let within = slides_within(smaller(by, SLIDES_BY));
    2.0 * SLIDES_FOR_S * within * within
}

/// Information from a period of `t` seconds on a quantity with this standard deviation and correlation time (s).
fn lasting(deviation: f64, seconds: f64, t: f64) -> f64 {
    t / (2.0 * seconds * deviation * deviation)
}
