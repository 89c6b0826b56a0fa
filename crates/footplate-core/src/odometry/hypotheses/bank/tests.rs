//! Which wheelset is called the first makes no difference; trains that are lost are found again.

use super::*;
use crate::odometry::wheels::Axle;
use crate::units::Length;

fn bank(speed: f64) -> Bank {
    let wheelset = Wheelset {
        teeth: 100,
        diameter: Length::from_m(0.955),
        diameter_tolerance: 0.002,
        axle: Axle::Powered,
    };
    Bank::new(speed, 1.0, &[wheelset; 2])
}

fn assert_near(found: f64, expected: f64) {
    assert!((found - expected).abs() <= 1e-9 * (1.0 + expected.abs()), "{found} {expected}");
}

/// The wheels of a run in which everything happens: a run, a slide of one and of both, a wheel that comes back, a dead
/// sensor, a stuck count, a missing row, and a spin.
fn eventful(period: usize, spins: bool) -> Scene {
    let second = period / 20;
    let (speeds, commanded) = match second {
        3.. if spins => ([19.0, 17.0], Some(0.6)),
        0..=2 => ([15.0, 15.0], Some(0.0)),
        3..=4 => ([9.0, 15.0 - 0.02 * period as f64], Some(-0.8)),
        5..=7 => ([8.0, 6.5], Some(-0.8)),
        8..=9 => ([13.0, 9.0], Some(-0.3)),
        _ => ([12.5, 0.0], None),
    };
    let mut scene = Scene::of_test(speeds, commanded);
    let [first, second_wheel] = &mut scene.wheels;
    first.acceleration = [-0.1, 5.0, -6.0, 0.4][period / 4 % 4];
    second_wheel.acceleration = if period % 40 < 20 { 0.3 } else { -0.5 };
    second_wheel.stuck = second == 12;
    first.read = !period.is_multiple_of(17);
    first.late = 0.01;
    scene.inertial = (second % 4 == 3).then_some(-0.4);
    scene.independent = second > 10;
    scene
}

#[test]
fn which_wheelset_is_called_the_first_does_not_matter() {
    mirrored(270, false);
    mirrored(120, true);
}

fn mirrored(periods: usize, spins: bool) {
    let (mut one, mut other) = (bank(15.0), bank(15.0));
    for period in 0..periods {
        let scene = eventful(period, spins);
        let mut swapped = scene;
        swapped.wheels.reverse();
        assert_near(one.step(&scene, 0.05), other.step(&swapped, 0.05));
        let [roll, first, second, slip, creep, rest, first_dead, second_dead] = other.probabilities();
        let mirrored = [roll, second, first, slip, creep, rest, second_dead, first_dead];
        for (found, expected) in one.probabilities().into_iter().zip(mirrored) {
            assert_near(found, expected);
        }
        assert_near(one.probabilities().iter().sum(), 1.0);
        assert_near(one.speed, other.speed);
        assert_near(one.acceleration, other.acceleration);
        assert_near(one.variance, other.variance);
        let ranges = one.interval(&scene, 1e-4, 0.05).into_iter().zip(other.interval(&swapped, 1e-4, 0.05));
        for (found, expected) in ranges {
            assert_near(found.low, expected.low);
            assert_near(found.high, expected.high);
        }
    }
}

/// The bank after `seconds` with these wheels (m/s) and this command (m/s²).
fn after(mut bank: Bank, speeds: [f64; 2], commanded: f64, seconds: usize) -> Bank {
    for _ in 0..20 * seconds {
        bank.step(&Scene::of_test(speeds, Some(commanded)), 0.05);
    }
    bank
}

#[test]
fn a_train_that_slid_with_locked_wheels_for_long_may_be_at_rest() {
    let mut slides = bank(20.0);
    slides.probability = Lanes([LEAST, LEAST, LEAST, 1.0, LEAST, LEAST, LEAST, LEAST]);
    // From 20 m/s at 0.5 ± 0.213 m/s², by the normal distribution 7.9 and 22 % are at rest after 25 and 30 s. Both wheels of the
    // others would have come free at 0.05 a second each, so those at rest count exp(0.1 t) times, t seconds after they came to rest:
    // integrated numerically, 10 and 31 % after 25 and 30 s.
    for (seconds, expected) in [(25, 0.102), (30, 0.308)] {
        let bank = after(slides, [0.0, 0.0], -1.0, seconds);
        let [_, _, _, slips, ..] = bank.probabilities();
        assert!((1.0 - slips - expected).abs() < 0.07, "after {seconds} s: {}", 1.0 - slips);
        assert!((bank.speed - slips * (20.0 - 0.5 * seconds as f64)).abs() < 1.0, "{}", bank.speed);
    }
}

