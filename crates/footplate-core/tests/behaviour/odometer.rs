//! The odometer accepts any tachometer input, reports what is wrong, and recovers.

#![expect(clippy::expect_used, reason = "the vehicle of a test is one")]

use footplate_core::odometry::wheels::{Axle, Count, Direction, Period, Vehicle, WheelReading, Wheelset};
use footplate_core::odometry::{Mode, MotionEstimate, Odometer, OdometrySettings, WheelState};
use footplate_core::{Acceleration, Length, Speed, TimeSpan, Timestamp};
use proptest::prelude::*;

const PERIOD_S: f64 = 0.05;

fn vehicle() -> Vehicle {
    let wheelset =
        |axle| Wheelset { teeth: 100, diameter: Length::from_m(0.86), diameter_tolerance: 0.002, axle };
    Vehicle::new(
        TimeSpan::from_s(PERIOD_S),
        Speed::from_m_per_s(70.0),
        [1.2, 1.4].map(Acceleration::from_m_per_s2),
        [wheelset(Axle::Powered), wheelset(Axle::Trailing)],
    )
    .expect("a vehicle of the contract")
}

/// Two rolling wheels and the clock of their recorder.
struct Rolling {
    time: f64,
    place: f64,
    counted: [i64; 2],
}

impl Rolling {
    fn next(&mut self, speed: f64, effort: f64) -> Period {
        let pitch = core::f64::consts::PI * 0.86 / 100.0;
        self.time += PERIOD_S;
        self.place += speed * PERIOD_S;
        let mut pulses = [0; 2];
        for ((pulses, counted), phase) in pulses.iter_mut().zip(&mut self.counted).zip([0.3, 0.8]) {
            let now = (self.place / pitch + phase).floor() as i64;
            *pulses = now - *counted;
            *counted = now;
        }
        let period = Period::with_pulses(Timestamp::from_s(self.time), pulses);
        Period { effort: Some(effort), ..period }
    }
}

fn assert_sound(estimate: &MotionEstimate) {
    let numbers = [
        estimate.speed.as_m_per_s(),
        estimate.speed_deviation.as_m_per_s(),
        estimate.guaranteed.speed_low.as_m_per_s(),
        estimate.guaranteed.speed_high.as_m_per_s(),
        estimate.confidence.speed_low.as_m_per_s(),
        estimate.confidence.speed_high.as_m_per_s(),
        estimate.acceleration.as_m_per_s2(),
        estimate.distance.as_m(),
        estimate.guaranteed.distance_low.as_m(),
        estimate.guaranteed.distance_high.as_m(),
        estimate.confidence.distance_low.as_m(),
        estimate.confidence.distance_high.as_m(),
        estimate.over.as_m(),
        estimate.under.as_m(),
    ];
    assert!(numbers.iter().all(|number| number.is_finite()), "{estimate:?}");
    let (inner, outer) = (estimate.confidence, estimate.guaranteed);
    assert!(outer.speed_low <= inner.speed_low && inner.speed_high <= outer.speed_high, "{estimate:?}");
    assert!(inner.speed_low <= inner.speed_high, "{estimate:?}");
    assert!(
        outer.distance_low <= inner.distance_low && inner.distance_high <= outer.distance_high,
        "{estimate:?}"
    );
    assert!(inner.distance_low <= inner.distance_high, "{estimate:?}");
    assert!(estimate.speed_deviation > Speed::ZERO, "{estimate:?}");
    assert!((estimate.shares.iter().sum::<f64>() - 1.0).abs() < 1e-9, "{estimate:?}");
}

fn any_number() -> impl Strategy<Value = f64> {
    prop_oneof![
        4 => -2.0..2.0_f64,
        1 => proptest::num::f64::ANY,
        1 => prop_oneof![Just(f64::NAN), Just(f64::INFINITY), Just(-1e300), Just(0.0)],
    ]
}

fn any_count() -> impl Strategy<Value = Count> {
    prop_oneof![
        1 => Just(Count::Missing),
        4 => (-5_i64..60).prop_map(Count::Pulses),
        1 => any::<i64>().prop_map(Count::Pulses),
        2 => (0_i64..70_000).prop_map(Count::Counter),
        1 => any::<i64>().prop_map(Count::Counter),
    ]
}

fn any_reading() -> impl Strategy<Value = WheelReading> {
    let direction =
        prop_oneof![Just(Direction::Unknown), Just(Direction::Forward), Just(Direction::Backward)];
    (any_count(), direction, proptest::option::of(any::<i64>())).prop_map(|(count, direction, edge)| {
        WheelReading { count, direction, last_edge: edge.map(Timestamp::from_ns) }
    })
}

