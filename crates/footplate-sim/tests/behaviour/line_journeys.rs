//! A driver keeps to every limit, stops where the line says, and energy is neither made nor lost.

use footplate_core::{Acceleration, Jerk, Length, Ratio, Speed, TimeSpan};
use footplate_sim::line::{
    Brake, Driver, DrivingPhase, Journey, JourneyError, LineParts, LineProfile, Resistance, State, Stop,
    Style, TractiveEffort, Train,
};
use proptest::prelude::*;

const STEP: TimeSpan = TimeSpan::from_ms(50);

fn train() -> Train {
    Train {
        name: "unit".to_owned(),
        length: Length::from_m(100.0),
        weight_length: Length::from_m(100.0),
        mass_kg: 100e3,
        rotating_mass: Ratio::from_percent(10.0),
        resistance: Resistance::davis(1000.0, 20.0, 4.0),
        tractive_effort: TractiveEffort::ForceAndPower { force_n: 100e3, power_w: 1e6 },
        brake: Brake { service: Acceleration::from_m_per_s2(0.8), full_n: 132e3 },
        max_speed: Speed::from_m_per_s(40.0),
        max_acceleration: None,
    }
}

fn place(m: f64) -> Length {
    Length::from_m(m)
}

fn stop(at: f64, dwell_s: f64) -> Stop {
    Stop { name: format!("at {at}"), at: place(at), dwell: TimeSpan::from_s(dwell_s) }
}

/// Limits in m/s and gradients in per mille, from places in m.
fn line(limits: &[(f64, f64)], gradients: &[(f64, f64)], stops: &[f64]) -> LineProfile {
    LineProfile::new(LineParts {
        name: "test".to_owned(),
        gradients: gradients.iter().map(|(m, rise)| (place(*m), *rise)).collect(),
        curve_resistances: Vec::new(),
        speed_limits: limits.iter().map(|(m, v)| (place(*m), Speed::from_m_per_s(*v))).collect(),
        stops: stops.iter().map(|at| stop(*at, 20.0)).collect(),
    })
    .unwrap()
}

/// The kinetic energy at a speed, the turning parts included.
fn kinetic_j(train: &Train, speed: Speed) -> f64 {
    0.5 * train.inertia_kg() * speed.as_m_per_s() * speed.as_m_per_s()
}

#[test]
fn a_train_without_resistance_takes_the_time_of_the_textbook() {
    // 110 t at 100 kN pull away with 0.9091 m/s² to 9 m/s (9.9 s, 44.55 m), brake with 0.8 m/s² (11.25 s,
    // 50.625 m) and run the rest of 1000 m at 9 m/s (100.536 s): 121.686 s in all.
    let frictionless = Train { resistance: Resistance::default(), ..train() };
    let level = line(&[(0.0, 9.0)], &[], &[0.0, 1000.0]);
    let style = Style { response: TimeSpan::from_ms(1), ..Style::FASTEST };
    let run = Journey::run(&frictionless, &level, style, TimeSpan::from_ms(5)).unwrap();
    let moving = run.time() - run.calls[0].departs;
    assert_eq!(run.calls[0].departs, TimeSpan::from_s(20.0));
    assert!((moving.as_s() - 121.686).abs() < 0.02, "{}", moving.as_s());
    assert!(run.calls[1].beyond.abs() < Length::from_mm(1.0), "{:?}", run.calls);
}

#[test]
fn energy_is_neither_made_nor_lost() {
    let hills = line(
        &[(0.0, 25.0), (2500.0, 15.0), (4000.0, 30.0)],
        &[(0.0, 0.0), (600.0, 12.0), (1900.0, -18.0), (5000.0, 3.0)],
        &[0.0, 3600.0, 7000.0],
    );
    let train = train();
    let imbalance = |step_ms: i64| {
        let run = Journey::run(&train, &hills, Style::FASTEST, TimeSpan::from_ms(step_ms)).unwrap();
        let work = run.work;
        // From rest to rest: what went in comes out.
        (work.traction_j - work.brake_j - work.resistance_j - work.line_j) / work.traction_j
    };
    for step in [20, 50, 100] {
        assert!(imbalance(step).abs() < 1e-9, "{step} ms: {:e}", imbalance(step));
    }
}

