//! What hypotheses cost, worked out by hand.

use super::*;
use crate::odometry::wheels::Range;

const T: f64 = 0.05;
/// The part of the evidence that is new in a period: 0.05 s of 0.15 s.
const NEW: f64 = 1.0 / 3.0;

fn compared(speed: f64) -> Compared {
    Compared { speed, variance: 0.01, dead: false }
}

/// Trains that all move at this speed, known to 0.3 m/s, and accelerate by 0.1 m/s², known to 0.2 m/s².
fn filters(speed: f64) -> Filters {
    let mut filters = Filters::new(speed, 0.09);
    (filters.a, filters.paa) = (Lanes::all(0.1), Lanes::all(0.04));
    filters
}

fn shown<'a>(scene: &'a Scene, compared: &'a Compared, side: f64) -> Shown<'a> {
    Shown { scene, wheel: &scene.wheels[0], compared, side, followed: NEW, t: T }
}

fn assert_near(found: f64, expected: f64) {
    assert!((found - expected).abs() < 1e-9, "{found} {expected}");
}

impl Shown<'_> {
    /// What it costs that it rolls, and that it rests with the train.
    fn rolls(&self, train: &State) -> f64 {
        self.terms().rolls([train.v, train.a], [train.pvv, train.paa])
    }

    fn rests(&self, train: &State) -> f64 {
        if self.is_faulty() { 0.0 } else { self.rolls(train) }
    }
}

#[test]
fn a_wheel_that_rolls_costs_what_its_speed_and_acceleration_are_off() {
    // Given half the brake, which creeps by 0.003 a full one, and a wheel 2 m/s slower than the train,
    let mut scene = Scene::of_test([18.0, 20.0], Some(-0.5));
    scene.wheels[0].acceleration = 1.7;
    let (wheel, train) = (compared(18.0), filters(20.0).state(0));
    // then its speed is 2² over 0.3² + 0.1² + (0.0015 + 0.0015)² 20², its acceleration 1.6² over 0.2² + 0.5² + 0.2²,
    let speed = 4.0 / (0.09 + 0.01 + 0.06 * 0.06) - 1.0;
    let acceleration = 2.56 / (0.04 + 0.25 + 0.04) - 1.0;
    let cost = -0.5 * NEW * (speed + acceleration);
    assert_near(shown(&scene, &wheel, 1.0).rolls(&train), cost);
    // a wheel without a brake does not creep by it,
    scene.wheels[0].braked = false;
    let unbraked = 4.0 / (0.09 + 0.01 + 0.03 * 0.03) - 1.0;
    assert_near(shown(&scene, &wheel, 1.0).rolls(&train), -0.5 * NEW * (unbraked + acceleration));
    // traction makes it creep, a quarter of it by 0.00075,
    scene.traction = 0.25;
    let driven = 4.0 / (0.09 + 0.01 + 0.045 * 0.045) - 1.0;
    assert_near(shown(&scene, &wheel, 1.0).rolls(&train), -0.5 * NEW * (driven + acceleration));
    scene.wheels[0].driven = false;
    assert_near(shown(&scene, &wheel, 1.0).rolls(&train), -0.5 * NEW * (unbraked + acceleration));
    // a stuck count costs ten nats a second, and nothing of a train at rest;
    scene.wheels[0].stuck = true;
    let stuck = -0.5 * NEW * (unbraked + acceleration) - 10.0 * T;
    assert_near(shown(&scene, &wheel, 1.0).rolls(&train), stuck);
    assert_eq!(shown(&scene, &wheel, 1.0).rests(&train), 0.0);
    scene.wheels[0].stuck = false;
    let dead = Compared { dead: true, ..wheel };
    assert_near(shown(&scene, &dead, 1.0).rolls(&train), stuck);
    assert_near(shown(&scene, &wheel, 1.0).rests(&train), -0.5 * NEW * (unbraked + acceleration));
    // and what is not read is no evidence.
    scene.wheels[0].read = false;
    assert_eq!(shown(&scene, &wheel, 1.0).rolls(&train), 0.0);
    assert_eq!(shown(&scene, &wheel, 1.0).slips(&train), 0.0);
}

