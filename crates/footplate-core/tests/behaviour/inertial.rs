//! An accelerometer carries the speed through a slide, with a true standard deviation and valid bounds.

use core::f64::consts::TAU;

use footplate_core::odometry::inertial::{
    AccelerationBlock, BlockAverage, DriftLimits, InertialBounds, InertialFilter, InertialLimits,
    InertialNoise, Standing, StandstillDetector, TripRecorder,
};
use footplate_core::{Acceleration, Length, Speed, TimeSpan, Timestamp};
use proptest::prelude::*;

use crate::draw::Draw;

const PERIOD_S: f64 = 0.05;

/// A train on a line with gradients, and the readings of its accelerometer.
struct Train {
    draw: Draw,
    /// Gravity along the track as waves over the distance: amplitude (m/s²), length (m), phase.
    gravity: [(f64, f64, f64); 4],
    bias: f64,
    bias_walk: f64,
    noise: f64,
    time: f64,
    speed: f64,
    place: f64,
}

impl Train {
    fn new(seed: u64, gravity: f64) -> Self {
        let mut draw = Draw::new(seed);
        let gravity = [900.0, 1400.0, 2300.0, 3700.0]
            .map(|length| (gravity * core::f64::consts::FRAC_1_SQRT_2, length, TAU * draw.share()));
        Self { draw, gravity, bias: 0.0, bias_walk: 0.0, noise: 0.05, time: 0.0, speed: 0.0, place: 0.0 }
    }

    fn gravity(&self) -> f64 {
        self.gravity
            .iter()
            .map(|(height, length, phase)| height * (TAU * self.place / length + phase).sin())
            .sum()
    }

    /// Accelerates for one period and returns the mean reading.
    fn run(&mut self, acceleration: f64) -> Acceleration {
        let acceleration =
            if self.speed + acceleration * PERIOD_S < 0.0 { -self.speed / PERIOD_S } else { acceleration };
        self.place += PERIOD_S * (self.speed + 0.5 * acceleration * PERIOD_S);
        // Exactly zero when it comes to rest.
        self.speed = if acceleration < 0.0 && self.speed + acceleration * PERIOD_S < 1e-9 {
            0.0
        } else {
            self.speed + acceleration * PERIOD_S
        };
        self.time += PERIOD_S;
        self.bias += self.bias_walk * PERIOD_S.sqrt() * self.draw.normal();
        Acceleration::from_m_per_s2(
            acceleration + self.bias + self.gravity() + self.noise * self.draw.normal(),
        )
    }
}

fn period() -> TimeSpan {
    TimeSpan::from_s(PERIOD_S)
}

fn m_per_s(speed: f64) -> Speed {
    Speed::from_m_per_s(speed)
}

/// 0.6 m/s² for 60 s, steady, and from 150 s on a brake that the rails hardly carry.
fn driven(time: f64) -> f64 {
    if time < 60.0 {
        0.6
    } else if time < 150.0 {
        0.0
    } else {
        -0.45
    }
}

#[test]
fn the_deviation_in_a_slide_is_true() {
    let noise = InertialNoise::default();
    let runs = 300;
    let mut squared = [0.0; 3];
    let mut beyond_two = 0.0;
    for seed in 0..runs {
        let mut train = Train::new(seed, 0.1);
        train.noise = 0.1;
        train.bias = 0.2 * train.draw.normal();
        train.bias_walk = 0.005 / 60.0_f64.sqrt();
        let mut filter = InertialFilter::new(noise);
        for after in 0..4200 {
            let time = f64::from(after) * PERIOD_S;
            let reading = train.run(driven(time));
            filter.predict(period(), Some(reading));
            if time < 150.0 {
                let wheels = m_per_s(train.speed + 0.1 * train.draw.normal());
                filter.align(wheels, m_per_s(0.1));
            }
            let error = (filter.speed().as_m_per_s() - train.speed) / filter.speed_deviation().as_m_per_s();
            for (squared, at) in squared.iter_mut().zip([3200, 3600, 4199]) {
                if after == at {
                    *squared += error * error / runs as f64;
                    beyond_two += f64::from(u8::from(error.abs() > 2.0)) / (3.0 * runs as f64);
                }
            }
        }
    }
    // After 10, 30 and 60 s of sliding.
    assert!(squared.iter().all(|squared| (0.3..1.5).contains(squared)), "{squared:.2?}");
    // 4.6 % if errors were normal.
    assert!(beyond_two < 0.09, "{beyond_two}");
}

