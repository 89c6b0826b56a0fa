//! All hypotheses: a filter for each, and its probability.

use super::advance::{Begins, Counts, LEAST, MOVES, Ran};
use super::arrivals::{Arrivals, Ending, arrivals};
use super::evidence::{CREEP as CREEP_BY, Compared, SILENT, STEADY_S, evidence};
use super::filters::{Filters, Pool, State};
use super::interval::interval;
use super::lanes::{Lanes, WIDTH, likelihood};
use super::rates::{Transitions, transitions};
use super::reach::{Reach, Shown};
use super::scene::{Scene, WheelScene};
use super::slides::slides_spread;
use super::touch::Touch;
use crate::odometry::wheels::{Range, Wheelset, larger, smaller};

/// Spectral density of the train's jerk (m²/s⁵) while a wheel tells the speed: 0.14 m/s² in a second, as a driver corrects a
/// cruising train. While none does, the acceleration is then known to 0.3 m/s² after a few seconds.
const JERK: Lanes = Lanes([0.02, 0.02, 0.02, 0.007, 0.05, 0.0, 0.02, 0.02]);
/// The same where no command is recorded: 0.06 more.
const JERK_UNANNOUNCED: Lanes = Lanes([0.08, 0.08, 0.08, 0.007, 0.05, 0.0, 0.08, 0.08]);
/// What is added to the variance of a count (m²), so that no filter takes it for exact.
const ROUNDING: f64 = 1e-9;
/// How long brakes and motors take to follow the command (s), and what part of it shows in the acceleration of a train whose wheels
/// roll. The rest is uncertain: gradients, resistance and the state of the brakes.
const BUILD_UP_S: f64 = 1.5;
const EXPECTED: f64 = 0.5;
/// Standard deviation of the change of acceleration when slipping wheels adhere again (m/s²).
const REGAINS: f64 = 0.4;
/// How long the error of a followed wheel lasts (s).
const FOLLOWED_S: f64 = 0.15;
/// Random walk of the ratio of the diameters (part, per square root of a second).
const RATIO_WANDERS: f64 = 2e-5;
/// Time constant for the difference of the wheels beyond their tolerances (s).
const BEYOND_S: f64 = 3.0;
/// The ratio is learnt above this speed (m/s); creepage under effort disturbs it by this part.
const RATIO_ABOVE: f64 = 3.0;
const RATIO_CREEPAGE: f64 = 0.008;
/// How long that creepage keeps its sign (s): a whole run of a driven wheel beside one that is not.
const CREEPAGE_FOR_S: f64 = 200.0;
/// Share of a driven wheel in traction beside one that is not driven: creepage biases the driven one.
const CREEPING_SHARE: f64 = 0.05;
/// Time constant of the acceleration that tells braking from motoring without a command (s).
const SIDE_S: f64 = 1.0;
/// Speed at which slips begin half as often as at high speed (m/s); the same for steady creep.
const SLIPS_ABOVE: f64 = 0.5;
const CREEPS_ABOVE: f64 = 5.0;
/// The hypotheses that both roll, and that both slip, independently and alike.
const ROLL: usize = 0;
const SLIP: usize = 3;
const CREEP: usize = 4;
/// Wheels have not come back to the train while they differ from it by more (m/s, part of its speed) ...
const AWAY: f64 = 0.5;
const AWAY_PART: f64 = 0.03;
/// ... or accelerate towards it harder than any train does (m/s²).
const RETURNS: f64 = 2.5;
/// A hypothesis has lost the train this many times less often than it ends; the wheels are then this many standard deviations
/// from it.
const LOST: f64 = 2.5e-3;
const FAR: f64 = 4.0;
/// A sensor of which this is as probable is found dead.
const FOUND_DEAD: f64 = 0.99;
/// A train comes to rest from below this speed (m/s).
const STOPS_BELOW: f64 = 0.15;
/// Squared speed over its variance from which exp(−½ of it) is zero.
const NEVER_STOPS: f64 = 1500.0;
/// Standard deviation of the deceleration of trains with locked wheels from slide to slide (m/s²), and for each m/s² of the command. It is
/// 0.10 at 0.45 and 0.28 at 1.1 m/s² about what is predicted (155 slides of random worlds); a seventh less, with which S2 is as it was.
const SLIDES_UNLIKE: (f64, f64) = (-0.017, 0.23);
/// The command (m/s²) that counts for it where none is recorded.
const UNKNOWN_BRAKE: f64 = 0.8;
/// Most slides of both that end at rest in a second (1/s).
const MOST_STOPS: f64 = 0.5;