#[test]
fn what_one_deviation_explains_costs_nothing() {
    assert_eq!([0.0, 0.99, 1.0, 1.5].map(unusual), [0.0, 0.0, 0.0, 0.5]);
    // 4 ln(1 + x/4): near x at first, 4 ln 2 at 4.
    assert_near(jerks(4.0), 4.0 * core::f64::consts::LN_2);
    assert!((jerks(1e-3) - 1e-3).abs() < 1e-6);
}

#[test]
fn a_wheel_that_slips_costs_its_width_and_more_on_the_wrong_side() {
    let mut scene = Scene::of_test([18.0, 20.0], Some(-0.5));
    scene.wheels[0].acceleration = -0.9;
    let train = filters(20.0).state(0);
    // The acceleration is 1 m/s² off and follows 0.15 s late; on a train at 20 m/s the mean slip is 0.5 + 0.1 · 20.
    let variance: f64 = 0.09 + 0.01 + 0.15 * 0.15;
    let (steady, mean): (f64, f64) = (0.04 + 0.25 + 0.04, 2.5);
    let wide = steady + 25.0;
    let jerk = 4.0 * (1.0 / wide / 4.0_f64).ln_1p();
    let width = 0.5 * (mean * mean / variance * wide / steady).ln();
    let expected = |ahead: f64, further: f64| {
        -0.5 * NEW * (ahead * ahead / variance + jerk) - T * (further + width) / 0.85
    };
    for (speed, side, ahead, further) in [
        (18.0, 1.0, 0.0, 2.0 / 2.5),
        // Beyond one and a half means all are equally probable.
        (14.0, 1.0, 0.0, 1.5),
        (21.0, 1.0, -1.0, 0.0),
        (21.0, -1.0, 0.0, 1.0 / 2.5),
        (18.0, -1.0, -2.0, 0.0),
    ] {
        assert_near(shown(&scene, &compared(speed), side).slips(&train), expected(ahead, further));
    }
}

#[test]
fn a_silent_wheel_is_locked_unless_the_train_hardly_moves() {
    let scene = Scene::of_test([0.1, 20.0], Some(-0.5));
    let slips = |speed: f64| shown(&scene, &compared(0.1), 1.0).slips(&filters(speed).state(0));
    // 0.05 nats a second, and 15 at rest; at 0.15 m/s a quarter of those.
    assert_near(slips(0.0), -T * (0.05 + 15.0));
    assert_near(slips(0.15), -T * (0.05 + 15.0 / 4.0));
    assert_near(slips(0.3), -T * (0.05 + 15.0 / 25.0));
    // 0.11 m/s is no longer silent.
    let turning = Scene::of_test([0.11, 20.0], Some(-0.5));
    let slow = shown(&turning, &compared(0.11), 1.0).slips(&filters(0.0).state(0));
    assert!((slow - slips(0.0)).abs() > 0.1, "{slow}");
    assert!(!scene.wheels[0].counts() && turning.wheels[0].counts());
}

#[test]
fn a_slip_needs_a_brake_or_a_motor_and_a_rail_that_lets_it() {
    let ruled_out = |side: f64, change: fn(&mut Scene)| {
        let mut scene = Scene::of_test([18.0, 20.0], None);
        change(&mut scene);
        shown(&scene, &compared(18.0), side).ruled_out()
    };
    assert_eq!([1.0, -1.0].map(|side| ruled_out(side, |_| ())), [0.0; 2]);
    assert_eq!([1.0, -1.0].map(|side| ruled_out(side, |scene| scene.slide = false)), [15.0, 0.0]);
    assert_eq!([1.0, -1.0].map(|side| ruled_out(side, |scene| scene.slip = false)), [0.0, 15.0]);
    assert_eq!([1.0, -1.0].map(|side| ruled_out(side, |scene| scene.wheels[0].braked = false)), [15.0, 0.0]);
    assert_eq!([1.0, -1.0].map(|side| ruled_out(side, |scene| scene.wheels[0].driven = false)), [0.0, 15.0]);
    let stuck = |scene: &mut Scene| (scene.slip, scene.wheels[0].stuck) = (false, true);
    assert_eq!([1.0, -1.0].map(|side| ruled_out(side, stuck)), [10.0, 25.0]);
}

