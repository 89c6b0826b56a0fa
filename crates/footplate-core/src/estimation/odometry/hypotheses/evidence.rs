//! How well each hypothesis explains what the wheels show: logarithms of likelihoods.
//!
//! Letters: `y` wheel speed less train speed, `b` wheel acceleration less train acceleration, `u` how much slower (in a
//! spin: faster) a wheel turns than the train moves. Speeds of wheels are followed, so that their errors last; evidence
//! counts once in the time over which it lasts, not once a period.

use super::filters::Filters;
use super::lanes::Lanes;
use super::scene::{Scene, WheelScene};
use crate::wheels::{Range, larger, smaller};

/// How long the error of a followed wheel speed lasts (s).
const FOLLOWED_S: f64 = 0.15;
/// How long a wheel that slips keeps to a speed (s), and to an acceleration.
const SLIP_SPEED_S: f64 = 0.6;
const SLIP_ACCELERATION_S: f64 = 1.2;
/// A wheel that slips further than this many means is not less probable for it.
const FARTHEST: f64 = 1.5;
/// Slower wheels are silent (m/s).
pub(super) const SILENT: f64 = 0.1;
/// Creepage of wheels that roll under full effort (m/s for each m/s).
const ROLLING_CREEPAGE: f64 = 0.003;
/// Deviation of the creepage of rolling wheels for which nothing is to blame, as part of the speed.
const RESTLESS: f64 = 0.0015;
/// Mean excess of a wheel that slips (m/s, part of the speed).
const SLIPS: (f64, f64) = (0.5, 0.1);
/// Deviation of the acceleration of a wheel that slips (m/s²).
const SLIP_ACCELERATION: f64 = 5.0;
/// Least and largest creepage of wheels that creep alike (m/s, part of the speed), and by how much they differ.
pub(super) const CREEP: [(f64, f64); 2] = [(0.2, 0.02), (1.0, 0.2)];
const CREEP_APART: f64 = 0.02;
/// How closely they accelerate with the train (m/s²), over so long (s).
const STEADY: f64 = 0.1;
pub(super) const STEADY_S: f64 = 1.0;
/// Squares of deviations over their variance up to this say nothing: no hypothesis gains by explaining noise.
const USUAL: f64 = 1.0;
/// What a dead sensor costs a second if it counts: it may say anything, so it explains nothing; most are silent.
const DEAD_COUNTS: f64 = 10.0;
/// What a silent wheel costs a second as a locked one: it may come free. A train slower than this has none (m/s).
const LOCKED: f64 = 0.1;
const NEARLY_STANDING: f64 = 0.15;
/// What it costs a second to say that a count which stands still is that of a wheel.
const STUCK: f64 = 10.0;
/// What a hypothesis costs a second that the command or the axle rules out.
const IMPOSSIBLE: f64 = 15.0;
/// Deviation of the train's acceleration beyond what it can be (m/s²).
const BEYOND: f64 = 0.06;
/// Pulses of a standing train that is shaken, and what each beyond costs.
const SHAKEN: f64 = 1.5;
const TURNS: f64 = 3.0;
/// Innovations of the place with a smaller square over their variance are usual.
const SURPRISING: f64 = 7.0;
/// No period says more than this for or against a hypothesis: what one row says may be a fault of that row.
const MOST: f64 = 25.0;

/// Which hypotheses say that a wheel rolls, slips in its own manner, or has a dead sensor: first wheel, second wheel.
const ROLLS: [Lanes; 2] =
    [Lanes([1.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 1.0]), Lanes([1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 1.0, 0.0])];
const OWN_SLIP: [Lanes; 2] =
    [Lanes([0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0]), Lanes([0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0])];
const DEAD: [Lanes; 2] =
    [Lanes([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0]), Lanes([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0])];
