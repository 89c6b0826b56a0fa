//! Two sensors recover the true acceleration with its uncertainty, and report when they cannot.

use footplate_core::kinematics::{
    ConstantAcceleration, Motion, TwoSensorError, TwoSensorRun, TwoSensorVerdict,
};
use footplate_core::{Acceleration, Estimate, Length, Speed, TimeSpan, Timestamp};
use proptest::prelude::*;

use crate::draw::Draw;

fn known<Q>(value: Q, uncertainty: Q) -> Estimate<Q> {
    Estimate { value, uncertainty, count: 1, date: Timestamp::ZERO }
}

/// A run in mm, s and mm/s, with typical uncertainties of tape, poll and speed table.
fn run(distance: f64, time: f64, from: f64, to: f64, command_delay: f64) -> TwoSensorRun {
    TwoSensorRun {
        distance: known(Length::from_mm(distance), Length::from_mm(3.0)),
        before_command: known(TimeSpan::ZERO, TimeSpan::ZERO),
        time: known(TimeSpan::from_s(time), TimeSpan::from_ms(10)),
        from: known(Speed::from_mm_per_s(from), Speed::from_mm_per_s(1.5)),
        to: known(Speed::from_mm_per_s(to), Speed::from_mm_per_s(1.5)),
        command_delay: known(TimeSpan::from_s(command_delay), TimeSpan::from_ms(5)),
    }
}

/// The same run of a train with constant acceleration after the delay.
fn driven(distance: f64, from: f64, to: f64, command_delay: f64, acceleration: f64) -> Option<TwoSensorRun> {
    let change = ConstantAcceleration::with_acceleration(
        Speed::from_mm_per_s(from),
        Speed::from_mm_per_s(to),
        Acceleration::from_mm_per_s2(acceleration),
    );
    let time = change.time_at(Length::from_mm(distance - from * command_delay))?;
    Some(run(distance, time.as_s() + command_delay, from, to, command_delay))
}

#[test]
fn a_change_that_was_over_is_recognised() {
    // By hand: 200 to 400 mm/s at 100 mm/s² takes 2 s and 600 mm; 400 mm more at full speed take 1 s.
    let verdict = run(1000.0, 3.0, 200.0, 400.0, 0.0).verdict().unwrap();
    let TwoSensorVerdict::Completed { acceleration, duration } = verdict else { panic!("{verdict:?}") };
    assert!((acceleration.value.as_mm_per_s2() - 100.0).abs() < 1e-9);
    assert_eq!(duration, TimeSpan::from_s(2.0));
}

#[test]
fn a_change_that_was_not_over_is_recognised() {
    // By hand: at 50 mm/s² it would take 4 s; in the first 2 s the train gets 500 mm and to 300 mm/s.
    let verdict = run(500.0, 2.0, 200.0, 400.0, 0.0).verdict().unwrap();
    let TwoSensorVerdict::Unfinished { acceleration, speed } = verdict else { panic!("{verdict:?}") };
    assert!((acceleration.value.as_mm_per_s2() - 50.0).abs() < 1e-9);
    assert!((speed.as_mm_per_s() - 300.0).abs() < 1e-9);
}

#[test]
fn slowing_down_is_the_mirror_image() {
    // 400 to 200 mm/s at 100 mm/s²: 2 s and 600 mm, then 400 mm in 2 s.
    let verdict = run(1000.0, 4.0, 400.0, 200.0, 0.0).verdict().unwrap();
    assert!(
        matches!(verdict, TwoSensorVerdict::Completed { acceleration, .. } if (acceleration.value.as_mm_per_s2() + 100.0).abs() < 1e-9),
        "{verdict:?}"
    );
    // At 50 mm/s² 2 s take it 700 mm and down to 300 mm/s.
    let verdict = run(700.0, 2.0, 400.0, 200.0, 0.0).verdict().unwrap();
    assert!(
        matches!(verdict, TwoSensorVerdict::Unfinished { acceleration, .. } if (acceleration.value.as_mm_per_s2() + 50.0).abs() < 1e-9),
        "{verdict:?}"
    );
}

#[test]
fn a_delay_of_the_command_is_run_at_the_old_speed() {
    // As the first case, after 0.5 s and 100 mm at 200 mm/s.
    let verdict = run(1100.0, 3.5, 200.0, 400.0, 0.5).verdict().unwrap();
    assert!(
        matches!(verdict, TwoSensorVerdict::Completed { acceleration, .. } if (acceleration.value.as_mm_per_s2() - 100.0).abs() < 1e-9),
        "{verdict:?}"
    );
}

#[test]
fn an_undecided_scenario_is_reported() {
    // The change ends just at the second sensor.
    let verdict = run(600.0, 2.0, 200.0, 400.0, 0.0).verdict().unwrap();
    let TwoSensorVerdict::Undecided { if_completed, if_unfinished } = verdict else { panic!("{verdict:?}") };
    assert!((if_completed.value - if_unfinished.value).abs() < Acceleration::from_mm_per_s2(1e-9));
    assert!(if_completed.uncertainty > Acceleration::ZERO && if_unfinished.uncertainty > Acceleration::ZERO);
}

