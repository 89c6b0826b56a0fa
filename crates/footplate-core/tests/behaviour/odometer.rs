//! The odometer takes whatever tachometers say, says so, and recovers from it.

#![expect(clippy::expect_used, reason = "the vehicle of a test is one")]

use footplate_core::estimation::odometry::{Mode, MotionEstimate, Odometer, OdometrySettings, WheelState};
use footplate_core::wheels::{Axle, Count, Direction, Period, Vehicle, WheelReading, Wheelset};
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

/// Two wheels that roll, and the clock of their recorder.
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
        estimate.speed_low.as_m_per_s(),
        estimate.speed_high.as_m_per_s(),
        estimate.acceleration.as_m_per_s2(),
        estimate.distance.as_m(),
        estimate.distance_low.as_m(),
        estimate.distance_high.as_m(),
        estimate.over.as_m(),
        estimate.under.as_m(),
    ];
    assert!(numbers.iter().all(|number| number.is_finite()), "{estimate:?}");
    assert!(estimate.speed_low <= estimate.speed_high, "{estimate:?}");
    assert!(estimate.distance_low <= estimate.distance_high, "{estimate:?}");
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
    fn nothing_poisons_it_and_it_recovers(
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
        // A train that rolls on at 12 m/s, after a pause that ends whatever was before.
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

#[test]
fn a_dead_second_sensor_costs_no_accuracy_and_is_said() {
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
    assert!(after.distance_high.as_m() > 70.0 * 3600.0, "it may have run at full speed: {after:?}");
    let mut last = after;
    for _ in 0..200 {
        last = odometer.step(&train.next(20.0, 0.0));
    }
    assert_eq!(last.mode, Mode::Normal);
    assert!((last.speed.as_m_per_s() - 20.0).abs() < 0.1, "{last:?}");
}