const CREEPS: Lanes = Lanes([0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]);
const GRIPS: Lanes = Lanes([1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0]);
const ONE_SLIPS: Lanes = Lanes([0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
const STANDS: Lanes = Lanes([0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0]);

/// A wheel as hypotheses compare it with their train.
#[derive(Debug, Clone, Copy)]
pub(super) struct Compared {
    /// Speed (m/s), with what is known of the ratio of the diameters, and its variance.
    pub(super) speed: f64,
    pub(super) variance: f64,
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
    let mut total = (surprise - Lanes::all(SURPRISING)).at_least(0.0) * -0.5;
    for (((wheel, compared), rolls), (slips, dead)) in
        scene.wheels.iter().zip(wheels).zip(ROLLS).zip(OWN_SLIP.into_iter().zip(DEAD))
    {
        let read = f64::from(u8::from(wheel.read));
        let effort = scene.brake * f64::from(u8::from(wheel.braked))
            + scene.traction * f64::from(u8::from(wheel.driven));
        let creep = (ROLLING_CREEPAGE * effort + RESTLESS) * filters.v.0[0].abs();
        let y = Lanes::all(compared.speed) - filters.v;
        let b = Lanes::all(wheel.acceleration) - filters.a;
        let speed_variance = filters.pvv + (compared.variance + creep * creep);
        let own = wheel.acceleration_deviation * wheel.acceleration_deviation;
        let acceleration_variance = filters.paa + (own + 0.04);
        let per_speed = speed_variance.inverse();
        let smooth = (b * b * acceleration_variance.inverse() - Lanes::all(USUAL)).at_least(0.0);
        let roll = ((y * y * per_speed - Lanes::all(USUAL)).at_least(0.0) + smooth) * (-0.5 * followed);

        // Silence says nothing of how a wheel slips: a locked one keeps to its speed.
        let turns = f64::from(u8::from(wheel.speed.abs() > SILENT));
        let u = -y * side;
        let ahead = u.at_most(0.0);
        let (least, part) = SLIPS;
        let mean = (filters.v * part).at_least(0.0) + least;
        let wide = acceleration_variance + (SLIP_ACCELERATION * SLIP_ACCELERATION);
        let still =
            (filters.v * filters.v * (1.0 / (NEARLY_STANDING * NEARLY_STANDING)) + Lanes::all(1.0)).inverse();
        let locked = (still * still * IMPOSSIBLE + Lanes::all(LOCKED)) * (1.0 - turns);
        let slip = (ahead * ahead * per_speed + b * b * wide.inverse()) * (-0.5 * followed)
            - ((u.at_least(0.0) * mean.inverse()).at_most(FARTHEST) * (1.0 / SLIP_SPEED_S)
                + log(mean * mean * per_speed).at_least(0.0) * (0.5 / SLIP_SPEED_S)
                + log(wide * acceleration_variance.inverse()) * (0.5 / SLIP_ACCELERATION_S))
                * (t * turns);
        let stuck = if wheel.stuck { STUCK } else { 0.0 };
        let dead_costs = if wheel.stuck || turns == 0.0 { 0.0 } else { DEAD_COUNTS };
        let ruled_out = rule_out(scene, wheel, side) + stuck;
        let of_wheel =
            rolls * (roll - Lanes::all(stuck * t)) + slips * (slip - (locked + Lanes::all(ruled_out)) * t);
        total += (of_wheel - dead * (dead_costs * t)) * read;
    }
    let [first, second] = &scene.wheels;
    let [a, b] = wheels;
    let both = f64::from(u8::from(first.read && second.read));
    let fastest = side * larger(side * a.speed, side * b.speed);
    let apart = a.speed - b.speed;
    let v = filters.v.at_least(0.0);
    let variance = a.variance + b.variance;
    let apart_variance = v * v * (CREEP_APART * CREEP_APART) + variance;
    let u = (filters.v - Lanes::all(fastest)) * side;
    let [(least, least_part), (most, most_part)] = CREEP;
    let outside = (u - (v * least_part + least)).at_most(0.0) + (u - (v * most_part + most)).at_least(0.0);
    let mut alike = (apart_variance.inverse() * (apart * apart) - Lanes::all(USUAL)).at_least(0.0)
        + outside * outside * (filters.pvv + 0.5 * variance).inverse();
    for wheel in &scene.wheels {
        let b = Lanes::all(wheel.acceleration) - filters.a;
        let own = wheel.acceleration_deviation * wheel.acceleration_deviation;
        alike += (b * b * (filters.paa + (own + 0.04)).inverse() - Lanes::all(USUAL)).at_least(0.0);
    }
    let b = (Lanes::all(wheels_a) - filters.a) * (1.0 / STEADY);
    let steady = (b * b - Lanes::all(USUAL)).at_least(0.0);
    let alike = alike * (-0.5 * followed) + steady * (-0.5 * smaller(t / STEADY_S, 1.0));
    // Wheels that do not turn do not creep.
    let silent = if first.speed.abs() < SILENT || second.speed.abs() < SILENT { IMPOSSIBLE } else { 0.0 };
    let stuck = if first.stuck || second.stuck { STUCK } else { 0.0 };
    let ruled_out =
        larger(larger(rule_out(scene, first, side), rule_out(scene, second, side)), silent) + stuck;
    total += CREEPS * (alike * both - Lanes::all(ruled_out * t));

    let turned = larger(first.counted.abs() / first.pitch, second.counted.abs() / second.pitch);
    let standing = larger(turned - SHAKEN, 0.0) * TURNS;
    total -= STANDS * standing;

    // Brakes do what is claimed of them where the rail carries it.
    let range = |of: fn(&Range) -> f64| {
        GRIPS * of(&scene.rolling) + (Lanes::all(1.0) - GRIPS) * of(&scene.acceleration)
    };
    let (low, high) = (range(|range| range.low), range(|range| range.high));
    // A train on whose rail one wheelset slides brakes no harder than half way between what is commanded and the most.
    let halfway = match scene.commanded {
        Some(commanded) if commanded < 0.0 => 0.5 * (commanded - scene.acceleration.low),
        _ => 0.0,
    };
    let low = low + ONE_SLIPS * larger(halfway, 0.0);
    let beyond = (filters.a - high).at_least(0.0) + (filters.a - low).at_most(0.0);
    total += beyond * beyond * (-0.5 * followed / (BEYOND * BEYOND));
    let best = total.largest();
    (total - Lanes::all(best)).at_least(-MOST)
}

/// What it costs a second to say that this wheel slips.
fn rule_out(scene: &Scene, wheel: &WheelScene, side: f64) -> f64 {
    let possible = if side > 0.0 { scene.slide && wheel.braked } else { scene.slip && wheel.driven };
    if possible { 0.0 } else { IMPOSSIBLE }
}

fn log(lanes: Lanes) -> Lanes {
    Lanes(lanes.0.map(|value| libm::log(larger(value, 1e-12))))
}
