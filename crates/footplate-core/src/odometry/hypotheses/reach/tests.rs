//! How far the train may be from its wheels, and when that ends.

use super::*;

fn wheel(speed: f64) -> WheelScene {
    WheelScene { driven: false, ..WheelScene::of_test(speed) }
}

/// The width above the wheels after so many seconds of a command (m/s²) with wheels at 20 m/s that slip with this
/// probability.
fn above(reach: &mut Reach, commanded: f64, slip: f64, seconds: f64) -> f64 {
    let p = [1.0 - slip, 0.0, 0.0, slip, 0.0, 0.0, 0.0, 0.0];
    widened(reach, &scene([20.0; 2], commanded), p, seconds)
}

fn scene(speeds: [f64; 2], commanded: f64) -> Scene {
    let acceleration = Range { low: -1.5, high: 0.4 };
    Scene {
        wheels: speeds.map(wheel),
        acceleration,
        rolling: acceleration,
        brake: 0.0,
        traction: 0.0,
        ..Scene::of_test(speeds, Some(commanded))
    }
}

/// The width above a train that hypotheses of these probabilities put at 20 m/s.
fn widened(reach: &mut Reach, scene: &Scene, p: [f64; 8], seconds: f64) -> f64 {
    let compared = scene.wheels.map(|wheel| Compared { speed: wheel.speed, variance: 0.0025, dead: false });
    let likely = Range { low: 19.8, high: 20.2 };
    let mut high = 0.0;
    for _ in 0..(seconds / 0.05) as usize {
        let never = f64::INFINITY;
        let shown = Shown { p, since_touch: never, since_lone_touch: never, wheels_a: 0.0, side: 1.0 };
        high = reach.widen(likely, scene, &compared, &shown, 0.05).high;
    }
    high - likely.high
}

#[test]
fn brakes_widen_it_by_unseen_creepage_and_coasting_ends_that() {
    let mut reach = Reach::new();
    assert!(above(&mut reach, 0.0, 0.0, 10.0) < 1e-9, "coasting");
    let soon = above(&mut reach, -0.5, 0.0, 1.5);
    assert!(soon > 0.1 && soon < 0.8 * 1.6, "{soon}: no more than the reach and the rate allow");
    let long = above(&mut reach, -0.5, 0.0, 60.0);
    assert!((long - 0.2 * 20.2).abs() < 1e-9, "{long}: a fifth of the speed");
    assert!(above(&mut reach, 0.0, 0.0, 6.0) < 1e-9, "coasting again");
}

#[test]
fn after_a_slip_of_both_it_lasts_as_long_as_the_brake() {
    let mut reach = Reach::new();
    above(&mut reach, 0.0, 0.0, 10.0);
    let slides = above(&mut reach, -0.5, 0.9, 10.0);
    assert!((slides - 0.35 * 10.0).abs() < 0.2, "{slides}: what gradients add");
    let alike = above(&mut reach, -0.5, 0.0, 10.0);
    assert!(alike > 5.0 && alike <= 0.25 * 20.2 + 1.0 + 1e-9, "{alike}");
    assert!(above(&mut reach, 0.0, 0.0, 6.0) < 1e-9, "they roll");
}

#[test]
fn traction_right_after_the_brake_does_not_show_whether_they_return() {
    let mut reach = Reach::new();
    above(&mut reach, 0.0, 0.0, 10.0);
    above(&mut reach, -0.5, 0.0, 60.0);
    let after = above(&mut reach, 0.4, 0.0, 8.0);
    assert!((after - (0.2 * 20.2 - RETURNS * 8.0)).abs() < 0.02, "{after}: they return slowly");
}