#[test]
fn the_line_takes_the_energy_of_its_heights() {
    // The weight's centre lies half a train behind the front; both ends are level for a whole train.
    let hills =
        line(&[(0.0, 25.0)], &[(0.0, 0.0), (600.0, 12.0), (1900.0, -18.0), (3000.0, 0.0)], &[0.0, 4000.0]);
    let run = Journey::run(&train(), &hills, Style::FASTEST, STEP).unwrap();
    // 1300 m at 12 and 1100 m at -18 per mille.
    let height = 1.3 * 12.0 - 1.1 * 18.0;
    let expected = 100e3 * 9.806_65 * height;
    assert!((run.work.line_j / expected - 1.0).abs() < 1e-5, "{} {expected}", run.work.line_j);
}

#[test]
fn a_finer_step_changes_a_running_time_by_less_than_two_steps() {
    let limits = [(0.0, 25.0), (2500.0, 15.0), (4000.0, 30.0)];
    let hills = line(&limits, &[(0.0, 0.0), (600.0, 12.0), (1900.0, -18.0)], &[0.0, 7000.0]);
    let time =
        |ms| Journey::run(&train(), &hills, Style::FASTEST, TimeSpan::from_ms(ms)).unwrap().time().as_s();
    let finest = time(2);
    // The arrival itself is counted in whole steps.
    assert!((time(50) - finest).abs() < 2.0 * 0.05, "{} {finest}", time(50));
    assert!((time(200) - finest).abs() < 2.0 * 0.2, "{} {finest}", time(200));
}

#[test]
fn jerk_stays_within_what_the_driver_was_given() {
    let limits = [(0.0, 20.0), (800.0, 10.0), (1500.0, 20.0)];
    let level = line(&limits, &[], &[0.0, 2500.0]);
    for coast_to in [None, Some(Ratio::from_percent(80.0))] {
        let style = Style { jerk: Some(Jerk::from_m_per_s3(0.5)), coast_to, ..Style::FASTEST };
        let run = Journey::run(&train(), &level, style, STEP).unwrap();
        let moving: Vec<_> =
            run.moments.iter().filter(|moment| moment.phase != DrivingPhase::Standing).collect();
        for pair in moving.windows(2) {
            let change = (pair[1].acceleration - pair[0].acceleration).as_m_per_s2().abs();
            assert!(change <= 0.5 * STEP.as_s() + 0.01, "{change} at {:?}", pair[0]);
        }
        // It stands without a jolt, where it should.
        let last = moving.last().unwrap();
        assert!(
            last.acceleration.abs() < Acceleration::from_m_per_s2(0.15),
            "{:?}",
            &moving[moving.len() - 20..]
        );
        assert!(run.calls[1].beyond.abs() < Length::from_m(0.3), "{:?}", run.calls[1]);
    }
}

#[test]
fn a_gentle_driver_uses_the_share_that_was_asked_for() {
    let level = line(&[(0.0, 9.0)], &[], &[0.0, 1000.0]);
    let frictionless = Train { resistance: Resistance::default(), ..train() };
    let strongest = |train: &Train, style: Style| {
        let run = Journey::run(train, &level, style, STEP).unwrap();
        let accelerations = run.moments.iter().map(|moment| moment.acceleration.as_m_per_s2());
        accelerations.fold([0.0_f64; 2], |[most, least], a| [most.max(a), least.min(a)])
    };
    // 100 kN and 0.8 m/s² of 110 t: half of the pull, three quarters of the brake.
    let (traction, braking) = (Ratio::from_parts(0.5), Ratio::from_parts(0.75));
    let [pulled, braked] = strongest(&frictionless, Style { traction, braking, ..Style::FASTEST });
    assert!((pulled - 0.5 / 1.1).abs() < 1e-9, "{pulled}");
    assert!((braked + 0.6).abs() < 0.01, "{braked}");
    // The builder's limit holds however much there is to pull with.
    let limited = Train { max_acceleration: Some(Acceleration::from_m_per_s2(0.3)), ..frictionless };
    let [pulled, _] = strongest(&limited, Style::FASTEST);
    assert!((pulled - 0.3).abs() < 1e-9, "{pulled}");
}

