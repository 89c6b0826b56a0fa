//! Log-likelihoods of the hypotheses.
//!
//! Letters: `y` wheel speed less train speed, `b` wheel acceleration less train acceleration, `u` how much slower (in a
//! spin: faster) a wheel turns than the train moves, `v`, `a`, `pvv`, `paa` the train as in `filters`. The errors of a tracked
//! speed are correlated; evidence counts once in a correlation time, not once a period.

use super::filters::{Filters, State};
use super::lanes::{Lanes, WIDTH, ln};
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
/// The same of wheels that roll, under effort too (part of the speed), and how long a difference of wheels that creep lasts (s).
const ALIKE: f64 = 0.003;
const APART_S: f64 = 1.0;
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
/// Cost of steady creepage of both without effort (nats per second), and the effort from which it costs none: rails that do not carry a
/// gentle command are rare, and the wheels alone do not tell it from rolling.
const GENTLE: (f64, f64) = (2.0, 0.3);
/// Cost of a locked wheel (nats per second): it may come free. (Both were locked for 18 s on average in 129 slides of more than 5 s, by which
/// it is 0.03; with that world 84210266 loses its train.) A slower train has none (m/s).
const LOCKED: f64 = 0.05;
const NEARLY_STANDING: f64 = 0.15;
/// Cost of taking a stuck count for that of a wheel (nats per second).
const STUCK: f64 = 10.0;
/// Cost of a hypothesis that the command or the axle excludes (nats per second).
const IMPOSSIBLE: f64 = 15.0;
/// Deviation of the train's acceleration beyond what it can be (m/s²).
const BEYOND: f64 = 0.06;
/// Squared deviation of a speed from the guaranteed bounds (m²/s²), and beyond how many of them it costs no more.
const OUT_OF_BOUNDS: (f64, f64) = (0.25, 30.0);
/// Variance of an acceleration that is known no better because a run or a hypothesis has just begun (m²/s⁴).
const UNKNOWN: f64 = 0.15;
/// Pulses that vibration gives at rest, and the cost of each further one (nats).
const SHAKEN: f64 = 1.5;
const TURNS: f64 = 3.0;
/// Squared innovations of the place over their variance up to this are no evidence.
const SURPRISING: f64 = 7.0;
/// The hypotheses that the first wheel slips, the second, and both, once for each; and others.
const SLIPPING: [usize; 4] = [1, 2, 3, 3];
const CREEPS: usize = 4;
const FIRST_DEAD: usize = 6;
const SECOND_DEAD: usize = 7;
/// Largest evidence of one period (nats): one row may be faulty.
const MOST: f64 = 25.0;

impl WheelScene {
    /// Whether its count is that of a wheel that turns.
    pub(super) fn counts(&self) -> bool {
        self.read && !self.stuck && self.speed.abs() > SILENT
    }

