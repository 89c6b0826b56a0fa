//! Which speeds the train can have while both wheelsets may have lost the rail together.
//!
//! Two wheels that creep alike look like two wheels that roll: no likelihood tells them apart, so no probability can be
//! trusted there. While brake or traction act on both wheelsets, the interval therefore reaches beyond the wheels by the
//! creepage that goes unseen. Once both were seen to slip, it reaches as far as the train can have accelerated since.
//! That ends where wheels must roll: some time after brake and traction were released.

use super::evidence::{Compared, SILENT, STEADY_S};
use super::scene::{Scene, WheelScene};
use crate::odometry::wheels::{Range, larger, smaller};

/// Creepage of both wheelsets that begins unseen (part of the speed of the wheels), under the brake and in traction. Steady
/// creepage of converters and of proportional protection reaches 0.2; all beyond this begins visibly. (0.2 of the speed of the train is
/// 0.25 of that of the wheels: that much made S4 and S5 wider by 7 %, and no draw of a thousand worlds needs it for its 99.98 %.)
const UNSEEN: [f64; 2] = [0.2, 0.155];
/// The same where no command is recorded: most of the time that the wheels' acceleration is taken for, nothing acts. Creepage of the brake
/// costs no width there, because the train is no faster than its wheels were (`RUNS_AWAY`).
const UNSEEN_WITHOUT_COMMAND: [f64; 2] = [0.22, 0.1];
/// By how much a gradient accelerates a train that is braked, or slows one that is driven, while its wheels creep unseen (m/s²).
const RUNS_AWAY: f64 = 0.1;
/// Wheels that begin to creep faster than this are seen to (m/s²), and sooner after one of them was turned up to the train. What they
/// decelerate by beyond the command comes on top.
const UNSEEN_RATE: f64 = 0.8;
const UNSEEN_RATE_TOUCHED: f64 = 0.3;
/// Wheels that turn alike so soon after one was turned up to the train (s), and slip with no more than this probability,
/// roll.
const TOUCHED_S: f64 = 3.0;
const ROLLS: f64 = 0.01;
/// The same of wheelsets that are braked independently: no converter feeds both.
const UNSEEN_INDEPENDENT: f64 = 0.02;
/// A command of less acceleration than this is carried by what ice leaves of adhesion (m/s²).
const SLIDES_BY: f64 = 0.2;
/// Creepage of both that lasts after they were seen to slip: part of the speed, and m/s.
const LASTING: (f64, f64) = (0.25, 1.0);
/// Probability at which both are seen to slip, and below which wheels that turn alike creep within limits.
const SEEN: f64 = 0.3;
const ALIKE: f64 = 0.05;
/// Probability at which one slips and the other does not.
const ONE: f64 = 0.9;
/// Wheels turn alike that differ by less than this part of their speed, and this (m/s), for so long (s).
const APART: (f64, f64) = (0.03, 0.3);
const ALIKE_FOR_S: f64 = 1.0;
/// Deviations within which a wheel tells its own speed.
const OF_WHEEL: f64 = 4.0;
/// How long after brake or traction ended both roll (s).
const ROLLS_AFTER_S: f64 = 5.0;
/// How far the train accelerates beyond its command while both slip (m/s²): gradients of 35 mm/m ...
const GRADIENT: f64 = 0.35;
/// ... and how much it decelerates at least with locked wheels (m/s²): by ice of 0.012 of which a fifth is left.
const LOCKED: f64 = 0.025;
/// Wheels that slipped and accelerate towards the train by more than this beyond the command (m/s²) are returning: a
/// converter brings them back by no less, and in this time after the command ended (s). Without a recorded command, longer times would
/// take every train that is driven for one whose wheels return.
const RETURNS: f64 = 0.1;
const RETURNS_FOR_S: f64 = 15.0;
/// Beyond what its train can do, a wheel accelerates by no more than this while it rolls (m/s²).
const STRAYS: f64 = 0.1;
/// Locked wheels that begin to turn, at no more than this (m/s), have not come back to the train.
const SLOWLY: f64 = 0.5;
/// Hypotheses that the guaranteed bounds exclude for so long (s) have lost the train.
const REFUTED_S: f64 = 0.5;
/// Least effort that makes wheels creep.
const EFFORT: f64 = 0.02;
/// Acceleration of wheels by which a train without a recorded command is braked or driven (m/s²).
const TREND: f64 = 0.03;