#[test]
fn a_change_too_quick_or_too_slow_to_see_is_not_measured() {
    assert_eq!(run(1000.0, 2.505, 200.0, 400.0, 0.0).verdict(), Ok(TwoSensorVerdict::TooQuick));
    assert_eq!(run(200.0, 0.998, 200.0, 400.0, 0.0).verdict(), Ok(TwoSensorVerdict::NotNoticed));
    // Shorter than at the final speed over the whole distance: no acceleration explains that.
    assert_eq!(run(1000.0, 2.0, 200.0, 400.0, 0.0).verdict(), Ok(TwoSensorVerdict::TooQuick));
    assert_eq!(run(1000.0, 6.0, 200.0, 400.0, 0.0).verdict(), Ok(TwoSensorVerdict::NotNoticed));
}

/// The time of a train from a command over a distance (mm) with constant acceleration (mm/s, mm/s²) after a delay
/// (s): stepped through in microseconds, with none of the formulas under test.
fn stepped(distance: f64, from: f64, to: f64, delay: f64, acceleration: f64) -> f64 {
    const STEP_S: f64 = 1e-6;
    let (mut time, mut place, mut speed) = (0.0, 0.0, from);
    while place < distance {
        if time >= delay {
            speed = (speed + acceleration * STEP_S).min(to);
        }
        place += speed * STEP_S;
        time += STEP_S;
    }
    time
}

#[test]
fn a_change_that_has_hardly_started_is_not_reported_as_too_quick() {
    // 18 mm are run before the command takes effect; 7 mm on, the train is at 205 mm/s of 500 and 0.1 mm ahead.
    let time = stepped(25.0, 200.0, 500.0, 0.09, 150.0);
    let near = TwoSensorRun {
        time: known(TimeSpan::from_s(time), TimeSpan::from_ms(19)),
        ..run(25.0, time, 200.0, 500.0, 0.09)
    };
    assert_eq!(near.verdict(), Ok(TwoSensorVerdict::NotNoticed));
    // An instantaneous change, seen from far enough: 1000 mm in 2.09 s.
    let quick = run(1000.0, stepped(1000.0, 200.0, 500.0, 0.09, 1e9), 200.0, 500.0, 0.09);
    assert_eq!(quick.verdict(), Ok(TwoSensorVerdict::TooQuick));
}

#[test]
fn a_command_after_the_first_sensor_is_handled() {
    // 0.8 s at 200 mm/s from the first sensor to the command, then 700 mm to the second, 100 mm/s² after 0.15 s.
    let at_command = run(700.0, stepped(700.0, 200.0, 400.0, 0.15, 100.0), 200.0, 400.0, 0.15);
    let later = TwoSensorRun {
        distance: known(Length::from_mm(860.0), Length::from_mm(3.0)),
        before_command: known(TimeSpan::from_ms(800), TimeSpan::from_ms(10)),
        ..at_command
    };
    let found = |run: TwoSensorRun| match run.verdict() {
        Ok(TwoSensorVerdict::Completed { acceleration, .. }) => acceleration,
        other => panic!("{other:?}"),
    };
    let (at_command, later) = (found(at_command), found(later));
    assert!((later.value.as_mm_per_s2() - 100.0).abs() < 0.1, "{later:?}");
    assert!((later.value - at_command.value).abs() < Acceleration::from_mm_per_s2(1e-9));
    assert!(later.uncertainty > at_command.uncertainty, "the first sensor is dated by a poll, too");
}

#[test]
fn a_run_without_information_is_rejected() {
    let refused = run(1000.0, 3.0, 300.0, 303.0, 0.0).verdict().unwrap_err();
    assert_eq!(
        refused.to_string(),
        "300 and 303 mm/s do not differ by more than their uncertainty: change the speed by more"
    );
    assert!(matches!(
        run(10.0, 0.05, 200.0, 400.0, 0.1).verdict(),
        Err(TwoSensorError::BeforeTheChange { .. })
    ));
    assert!(matches!(run(10.0, 0.05, -200.0, 400.0, 0.0).verdict(), Err(TwoSensorError::NotForwards { .. })));
    assert_eq!(run(f64::NAN, 1.0, 200.0, 400.0, 0.0).verdict(), Err(TwoSensorError::NotFinite));
}

/// The measured values, perturbed by their own uncertainties.
fn scattered(run: TwoSensorRun, draw: &mut Draw) -> TwoSensorRun {
    let distance = run.distance.value + draw.normal() * run.distance.uncertainty;
    let time = run.time.value + TimeSpan::from_s(draw.normal() * run.time.uncertainty.as_s());
    let command_delay =
        run.command_delay.value + TimeSpan::from_s(draw.normal() * run.command_delay.uncertainty.as_s());
    let [from, to] = [run.from, run.to].map(|speed| speed.value + draw.normal() * speed.uncertainty);
    TwoSensorRun {
        before_command: run.before_command,
        distance: Estimate { value: distance, ..run.distance },
        time: Estimate { value: time, ..run.time },
        from: Estimate { value: from, ..run.from },
        to: Estimate { value: to, ..run.to },
        command_delay: Estimate { value: command_delay, ..run.command_delay },
    }
}