#[test]
fn a_dead_sensor_does_not_count() {
    let mut scene = Scene::of_test([18.0, 20.0], None);
    assert_near(shown(&scene, &compared(18.0), 1.0).dead(), -10.0 * T);
    scene.wheels[0].stuck = true;
    assert_eq!(shown(&scene, &compared(18.0), 1.0).dead(), 0.0);
}

/// What two wheels at these speeds that creep alike cost a train at 20 m/s, in a slide (1) or a spin (−1).
fn creeping(speeds: [f64; 2], side: f64, wheels_a: f64) -> f64 {
    creeping_under(None, speeds, side, wheels_a)
}

fn creeping_under(commanded: Option<f64>, speeds: [f64; 2], side: f64, wheels_a: f64) -> f64 {
    let scene = Scene::of_test(speeds, commanded);
    let [a, b] = speeds.map(compared);
    let [one, other] = [&a, &b].map(|compared| shown(&scene, compared, side));
    let other = Shown { wheel: &scene.wheels[1], ..other };
    alike(&one, &other, &filters(20.0).state(CREEPING), wheels_a)
}
const CREEPING: usize = 4;

#[test]
fn wheels_that_creep_alike_keep_within_limits_and_near_each_other() {
    // Rolling wheels would differ by 0.003 · 20 m/s instead of 0.02 · 20: ½ ln of the ratio of the variances a second.
    let alike = -T * 0.5 * (0.18_f64 / 0.0236).ln();
    // Within 0.2 + 0.02 · 20 = 0.6 and 1 + 0.2 · 20 = 5 m/s of the train, and steady, they cost nothing else.
    for speeds in [[19.4, 19.4], [15.0, 15.0]] {
        assert_near(creeping(speeds, 1.0, 0.1), alike);
    }
    for speeds in [[20.6, 20.6], [25.0, 25.0]] {
        assert_near(creeping(speeds, -1.0, 0.1), alike);
    }
    // The fastest counts in a slide, the slowest in a spin; outside by 1 m/s is 1 over 0.3² + ½ (0.1² + 0.1²).
    let outside = 1.0 / 0.1;
    // Apart by 0.4 m/s: 0.16 over (0.02 · 20)² + 2 · 0.01, which is no evidence; by 1 m/s it is.
    for (speeds, side) in
        [([20.4, 20.0], 1.0), ([13.6, 14.0], 1.0), ([19.6, 20.0], -1.0), ([26.4, 26.0], -1.0)]
    {
        assert_near(creeping(speeds, side, 0.1), alike - 0.5 * NEW * outside);
    }
    let apart = 1.0 / (0.16 + 0.02) - 1.0;
    assert_near(creeping([18.0, 17.0], 1.0, 0.1), alike - 0.5 * NEW * apart);
    // They accelerate with the train within 0.1 m/s² for a second: three deviations cost half of 9 − 1 a second.
    assert_near(creeping([18.0, 18.0], 1.0, 0.4), alike - T * 0.5 * 8.0);
    // No effort costs two nats a second, three tenths of the full brake none.
    for (commanded, cost) in [(0.0, 2.0), (-0.06, 1.6), (-0.3, 0.0), (-0.9, 0.0)] {
        assert_near(creeping_under(Some(commanded), [18.0, 18.0], 1.0, 0.1), alike - T * cost);
    }
    // Wheels that do not turn do not creep.
    let silent = creeping([0.0, 0.0], 1.0, 0.1);
    assert_near(silent, alike - 0.5 * NEW * 15.0 * 15.0 / 0.1 - T * 15.0);
}

/// Evidence of the hypotheses, all of which are about trains at this speed.
fn of_all(scene: &Scene, speed: f64, surprise: f64) -> [f64; WIDTH] {
    let wheels = [0, 1].map(|nth| compared(scene.wheels[nth].speed));
    evidence(scene, &wheels, &filters(speed), &Lanes::all(surprise), 0.1, 1.0, T).0
}

#[test]
fn the_best_hypothesis_has_zero_and_none_less_than_the_most() {
    let rolling = of_all(&Scene::of_test([20.0, 20.0], Some(0.0)), 20.0, 0.0);
    assert_eq!(rolling.iter().copied().fold(f64::MIN, f64::max), 0.0);
    assert_eq!(rolling[0], 0.0, "both roll");
    // A dead sensor that counts costs ten nats a second, wheels at rest that turned 1 m by 33 pulses the most.
    assert_near(rolling[6], -10.0 * T);
    assert_near(rolling[7], -10.0 * T);
    assert_eq!(rolling[5], -25.0);
}