/// How far the train may be from its wheels.
#[derive(Debug, Clone, Copy)]
pub(super) struct Reach {
    /// Speeds that the train can have (m/s).
    speed: Range,
    /// Both were seen to slip, and have not had to roll since.
    slipped: bool,
    /// On which side of the train they were then: 1 where they turned slower, −1 where faster.
    side: f64,
    alike_for: f64,
    /// Both are locked, or begin to turn after that.
    locked: bool,
    /// Smoothed acceleration of each wheel (m/s²).
    own: [f64; 2],
    /// Wheels spun and have been slowing down since, without a recorded command.
    spun: bool,
    /// Without a recorded command: what the speed can be by that of the wheels since they had to roll (m/s).
    since_rolling: Range,
    /// Time since brake and traction acted (s).
    since: [f64; 2],
    /// One sensor is dead, and the wheel of the other accelerated as no train does since.
    strayed: bool,
    /// By how much they can have begun to creep unseen since both rolled for certain (m/s).
    crept: f64,
    /// How far a brake that has let go may still hold them back (m/s): they return by `RETURNS` at least.
    held: f64,
    /// How long the guaranteed bounds have excluded all hypotheses (s).
    refuted_for: f64,
    /// The acceleration that was last commanded (m/s²).
    by: f64,
}

/// What the wheels have shown up to a period.
#[derive(Debug, Clone, Copy)]
pub(super) struct Shown {
    /// Probabilities of the hypotheses.
    pub(super) p: [f64; 8],
    /// Time since a wheel was turned up to the train (s), and since one was while the other was not accelerated.
    pub(super) since_touch: f64,
    pub(super) since_lone_touch: f64,
    /// Smoothed acceleration of the wheels (m/s²).
    pub(super) wheels_a: f64,
    /// 1 where wheels that slip turn slower than the train and −1 where faster.
    pub(super) side: f64,
}

impl Reach {
    pub(super) const fn new() -> Self {
        let speed = Range { low: 0.0, high: 0.0 };
        Self {
            speed,
            slipped: false,
            side: 1.0,
            alike_for: 0.0,
            locked: false,
            own: [0.0; 2],
            spun: false,
            since_rolling: Range::ANY,
            since: [f64::INFINITY; 2],
            strayed: false,
            crept: f64::INFINITY,
            held: 0.0,
            refuted_for: 0.0,
            by: 0.0,
        }
    }

    /// The train has turned round.
    pub(super) fn reverse(&mut self) {
        self.speed = self.speed.reversed();
        self.since_rolling = self.since_rolling.reversed();
    }