#[test]
fn a_train_that_slides_under_a_gentle_brake_keeps_its_speed_longer() {
    // Commanded to decelerate by 0.31 m/s² they do so to within 0.054, by 1 to within 0.213: both have 1.28 m/s left after 12 s.
    let stands = |speed: f64, commanded: f64| {
        let mut slides = bank(speed);
        slides.acted = commanded;
        slides.probability = Lanes([LEAST, LEAST, LEAST, 1.0, LEAST, LEAST, LEAST, LEAST]);
        slides.filters.a = Lanes::all(larger(commanded, -0.5));
        (slides.filters.pvv, slides.filters.paa) = (Lanes::all(1e-4), Lanes::all(0.04));
        let [_, _, _, slips, ..] = after(slides, [0.0, 0.0], commanded, 12).probabilities();
        1.0 - slips
    };
    let [gentle, full] = [stands(5.0, -0.31), stands(7.28, -1.0)];
    // 0.32 if deceleration under a gentle brake differed by as much as under a full one.
    assert!((gentle - 0.258).abs() < 0.02 && (full - 0.415).abs() < 0.02, "{gentle} {full}");
}

#[test]
fn locked_wheels_of_a_train_without_a_recorded_command_are_braked() {
    // World 84210033: a train came to rest with locked wheels while its estimate was taken to spin, and ran away by 0.3 m/s² to 46 m/s.
    let mut slides = bank(5.0);
    slides.probability = Lanes([LEAST, LEAST, LEAST, 1.0, LEAST, LEAST, LEAST, LEAST]);
    (slides.trend, slides.side) = (0.3, -1.0);
    for _ in 0..20 * 30 {
        slides.step(&Scene::of_test([0.0, 0.0], None), 0.05);
    }
    assert!(slides.speed.abs() < 0.01, "{} {:?}", slides.speed, slides.probabilities());
}

#[test]
fn a_train_does_not_stand_because_a_sensor_died_beside_a_spinning_wheel() {
    // World 4064714: the first wheel was taken to spin on a train at rest, because the second sensor was silent.
    let mut stands = bank(0.0);
    stands.probability = Lanes([LEAST, 1.0, LEAST, LEAST, LEAST, LEAST, LEAST, LEAST]);
    stands.side = -1.0;
    let found = after(stands, [15.0, 0.0], 0.4, 10);
    assert!((found.speed - 15.0).abs() < 0.5, "{} {:?}", found.speed, found.probabilities());
}

#[test]
fn no_hypothesis_leaps_where_a_slide_may_end_at_rest() {
    let mut bank = bank(0.05);
    bank.filters.a = Lanes::all(-0.6);
    bank.filters.pvv = Lanes::all(0.02);
    bank.probability = Lanes([0.1, 1e-6, 1e-6, 0.85, 1e-6, 0.05, 1e-9, 1e-9]);
    bank.step(&Scene::of_test([0.0, 0.0], Some(-0.6)), 0.2);
    let fastest = bank.filters.v.0.iter().fold(0.0_f64, |most, v| most.max(v.abs()));
    assert!(fastest < 0.2, "{:?}", bank.filters.v);
    assert!(bank.speed.abs() < 0.05, "{}", bank.speed);
}

/// A train that is taken to creep at 24 m/s, whose wheels brake from 20 m/s by 0.8 m/s² and differ by a share of their speed that changes its
/// sign each second. Returns the bank and the speed of the wheels after 8 s.
fn taken_to_creep(apart: f64) -> (Bank, f64) {
    let mut bank = bank(24.0);
    bank.filters.a = Lanes::all(-0.8);
    bank.probability = Lanes([1e-9, LEAST, LEAST, 1e-3, 1.0, LEAST, LEAST, LEAST]);
    let mut speed = 20.0;
    for period in 0..160 {
        speed -= 0.8 * 0.05;
        let half = if period / 20 % 2 == 0 { 0.5 * apart } else { -0.5 * apart };
        let mut scene = Scene::of_test([speed * (1.0 + half), speed * (1.0 - half)], Some(-0.8));
        for wheel in &mut scene.wheels {
            wheel.acceleration = -0.8;
        }
        bank.step(&scene, 0.05);
    }
    (bank, speed)
}

#[test]
fn wheels_that_agree_for_long_roll_again() {
    let (bank, speed) = taken_to_creep(0.0);
    assert!((bank.speed - speed).abs() < 0.1, "{} instead of {speed}: {:?}", bank.speed, bank.probability);
}

#[test]
fn wheels_that_differ_by_three_percent_creep_on() {
    let (bank, speed) = taken_to_creep(0.03);
    let train = 24.0 - 0.8 * 8.0;
    assert!((bank.speed - train).abs() < 1.5, "{}, wheels {speed}: {:?}", bank.speed, bank.probability);
}