/// Filters and probabilities of all hypotheses.
#[derive(Debug, Clone, Copy)]
pub(in super::super) struct Bank {
    probability: Lanes,
    pub(super) filters: Filters,
    /// Distance by each hypothesis less that of the estimate (m).
    ahead: Lanes,
    /// Distance run in the last period by each hypothesis (m).
    distances: Lanes,
    /// The shares of both wheels in the period where both roll.
    shares: [f64; 2],
    /// First over second wheel speed when both roll, less 1, and its variance.
    pub(super) ratio: f64,
    ratio_variance: f64,
    /// Difference of the wheels beyond their tolerances, smoothed (part).
    beyond: f64,
    /// Smoothed acceleration of the estimate and of the wheels (m/s²).
    trend: f64,
    wheels_a: f64,
    /// The commanded acceleration after the delay of brakes and motors (m/s²).
    acted: f64,
    /// 1 while slipping wheels turn slower than the train, −1 while they turn faster.
    pub(super) side: f64,
    /// Whether each wheel has been accelerated to the speed of the train.
    pub(super) touches: [Touch; 2],
    /// Time since one of them was (s), and since one was while the other was not accelerated.
    pub(super) since_touch: f64,
    pub(super) since_lone_touch: f64,
    /// Which sensors were found dead and have not counted since: they are still dead after a stop.
    found_dead: [bool; 2],
    /// How far the train may be from wheels that lost the rail together.
    reach: Reach,
    /// The estimate of the last period.
    speed: f64,
    acceleration: f64,
    variance: f64,
}

impl Bank {
    /// A train at a speed (m/s) with a variance (m²/s²).
    pub(in super::super) fn new(speed: f64, variance: f64, wheelsets: &[Wheelset; 2]) -> Self {
        let mut filters = Filters::new(speed, variance);
        filters.v *= MOVES;
        let variances =
            wheelsets.map(|wheelset| wheelset.diameter_tolerance * wheelset.diameter_tolerance / 3.0);
        Self {
            probability: Lanes([0.9, 1e-3, 1e-3, 1e-6, 1e-9, 0.1, LEAST, LEAST]),
            filters,
            ahead: Lanes::all(0.0),
            distances: Lanes::all(0.0),
            shares: [0.0; 2],
            ratio: 0.0,
            beyond: 0.0,
            ratio_variance: variances.iter().sum(),
            trend: 0.0,
            wheels_a: 0.0,
            acted: 0.0,
            side: 1.0,
            touches: [Touch::new(); 2],
            since_touch: f64::INFINITY,
            since_lone_touch: f64::INFINITY,
            found_dead: [false; 2],
            reach: Reach::new(),
            speed,
            acceleration: 0.0,
            variance,
        }
    }

    /// Speed (m/s), acceleration (m/s²) and the variance of the speed, over all hypotheses.
    pub(in super::super) fn motion(&self) -> (f64, f64, f64) {
        (self.speed, self.acceleration, self.variance)
    }

    /// The probability of every hypothesis, in the order of [`HYPOTHESES`](super::HYPOTHESES).
    pub(in super::super) fn probabilities(&self) -> [f64; 8] {
        self.probability.0
    }

    /// Whether slipping wheels turn slower than the train now.
    pub(in super::super) fn holds_back(&self) -> bool {
        self.side > 0.0
    }

    /// Reverses everything: the train has reversed.
    pub(in super::super) fn reverse(&mut self) {
        self.filters.reverse();
        self.ahead = -self.ahead;
        self.speed = -self.speed;
        self.acceleration = -self.acceleration;
        self.trend = -self.trend;
        self.wheels_a = -self.wheels_a;
        self.reach.reverse();
    }

