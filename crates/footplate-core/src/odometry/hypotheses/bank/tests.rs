//! Which wheelset is called the first makes no difference.

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