fn any_span_ns() -> impl Strategy<Value = i64> {
    prop_oneof![
        6 => Just(50_000_000_i64),
        2 => 1_i64..3_000_000_000,
        1 => Just(0_i64),
        1 => -1_000_000_000_i64..0,
        1 => Just(3_600_000_000_000_i64),
    ]
}

prop_compose! {
    fn any_period()(
        readings in proptest::array::uniform2(any_reading()),
        span in any_span_ns(),
        effort in proptest::option::of(any_number()),
        acceleration in proptest::option::of(any_number()),
        balise in proptest::option::weighted(0.1, any_number()),
    ) -> (i64, Period) {
        let period = Period {
            wheels: readings,
            effort,
            acceleration: acceleration.map(Acceleration::from_m_per_s2),
            balise: balise.map(Length::from_m),
            ..Period::empty(Timestamp::ZERO)
        };
        (span, period)
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(256))]

    #[test]
    fn no_input_corrupts_the_odometer_for_good(
        periods in proptest::collection::vec(any_period(), 1..300),
        as_published in any::<bool>(),
    ) {
        let settings = if as_published { OdometrySettings::paper() } else { OdometrySettings::recommended() };
        let mut odometer = Odometer::new(vehicle(), settings).expect("a vehicle");
        let mut again = odometer.clone();
        let mut now = 0_i64;
        let mut latest = 0_i64;
        let mut amounts = [Length::ZERO; 2];
        for (span, period) in periods {
            now += span;
            latest = latest.max(now);
            let period = Period { time: Timestamp::from_ns(now), ..period };
            let estimate = odometer.step(&period);
            assert_sound(&estimate);
            prop_assert_eq!(format!("{estimate:?}"), format!("{:?}", again.step(&period)), "the same input");
            prop_assert!(estimate.over >= amounts[0] && estimate.under >= amounts[1], "amounts never decrease");
            amounts = [estimate.over, estimate.under];
        }
        // A train that continues at 12 m/s, after a pause that ends whatever was before.
        let mut train = Rolling { time: latest as f64 * 1e-9 + 10.0, place: 0.0, counted: [0; 2] };
        let mut last = None;
        for _ in 0..1200 {
            let estimate = odometer.step(&train.next(12.0, 0.0));
            assert_sound(&estimate);
            last = Some(estimate);
        }
        let last = last.expect("an estimate");
        prop_assert!((last.speed.as_m_per_s().abs() - 12.0).abs() < 0.2, "{last:?}");
        prop_assert_eq!(last.mode, Mode::Normal, "{:?}", last);
    }
}

/// The paper knows no dead sensor: one wheel that turns beside one at rest met its criterion for a spin, and the train was said to
/// stand.
#[test]
fn the_published_odometer_does_not_follow_a_sensor_that_died_before_the_train_was_driven() {
    let mut odometer = Odometer::new(vehicle(), OdometrySettings::paper()).expect("a vehicle");
    let mut train = Rolling { time: 0.0, place: 0.0, counted: [0; 2] };
    let mut worst: f64 = 0.0;
    for period in 0..2400 {
        // At rest for 10 s, then driven with 0.8 m/s² up to 40 m/s.
        let driven_s = (f64::from(period) * PERIOD_S - 10.0).clamp(0.0, 50.0);
        let effort = if driven_s > 0.0 && driven_s < 50.0 { 0.8 } else { 0.0 };
        let mut readings = train.next(0.8 * driven_s, effort);
        readings.wheels[1].count = Count::Pulses(0);
        let estimate = odometer.step(&readings);
        if driven_s > 5.0 {
            worst = worst.max((estimate.speed.as_m_per_s() - 0.8 * driven_s).abs());
        }
    }
    assert!(worst < 0.5, "{worst}");
}

#[test]
fn a_dead_second_sensor_costs_no_accuracy_and_is_reported() {
    let mut odometer = Odometer::new(vehicle(), OdometrySettings::recommended()).expect("a vehicle");
    let mut train = Rolling { time: 0.0, place: 0.0, counted: [0; 2] };
    let mut worst: f64 = 0.0;
    for period in 0..2400 {
        let mut readings = train.next(20.0, 0.0);
        let dead = period >= 400;
        if dead {
            readings.wheels[1].count = Count::Pulses(0);
        }
        let estimate = odometer.step(&readings);
        if period > 60 {
            worst = worst.max((estimate.speed.as_m_per_s() - 20.0).abs());
        }
        if period >= 402 {
            assert_eq!(estimate.mode, Mode::Degraded);
            assert_eq!(estimate.wheels, [WheelState::Rolling, WheelState::Excluded]);
        }
    }
    assert!(worst < 0.15, "one sensor is enough: {worst}");
}