    /// Takes in a period of `t` seconds. Returns the distance run (m).
    pub(in super::super) fn step(&mut self, scene: &Scene, t: f64) -> f64 {
        self.side = self.next_side(scene, t);
        self.shares = shares(scene);
        let [first, second] = &scene.wheels;
        let wheels_a = 0.5 * (first.acceleration + second.acceleration);
        self.wheels_a += (wheels_a - self.wheels_a) * smaller(t / STEADY_S, 1.0);
        let wheels = self.compared(scene);
        let transitions = self.transitions(scene, t);
        let arrivals = self.arrivals(scene, &wheels, &transitions);
        let begins = self.begins(scene, &wheels, &transitions, &arrivals);
        let counts = self.counts(scene, t);
        let Ran { distances, surprise, exceeds } =
            self.filters.advance(&begins, &arrivals, &counts, &mut self.probability, &mut self.ahead, t);
        self.distances = distances;
        self.correct_slips(scene, &wheels, t);
        if exceeds {
            self.filters.cut();
        }
        let evidence = evidence(scene, &wheels, &self.filters, &surprise, self.wheels_a, self.side, t);
        let distance = self.learn(&evidence, scene.top_speed);
        self.find_dead(scene);
        self.learn_ratio(scene, t);
        distance
    }

    /// Takes in the logarithms of the likelihoods and combines all hypotheses. Returns the distance that the estimate moved (m).
    #[inline(never)]
    #[expect(clippy::indexing_slicing, reason = "below the width of all")]
    fn learn(&mut self, evidence: &Lanes, top: f64) -> f64 {
        let one = 1.0 / self.probability.sum();
        let about = self.speed;
        let (Filters { v, a, pvv, .. }, p) = (&self.filters, &mut self.probability);
        let [mut speeds, mut squares, mut accelerations, mut ahead] = [Lanes::all(0.0); 4];
        for lane in 0..WIDTH {
            let w = larger(p.0[lane] * one * likelihood(evidence.0[lane]), LEAST);
            p.0[lane] = w;
            let dv = v.0[lane] - about;
            speeds.0[lane] = w * dv;
            squares.0[lane] = w * (pvv.0[lane] + dv * dv);
            accelerations.0[lane] = w * a.0[lane];
            ahead.0[lane] = w * self.ahead.0[lane];
        }
        let one = 1.0 / p.sum();
        *p *= Lanes::all(one);
        let dv = speeds.sum() * one;
        self.variance = squares.sum() * one - dv * dv;
        self.speed = larger(smaller(about + dv, top), -top);
        self.acceleration = accelerations.sum() * one;
        let distance = ahead.sum() * one;
        self.ahead -= Lanes::all(distance);
        distance
    }

    /// Intervals of the speed (m/s) and of the distance of the period (m) that leave out no more than `risk`.
    pub(in super::super) fn interval(&mut self, scene: &Scene, risk: f64, t: f64) -> [Range; 2] {
        let [likely, distance] =
            interval(&self.probability, &self.filters, &self.distances, scene, (risk, self.beyond), t);
        let wheels = self.compared(scene);
        let shown = Shown {
            p: self.probability.0,
            since_touch: self.since_touch,
            since_lone_touch: self.since_lone_touch,
            wheels_a: self.wheels_a,
            side: self.side,
        };
        let speed = self.reach.widen(likely, scene, &wheels, &shown, t);
        let distance = Range {
            low: distance.low + (speed.low - likely.low) * t,
            high: distance.high + (speed.high - likely.high) * t,
        };
        [speed, distance]
    }

    /// On which side of the train slipping wheels turn.
    fn next_side(&mut self, scene: &Scene, t: f64) -> f64 {
        self.trend += (self.acceleration - self.trend) * smaller(t / SIDE_S, 1.0);
        match scene.commanded {
            // The opposite command does not end a slip.
            Some(commanded) if commanded != 0.0 && self.is_away(scene) => self.side,
            Some(commanded) if commanded < 0.0 => 1.0,
            Some(commanded) if commanded > 0.0 => -1.0,
            // The last command may still act.
            Some(_) => self.side,
            // No wheel is locked in traction.
            None if self.trend < 0.0 || scene.wheels.iter().all(WheelScene::is_silent) => 1.0,
            None => -1.0,
        }
    }

