//! Every law of speed change leads from one speed to the other without a step, and back from distance to time.

use footplate_core::kinematics::{Lag, Motion, SpeedChange, SpeedLaw, StepRamp, StepTable};
use footplate_core::{Acceleration, Length, Speed, SpeedStep, TimeSpan};
use proptest::prelude::*;

use crate::draw::Draw;
use crate::motion_checks::{assert_integrals_agree, assert_inverse_leads_back, assert_no_step};

const SECOND: TimeSpan = TimeSpan::from_ms(1000);

fn m_per_s(speed: f64) -> Speed {
    Speed::from_m_per_s(speed)
}

/// The documentation's table of each law, at a quarter, half and three quarters of two seconds from 1 m/s to 3 m/s:
/// distance in m, speed in m/s, acceleration in m/s², computed by hand.
#[test]
fn the_laws_are_those_of_the_table() {
    let expected = [
        (SpeedLaw::MidStep, [(0.5, 1.0, 0.0), (1.0, 3.0, 0.0), (2.5, 3.0, 0.0)]),
        (SpeedLaw::ConstantAcceleration, [(0.625, 1.5, 1.0), (1.5, 2.0, 1.0), (2.625, 2.5, 1.0)]),
        (
            SpeedLaw::ConstantJerk,
            [(0.5 + 1.0 / 24.0, 1.25, 1.0), (4.0 / 3.0, 2.0, 2.0), (2.5 + 1.0 / 24.0, 2.75, 1.0)],
        ),
        (SpeedLaw::Smooth, [(0.554_687_5, 1.3125, 1.125), (1.375, 2.0, 1.5), (2.554_687_5, 2.6875, 1.125)]),
    ];
    for (law, states) in expected {
        let change = law.between(m_per_s(1.0), m_per_s(3.0), SECOND + SECOND);
        assert_eq!((change.duration(), change.distance()), (SECOND + SECOND, Length::from_m(4.0)), "{law:?}");
        for (at, (distance, speed, acceleration)) in (1..).zip(states) {
            let state = change.state_at(TimeSpan::from_ms(500 * at));
            assert!((state.distance.as_m() - distance).abs() < 1e-14, "{law:?}: {state:?}");
            assert!((state.speed.as_m_per_s() - speed).abs() < 1e-14, "{law:?}: {state:?}");
            assert!((state.acceleration.as_m_per_s2() - acceleration).abs() < 1e-14, "{law:?}: {state:?}");
        }
    }
}

#[test]
fn a_lag_closes_the_same_share_in_every_time_constant() {
    let change = Lag::new(m_per_s(1.0), m_per_s(3.0), SECOND, Lag::SETTLED_WITHIN);
    for seconds in 1..6 {
        let state = change.state_at(TimeSpan::from_s(f64::from(seconds)));
        let left = 2.0 * (-f64::from(seconds)).exp();
        assert!((state.speed.as_m_per_s() - (3.0 - left)).abs() < 1e-15);
        assert!((state.acceleration.as_m_per_s2() - left).abs() < 1e-15);
        assert!((state.distance.as_m() - (3.0 * f64::from(seconds) - 2.0 + left)).abs() < 1e-14);
    }
    // 2 m/s have shrunk to 1 mm/s after ln 2000 time constants.
    assert!((change.duration().as_s() - 2000.0_f64.ln()).abs() < 1e-9);
    let end = change.state_at(change.duration()).distance;
    assert!((end - change.distance()).abs() < Length::from_m(3e-9), "the duration is rounded to nanoseconds");
}

#[test]
fn a_lagging_stop_ends_at_speed_times_time_constant() {
    let stop = Lag::new(m_per_s(0.5), Speed::ZERO, TimeSpan::from_ms(1200), Lag::SETTLED_WITHIN);
    assert!(
        (stop.distance().as_m() - (0.6 - 0.001 * 1.2)).abs() < 1e-12,
        "short of 600 mm by 1 mm/s times 1.2 s"
    );
    assert!(stop.time_at(Length::from_mm(599.0)).is_some());
    assert_eq!(stop.time_at(Length::from_mm(601.0)), None);
}