/// Both wheels roll for ten seconds, brake, and slide from the 15th second to the 20th by `creepage`; the train slows down by
/// 0.5 m/s². Returns the errors of the estimate while it slides and from three seconds after it on, and the widest
/// confidence interval then.
fn slide_of_both(creepage: f64, back_within: f64) -> [f64; 3] {
    let mut odometer = Odometer::new(vehicle(), OdometrySettings::recommended()).expect("a vehicle");
    let mut train = Rolling { time: 0.0, place: 0.0, counted: [0; 2] };
    let (mut speed, mut slower) = (25.0, 0.0_f64);
    let mut worst = [0.0_f64; 3];
    for period in 0..600 {
        let time = f64::from(period) * PERIOD_S;
        let braked = time >= 10.0;
        speed -= if braked { 0.5 * PERIOD_S } else { 0.0 };
        let sliding = (15.0..20.0).contains(&time);
        let aim = if sliding { creepage } else { 0.0 };
        let step = if sliding { 0.3 * PERIOD_S } else { creepage / back_within * PERIOD_S };
        slower += (aim - slower).clamp(-step, step);
        let estimate = odometer.step(&train.next(speed * (1.0 - slower), if braked { -0.5 } else { 0.0 }));
        let error = (estimate.speed.as_m_per_s() - speed).abs();
        let inside = estimate.guaranteed.speed_low.as_m_per_s() <= speed
            && speed <= estimate.guaranteed.speed_high.as_m_per_s();
        assert!(inside || period == 0, "{time} s: {estimate:?}");
        let [while_sliding, after, width] = &mut worst;
        if (15.2..20.0).contains(&time) {
            *while_sliding = while_sliding.max(error);
        }
        if time > 20.0 + back_within + 3.0 {
            *after = after.max(error);
            let bounds = estimate.confidence;
            *width = width.max((bounds.speed_high - bounds.speed_low).as_m_per_s());
        }
    }
    worst
}

#[test]
fn a_common_slide_is_detected_and_left_without_a_hard_recovery() {
    // 15 % creepage is 3.4 m/s; adhesion returns within half a second.
    let [sliding, after, _] = slide_of_both(0.15, 0.5);
    assert!(sliding < 0.6, "{sliding} m/s off in the slide");
    assert!(after < 0.2, "{after} m/s off after it");
}

#[test]
fn a_spike_in_the_first_row_is_rejected() {
    let mut odometer = Odometer::new(vehicle(), OdometrySettings::recommended()).expect("a vehicle");
    let mut train = Rolling { time: 0.0, place: 0.0, counted: [0; 2] };
    for period in 0..40 {
        let mut readings = train.next(10.0, 0.0);
        if period == 0 {
            readings.wheels = [WheelReading::pulses(100); 2];
        }
        let estimate = odometer.step(&readings);
        assert!(estimate.guaranteed.speed_low.as_m_per_s() <= 10.0, "{estimate:?}");
        assert!(estimate.confidence.speed_low.as_m_per_s() <= 10.0, "{estimate:?}");
        if period > 10 {
            assert!((estimate.speed.as_m_per_s() - 10.0).abs() < 0.2, "{period}: {estimate:?}");
        }
    }
}

#[test]
fn the_upper_bound_never_exceeds_the_top_speed_of_the_train() {
    let mut odometer = Odometer::new(vehicle(), OdometrySettings::recommended()).expect("a vehicle");
    let mut train = Rolling { time: 0.0, place: 0.0, counted: [0; 2] };
    for period in 0..6000 {
        // A brake applied and released while the train is at rest.
        let effort = if period / 20 % 2 == 0 { -0.5 } else { 0.0 };
        let estimate = odometer.step(&train.next(0.0, effort));
        assert!(
            estimate.guaranteed.speed_high.as_m_per_s() <= 70.0 && estimate.speed.as_m_per_s().abs() < 0.05
        );
    }
}

#[test]
fn a_gap_of_an_hour_is_degraded_and_the_bounds_span_it() {
    let mut odometer = Odometer::new(vehicle(), OdometrySettings::recommended()).expect("a vehicle");
    let mut train = Rolling { time: 0.0, place: 0.0, counted: [0; 2] };
    for _ in 0..200 {
        odometer.step(&train.next(20.0, 0.0));
    }
    train.time += 3600.0;
    let after = odometer.step(&train.next(20.0, 0.0));
    assert_eq!(after.mode, Mode::Degraded);
    assert!(
        after.guaranteed.distance_high.as_m() > 70.0 * 3600.0,
        "it may have run at full speed: {after:?}"
    );
    let mut last = after;
    for _ in 0..200 {
        last = odometer.step(&train.next(20.0, 0.0));
    }
    assert_eq!(last.mode, Mode::Normal);
    assert!((last.speed.as_m_per_s() - 20.0).abs() < 0.1, "{last:?}");
}