    /// Whether both wheels slip on the present side, and at least one has not come back to the train.
    fn is_away(&self, scene: &Scene) -> bool {
        let [.., slip, creep, _, _, _] = self.probability.0;
        let may = if self.side > 0.0 { scene.slide } else { scene.slip };
        let train = self.filters.state(if slip > creep { SLIP } else { CREEP }).v;
        let away = |wheel: &WheelScene| {
            self.side * (train - wheel.speed) > AWAY + AWAY_PART * train.abs()
                || self.side * wheel.acceleration > RETURNS
        };
        may && slip + creep > 0.5 && scene.wheels.iter().any(away)
    }

    /// The wheels, corrected by the ratio of their diameters.
    fn compared(&self, scene: &Scene) -> [Compared; 2] {
        let [first, second] = &scene.wheels;
        let of = |wheel: &WheelScene, scale: f64, dead: bool| {
            let speed = wheel.speed * scale;
            let ratio = 0.25 * self.ratio_variance * speed * speed;
            Compared { speed, variance: wheel.speed_deviation * wheel.speed_deviation + ratio, dead }
        };
        let [one, other] = self.scales();
        let [first_dead, second_dead] = self.found_dead;
        [of(first, one, first_dead), of(second, other, second_dead)]
    }

    /// The transitions of a period. A hypothesis that cannot begin now takes no probability.
    fn transitions(&self, scene: &Scene, t: f64) -> Transitions {
        let Transitions { ends, after_rolling, after_others } = transitions(scene, self.found_dead, t);
        let may = self.may_begin();
        let State { v, pvv, .. } = self.filters.state(ROLL);
        let after_rolling = with_stands(after_rolling * may, |stands| stands * may_stop(v, pvv));
        // Wheels that roll show how fast the train is. Those of a slide do not.
        let ending = larger((ends * self.probability).sum(), LEAST);
        let after_others = with_stands(after_others * may, |stands| {
            larger(
                stands * may_stop(self.speed, self.variance),
                self.slides_that_stop(scene.commanded.is_some()) * t / ending,
            )
        });
        Transitions { ends, after_rolling, after_others }
    }

    /// What ends in a period.
    fn arrivals(&self, scene: &Scene, wheels: &[Compared; 2], transitions: &Transitions) -> Arrivals {
        let Transitions { ends, after_rolling, after_others } = transitions;
        let [rolling, ..] = self.probability.0;
        let ending = Ending {
            filters: &self.filters,
            probability: &self.probability,
            ahead: &self.ahead,
            ends,
            follows: after_others,
            of_rolling: rolling * after_rolling.sum(),
            about: [self.speed, self.acceleration],
        };
        let [first, second] = &scene.wheels;
        let pitch = larger(first.pitch, second.pitch);
        let mut arrivals = arrivals(scene, wheels, &ending, pitch * pitch);
        let [.., slip, creep, _, _, _] = arrivals.leaves.0;
        arrivals.pool.paa += REGAINS * REGAINS * (slip + creep) / arrivals.leaves.sum();
        arrivals
    }

    /// What each hypothesis begins with by the transitions between them.
    fn begins(
        &self,
        scene: &Scene,
        wheels: &[Compared; 2],
        transitions: &Transitions,
        arrivals: &Arrivals,
    ) -> Begins {
        let Transitions { after_rolling, after_others: mut follows, .. } = *transitions;
        let [rolling, ..] = self.probability.0;
        let [alike, of_first, of_second] = self.lost(scene, wheels, &arrivals.pool);
        let lost = Lanes([alike, of_second, of_first, 0.0, 0.0, 0.0, of_second, of_first]);
        if alike + of_first + of_second > 0.0 {
            follows *= Lanes(lost.0.map(|leap| if leap > 0.0 { LOST } else { 1.0 }));
        }
        Begins { follows, after_rolling, rolling, lost }
    }