    /// Whether it was read and does not turn.
    pub(super) fn is_silent(&self) -> bool {
        self.read && self.speed.abs() < SILENT
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
    surprise: &Lanes,
    wheels_a: f64,
    side: f64,
    t: f64,
) -> Lanes {
    let followed = smaller(t / FOLLOWED_S, 1.0);
    let [first, second] = &scene.wheels;
    let [a, b] = wheels;
    let of = |wheel, compared| Shown { scene, wheel, compared, side, followed, t };
    let (one, other) = (of(first, a), of(second, b));
    // A stuck count is no evidence against a train at rest.
    let turned = |wheel: &WheelScene| if wheel.stuck { 0.0 } else { wheel.counted.abs() / wheel.pitch };
    let turned = larger(turned(first), turned(second));
    let shaken = larger(turned - SHAKEN, 0.0) * TURNS;
    // A train on whose rail one wheelset slides brakes no harder than the middle between what is commanded and the most.
    let halfway = match scene.commanded {
        Some(commanded) if commanded < 0.0 => 0.5 * (commanded - scene.acceleration.low),
        _ => 0.0,
    };
    // Brakes do what is claimed of them where the rail carries it.
    let (rolling, any) = (scene.rolling, scene.acceleration);
    let low = any.low + larger(halfway, 0.0);
    let limits = [
        Lanes([rolling.low, low, low, any.low, any.low, any.low, rolling.low, rolling.low]),
        Lanes([rolling.high, any.high, any.high, any.high, any.high, any.high, rolling.high, rolling.high]),
    ];
    let terms = [one.terms(), other.terms()];
    let [rolls_1, rolls_2, usual] = costs(filters, surprise, &limits, scene.bounded, &terms, followed);
    let (
        [one_rolls, _, one_beside, .., one_rests, _, one_by_dead],
        [two_rolls, two_beside, .., two_rests, two_by_dead, _],
    ) = (rolls_1.0, rolls_2.0);
    let slips = slipping(filters, &terms);
    let [first_slips, second_slips, one_slips, two_slips] = if one.turns() && other.turns() {
        slips
    } else {
        let [of_first, of_second, of_one, of_other] = SLIPPING.map(|lane| filters.state(lane));
        [one.slips(&of_first), other.slips(&of_second), one.slips(&of_one), other.slips(&of_other)]
    };
    let rests = |shown: &Shown, rolls: f64| if shown.is_faulty() { 0.0 } else { rolls };
    let of_wheels = Lanes([
        one_rolls + two_rolls,
        first_slips + two_beside,
        one_beside + second_slips,
        one_slips + two_slips,
        alike(&one, &other, &filters.state(CREEPS), wheels_a),
        rests(&one, one_rests) + rests(&other, two_rests) - shaken,
        one.dead() + two_by_dead,
        one_by_dead + other.dead(),
    ]);
    let mut total = of_wheels + usual;
    if one.is_faulty() || other.is_faulty() {
        total = total.or_if_larger(beside_dead(
            &one,
            &other,
            [&filters.state(FIRST_DEAD), &filters.state(SECOND_DEAD)],
        ));
    }
    let best = total.largest();
    (total - Lanes::all(best)).at_least(-MOST)
}

/// What it costs every hypothesis that the first and the second wheel roll, and what it costs it that its train accelerates beyond
/// its `limits`, its speed is out of the guaranteed bounds and its place is surprising.
#[inline(never)]
#[expect(clippy::indexing_slicing, reason = "below the width of all")]
fn costs(
    filters: &Filters,
    surprise: &Lanes,
    [low, high]: &[Lanes; 2],
    bounded: Range,
    [one, other]: &[Terms; 2],
    followed: f64,
) -> [Lanes; 3] {
    let [mut rolls_1, mut rolls_2, mut usual] = [Lanes::all(0.0); 3];
    let Filters { v, a, pvv, paa, .. } = filters;
    for lane in 0..WIDTH {
        let (v, a, pvv, paa) = (v.0[lane], a.0[lane], pvv.0[lane], paa.0[lane]);
        rolls_1.0[lane] = one.rolls([v, a], [pvv, paa]);
        rolls_2.0[lane] = other.rolls([v, a], [pvv, paa]);
        let beyond = larger(a - high.0[lane], 0.0) + smaller(a - low.0[lane], 0.0);
        let surprising = larger(surprise.0[lane] - SURPRISING, 0.0) * -0.5;
        let known = larger(paa - UNKNOWN, 0.0) + BEYOND * BEYOND;
        let out = larger(v - bounded.high, 0.0) + smaller(v - bounded.low, 0.0);
        let excluded = smaller(out * out * (1.0 / (pvv + OUT_OF_BOUNDS.0)), OUT_OF_BOUNDS.1);
        let unlikely = beyond * beyond * (1.0 / known) + excluded;
        usual.0[lane] = surprising - unlikely * (0.5 * followed);
    }
    [rolls_1, rolls_2, usual]
}

/// What it costs the trains that the first, the second, the first and the second wheel slip, if they turn.
#[inline(never)]
#[expect(clippy::indexing_slicing, reason = "below the length of all")]
fn slipping(filters: &Filters, [one, other]: &[Terms; 2]) -> [f64; 4] {
    let of = |lanes: &Lanes| SLIPPING.map(|lane| lanes.0[lane]);
    let (v, a, pvv, paa) = (of(&filters.v), of(&filters.a), of(&filters.pvv), of(&filters.paa));
    let twice = |of: fn(&Terms) -> f64| [of(one), of(other), of(one), of(other)];
    let (speed, variance) = (twice(|terms| terms.speed), twice(|terms| terms.variance));
    let acceleration = twice(|terms| terms.acceleration);
    let acceleration_variance = twice(|terms| terms.acceleration_variance);
    let ruled_out = twice(|terms| terms.ruled_out);
    let mut costs = [0.0; SLIPPING.len()];
    for slip in 0..SLIPPING.len() {
        let terms = Terms {
            speed: speed[slip],
            variance: variance[slip],
            acceleration: acceleration[slip],
            acceleration_variance: acceleration_variance[slip],
            ruled_out: ruled_out[slip],
            ..*one
        };
        costs[slip] = terms.slips([v[slip], a[slip]], [pvv[slip], paa[slip]]);
    }
    costs
}

/// What one wheel shows, the same for every hypothesis.
struct Terms {
    /// Speed (m/s) and acceleration (m/s²), and their variances without those of the train.
    speed: f64,
    variance: f64,
    acceleration: f64,
    acceleration_variance: f64,
    /// Standard deviation of the creepage of a wheel that rolls (part of the speed).
    creepage: f64,
    /// 1 if it was read, otherwise 0.
    read: f64,
    /// Cost of taking it for a wheel that rolls, and cost of a slip (nats).
    fault: f64,
    ruled_out: f64,
    side: f64,
    followed: f64,
    t: f64,
}

impl Terms {
    /// It rolls.
    #[inline(always)]
    fn rolls(&self, [v, a]: [f64; 2], [pvv, paa]: [f64; 2]) -> f64 {
        let creep = self.creepage * v;
        let y = self.speed - v;
        let speed = unusual(y * y / (pvv + self.variance + creep * creep));
        let b = self.acceleration - a;
        let unsteady = unusual(b * b / (paa + self.acceleration_variance));
        (-0.5 * self.followed * (speed + unsteady) - self.fault) * self.read
    }