#[test]
fn of_a_long_stop_the_first_and_the_last_moment_are_kept() {
    let long = LineProfile::new(LineParts {
        name: "night".to_owned(),
        speed_limits: vec![(place(0.0), Speed::from_m_per_s(20.0))],
        stops: vec![stop(0.0, 0.0), stop(500.0, 8.0 * 3600.0), stop(1000.0, 0.0)],
        ..LineParts::default()
    });
    let run = Journey::run(&train(), &long.unwrap(), Style::FASTEST, STEP).unwrap();
    let night = run
        .moments
        .iter()
        .filter(|moment| moment.phase == DrivingPhase::Standing && moment.front > place(400.0));
    let times: Vec<_> = night.take(2).map(|moment| moment.time).collect();
    let call = run.calls[1];
    assert_eq!(times, [call.arrives, call.departs - STEP]);
    assert_eq!((call.departs - call.arrives).as_s(), 8.0 * 3600.0);
}

#[test]
fn who_eases_off_to_a_limit_brakes_again_for_the_stop_behind_it() {
    // Found at random: 20 m behind the begin of a limit of 6 m/s lies a stop, as far off as the brake needs from there.
    let limits = [(0.0, 5.0), (100.0, 27.5), (1300.0, 6.26), (2000.0, 5.0)];
    let level = line(&limits, &[], &[0.0, 1320.7, 2500.0]);
    for jerk in [0.3, 0.5, 0.8] {
        let style = Style { jerk: Some(Jerk::from_m_per_s3(jerk)), ..Style::FASTEST };
        let run = Journey::run(&train(), &level, style, TimeSpan::from_ms(5)).unwrap();
        assert!(run.calls[1].beyond.abs() < Length::from_m(0.3), "{jerk}: {:?}", run.calls[1]);
    }
}

#[test]
fn what_no_driver_can_keep_to_is_named() {
    let level = line(&[(0.0, 9.0)], &[], &[0.0, 1000.0]);
    let fault = |style| Journey::run(&train(), &level, style, STEP).unwrap_err().to_string();
    assert_eq!(
        fault(Style { jerk: Some(Jerk::from_m_per_s3(-1.0)), ..Style::FASTEST }),
        "the driver's jerk is -1; it should lie between 0.01 and 100"
    );
    assert!(
        fault(Style { braking: Ratio::from_parts(0.0), ..Style::FASTEST }).contains("share of braking is 0;")
    );
    assert!(fault(Style { traction: Ratio::from_parts(f64::NAN), ..Style::FASTEST }).contains("is NaN;"));
    // One that is driven nevertheless does not panic, whatever comes in.
    let style = Style { jerk: Some(Jerk::from_m_per_s3(f64::NAN)), ..Style::FASTEST };
    let mut driver = Driver::new(train(), level, style);
    for speed in [0.0, 5.0, f64::NAN, -3.0, f64::INFINITY] {
        let state = State { front: place(10.0), speed: Speed::from_m_per_s(speed) };
        assert!(driver.command(state, STEP).effort.abs() <= 1.0);
        driver = Driver::new(driver.train().clone(), driver.line().clone(), Style::FASTEST);
    }
}

#[test]
fn who_coasts_takes_longer_and_uses_less() {
    let level = line(&[(0.0, 22.0)], &[], &[0.0, 3000.0]);
    let held = Journey::run(&train(), &level, Style::FASTEST, STEP).unwrap();
    let style = Style { coast_to: Some(Ratio::from_percent(85.0)), ..Style::FASTEST };
    let coasted = Journey::run(&train(), &level, style, STEP).unwrap();
    assert!(coasted.moments.iter().any(|moment| moment.phase == DrivingPhase::Coasting));
    assert!(coasted.time() > held.time());
    assert!(coasted.work.traction_j < 0.97 * held.work.traction_j);
}