#[test]
fn beside_one_that_slips_alone_it_reaches_as_far_as_the_other_may_creep() {
    let mut reach = Reach::new();
    above(&mut reach, 0.0, 0.0, 10.0);
    let first_slips = [0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    let locked = widened(&mut reach, &scene([0.0, 20.0], -0.5), first_slips, 60.0);
    assert!((locked - 0.2 * 20.2).abs() < 1e-9, "{locked}");
}

#[test]
fn hypotheses_that_the_guaranteed_bounds_exclude_have_lost_the_train() {
    let mut reach = Reach::new();
    above(&mut reach, 0.0, 0.0, 10.0);
    let faster = Scene { bounded: Range { low: 25.0, high: 30.0 }, ..scene([20.0; 2], -0.5) };
    let rolling = [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    assert!(widened(&mut reach, &faster, rolling, 0.4) < 1.0, "one row may be faulty");
    assert!(widened(&mut reach, &faster, rolling, 0.3) > 9.0, "all that the bounds allow");
}

#[test]
fn without_a_command_the_train_is_no_faster_than_its_wheels_were() {
    let mut reach = Reach::new();
    let rolling = [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    let braked = |reach: &mut Reach, wheels_a: f64, likely: Range| {
        let scene = Scene { commanded: None, ..scene([20.0; 2], 0.0) };
        let compared =
            scene.wheels.map(|wheel| Compared { speed: wheel.speed, variance: 0.0025, dead: false });
        let never = f64::INFINITY;
        let shown = Shown { p: rolling, since_touch: never, since_lone_touch: never, wheels_a, side: 1.0 };
        reach.widen(likely, &scene, &compared, &shown, 0.05).high
    };
    for _ in 0..200 {
        braked(&mut reach, 0.0, Range { low: 19.8, high: 20.2 });
    }
    // Two seconds at -0.5 m/s²: the wheels lost 1 m/s, and a gradient may have added 0.2.
    let mut high = 0.0;
    for period in 1..=40 {
        let lost = 0.025 * f64::from(period);
        high = braked(&mut reach, -0.5, Range { low: 19.8 - lost, high: 20.2 - lost });
    }
    assert!((high - (20.2 + RUNS_AWAY * 2.0)).abs() < 0.02, "{high}");
}

#[test]
fn wheels_that_spun_and_slow_down_alike_show_no_speed_without_a_command() {
    // World 83700550: both fell by 1.2 m/s² from 60 to 12 m/s, past the 16 m/s of their train.
    let mut reach = Reach::new();
    let scene = Scene { commanded: None, ..scene([20.0; 2], 0.0) };
    let compared = scene.wheels.map(|wheel| Compared { speed: wheel.speed, variance: 0.0025, dead: false });
    let mut low = |wheels_a: f64, slip: f64, side: f64, periods: usize| {
        let p = [1.0 - slip, 0.0, 0.0, slip, 0.0, 0.0, 0.0, 0.0];
        let mut low = 0.0;
        for _ in 0..periods {
            let never = f64::INFINITY;
            let shown = Shown { p, since_touch: never, since_lone_touch: never, wheels_a, side };
            low = reach.widen(Range { low: 19.8, high: 20.2 }, &scene, &compared, &shown, 0.05).low;
        }
        low
    };
    low(1.0, 0.9, -1.0, 20);
    // The trend of the estimate, which decides on the side, lags behind them.
    low(-1.2, 0.9, -1.0, 20);
    low(-1.2, 0.9, 1.0, 100);
    let slowing = low(-1.2, 0.0, 1.0, 100);
    assert!(slowing < 10.0, "{slowing}");
    let steady = low(0.0, 0.0, 1.0, 60);
    assert!(steady > 12.0, "{steady}: they turn alike and steadily");
}

#[test]
fn a_wheel_that_counts_strays_once_it_is_steadily_beyond_what_its_train_can_do() {
    let strays_after = |acceleration: f64, dead: f64, read: bool| {
        let mut reach = Reach::new();
        let mut scene = scene([20.0; 2], -0.5);
        scene.wheels[1] = WheelScene { acceleration, read, ..scene.wheels[1] };
        (1..400).find(|_| reach.strays(&scene, [0.0, dead], 0.05)).map(|n| f64::from(n) * 0.05)
    };
    // From −1.5 to 0.4 m/s², and 0.1 beyond. A mean over `STEADY_S` gets to 0.5 of 1.0 after ln 2 of it.
    for (acceleration, expected) in
        [(1.0, Some(1.0_f64 / 2.0)), (-2.0, Some(0.4 / 2.0)), (0.45, None), (-1.55, None)]
    {
        let found = strays_after(acceleration, 0.0, true);
        let expected = expected.map(|left| -left.ln() * STEADY_S);
        assert!(
            found.is_some() == expected.is_some()
                && found.zip(expected).is_none_or(|(a, b)| (a - b).abs() < 0.1),
            "{acceleration}: {found:?}, not {expected:?}"
        );
    }
    assert_eq!(strays_after(1.0, 0.5, true), None, "its sensor is probably dead");
    assert_eq!(strays_after(1.0, 0.0, false), None, "it was not read");
}
