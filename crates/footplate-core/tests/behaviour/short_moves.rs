//! Short moves: the law has the shape of measured moves, measured moves correct it, and "move 37 mm" gives the time
//! of the stop command.

#![expect(clippy::unwrap_used, reason = "the laws of a test are laws")]

use footplate_core::kinematics::{
    Braking, FromCommand, Lag, ShortMove, ShortMoveError, SpeedChange, SpeedLaw, StoppingLaw,
};
use footplate_core::model::report::{PredictedMove, ShortMoveFit};
use footplate_core::{Acceleration, Length, Speed, TimeSpan};
use proptest::prelude::*;

/// The distance of a model train that was commanded to start and, after a number of quarters of a second, to stop:
/// tape measurements of a team, course CS 452 of the University of Waterloo, autumn 2023, train 58.
const MEASURED_MM: [f64; 16] = [
    10.0, 25.0, 72.0, 118.0, 192.0, 245.0, 290.0, 330.0, 384.0, 446.0, 477.0, 540.0, 575.0, 639.0, 672.0,
    714.0,
];

fn measured() -> impl Iterator<Item = (TimeSpan, Length)> {
    (1..).zip(MEASURED_MM).map(|(quarter, mm)| (TimeSpan::from_ms(250 * quarter), Length::from_mm(mm)))
}

fn stop(delay_ms: i64, deceleration_mm_per_s2: f64) -> StoppingLaw<FromCommand> {
    let braking = Braking::Constant(Acceleration::from_mm_per_s2(deceleration_mm_per_s2));
    StoppingLaw::new(TimeSpan::from_ms(delay_ms), braking).unwrap()
}

/// Least squares on all sixteen, computed outside of this program: speed up to 192 mm/s in 1.268 s, brake at 230
/// mm/s².
fn fitted() -> ShortMove<'static> {
    let start = SpeedLaw::ConstantAcceleration.between(
        Speed::ZERO,
        Speed::from_mm_per_s(191.9),
        TimeSpan::from_ms(1268),
    );
    ShortMove::new(TimeSpan::from_ms(17), start, stop(0, 229.7)).unwrap()
}

#[test]
fn a_start_and_a_stop_have_the_shape_of_measured_moves() {
    let errors: Vec<f64> =
        measured().map(|(time, distance)| (fitted().distance(time) - distance).as_mm()).collect();
    let rms = (errors.iter().map(|error| error * error).sum::<f64>() / 16.0).sqrt();
    // Independent arithmetic got 6.3 mm for these parameters.
    assert!((rms - 6.3).abs() < 0.1, "{rms} mm rms: {errors:.1?}");
}

#[test]
fn the_error_of_laws_and_of_tables_is_that_of_moves_left_out() {
    let fit = ShortMoveFit::of(&measured().collect::<Vec<_>>()).unwrap();
    let squares = |of: &dyn Fn(&PredictedMove) -> Length| -> f64 {
        fit.moves.iter().map(|one| (of(one) - one.measured).as_mm().powi(2)).sum()
    };
    let (law, table) = (squares(&|one| one.by_law), squares(&|one| one.by_table.unwrap()));
    assert!((fit.law_error().as_mm() - (law / 16.0).sqrt()).abs() < 1e-9, "{:?}", fit.law_error());
    let table_error = fit.table_error().unwrap();
    assert!((table_error.as_mm() - (table / 16.0).sqrt()).abs() < 1e-9, "{table_error:?}");
    // Left out, each move is predicted worse than the 6.3 mm with which laws of all sixteen describe them.
    assert!((6.3..15.0).contains(&fit.law_error().as_mm()), "{:?}", fit.law_error());
}

#[test]
fn it_grows_like_the_square_and_then_like_the_speed() {
    let start = SpeedLaw::ConstantAcceleration.between(
        Speed::ZERO,
        Speed::from_mm_per_s(400.0),
        TimeSpan::from_ms(2000),
    );
    let model = ShortMove::new(TimeSpan::from_ms(100), start, stop(0, 200.0)).unwrap();
    let distance = |ms| model.distance(TimeSpan::from_ms(ms)).as_mm();
    assert_eq!([distance(0), distance(100)], [0.0, 0.0], "nothing happens during the delay of the start");
    // 200 mm/s² up and down: twice the half square.
    assert!((distance(600) - 50.0).abs() < 1e-9 && (distance(1100) - 200.0).abs() < 1e-9);
    assert!((distance(3100) - distance(2100) - 400.0).abs() < 1e-9);
}