#[test]
fn a_ramp_follows_the_table() {
    // Slow at low steps and steep above: 0, 10, 30, 100 mm/s at half a second a step.
    let table = StepTable::new(&[0.0, 10.0, 30.0, 100.0].map(Speed::from_mm_per_s)).unwrap();
    let [first, last] = [1, 3].map(|step| SpeedStep::new(step).unwrap());
    let up = StepRamp::new(&table, first, last, TimeSpan::from_ms(500));
    assert_eq!(up.duration(), SECOND);
    assert!((up.distance().as_mm() - (10.0 + 32.5)).abs() < 1e-12);
    let state = up.state_at(TimeSpan::from_ms(750));
    assert!((state.distance.as_mm() - (10.0 + 0.25 * 47.5)).abs() < 1e-12);
    assert!((state.speed.as_mm_per_s() - 65.0).abs() < 1e-12);
    assert!((state.acceleration.as_mm_per_s2() - 140.0).abs() < 1e-10);
    let down = StepRamp::new(&table, last, first, TimeSpan::from_ms(500));
    assert_eq!(down.distance(), up.distance());
    assert!((down.state_at(TimeSpan::from_ms(250)).acceleration.as_mm_per_s2() + 140.0).abs() < 1e-10);
}

#[test]
fn a_rate_gives_the_duration() {
    use footplate_core::kinematics::ConstantAcceleration;
    let even = ConstantAcceleration::with_acceleration(
        m_per_s(0.5),
        m_per_s(0.2),
        Acceleration::from_mm_per_s2(150.0),
    );
    assert_eq!(even.duration(), TimeSpan::from_s(2.0));
}

#[test]
fn a_train_that_backs_up_mirrors_one_that_runs_forwards() {
    for law in SpeedLaw::ALL {
        let ahead = law.between(m_per_s(0.3), m_per_s(0.1), SECOND);
        let back = law.between(m_per_s(-0.3), m_per_s(-0.1), SECOND);
        let (at, then) = (ahead.state_at(TimeSpan::from_ms(400)), back.state_at(TimeSpan::from_ms(400)));
        assert_eq!(
            (at.distance, at.speed, at.acceleration),
            (-then.distance, -then.speed, -then.acceleration)
        );
        assert_eq!(ahead.time_at(Length::from_mm(110.0)), back.time_at(Length::from_mm(-110.0)));
        assert_eq!(back.distance(), -ahead.distance());
    }
}

/// Where a law may switch from one formula to another.
fn borders(change: &SpeedChange<'_>) -> [TimeSpan; 3] {
    [TimeSpan::ZERO, TimeSpan::from_ns(change.duration().as_ns() / 2), change.duration()]
}

fn assert_law_holds(change: &SpeedChange<'_>, from: Speed, to: Speed, draw: &mut Draw, tolerance: f64) {
    let (start, end) = (change.state_at(TimeSpan::ZERO), change.state_at(change.duration()));
    let grain = 1e-14 * (from.max(to)).as_m_per_s();
    assert!(start.distance.abs().as_m() <= grain * change.duration().as_s(), "{start:?}");
    assert!((start.speed - from).abs().as_m_per_s() <= grain, "{start:?} should have {from:?}");
    let settled = if matches!(change, SpeedChange::Lag(_)) { Lag::SETTLED_WITHIN } else { Speed::ZERO };
    // An error of one nanosecond in the duration changes the speed by the acceleration in it.
    let rounding = 2e-9 * end.acceleration.abs().as_m_per_s2();
    assert!(
        (end.speed - to).abs().as_m_per_s() <= 1.001 * settled.as_m_per_s() + grain + rounding,
        "{change:?}"
    );
    for border in borders(change) {
        if !matches!(change, SpeedChange::MidStep(_)) {
            assert_no_step(change, border);
        }
    }
    let moment = draw.moment(change.duration());
    let speed = change.state_at(moment).speed;
    let slack = m_per_s(grain);
    assert!(from.min(to) - slack <= speed && speed <= from.max(to) + slack, "{speed:?} in {change:?}");
    let at_the_step = matches!(change, SpeedChange::MidStep(_))
        && (moment + moment - change.duration()).abs() <= TimeSpan::from_ns(2);
    if !at_the_step {
        assert_inverse_leads_back(change, moment); // from standstill, every moment before has the same distance
    }
    // Within one half, so that no kink lies inside.
    let half = change.duration().as_s() / 2.0;
    let offset = if draw.one_in(2) { half } else { 0.0 };
    let mut ends = [draw.within(0.0, half), draw.within(0.0, half)];
    ends.sort_by(f64::total_cmp);
    let [start, end] = ends.map(|s| TimeSpan::from_s(offset + s));
    // Where the rounding of the ends to nanoseconds may carry them over the middle, the result is open.
    if start > TimeSpan::from_s(offset) + SECOND_MILLIONTH
        && end + SECOND_MILLIONTH < TimeSpan::from_s(offset + half)
    {
        assert_integrals_agree(change, start, end, tolerance);
    }
}