    /// Variance (m²/s²) that hypotheses begin with in addition, if their speed has to leap: the leap then costs likelihood once, not
    /// in every period. Of "both roll", and of those in which the first and the second wheel rolls.
    ///
    /// A slide has lost the train where both wheels turn alike at quite another speed: they
    /// roll. A sensor that is taken for dead may be the good one: its wheel rolls, and the other slips or has the dead sensor. So may a
    /// wheel that is taken to slip beside a stuck count, or to spin beside a silent one: no wheel is locked in traction.
    fn lost(&self, scene: &Scene, [one, other]: &[Compared; 2], pool: &Pool) -> [f64; 3] {
        let [_, first_slips, second_slips, slip, creep, _, first_dead, second_dead] = self.probability.0;
        let [_, (most, part)] = CREEP_BY;
        let leap = |speed: f64, variance: f64, least: f64| {
            let leap = (speed - pool.v).abs();
            let far = larger(FAR * libm::sqrt(pool.pvv + variance), least);
            if leap > far { leap * leap } else { 0.0 }
        };
        let turn = scene.wheels.iter().all(|wheel| wheel.read && wheel.speed.abs() > SILENT);
        // After slides of each, a smaller leap may be creep; wheels that are taken to creep may roll at any speed below. Spinning wheels turn
        // alike, too.
        let alike = if self.side > 0.0 && turn && larger(slip, creep) > 0.9 {
            let least = if creep > slip { AWAY } else { most + part * pool.v.abs() };
            leap(0.5 * (one.speed + other.speed), one.variance, least)
        } else {
            0.0
        };
        let of_wheel = |wheel: &WheelScene, compared: &Compared| {
            if wheel.counts() { leap(compared.speed, compared.variance, AWAY) } else { 0.0 }
        };
        let [first, second] = &scene.wheels;
        let beside = |wheel: &WheelScene, slips: f64| {
            wheel.stuck && slips > 0.9 || self.side < 0.0 && wheel.is_silent() && larger(slips, slip) > 0.9
        };
        let lost_first = first_dead > 0.9 || beside(second, first_slips);
        let lost_second = second_dead > 0.9 || beside(first, second_slips);
        let of_first = if lost_first { of_wheel(first, one) } else { 0.0 };
        let of_second = if lost_second { of_wheel(second, other) } else { 0.0 };
        [alike, of_first, of_second]
    }

    /// How easily each hypothesis but that of a train at rest begins at the speed of the train, 0 to 1: nothing slips at rest.
    fn may_begin(&self) -> Lanes {
        let moves = self.speed * self.speed;
        let moving = |above: f64| moves / (moves + above * above);
        let (slips, creeps) = (moving(SLIPS_ABOVE), moving(CREEPS_ABOVE) * moving(CREEPS_ABOVE));
        Lanes([1.0, slips, slips, slips, creeps, 1.0, 1.0, 1.0])
    }

    /// How often a slide of both comes to rest now (1/s), times its probability: as often as its speed passes zero. Silent wheels do not
    /// show it.
    fn slides_that_stop(&self, is_commanded: bool) -> f64 {
        let [_, _, _, slips, ..] = self.probability.0;
        let State { v, a, pvv, .. } = self.filters.state(SLIP);
        let by = if is_commanded { larger(-self.acted, 0.0) } else { UNKNOWN_BRAKE };
        let (least, part) = SLIDES_UNLIKE;
        let unlike = larger(least + part * by, 0.0) * pvv / slides_spread(by);
        let variance = unlike * unlike + STOPS_BELOW * STOPS_BELOW;
        if a >= 0.0 || v * v > NEVER_STOPS * variance {
            return 0.0;
        }
        let density = libm::exp(-0.5 * v * v / variance) / libm::sqrt(2.0 * core::f64::consts::PI * variance);
        slips * smaller(-a * density, MOST_STOPS)
    }