#[test]
fn measured_moves_are_interpolated_exactly_and_the_law_fills_in() {
    let every_other: Vec<_> = measured().skip(1).step_by(2).collect();
    let model = fitted().corrected_by(&every_other).unwrap();
    for &(time, distance) in &every_other {
        assert!((model.distance(time) - distance).abs() < Length::from_mm(0.001));
    }
    let between: Vec<f64> =
        measured().step_by(2).map(|(time, distance)| (model.distance(time) - distance).as_mm()).collect();
    let rms = (between.iter().map(|error| error * error).sum::<f64>() / 8.0).sqrt();
    assert!(rms < 13.0, "held out: {rms} mm rms, {between:.1?}");
}

#[test]
fn move_37_mm() {
    let model = fitted().corrected_by(&measured().collect::<Vec<_>>()).unwrap();
    let time = model.command_time(Length::from_mm(37.0)).unwrap();
    assert!((500.0..750.0).contains(&time.as_ms()), "between the moves of 25 and 72 mm, not {time:?}");
    assert!((model.distance(time).as_mm() - 37.0).abs() < 1e-5);
    assert_eq!(model.command_time(Length::ZERO), None);
    assert_eq!(model.command_time(Length::from_mm(f64::NAN)), None);
}

#[test]
fn moves_that_are_not_short_are_rejected() {
    let rolling = SpeedLaw::Smooth.between(
        Speed::from_mm_per_s(50.0),
        Speed::from_mm_per_s(90.0),
        TimeSpan::from_ms(900),
    );
    let refused = ShortMove::new(TimeSpan::ZERO, rolling, stop(0, 100.0)).unwrap_err();
    assert_eq!(
        refused.to_string(),
        "a short move should start from 0 mm/s and lead ahead, not go from 50 to 90 mm/s"
    );
    let backwards =
        [(TimeSpan::from_ms(500), Length::from_mm(20.0)), (TimeSpan::from_ms(750), Length::from_mm(20.0))];
    assert_eq!(
        fitted().corrected_by(&backwards).unwrap_err().to_string(),
        "the move of 750 ms got 20 mm, which should be more than the move before it got in less time"
    );
    let many = vec![backwards[0]; 25];
    assert_eq!(fitted().corrected_by(&many), Err(ShortMoveError::TooMany { found: 25 }));
}

fn starts() -> impl Strategy<Value = SpeedChange<'static>> {
    let numbers = (proptest::sample::select(SpeedLaw::ALL.to_vec()), 20.0..900.0_f64, 50..8000_i64);
    numbers.prop_map(|(law, speed, ms)| {
        match law {
            // At rest at first and jumping then, a step skips distances.
            SpeedLaw::MidStep | SpeedLaw::ConstantAcceleration => SpeedLaw::ConstantAcceleration,
            other => other,
        }
        .between(Speed::ZERO, Speed::from_mm_per_s(speed), TimeSpan::from_ms(ms))
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn every_distance_ahead_has_its_time(
        start in starts(), delay in 0..500_i64, stop_delay in 0..1500_i64, deceleration in 50.0..1000.0_f64,
        distance in 1.0..10_000.0_f64, gaps in proptest::collection::vec((50..1000_i64, 1.0..300.0_f64), 0..24),
    ) {
        let law = ShortMove::new(TimeSpan::from_ms(delay), start, stop(stop_delay, deceleration)).unwrap();
        let mut at = (TimeSpan::ZERO, Length::ZERO);
        let moves: Vec<_> = gaps
            .into_iter()
            .map(|(ms, mm)| {
                at = (at.0 + TimeSpan::from_ms(ms), at.1 + Length::from_mm(mm));
                at
            })
            .collect();
        let model = law.corrected_by(&moves).unwrap();
        let time = model.command_time(Length::from_mm(distance)).unwrap();
        let found = model.distance(time).as_mm();
        // Once in each direction of the inverse; a sharp start before a long stop differs by 0.3 µm.
        let rounding = TimeSpan::from_ns(2);
        let [soonest, latest] = [time - rounding, time + rounding].map(|time| model.distance(time).as_mm());
        prop_assert!(
            (soonest - 1e-6..=latest + 1e-6).contains(&distance),
            "time is rounded to nanoseconds, no more: {distance} mm: {time:?} gives {found} mm"
        );
        prop_assert!(model.distance(time + TimeSpan::from_ms(10)) >= model.distance(time));
    }
}

#[test]
fn a_lagging_start_is_settled_by_its_tolerance_and_still_inverted() {
    let lag =
        Lag::new(Speed::ZERO, Speed::from_mm_per_s(300.0), TimeSpan::from_ms(1100), Lag::SETTLED_WITHIN);
    let model = ShortMove::new(TimeSpan::ZERO, SpeedChange::Lag(lag), stop(800, 250.0)).unwrap();
    for mm in [1.0, 100.0, 5_000.0, 50_000.0] {
        let time = model.command_time(Length::from_mm(mm)).unwrap();
        assert!((model.distance(time).as_mm() - mm).abs() < 1e-5, "{mm} mm");
    }
}