#[test]
fn a_train_that_accelerates_beyond_its_limits_is_improbable() {
    // By how much more the evidence is of trains that roll than of one of which a wheelset slips: both, and beside a dead sensor.
    let rolling = |scene: &Scene, a: f64| {
        let wheels = [compared(20.0); 2];
        let mut trains = filters(20.0);
        trains.a = Lanes::all(a);
        let found = evidence(scene, &wheels, &trains, &Lanes::all(0.0), a, 1.0, T);
        let [both, one_slips, .., dead] = found.0;
        [both - one_slips, dead - one_slips]
    };
    let free = Scene::of_test([20.0, 20.0], None);
    // What is known to 0.2 m/s², better than 0.15 m²/s⁴, may be 0.06 m/s² beyond.
    let more = |scene: &Scene, a: f64, deviations: f64| {
        for (found, usual) in rolling(scene, a).into_iter().zip(rolling(&free, a)) {
            assert_near(found - usual, 0.5 * NEW * deviations * deviations);
        }
    };
    let less = |scene: &Scene, a: f64, deviations: f64| {
        for (found, usual) in rolling(scene, a).into_iter().zip(rolling(&free, a)) {
            assert_near(usual - found, 0.5 * NEW * deviations * deviations);
        }
    };
    // Given a rail that carries the brake, and less acceleration on it than that of the train, or more,
    less(&Scene { rolling: Range { low: -1.4, high: 0.04 }, ..free }, 0.1, 1.0);
    less(&Scene { rolling: Range { low: 0.22, high: 1.0 }, ..free }, 0.1, 2.0);
    // or a rail that does not: where one wheelset slips a train decelerates no more than halfway between the command, 0.9,
    // and the most, 1.5 m/s²,
    more(&Scene { commanded: Some(-0.9), ..free }, -1.32, 2.0);
    more(&Scene { commanded: Some(-0.9), ..free }, -1.2, 0.0);
    // which a train that is driven does not.
    more(&Scene { commanded: Some(0.3), ..free }, -1.32, 0.0);
    let weak = Scene { acceleration: Range { low: -1.5, high: -1.38 }, ..free };
    more(&weak, -1.32, 1.0);
}

#[test]
fn a_place_that_is_surprising_costs_half_its_excess() {
    let scene = Scene::of_test([20.0, 20.0], None);
    let mut surprise = Lanes::all(0.0);
    (surprise.0[1], surprise.0[2]) = (6.9, 8.0);
    let wheels = [compared(20.0); 2];
    let found = evidence(&scene, &wheels, &filters(20.0), &surprise, 0.1, 1.0, T);
    assert_near(found.0[1] - found.0[2], 0.5);
}

#[test]
fn beside_a_sensor_found_dead_the_other_wheel_may_slip() {
    let scene = Scene::of_test([0.0, 23.0], Some(0.5));
    let (dead, spins) = (Compared { dead: true, ..compared(0.0) }, compared(23.0));
    let trains = filters(20.0);
    let (one, other) = (trains.state(6), trains.state(7));
    let cost = |side: f64| {
        let first = shown(&scene, &dead, side);
        let second = Shown { wheel: &scene.wheels[1], ..shown(&scene, &spins, side) };
        let slip = [second.slips(&one), first.slips(&other)];
        (beside_dead(&first, &second, [&one, &other]), beside_dead(&second, &first, [&one, &other]), slip)
    };
    // One nat a second in a spin, eight in a slide, for the one that is dead.
    for (side, nats) in [(-1.0, 1.0), (1.0, 8.0)] {
        let (of_first, of_second, [slip, _]) = cost(side);
        assert_near(of_first.0[6], slip - nats * T);
        assert_near(of_second.0[7], slip - nats * T);
        assert!(of_first.0[7] == f64::NEG_INFINITY && of_second.0[6] == f64::NEG_INFINITY);
        assert!(of_first.0[..6].iter().all(|none| *none == f64::NEG_INFINITY));
    }
}
