//! Log-likelihoods of the hypotheses.
//!
//! Letters: `y` wheel speed less train speed, `b` wheel acceleration less train acceleration, `u` how much slower (in a
//! spin: faster) a wheel turns than the train moves, `v`, `a`, `pvv`, `paa` the train as in `filters`. The errors of a tracked
//! speed are correlated; evidence counts once in a correlation time, not once a period.

use core::array;

use super::filters::{Filters, State};
use super::lanes::Lanes;
use super::scene::{Scene, WheelScene};
use crate::odometry::wheels::{Range, larger, smaller};

/// Correlation time of the error of a tracked wheel speed (s).
const FOLLOWED_S: f64 = 0.15;
/// Correlation time of the speed and acceleration of a slipping wheel (s).
const SLIP_S: f64 = 0.85;
/// Slips beyond this many means are equally probable.
const FARTHEST: f64 = 1.5;
/// Slower wheels are silent (m/s).
pub(super) const SILENT: f64 = 0.1;
/// Creepage of wheels that roll under full effort (m/s for each m/s).
const ROLLING_CREEPAGE: f64 = 0.003;
/// Standard deviation of the creepage of rolling wheels without effort (part of the speed).
const RESTLESS: f64 = 0.0015;
/// Mean excess of a wheel that slips (m/s, part of the speed).
const SLIPS: (f64, f64) = (0.5, 0.1);
/// Deviation of the acceleration of a wheel that slips (m/s²).
const SLIP_ACCELERATION: f64 = 5.0;
/// Beyond this square of deviations a further one of its acceleration hardly counts.
const JERKS: f64 = 4.0;
/// Least and largest creepage of wheels that creep alike (m/s, part of the speed), and by how much they differ.
pub(super) const CREEP: [(f64, f64); 2] = [(0.2, 0.02), (1.0, 0.2)];
const CREEP_APART: f64 = 0.02;
/// How closely they accelerate with the train (m/s²), over so long (s).
const STEADY: f64 = 0.1;
pub(super) const STEADY_S: f64 = 1.0;
/// Squared innovations over their variance up to this are no evidence.
const USUAL: f64 = 1.0;
/// Variance of the acceleration of rolling wheels about that of the train (m²/s⁴).
const RESTLESS_ACCELERATION: f64 = 0.04;
/// Cost of a dead sensor that counts (nats per second): it explains no count, and most dead sensors are silent.
const DEAD_COUNTS: f64 = 10.0;
/// Cost of taking the spin of a wheel beside a dead sensor for the motion of the train (nats per second), and the slide of one.
const BESIDE_DEAD: [f64; 2] = [1.0, 8.0];
/// Cost of a locked wheel (nats per second): it may come free. A slower train has none (m/s).
const LOCKED: f64 = 0.1;
const NEARLY_STANDING: f64 = 0.15;
/// Cost of taking a stuck count for that of a wheel (nats per second).
const STUCK: f64 = 10.0;
/// Cost of a hypothesis that the command or the axle excludes (nats per second).
const IMPOSSIBLE: f64 = 15.0;
/// Deviation of the train's acceleration beyond what it can be (m/s²).
const BEYOND: f64 = 0.06;
/// Variance of an acceleration that is known no better because a run or a hypothesis has just begun (m²/s⁴).
const UNKNOWN: f64 = 0.15;
/// Pulses that vibration gives at rest, and the cost of each further one (nats).
const SHAKEN: f64 = 1.5;
const TURNS: f64 = 3.0;
/// Squared innovations of the place over their variance up to this are no evidence.
const SURPRISING: f64 = 7.0;
/// Largest evidence of one period (nats): one row may be faulty.
const MOST: f64 = 25.0;

/// Hypotheses by which the rail carries the whole brake, and by which one wheelset finds that it does not.
const GRIPS: Lanes = Lanes([1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0]);
const ONE_SLIPS: Lanes = Lanes([0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0]);

impl WheelScene {
    /// Whether its count is that of a wheel that turns.
    pub(super) fn counts(&self) -> bool {
        self.read && !self.stuck && self.speed.abs() > SILENT
    }
}

/// A wheel as hypotheses compare it with their train.
#[derive(Debug, Clone, Copy)]
pub(super) struct Compared {
    /// Speed (m/s), with what is known of the ratio of the diameters, and its variance.
    pub(super) speed: f64,
    pub(super) variance: f64,
    /// Its sensor was found dead and has not counted since.
    pub(super) dead: bool,
}