#[test]
fn a_minute_of_sliding_stays_within_two_metres_per_second_on_a_level_line() {
    let mut worst: f64 = 0.0;
    for seed in 0..50 {
        let mut train = Train::new(seed, 0.005);
        train.bias = 0.05;
        let mut filter = InertialFilter::new(InertialNoise::default());
        for after in 0..4200 {
            let time = f64::from(after) * PERIOD_S;
            let reading = train.run(driven(time));
            filter.predict(period(), Some(reading));
            if time < 150.0 {
                filter.align(m_per_s(train.speed), m_per_s(0.1));
            } else {
                worst = worst.max((filter.speed().as_m_per_s() - train.speed).abs());
            }
        }
    }
    // An unknown bias of 0.05 m/s² would give an error of 3 m/s.
    assert!(worst < 2.0, "{worst}");
}

#[test]
fn the_sensor_bias_is_learnt_at_standstill() {
    let mut train = Train::new(1, 0.03);
    train.bias = -0.04;
    let mut filter = InertialFilter::new(InertialNoise::default());
    for _ in 0..1200 {
        filter.predict(period(), Some(train.run(0.0)));
        filter.stand();
    }
    let [excess, deviation] = filter.excess().map(Acceleration::as_m_per_s2);
    assert!((excess - (train.gravity() - 0.04)).abs() < 0.01, "{excess}");
    assert!(deviation < 0.01, "{deviation}");
    assert!(filter.speed().as_m_per_s().abs() < 0.02);
}

#[test]
fn a_common_slide_shows_in_the_innovation() {
    let mut train = Train::new(2, 0.01);
    let mut filter = InertialFilter::new(InertialNoise::default());
    let mut wheels = 0.0;
    for after in 0..3300 {
        let time = f64::from(after) * PERIOD_S;
        filter.predict(period(), Some(train.run(driven(time))));
        // Both wheels lag behind by a further 0.8 m/s each second.
        wheels = if time < 150.0 { train.speed } else { wheels + (-0.45 - 0.8) * PERIOD_S };
        if time < 150.0 {
            filter.align(m_per_s(wheels), m_per_s(0.1));
            let innovation = filter.innovation(m_per_s(wheels), m_per_s(0.1));
            assert!(innovation.standardised().abs() < 4.0, "{innovation:?} at {time}");
        } else if time > 152.0 {
            let innovation = filter.innovation(m_per_s(wheels), m_per_s(0.1));
            assert!(innovation.standardised() < -6.0, "{innovation:?} at {time}");
        }
    }
}

#[test]
fn a_silent_sensor_only_increases_the_uncertainty() {
    let mut train = Train::new(3, 0.0);
    let mut filter = InertialFilter::new(InertialNoise::default());
    let mut bounds = InertialBounds::new(InertialLimits::default());
    for after in 0..2000 {
        let reading = train.run(driven(f64::from(after) * PERIOD_S));
        let silent = (1000..1100).contains(&after);
        let read = if silent { None } else { Some(reading) };
        filter.predict(period(), read);
        bounds.predict(period(), if silent { Some(Acceleration::from_m_per_s2(f64::NAN)) } else { read });
        if silent {
            assert_eq!(bounds.speed(), None);
        } else {
            filter.align(m_per_s(train.speed), m_per_s(0.1));
            assert!(bounds.hold(m_per_s(train.speed - 0.3), m_per_s(train.speed + 0.3)));
        }
        if after == 1099 {
            // Five seconds of anything up to hard braking.
            assert!((4.0..6.0).contains(&filter.speed_deviation().as_m_per_s()));
        }
    }
    assert!((filter.speed().as_m_per_s() - train.speed).abs() < 0.1);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]
    /// The speed stays within its bounds while bias and gradients keep theirs, and the bounds of the bias contain it.
    #[test]
    fn the_bounds_hold(
        seed in 0..1_000_000_u64,
        bias in -0.5..0.5_f64,
        gravity in 0.0..0.04_f64,
        wheels_off in 0.0..0.5_f64,
    ) {
        let mut train = Train::new(seed, gravity);
        train.bias = bias;
        let mut bounds = InertialBounds::new(InertialLimits::default());
        for after in 0..4200 {
            let time = f64::from(after) * PERIOD_S;
            bounds.predict(period(), Some(train.run(driven(time))));
            if time < 150.0 {
                let (below, above) = (wheels_off * train.draw.share(), wheels_off * train.draw.share());
                prop_assert!(bounds.hold(m_per_s(train.speed - below), m_per_s(train.speed + above)));
            }
            let [low, high] = bounds.speed().unwrap_or([m_per_s(f64::NEG_INFINITY), m_per_s(f64::INFINITY)]);
            prop_assert!(low.as_m_per_s() <= train.speed && train.speed <= high.as_m_per_s(), "{low:?} {high:?} {time}");
            let [least, most] = bounds.bias().map(Acceleration::as_m_per_s2);
            prop_assert!(least <= bias && bias <= most, "{least} to {most}, is {bias}");
        }
        // A minute with at most 0.62 m/s² in either direction, where 2.6 m/s² are what the train can do.
        let [low, high] = bounds.speed().unwrap();
        prop_assert!((high - low).as_m_per_s() < 2.0 * (0.62 * 60.0 + 0.9 + 0.5));
    }

    /// No readings, however long, break the filter.
    #[test]
    fn no_reading_breaks_the_filter(
        readings in prop::collection::vec(
            (-1.0..4000.0_f64, prop::option::of(prop_oneof![-1e3..1e3_f64, Just(f64::NAN)]), 0..3usize, -500.0..500.0_f64),
            1..200,
        ),
    ) {
        let mut filter = InertialFilter::new(InertialNoise::default());
        for (span, reading, then, wheels) in readings {
            filter.predict(TimeSpan::from_s(span), reading.map(Acceleration::from_m_per_s2));
            match then {
                0 => filter.align(m_per_s(wheels), m_per_s(0.1)),
                1 => filter.stand(),
                _ => {}
            }
            prop_assert!(filter.speed().is_finite() && filter.speed_deviation().as_m_per_s() >= 0.0);
            prop_assert!(filter.excess().iter().all(|excess| excess.is_finite()));
        }
    }
}