    /// Widens the interval `likely` of a period of `t` seconds by what the wheels have `shown`.
    pub(super) fn widen(
        &mut self,
        likely: Range,
        scene: &Scene,
        wheels: &[Compared; 2],
        shown: &Shown,
        t: f64,
    ) -> Range {
        if self.is_refuted(&likely, scene, t) {
            self.speed = scene.bounded;
            self.slipped = true;
            self.alike_for = 0.0;
        }
        let Shown { p, since_touch, since_lone_touch, wheels_a, side } = *shown;
        let [_, first_slips, second_slips, slip, creep, _, first_dead, second_dead] = p;
        let silent = wheels.iter().all(|wheel| wheel.speed.abs() < SILENT);
        let [brakes, drives] = self.acts(scene, silent, wheels_a, [first_dead, second_dead]);
        for (since, acts) in self.since.iter_mut().zip([brakes, drives]) {
            *since = if acts { 0.0 } else { *since + t };
        }
        let slipped = self.slipped;
        let [brake, traction] = self.since.map(|since| {
            let over = smaller(since / ROLLS_AFTER_S, 1.0);
            // Wheels that slipped may return late.
            if slipped && over < 1.0 { 1.0 } else { 1.0 - over }
        });
        let dead = first_dead + second_dead;
        let turn_alike = turn_alike(scene, wheels, [first_dead, second_dead]);
        // Locked wheels turn alike until the brake has let go of them.
        let [since_brake, since_traction] = self.since;
        // They have not come back to the train when they begin to turn.
        let slowest = if self.locked { SLOWLY } else { SILENT };
        let is_slow = |(wheel, seen): (&Compared, &WheelScene)| seen.stuck || wheel.speed.abs() < slowest;
        let are_slow = wheels.iter().zip(&scene.wheels).all(is_slow);
        self.locked = are_slow && self.slipped && since_brake < RETURNS_FOR_S;
        let Range { low, high } = scene.acceleration;
        let strays = self.strays(scene, [first_dead, second_dead], t);
        // A train beside whose wheels one sensor is faulty may be taken to stand.
        let faulty = wheels.iter().zip(&scene.wheels).any(|(wheel, seen)| wheel.dead || seen.stuck);
        self.strayed = dead > SEEN && strays || (dead > SEEN || faulty) && self.strayed;
        let creeps_at_most = slip + creep < ALIKE && turn_alike && !self.locked && !self.strayed;
        self.alike_for = if creeps_at_most { self.alike_for + t } else { 0.0 };
        let alike = self.alike_for >= ALIKE_FOR_S;
        // Wheels that slipped and still accelerate towards the train beyond the command are returning.
        if slip + creep > SEEN {
            self.side = side;
            self.spun |= side < 0.0 && scene.commanded.is_none();
        }
        self.spun &= self.slipped && wheels_a < -RETURNS;
        let beyond = self.side * (wheels_a - scene.commanded.unwrap_or(0.0));
        let (since, opposite) =
            if self.side > 0.0 { (since_brake, traction) } else { (since_traction, brake) };
        let may_return = since < if self.slipped { RETURNS_FOR_S } else { ROLLS_AFTER_S };
        let returns = may_return && (beyond > RETURNS || self.slipped && opposite > 0.0);
        let free = brake <= 0.0 && traction <= 0.0 && !returns;
        self.strayed = self.strayed && !free;
        // A wheel that spins is slowed down to no certain speed.
        let is_known = scene.commanded.is_some() && traction <= 0.0;
        let touched = is_known && since_touch < TOUCHED_S && slip + creep + dead < ROLLS;
        let roll = alike && (free || touched);
        self.slipped = slip + creep + dead > SEEN && !free || self.slipped && !roll;
        let commanded = scene.commanded.unwrap_or(0.0);
        let rate = match () {
            () if traction > 0.0 => UNSEEN_RATE,
            () if since_touch < TOUCHED_S => UNSEEN_RATE_TOUCHED,
            () => smaller(creeps_away(scene, wheels_a), GRADIENT - commanded),
        };
        let rate = if brakes { rate + larger(commanded - wheels_a, 0.0) } else { rate };
        let touched_at =
            if since_lone_touch < TOUCHED_S { UNSEEN_RATE_TOUCHED * since_lone_touch } else { f64::INFINITY };
        self.crept = match (roll, self.slipped) {
            (true, _) if free => 0.0,
            // A converter that turns up both at once leaves them at any creepage.
            (true, _) => smaller(self.crept + rate * t, touched_at),
            (_, true) => f64::INFINITY,
            _ => self.crept + rate * t,
        };

        let up = if silent && brakes { -LOCKED } else { GRADIENT + larger(commanded, 0.0) };
        let (up, down) = match scene.commanded {
            Some(_) => {
                // The brake still acts after its command ended.
                let braked = if brake > 0.0 { -self.by } else { 0.0 };
                (smaller(high, up), larger(low, smaller(commanded, braked) - GRADIENT))
            }
            None => (smaller(high, if silent { 0.0 } else { high }), low),
        };
        let reaches = Range { low: self.speed.low + down * t, high: self.speed.high + up * t };
        if brakes || drives {
            self.by = scene.commanded.map_or(SLIDES_BY, f64::abs);
        }
        let effort = smaller(self.by / SLIDES_BY, 1.0);
        let moving = larger(likely.high.abs(), likely.low.abs());
        let crept = if scene.commanded.is_some() { self.crept } else { f64::INFINITY };
        let creeps = |unseen: f64| {
            let unseen = if scene.independent { UNSEEN_INDEPENDENT * effort } else { unseen };
            if self.slipped { LASTING.0 * moving + LASTING.1 } else { smaller(unseen * moving, crept) }
        };
        let unseen = if scene.commanded.is_some() { UNSEEN } else { UNSEEN_WITHOUT_COMMAND };
        let [of_brake, of_traction] = unseen.map(creeps);
        let held = smaller(of_brake, UNSEEN[0] * moving);
        let held = self.hold_back(scene, held, wheels_a, [brakes, roll && touched, free], t);
        let [towards_low, towards_high] = match (returns, self.side > 0.0) {
            (true, true) => [traction, 1.0],
            (true, false) => [1.0, brake],
            (false, _) => [traction, brake],
        };
        let about = Range {
            low: likely.low - towards_low * of_traction,
            high: likely.high + larger(towards_high * of_brake, held),
        };
        let about = self.no_faster_than_they_were(about, likely, scene, free, t);
        // Wheels that spin alike spin at any speed. Where a command is recorded, slip control acts in time.
        let creeps_alike =
            alike && !self.spun && (self.side > 0.0 || !self.slipped || scene.commanded.is_some());
        // Beside one that slips alone, the other creeps unseen at most.
        let one_slips = first_slips + second_slips > ONE && slip + creep + dead < ALIKE && !self.slipped;
        let near = creeps_alike || one_slips || free && !self.slipped;
        let reached = if near { reaches.and(about) } else { reaches };
        self.speed = Range { low: smaller(reached.low, likely.low), high: larger(reached.high, likely.high) };
        if dead > SEEN {
            // The sensor that is taken for dead may be the one that is right, and what was made of the other may be late.
            for (wheel, seen) in wheels.iter().zip(&scene.wheels) {
                let off = OF_WHEEL * libm::sqrt(wheel.variance);
                if !turn_alike || seen.counts() {
                    self.speed = self.speed.or(Range { low: wheel.speed - off, high: wheel.speed + off });
                }
            }
        }
        self.speed
    }