    /// What the counters and the command of a period of `t` seconds say to each hypothesis.
    fn counts(&mut self, scene: &Scene, t: f64) -> Counts {
        let [first, second] = &scene.wheels;
        let [one, other] = self.scales();
        let [both_1, both_2] = self.shares;
        // Without a reading, nothing corrects a hypothesis that trusts that wheel.
        let trusts = |wheel: &WheelScene| f64::from(u8::from(wheel.read));
        let of_both = |both: f64, one: f64, two: f64| Lanes([both, two, one, 0.0, 0.0, 0.0, two, one]);
        let (counted_1, counted_2) = (first.counted * one, second.counted * other);
        let (white_1, white_2) = (first.pitch * first.pitch / 12.0, second.pitch * second.pitch / 12.0);
        let both = both_1 * both_1 * white_1 + both_2 * both_2 * white_2;
        let rest = scene.commanded.map_or(0.0, |commanded| commanded - self.acted);
        let acts = rest * smaller(t / BUILD_UP_S, 1.0);
        self.acted += acts;
        let added = EXPECTED * acts;
        Counts {
            counted: of_both(both_1 * counted_1 + both_2 * counted_2, counted_1, counted_2),
            variance: of_both(both + ROUNDING, white_1 + ROUNDING, white_2 + ROUNDING),
            trusted: of_both(smaller(both_1 + both_2, 1.0), trusts(first), trusts(second)),
            added: of_both(added, added, added),
            jerk: if scene.commanded.is_some() { &JERK } else { &JERK_UNANNOUNCED },
            top: scene.top_speed,
            inertial: scene.inertial.is_some(),
        }
    }

    /// Factors that make both wheels agree while both roll.
    pub(super) fn scales(&self) -> [f64; 2] {
        let [one, other] = self.shares;
        [1.0 - other * self.ratio, 1.0 + one * self.ratio]
    }

    /// Remembers which sensors are dead.
    fn find_dead(&mut self, scene: &Scene) {
        let [.., first, second] = self.probability.0;
        for ((found, wheel), dead) in self.found_dead.iter_mut().zip(&scene.wheels).zip([first, second]) {
            *found = !wheel.counts() && (*found || dead > FOUND_DEAD);
        }
    }

    /// Learns the ratio of the diameters while both roll.
    fn learn_ratio(&mut self, scene: &Scene, t: f64) {
        self.ratio_variance += RATIO_WANDERS * RATIO_WANDERS * t;
        let [first, second] = &scene.wheels;
        let [rolling, ..] = self.probability.0;
        let mean = 0.5 * (first.speed + second.speed);
        if !(first.read && second.read) || mean.abs() < RATIO_ABOVE || rolling < 0.9 {
            return;
        }
        let measured = (first.speed - second.speed) / mean - self.ratio;
        let noise = (first.speed_deviation + second.speed_deviation) / mean;
        let creep = RATIO_CREEPAGE * larger(scene.brake, scene.traction);
        let variance = noise * noise * (2.0 * FOLLOWED_S / t) + creep * creep * (CREEPAGE_FOR_S / t);
        let gain = self.ratio_variance / (self.ratio_variance + variance);
        let most = first.tolerance + second.tolerance;
        self.ratio = larger(smaller(self.ratio + gain * measured, most), -most);
        self.ratio_variance *= 1.0 - gain;
        let differ = larger((measured + self.ratio).abs() - most, 0.0);
        self.beyond += (differ - self.beyond) * smaller(t / BEYOND_S, 1.0);
    }
}

/// How easily a train of this speed (m/s) and variance (m²/s²) comes to rest, 0 to 1.
fn may_stop(v: f64, variance: f64) -> f64 {
    let slow = variance + STOPS_BELOW * STOPS_BELOW;
    // At speed this is less than the least number there is.
    if v * v > NEVER_STOPS * slow {
        return 0.0;
    }
    libm::exp(-0.5 * v * v / slow) * STOPS_BELOW / libm::sqrt(slow)
}

/// The same rates with another one for a train that comes to rest.
fn with_stands(mut rates: Lanes, of: impl Fn(f64) -> f64) -> Lanes {
    let [.., stands, _, _] = &mut rates.0;
    *stands = of(*stands);
    rates
}

/// The shares of both wheels where both roll.
fn shares(scene: &Scene) -> [f64; 2] {
    let [first, second] = &scene.wheels;
    let weight = |driven: bool, other: bool, pitch: f64, read: bool| {
        let creeps = if driven && !other && scene.slip { CREEPING_SHARE } else { 1.0 };
        if read { creeps / (pitch * pitch) } else { 0.0 }
    };
    let a = weight(first.driven, second.driven, first.pitch, first.read);
    let b = weight(second.driven, first.driven, second.pitch, second.read);
    if a + b > 0.0 { [a / (a + b), b / (a + b)] } else { [0.0; 2] }
}

#[cfg(test)]
mod tests;