#[test]
fn contradictory_bounds_are_reported_and_restarted() {
    let mut bounds = InertialBounds::new(InertialLimits::default());
    assert!(bounds.hold(m_per_s(20.0), m_per_s(20.5)));
    for _ in 0..100 {
        bounds.predict(period(), Some(Acceleration::ZERO));
    }
    assert!(!bounds.hold(m_per_s(12.0), m_per_s(12.5)), "5 s cannot explain 8 m/s");
    let [low, high] = bounds.speed().unwrap().map(Speed::as_m_per_s);
    assert!(low < 12.0 && 12.5 < high && high - low < 2.4, "{low} to {high}");
}

/// The readings in a shaking car, and whether it was at rest at the end of each block.
fn shaken(train: &mut Train, acceleration: f64, readings: u32) -> Vec<(AccelerationBlock, bool)> {
    let mut average = BlockAverage::default();
    let mut blocks = Vec::new();
    for _ in 0..readings {
        let along = train.run(acceleration);
        let shakes = if train.speed > 0.0 { 0.1 + 0.01 * train.speed } else { 0.01 };
        let across = [0, 1].map(|_| Acceleration::from_m_per_s2(shakes * train.draw.normal()));
        let [first, second] = across;
        let along = along + Acceleration::from_m_per_s2(shakes * train.draw.normal());
        let block = average.take(Timestamp::from_s(train.time), [along, first, second], along);
        blocks.extend(block.map(|block| (block, train.speed == 0.0)));
    }
    blocks
}

#[test]
fn a_low_frequency_accelerometer_detects_stops_and_trips() {
    let mut train = Train::new(7, 0.02);
    train.noise = 0.01;
    train.bias = 0.05;
    let mut detector = StandstillDetector::new(DriftLimits::steady());
    let mut recorder = TripRecorder::new(DriftLimits::steady());
    let mut trips = Vec::new();
    let mut truths = Vec::new();
    let (mut right, mut asked) = (0.0, 0.0);
    for _ in 0..6 {
        let from = train.place;
        let left = train.time + 20.0;
        for (acceleration, seconds) in [(0.0, 20.0), (0.9, 15.0), (-0.03, 25.0), (-0.9, 20.0), (0.0, 10.0)] {
            for (block, truly) in shaken(&mut train, acceleration, (seconds / PERIOD_S) as u32) {
                let is_at_rest = matches!(detector.take(block), Standing::Since(_));
                trips.extend(recorder.take(block));
                asked += 1.0;
                right += f64::from(u8::from(is_at_rest == truly));
            }
        }
        truths.push((left, train.place - from));
    }
    assert_eq!(trips.len(), 6);
    for (trip, (left, length)) in trips.iter().zip(&truths) {
        assert!((trip.departure.as_s() - left).abs() < 0.5);
        let off = (trip.length - Length::from_m(*length)).as_m();
        // The gradients of 2 to 6 mm/m that differ from stop to stop remain.
        assert!(off.abs() < 0.12 * length, "{off} m of {length}");
    }
    assert!(right / asked > 0.95, "{}", right / asked);
}