    /// It turns and slips independently.
    #[inline(always)]
    fn slips(&self, [v, a]: [f64; 2], [pvv, paa]: [f64; 2]) -> f64 {
        let u = (v - self.speed) * self.side;
        let ahead = smaller(u, 0.0);
        let b = self.acceleration - a;
        let (least, part) = SLIPS;
        let mean = least + larger(part * v, 0.0);
        // The tracker lags behind a wheel that accelerates.
        let late = b * FOLLOWED_S;
        let variance = pvv + self.variance + late * late;
        let steady = paa + self.acceleration_variance;
        let wide = steady + SLIP_ACCELERATION * SLIP_ACCELERATION;
        let spread = larger(mean * mean, variance) * wide / (variance * steady);
        let further = smaller(larger(u, 0.0) / mean, FARTHEST);
        -0.5 * self.followed * (ahead * ahead / variance + jerks(b * b / wide))
            - self.ruled_out
            - self.t * ((further + 0.5 * ln(spread)) / SLIP_S)
    }
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

    /// What it shows to every hypothesis.
    fn terms(&self) -> Terms {
        let Self { scene, wheel, compared, side, followed, t } = *self;
        let effort =
            if wheel.braked { scene.brake } else { 0.0 } + if wheel.driven { scene.traction } else { 0.0 };
        let own = wheel.acceleration_deviation;
        Terms {
            speed: compared.speed,
            variance: compared.variance,
            acceleration: wheel.acceleration,
            acceleration_variance: own * own + RESTLESS_ACCELERATION,
            creepage: ROLLING_CREEPAGE * effort + RESTLESS,
            read: f64::from(u8::from(wheel.read)),
            fault: if self.is_faulty() { STUCK * t } else { 0.0 },
            ruled_out: self.ruled_out() * t,
            side,
            followed,
            t,
        }
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

    /// Its count was read, and it is not silent.
    fn turns(&self) -> bool {
        self.wheel.read && self.wheel.speed.abs() > SILENT
    }

    /// It slips independently.
    fn slips(&self, train: &State) -> f64 {
        if self.turns() {
            return self.terms().slips([train.v, train.a], [train.pvv, train.paa]);
        }
        if !self.wheel.read {
            return 0.0;
        }
        // A silent wheel is locked and stays so.
        let still = 1.0 / (1.0 + train.v * train.v / (NEARLY_STANDING * NEARLY_STANDING));
        -self.t * (self.ruled_out() + LOCKED + still * still * IMPOSSIBLE)
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
    let Scene { commanded, brake, traction, .. } = one.scene;
    let (gentle, effort) = GENTLE;
    let gentle =
        if commanded.is_some() { gentle * larger(1.0 - (brake + traction) / effort, 0.0) } else { 0.0 };
    let ruled_out = larger(one.ruled_out(), other.ruled_out()) + gentle;
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
    // Wheels that roll agree more closely: that they agree says less for creepage.
    let rolling = v * v * (ALIKE * ALIKE) + variance;
    let spread = (v * v * (CREEP_APART * CREEP_APART) + variance) / rolling;
    -0.5 * one.followed * (differs + outside + one.unsteady(train) + other.unsteady(train))
        - one.t * (ruled_out + silent + 0.5 / STEADY_S * unusual(b * b) + 0.5 / APART_S * ln(spread))
}

/// Heavy-tailed cost of a squared innovation of the acceleration of a slipping wheel: the rail grips and lets go in jerks.
#[inline(always)]
fn jerks(square: f64) -> f64 {
    JERKS * ln(1.0 + square * (1.0 / JERKS))
}

/// A squared innovation without its usual part: no hypothesis gains by explaining noise.
fn unusual(square: f64) -> f64 {
    larger(square - USUAL, 0.0)
}

#[cfg(test)]
mod tests;