#[test]
fn a_train_that_cannot_climb_says_where_it_stands() {
    // 100 kN pull 100 t up 80 per mille (78 kN) and not up 120 (118 kN).
    let wall = line(&[(0.0, 20.0)], &[(0.0, 0.0), (500.0, 120.0)], &[0.0, 5000.0]);
    let error = Journey::run(&train(), &wall, Style::FASTEST, STEP).unwrap_err();
    let JourneyError::Stalled { at_m, .. } = error else { panic!("{error}") };
    assert!(at_m > 500.0 && at_m < 1500.0, "{at_m}");
}

#[test]
fn the_same_driver_stops_a_train_whose_brake_comes_late() {
    // A world of another make: the force follows the command with a lag of 0.4 s, in steps of 1 ms.
    let level = line(&[(0.0, 25.0), (1500.0, 15.0)], &[], &[0.0, 3000.0]);
    let (train, step, lag) = (train(), TimeSpan::from_ms(1), 0.4);
    let style =
        Style { jerk: Some(Jerk::from_m_per_s3(0.6)), anticipation: TimeSpan::from_s(lag), ..Style::FASTEST };
    let mut driver = Driver::new(train.clone(), level, style);
    let mut state = State { front: Length::ZERO, speed: Speed::ZERO };
    let (mut force, mut fastest_after) = (0.0, Speed::ZERO);
    for _ in 0..400_000 {
        let command = driver.command(state, step);
        if driver.has_arrived() {
            break;
        }
        force += (command.force_n - force) * step.as_s() / lag;
        let acceleration = train.acceleration(force, 0.0, state.speed);
        state.speed = (state.speed + acceleration * step).max(Speed::ZERO);
        state.front += state.speed * step;
        if state.front > place(1500.0) {
            fastest_after = fastest_after.max(state.speed);
        }
    }
    assert!(driver.has_arrived());
    assert!((state.front - place(3000.0)).abs() < Length::from_m(1.0), "{state:?}");
    assert!(fastest_after < Speed::from_m_per_s(15.3), "{fastest_after:?}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn no_limit_is_exceeded_and_every_stop_is_made(
        lengths in prop::collection::vec(60.0..1500.0_f64, 1..9),
        speeds in prop::collection::vec(5.0..45.0_f64, 9),
        rises in prop::collection::vec(-35.0..35.0_f64, 9),
        jerk in prop::option::of(0.3..1.0_f64),
        coast in prop::option::of(0.7..0.95_f64),
        step_ms in 5_i64..100,
    ) {
        let mut at = 0.0;
        let (mut limits, mut gradients) = (Vec::new(), Vec::new());
        for ((length, speed), rise) in lengths.iter().zip(&speeds).zip(&rises) {
            limits.push((at, *speed));
            gradients.push((at, *rise));
            at += length;
        }
        let line = line(&limits, &gradients, &[0.0, at / 2.0, at]);
        let style = Style {
            jerk: jerk.map(Jerk::from_m_per_s3),
            coast_to: coast.map(Ratio::from_parts),
            ..Style::FASTEST
        };
        let train = train();
        let run = Journey::run(&train, &line, style, TimeSpan::from_ms(step_ms)).unwrap();
        let driver = Driver::new(train.clone(), line.clone(), style);
        for moment in &run.moments {
            let permitted = driver.permitted_speed(moment.front);
            // A step and a change of gradient are made good within the driver's response.
            prop_assert!(
                moment.speed.as_m_per_s() <= permitted.as_m_per_s() + 0.5,
                "{} m/s at {} m, {} permitted", moment.speed.as_m_per_s(), moment.front.as_m(), permitted.as_m_per_s(),
            );
        }
        prop_assert_eq!(run.calls.len(), 3);
        for call in &run.calls {
            prop_assert!(call.beyond.abs() < Length::from_m(1.0), "{:?}", call);
        }
        let balance = run.work.traction_j - run.work.brake_j - run.work.resistance_j - run.work.line_j;
        prop_assert!(balance.abs() < 1e-6 * run.work.traction_j.max(1.0), "{} J", balance);
        prop_assert_eq!(kinetic_j(&train, run.moments.last().unwrap().speed), 0.0);
    }
}