const SECOND_MILLIONTH: TimeSpan = TimeSpan::from_us(1);

#[test]
fn half_a_million_random_changes_of_speed_hold() {
    let mut draw = Draw::new(1);
    for _ in 0..100_000 {
        let (from, to) = (draw.speed(), draw.speed());
        let time = TimeSpan::from_s(draw.magnitude(1e-3, 300.0));
        for law in SpeedLaw::ALL {
            // Three points integrate polynomials exactly, and an exponential over several time constants not.
            let tolerance = if law == SpeedLaw::Lag { 0.3 } else { 1e-12 };
            assert_law_holds(&law.between(from, to, time), from, to, &mut draw, tolerance);
        }
    }
}

#[test]
fn thirty_thousand_random_ramps_hold() {
    let mut draw = Draw::new(2);
    for _ in 0..3_000 {
        let steps = 2 + (draw.bits() % 126) as usize;
        let mut speed = Speed::ZERO;
        let speeds: Vec<Speed> = (0..steps)
            .map(|_| {
                let this = speed;
                // Some steps are slower than the one before, as in tables of real trains.
                speed = (speed + Speed::from_mm_per_s(draw.within(-2.0, 10.0))).max(Speed::ZERO);
                this
            })
            .collect();
        let table = StepTable::new(&speeds).unwrap();
        for _ in 0..10 {
            let [from, to] = [0, 0].map(|_| SpeedStep::new((draw.bits() % steps as u64) as u8).unwrap());
            let ramp = StepRamp::new(&table, from, to, TimeSpan::from_s(draw.magnitude(1e-3, 1.0)));
            assert_eq!(ramp.state_at(TimeSpan::from_ns(-1)).speed, table.speed(from));
            assert_eq!(ramp.state_at(ramp.duration() + SECOND).speed, table.speed(to));
            assert_no_step(&ramp, draw.moment(ramp.duration()));
            assert_inverse_leads_back(&ramp, draw.moment(ramp.duration()));
        }
    }
}

proptest! {
    #[test]
    fn no_numbers_make_a_law_panic(
        from in any::<f64>(), to in any::<f64>(), ns in any::<i64>(), at in any::<i64>(), distance in any::<f64>(),
    ) {
        for law in SpeedLaw::ALL {
            let change = law.between(m_per_s(from), m_per_s(to), TimeSpan::from_ns(ns));
            let _ = change.state_at(TimeSpan::from_ns(at));
            let _ = change.time_at(Length::from_m(distance));
            let _ = (change.duration(), change.distance());
        }
    }

    #[test]
    fn sensible_numbers_give_finite_answers(
        from in -200.0..200.0_f64, to in -200.0..200.0_f64, ns in 0..1_000_000_000_000_i64, at in any::<i32>(),
    ) {
        for law in SpeedLaw::ALL {
            for ns in [0, 1, ns] {
                let change = law.between(m_per_s(from), m_per_s(to), TimeSpan::from_ns(ns));
                let state = change.state_at(TimeSpan::from_us(i64::from(at)));
                prop_assert!(state.distance.is_finite() && state.speed.is_finite() && state.acceleration.is_finite());
            }
        }
    }

    #[test]
    fn any_speeds_give_a_table_or_an_error(speeds in proptest::collection::vec(any::<f64>(), 0..130)) {
        let speeds: Vec<Speed> = speeds.into_iter().map(m_per_s).collect();
        if let Ok(table) = StepTable::new(&speeds) {
            prop_assert_eq!(usize::from(table.last().get()) + 1, speeds.len());
        }
    }
}