/// The logarithm of the likelihood of every hypothesis, less that of the best. `surprise` is the square of the innovation
/// of the place over its variance, `wheels_a` the smoothed acceleration of the wheels; `side` is 1 where wheels that slip
/// turn slower than the train and −1 where faster.
pub(super) fn evidence(
    scene: &Scene,
    wheels: &[Compared; 2],
    filters: &Filters,
    surprise: Lanes,
    wheels_a: f64,
    side: f64,
    t: f64,
) -> Lanes {
    let followed = smaller(t / FOLLOWED_S, 1.0);
    let [first, second] = &scene.wheels;
    let [a, b] = wheels;
    let of = |wheel, compared| Shown { scene, wheel, compared, side, followed, t };
    let (one, other) = (of(first, a), of(second, b));
    let [both, first_slips, second_slips, slip, creep, stands, first_dead, second_dead] =
        array::from_fn(|lane| filters.state(lane));
    // A stuck count is no evidence against a train at rest.
    let turned = |wheel: &WheelScene| if wheel.stuck { 0.0 } else { wheel.counted.abs() / wheel.pitch };
    let turned = larger(turned(first), turned(second));
    let shaken = larger(turned - SHAKEN, 0.0) * TURNS;
    let of_wheels = Lanes([
        one.rolls(&both) + other.rolls(&both),
        one.slips(&first_slips) + other.rolls(&first_slips),
        one.rolls(&second_slips) + other.slips(&second_slips),
        one.slips(&slip) + other.slips(&slip),
        alike(&one, &other, &creep, wheels_a),
        one.rests(&stands) + other.rests(&stands) - shaken,
        one.dead() + other.rolls(&first_dead),
        one.rolls(&second_dead) + other.dead(),
    ]);

    // Brakes do what is claimed of them where the rail carries it.
    let range = |of: fn(&Range) -> f64| {
        GRIPS * of(&scene.rolling) + (Lanes::all(1.0) - GRIPS) * of(&scene.acceleration)
    };
    let (low, high) = (range(|range| range.low), range(|range| range.high));
    // A train on whose rail one wheelset slides brakes no harder than the middle between what is commanded and the most.
    let halfway = match scene.commanded {
        Some(commanded) if commanded < 0.0 => 0.5 * (commanded - scene.acceleration.low),
        _ => 0.0,
    };
    let low = low + ONE_SLIPS * larger(halfway, 0.0);
    let beyond = (filters.a - high).at_least(0.0) + (filters.a - low).at_most(0.0);
    let surprising = (surprise - Lanes::all(SURPRISING)).at_least(0.0) * -0.5;
    let known = (filters.paa - Lanes::all(UNKNOWN)).at_least(0.0) + Lanes::all(BEYOND * BEYOND);
    let total = of_wheels + surprising - beyond * beyond * known.inverse() * (0.5 * followed);
    let total = total.or_if_larger(beside_dead(&one, &other, [&first_dead, &second_dead]));
    let best = total.largest();
    (total - Lanes::all(best)).at_least(-MOST)
}

/// One wheel as hypotheses have to explain it.
struct Shown<'a> {
    scene: &'a Scene,
    wheel: &'a WheelScene,
    compared: &'a Compared,
    side: f64,
    /// Part of its evidence that is new since the last period.
    followed: f64,
    t: f64,
}