/// The worst error of the speed (m/s), and how often it was outside the 99.99 % interval, of a train that accelerates by 0.4 m/s² from
/// 20 s to 80 s and then runs on; `counts` changes what the sensors of a time and a speed (s, m/s) count.
fn driven(counts: impl Fn(f64, f64, &mut Rolling, &mut Period)) -> (f64, usize) {
    let mut odometer = Odometer::new(vehicle(), OdometrySettings::recommended()).expect("a vehicle");
    let mut train = Rolling { time: 0.0, place: 0.0, counted: [0; 2] };
    let (mut worst, mut outside) = (0.0_f64, 0);
    for row in 0..2400 {
        let time = f64::from(row) * PERIOD_S;
        let speed = 0.4 * (time - 20.0).clamp(0.0, 60.0);
        let effort = if time < 20.0 { -0.6 } else { 0.5 };
        let mut period = train.next(speed, effort);
        counts(time, speed, &mut train, &mut period);
        let estimate = odometer.step(&period);
        assert_sound(&estimate);
        worst = worst.max((estimate.speed.as_m_per_s() - speed).abs());
        let within = estimate.confidence;
        let outside_now =
            speed < within.speed_low.as_m_per_s() - 0.01 || within.speed_high.as_m_per_s() + 0.01 < speed;
        outside += usize::from(outside_now);
    }
    (worst, outside)
}

#[test]
fn a_train_does_not_stand_because_a_wheel_spins_beside_a_dead_sensor() {
    // The second sensor dies at 30 s. At 60 s the driven wheel runs away by 2 m/s within a second and comes back.
    let (worst, outside) = driven(|time, _, _, period| {
        if time > 30.0 {
            period.wheels[1] = WheelReading::pulses(0);
        }
        let spins = (1.0 - (time - 61.0).abs()).max(0.0) * 2.0;
        if let Count::Pulses(pulses) = period.wheels[0].count {
            let more = (spins * PERIOD_S / (core::f64::consts::PI * 0.86 / 100.0)).round() as i64;
            period.wheels[0] = WheelReading::pulses(pulses + more);
        }
    });
    // No wheel shows how much of 2 m/s is spin.
    assert!(worst < 2.5 && outside < 40, "{worst} {outside}");
}

#[test]
fn a_sensor_that_repeats_its_count_is_found_though_the_wheels_differ_little() {
    // From 40 s on the second sensor repeats what it counted then, for 4 s, in which the train gains 1.6 m/s.
    let (worst, outside) = driven(|time, _, _, period| {
        if (40.0..44.0).contains(&time) {
            let pulses = (8.0 * PERIOD_S / (core::f64::consts::PI * 0.86 / 100.0)).round() as i64;
            period.wheels[1] = WheelReading::pulses(pulses);
        }
    });
    assert!(worst < 1.0 && outside < 30, "{worst} {outside}");
}

#[test]
fn over_a_gap_the_train_may_have_run_as_far_as_its_top_speed_takes_it_either_direction() {
    let mut odometer = Odometer::new(vehicle(), OdometrySettings::recommended()).expect("settings");
    let mut rolling = Rolling { time: 0.0, place: 0.0, counted: [0; 2] };
    let mut before = odometer.step(&rolling.next(20.0, 0.0));
    for _ in 0..200 {
        before = odometer.step(&rolling.next(20.0, 0.0));
    }
    assert!((before.distance.as_m() - 200.0).abs() < 1.0, "{before:?}");
    // Half a minute at 70 m/s are 2100 m.
    rolling.time += 30.0;
    let after = odometer.step(&rolling.next(20.0, 0.0));
    let [low, high] = [after.guaranteed.distance_low, after.guaranteed.distance_high].map(Length::as_m);
    let reach = 70.0 * (30.0 + PERIOD_S);
    assert!((low - (before.guaranteed.distance_low.as_m() - reach)).abs() < 5.0, "{low}");
    assert!((high - (before.guaranteed.distance_high.as_m() + reach)).abs() < 5.0, "{high}");
    assert_eq!(after.mode, Mode::Degraded);
    assert_eq!(after.distance, before.distance, "nothing was counted");
    let next = odometer.step(&rolling.next(20.0, 0.0));
    assert!((next.distance - after.distance).as_m() > 0.5, "it goes on");
}