#[test]
fn the_stated_uncertainty_matches_the_spread() {
    let mut draw = Draw::new(21);
    // Acceleration and deceleration, completed well before the second sensor and far from completed at it.
    let cases = [
        (1000.0, 200.0, 400.0, 100.0),
        (500.0, 200.0, 400.0, 40.0),
        (1000.0, 400.0, 150.0, 100.0),
        (900.0, 400.0, 100.0, 50.0),
    ];
    for (distance, from, to, acceleration) in cases {
        let truth = driven(distance, from, to, 0.15, acceleration).unwrap();
        let signed = if to < from { -acceleration } else { acceleration };
        let (mut squares, mut runs) = (0.0, 0.0);
        for _ in 0..20_000 {
            let found = match scattered(truth, &mut draw).verdict() {
                Ok(
                    TwoSensorVerdict::Completed { acceleration, .. }
                    | TwoSensorVerdict::Unfinished { acceleration, .. },
                ) => acceleration,
                other => panic!("{other:?} from {distance} mm at {acceleration} mm/s²"),
            };
            squares += ((found.value.as_mm_per_s2() - signed) / found.uncertainty.as_mm_per_s2()).powi(2);
            runs += 1.0;
        }
        let spread: f64 = squares / runs;
        // 1 by definition; 2 % are two standard deviations of 20 000 draws, the rest is what lies beyond the
        // first order.
        assert!(
            (spread - 1.0).abs() < 0.06,
            "errors are {} of the stated ones over {distance} mm",
            spread.sqrt()
        );
    }
}

#[test]
fn the_wrong_scenario_is_named_no_more_often_than_stated() {
    let mut draw = Draw::new(22);
    let (mut wrong, mut undecided, mut all) = (0.0, 0.0, 0.0);
    for _ in 0..20_000 {
        // Changes that end within 30 mm of the second sensor, on either side.
        let ends = 600.0 + draw.within(-30.0, 30.0);
        let truth = driven(600.0, 200.0, 400.0, 0.0, 60_000.0 / ends).unwrap();
        match scattered(truth, &mut draw).verdict().unwrap() {
            TwoSensorVerdict::Completed { .. } => wrong += f64::from(ends > 600.0),
            TwoSensorVerdict::Unfinished { .. } => wrong += f64::from(ends < 600.0),
            TwoSensorVerdict::Undecided { .. } => undecided += 1.0,
            other => panic!("{other:?}"),
        }
        all += 1.0;
    }
    assert!(wrong / all < 0.03, "{wrong} wrong of {all}");
    assert!(
        undecided / all > 0.3,
        "so close to the border, the data often cannot decide: {undecided} of {all}"
    );
}

proptest! {
    #[test]
    fn any_change_is_recovered(
        distance in 100.0..5000.0_f64, from in 20.0..600.0_f64, to in 20.0..600.0_f64, delay in 0.0..0.3_f64,
        acceleration in 20.0..1000.0_f64,
    ) {
        let Some(run) = driven(distance, from, to, delay, acceleration) else { return Ok(()) };
        let (Ok(verdict), signed) = (run.verdict(), if to < from { -acceleration } else { acceleration }) else {
            return Ok(());
        };
        let found = match verdict {
            TwoSensorVerdict::Completed { acceleration, .. } | TwoSensorVerdict::Unfinished { acceleration, .. } => acceleration,
            // Of the two, the one closer to the truth.
            TwoSensorVerdict::Undecided { if_completed, if_unfinished } => {
                let off = |estimate: Estimate<Acceleration>| (estimate.value.as_mm_per_s2() - signed).abs();
                if off(if_completed) < off(if_unfinished) { if_completed } else { if_unfinished }
            }
            TwoSensorVerdict::TooQuick | TwoSensorVerdict::NotNoticed => return Ok(()),
        };
        prop_assert!((found.value.as_mm_per_s2() - signed).abs() < 1e-4 * acceleration, "{found:?}");
    }

    #[test]
    fn any_numbers_give_a_result(values in any::<[f64; 6]>(), spans in any::<[i64; 4]>()) {
        let [distance, distance_by, from, from_by, to, to_by] = values;
        let [time, time_by, delay, delay_by] = spans.map(TimeSpan::from_ns);
        let _ = TwoSensorRun {
            distance: known(Length::from_m(distance), Length::from_m(distance_by)),
            before_command: known(time, time_by),
            time: known(time, time_by),
            from: known(Speed::from_m_per_s(from), Speed::from_m_per_s(from_by)),
            to: known(Speed::from_m_per_s(to), Speed::from_m_per_s(to_by)),
            command_delay: known(delay, delay_by),
        }
        .verdict();
    }
}