impl Shown<'_> {
    /// Its count is stuck, or its sensor was found dead and has not counted since.
    fn is_faulty(&self) -> bool {
        self.wheel.stuck || self.compared.dead
    }

    /// It rolls.
    fn rolls(&self, train: &State) -> f64 {
        let Self { scene, wheel, compared, .. } = self;
        if !wheel.read {
            return 0.0;
        }
        let effort =
            if wheel.braked { scene.brake } else { 0.0 } + if wheel.driven { scene.traction } else { 0.0 };
        let creep = (ROLLING_CREEPAGE * effort + RESTLESS) * train.v;
        let y = compared.speed - train.v;
        let speed = unusual(y * y / (train.pvv + compared.variance + creep * creep));
        let faulty = if self.is_faulty() { STUCK } else { 0.0 };
        -0.5 * self.followed * (speed + self.unsteady(train)) - faulty * self.t
    }

    /// It rests with the train.
    fn rests(&self, train: &State) -> f64 {
        if self.is_faulty() { 0.0 } else { self.rolls(train) }
    }

    /// By how much its acceleration is unlike that of the train.
    fn unsteady(&self, train: &State) -> f64 {
        let b = self.wheel.acceleration - train.a;
        unusual(b * b / self.acceleration_variance(train))
    }

    fn acceleration_variance(&self, train: &State) -> f64 {
        let own = self.wheel.acceleration_deviation;
        train.paa + own * own + RESTLESS_ACCELERATION
    }

    /// It slips independently.
    fn slips(&self, train: &State) -> f64 {
        let Self { wheel, compared, followed, t, .. } = self;
        if !wheel.read {
            return 0.0;
        }
        let ruled_out = self.ruled_out();
        if wheel.speed.abs() <= SILENT {
            // A silent wheel is locked and stays so.
            let still = 1.0 / (1.0 + train.v * train.v / (NEARLY_STANDING * NEARLY_STANDING));
            return -t * (ruled_out + LOCKED + still * still * IMPOSSIBLE);
        }
        let u = (train.v - compared.speed) * self.side;
        let ahead = smaller(u, 0.0);
        let b = wheel.acceleration - train.a;
        let (least, part) = SLIPS;
        let mean = least + larger(part * train.v, 0.0);
        // The tracker lags behind a wheel that accelerates.
        let late = b * FOLLOWED_S;
        let variance = train.pvv + compared.variance + late * late;
        let steady = self.acceleration_variance(train);
        let wide = steady + SLIP_ACCELERATION * SLIP_ACCELERATION;
        let spread = larger(mean * mean / variance, 1.0) * wide / steady;
        let further = smaller(larger(u, 0.0) / mean, FARTHEST);
        -0.5 * followed * (ahead * ahead / variance + jerks(b * b / wide))
            - t * (ruled_out + (further + 0.5 * libm::log(spread)) / SLIP_S)
    }

    /// Its sensor is dead.
    fn dead(&self) -> f64 {
        if self.wheel.counts() { -DEAD_COUNTS * self.t } else { 0.0 }
    }

    /// Cost of a slip of this wheel (nats per second).
    fn ruled_out(&self) -> f64 {
        let Self { scene, wheel, side, .. } = self;
        let possible = if *side > 0.0 { scene.slide && wheel.braked } else { scene.slip && wheel.driven };
        let stuck = if wheel.stuck { STUCK } else { 0.0 };
        if possible { stuck } else { IMPOSSIBLE + stuck }
    }
}

/// What the hypotheses of a dead sensor cost at most where the sensor was found dead before, or its count is stuck: the other wheel may
/// slip. Beside a wheel that does not turn no other hypothesis says so in traction; in a slide the silent wheel may be locked, and
/// "both slip" says that. Another silent sensor may be that of a wheel that still stands, beside one that spins at the start.
fn beside_dead(one: &Shown, other: &Shown, [first_dead, second_dead]: [&State; 2]) -> Lanes {
    let [spins, slides] = BESIDE_DEAD;
    let cost = one.t * if one.side < 0.0 { spins } else { slides };
    let of = |dead: &Shown, slips: &Shown, train: &State| {
        if dead.is_faulty() { slips.slips(train) - cost } else { f64::NEG_INFINITY }
    };
    let mut least = Lanes::all(f64::NEG_INFINITY);
    let [.., of_first, of_second] = &mut least.0;
    *of_first = of(one, other, first_dead);
    *of_second = of(other, one, second_dead);
    least
}

/// Both wheels creep alike.
fn alike(one: &Shown, other: &Shown, train: &State, wheels_a: f64) -> f64 {
    let ruled_out = larger(one.ruled_out(), other.ruled_out());
    if !(one.wheel.read && other.wheel.read) {
        return -ruled_out * one.t;
    }
    // Wheels that do not turn do not creep.
    let silent = one.wheel.speed.abs() < SILENT || other.wheel.speed.abs() < SILENT;
    let silent = if silent { IMPOSSIBLE } else { 0.0 };
    let (a, b) = (one.compared, other.compared);
    let fastest = one.side * larger(one.side * a.speed, one.side * b.speed);
    let apart = a.speed - b.speed;
    let v = larger(train.v, 0.0);
    let variance = a.variance + b.variance;
    let differs = unusual(apart * apart / (v * v * (CREEP_APART * CREEP_APART) + variance));
    let u = (train.v - fastest) * one.side;
    let [(least, least_part), (most, most_part)] = CREEP;
    let outside = smaller(u - least_part * v - least, 0.0) + larger(u - most_part * v - most, 0.0);
    let outside = outside * outside / (train.pvv + 0.5 * variance);
    let b = (wheels_a - train.a) / STEADY;
    -0.5 * one.followed * (differs + outside + one.unsteady(train) + other.unsteady(train))
        - one.t * (ruled_out + silent + 0.5 / STEADY_S * unusual(b * b))
}

/// Heavy-tailed cost of a squared innovation of the acceleration of a slipping wheel: the rail grips and lets go in jerks.
fn jerks(square: f64) -> f64 {
    JERKS * libm::log1p(square * (1.0 / JERKS))
}

/// A squared innovation without its usual part: no hypothesis gains by explaining noise.
fn unusual(square: f64) -> f64 {
    larger(square - USUAL, 0.0)
}

#[cfg(test)]
mod tests;