    /// `about`, without a recorded command limited by what the wheels ran since they had to roll: those that creep away under the brake
    /// slow down, and the train is no faster than they were; in traction no slower.
    fn no_faster_than_they_were(
        &mut self,
        about: Range,
        likely: Range,
        scene: &Scene,
        free: bool,
        t: f64,
    ) -> Range {
        let off = RUNS_AWAY * t;
        let Range { low, high } = self.since_rolling;
        self.since_rolling = match () {
            () if scene.commanded.is_some() || self.slipped => Range::ANY,
            () if free => likely,
            () => likely.or(Range { low: low - off, high: high + off }),
        };
        about.and(self.since_rolling)
    }

    /// Whether a wheel that counts accelerates as its train cannot. The acceleration of both would take the fall to zero of a sensor
    /// that dies for that of a wheel.
    fn strays(&mut self, scene: &Scene, dead: [f64; 2], t: f64) -> bool {
        let Range { low, high } = scene.acceleration;
        let mut strays = false;
        for ((own, wheel), dead) in self.own.iter_mut().zip(&scene.wheels).zip(dead) {
            *own += (wheel.acceleration - *own) * smaller(t / STEADY_S, 1.0);
            strays |= wheel.counts() && dead < SEEN && (*own < low - STRAYS || *own > high + STRAYS);
        }
        strays
    }

    /// Whether the guaranteed bounds have excluded for a while what the hypotheses say.
    fn is_refuted(&mut self, likely: &Range, scene: &Scene, t: f64) -> bool {
        let excluded = likely.and(scene.bounded).is_empty() && !scene.bounded.is_empty();
        self.refuted_for = if excluded { self.refuted_for + t } else { 0.0 };
        self.refuted_for > REFUTED_S
    }

    /// By how much a brake may still hold back wheels that may be returning (m/s); by up to `of_brake` while it acts. They may be where
    /// they accelerate beyond the command. In traction nothing in their acceleration shows it.
    fn hold_back(
        &mut self,
        scene: &Scene,
        of_brake: f64,
        wheels_a: f64,
        [brakes, touched, free]: [bool; 3],
        t: f64,
    ) -> f64 {
        let commanded = scene.commanded.unwrap_or(0.0);
        let return_now = commanded > EFFORT || wheels_a - commanded > RETURNS;
        self.held = match () {
            () if brakes => of_brake,
            () if !scene.slide || free && !return_now => 0.0,
            () => larger(self.held - RETURNS * t, 0.0),
        };
        if touched {
            self.held = smaller(self.held, self.crept);
        }
        if return_now { self.held } else { 0.0 }
    }

    /// Whether brake and traction act on both wheelsets.
    fn acts(&self, scene: &Scene, silent: bool, wheels_a: f64, dead: [f64; 2]) -> [bool; 2] {
        let [brakes, drives] = match scene.commanded {
            Some(commanded) => [commanded < -EFFORT, commanded > EFFORT],
            // Wheels that a brake has locked show nothing more of it.
            None if silent && self.slipped => [true, false],
            None if silent => self.since.map(|since| since <= 0.0),
            None => [wheels_a < -TREND, wheels_a > TREND],
        };
        // A dead sensor shows no wheel that rolls.
        let all = |of: fn(&WheelScene) -> bool| {
            scene.wheels.iter().zip(dead).all(|(wheel, dead)| dead > SEEN || of(wheel))
        };
        [brakes && all(|wheel| wheel.braked), drives && all(|wheel| wheel.driven)]
    }
}

/// How fast wheels can begin to creep unseen (m/s²). Where they decelerate at least as the brake makes a train do whose rail
/// carries it, they creep away from that train no faster than by the rest.
fn creeps_away(scene: &Scene, wheels_a: f64) -> f64 {
    let rest = scene.rolling.high - wheels_a;
    if rest > 0.0 { smaller(rest, UNSEEN_RATE) } else { UNSEEN_RATE }
}

/// Whether what is read of the wheels is one speed; `dead` is the probability that the sensor of each is.
fn turn_alike(scene: &Scene, [one, other]: &[Compared; 2], [first_dead, second_dead]: [f64; 2]) -> bool {
    let [first, second] = &scene.wheels;
    let quiet = |wheel: &WheelScene, compared: &Compared, dead: f64| {
        !wheel.read || wheel.stuck || dead > 0.5 && compared.speed.abs() < SILENT
    };
    if quiet(first, one, first_dead) || quiet(second, other, second_dead) {
        return true;
    }
    let (part, least) = APART;
    let noise = libm::sqrt(one.variance + other.variance);
    (one.speed - other.speed).abs() < part * one.speed.abs() + least + 2.0 * noise
}

#[cfg(test)]
mod tests;
