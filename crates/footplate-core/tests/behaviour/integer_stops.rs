//! A stop in integers gives the results of floating point: in a million random situations, and at the ends of all
//! ranges.
#![expect(clippy::expect_used, reason = "drawn situations are within all ranges")]

use footplate_core::kinematics::{
    Braking, FromCommand, IntegerStop, IntegerStopError, Lag, Motion, RampedLag, StoppingLaw,
    UnusableConstants,
};
use footplate_core::{Acceleration, Speed, TimeSpan};
use proptest::prelude::*;

use crate::draw::Draw;

/// Situations of each kind of stop and tick: twelve of them make a million.
const SITUATIONS: u32 = 1_000_000 / 12 + 1;
/// Rounding to whole units or ticks alone is half of one.
const MOST: f64 = 0.51;

/// A stop in floating point.
#[derive(Debug, Clone, Copy)]
enum Stop {
    Law(StoppingLaw<FromCommand>),
    Shape { delay: TimeSpan, shape: RampedLag },
}

/// A random stop of a model train or a full-size one.
type Drawn = fn(&mut Draw) -> Stop;

fn even(draw: &mut Draw) -> Stop {
    let deceleration = Acceleration::from_m_per_s2(draw.magnitude(0.02, 5.0));
    Stop::Law(StoppingLaw::new(delay(draw), Braking::Constant(deceleration)).expect("a law"))
}

fn exponential(draw: &mut Draw) -> Stop {
    let time_constant = TimeSpan::from_s(draw.magnitude(0.02, 10.0));
    Stop::Law(StoppingLaw::new(delay(draw), Braking::Exponential(time_constant)).expect("a law"))
}

fn ramp_with_lag(draw: &mut Draw) -> Stop {
    let shape = RampedLag::new(draw.magnitude(1e-3, 60.0), draw.magnitude(1e-4, 10.0));
    Stop::Shape { delay: delay(draw), shape }
}

fn delay(draw: &mut Draw) -> TimeSpan {
    if draw.one_in(5) { TimeSpan::ZERO } else { TimeSpan::from_s(draw.magnitude(0.01, 5.0)) }
}

impl Stop {
    fn in_integers(&self, speed: Speed, tick: TimeSpan) -> Result<IntegerStop, IntegerStopError> {
        match self {
            Self::Law(law) => IntegerStop::new(speed, law, tick),
            Self::Shape { delay, shape } => IntegerStop::with_shape(speed, *delay, shape, tick),
        }
    }

    /// In m, and in s.
    fn distance_and_time(&self, speed: Speed) -> (f64, f64) {
        match self {
            Self::Law(law) => (law.distance(speed).length().as_m(), law.time(speed).as_s()),
            Self::Shape { delay, shape } => {
                let left = Lag::SETTLED_WITHIN.as_m_per_s() / speed.as_m_per_s();
                let distance = speed.as_m_per_s() * (delay.as_s() + shape.delay());
                (distance, delay.as_s() + shape.settled(left))
            }
        }
    }

    /// The distance run (m) at a time (s) after the command.
    fn run(&self, speed: Speed, time: f64) -> f64 {
        let delay = match self {
            Self::Law(law) => law.delay().as_s(),
            Self::Shape { delay, .. } => delay.as_s(),
        };
        let braking = (time - delay).max(0.0);
        let braked = match self {
            Self::Law(law) => {
                let state = law.change_from(speed).state_at(TimeSpan::from_s(braking));
                state.distance.as_m()
            }
            Self::Shape { shape, .. } => speed.as_m_per_s() * (braking - shape.area(braking)),
        };
        speed.as_m_per_s() * time.min(delay) + braked
    }
}

/// The largest differences from floating point so far, in units of 0.1 mm and in ticks.
#[derive(Debug, Default)]
struct Worst {
    units: f64,
    ticks: f64,
}

impl Worst {
    fn length(&mut self, found: i32, metres: f64) {
        self.units = self.units.max((f64::from(found) - metres / IntegerStop::UNIT.as_m()).abs());
    }

    fn time(&mut self, found: i64, seconds: f64, tick: TimeSpan) {
        self.ticks = self.ticks.max((found as f64 - seconds / tick.as_s()).abs());
    }
}

fn agrees_with_floating_point(drawn: Drawn, tick: TimeSpan, seed: u64) {
    let mut draw = Draw::new(seed);
    let mut worst = Worst::default();
    let mut count = 0;
    while count < SITUATIONS {
        // From a slow model to 80 m/s, for stops that lengths of 32 bits can hold.
        let speed = Speed::from_m_per_s(draw.magnitude(0.002, 80.0));
        let stop = drawn(&mut draw);
        let (distance, time) = stop.distance_and_time(speed);
        if distance > 100_000.0 || time > 1_200.0 {
            continue;
        }
        count += 1;
        let whole = stop.in_integers(speed, tick).expect("a stop within all ranges");
        worst.length(whole.stopping_distance(), distance);
        worst.time(whole.stopping_time(), time, tick);

        // A target near the end of the stop, or up to 20 km away, in whole units as a controller has it.
        let away =
            if draw.one_in(2) { draw.within(0.8, 1.2) * distance } else { draw.magnitude(1e-3, 20_000.0) };
        let target = (away / IntegerStop::UNIT.as_m()) as i32 * if draw.one_in(10) { -1 } else { 1 };
        let ahead = (f64::from(target) * IntegerStop::UNIT).as_m();
        let command = (ahead - distance) / speed.as_m_per_s();
        worst.time(whole.command_in(target), command, tick);
        worst.time(whole.ticks_to(target), ahead / speed.as_m_per_s(), tick);
        worst.length(whole.overrun(target), distance - ahead);

        // From before the command to beyond rest.
        let since = (draw.within(-0.1, 1.2) * time / tick.as_s()) as i64;
        let seconds = since as f64 * tick.as_s();
        worst.length(whole.run_since_command(since), stop.run(speed, seconds));
        worst.length(whole.run(since), speed.as_m_per_s() * seconds);
    }
    println!("largest differences: {:.4} units of 0.1 mm, {:.4} ticks", worst.units, worst.ticks);
    assert!(worst.units < MOST && worst.ticks < MOST, "{worst:?}");
}

/// In ticks of 1 µs, 100 µs, 1 ms and 10 ms.
fn in_all_ticks(drawn: Drawn, seed: u64) {
    for (nth, us) in (0..).zip([1, 100, 1_000, 10_000]) {
        agrees_with_floating_point(drawn, TimeSpan::from_us(us), seed + nth);
    }
}

#[test]
fn constant_braking_agrees() {
    in_all_ticks(even, 20_261_123);
}

#[test]
fn exponential_braking_agrees() {
    in_all_ticks(exponential, 20_261_223);
}

#[test]
fn a_ramp_with_a_lag_agrees() {
    in_all_ticks(ramp_with_lag, 20_261_323);
}

#[test]
fn a_stop_by_hand_arithmetic() {
    // 500 mm/s, 0.2 s, then 250 mm/s²: 100 + 500 mm in 2.2 s.
    let law =
        StoppingLaw::new(TimeSpan::from_ms(200), Braking::Constant(Acceleration::from_mm_per_s2(250.0)));
    let stop = IntegerStop::new(Speed::from_mm_per_s(500.0), &law.expect("a law"), TimeSpan::from_ms(10))
        .expect("usual numbers");
    assert_eq!((stop.stopping_distance(), stop.stopping_time()), (6_000, 220));
    assert_eq!(stop.command_in(11_000), 100, "half a metre at half a metre a second");
    assert_eq!(stop.command_in(5_000), -20, "late by 0.2 s");
    assert_eq!(stop.overrun(5_000), 1_000);
    assert_eq!([20, 120, 220, 400].map(|tick| stop.run_since_command(tick)), [1_000, 4_750, 6_000, 6_000]);
    assert_eq!(IntegerStop::from_constants(stop.constants()), Ok(stop));
}

#[test]
fn values_beyond_the_integer_range_are_rejected() {
    let law = |deceleration: f64| {
        let braking = Braking::Constant(Acceleration::from_m_per_s2(deceleration));
        StoppingLaw::<FromCommand>::new(TimeSpan::ZERO, braking).expect("a law")
    };
    let made = |speed: f64, deceleration: f64, tick| {
        IntegerStop::new(Speed::from_m_per_s(speed), &law(deceleration), tick)
    };
    let tick = TimeSpan::from_ms(10);
    assert!(matches!(made(0.5, 0.3, TimeSpan::ZERO), Err(IntegerStopError::Tick { .. })));
    for speed in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e9] {
        assert!(matches!(made(speed, 0.3, tick), Err(IntegerStopError::Speed { .. })), "{speed}");
    }
    assert!(matches!(made(50.0, 1e-12, tick), Err(IntegerStopError::Stop { .. })));
    let shape = RampedLag::new(1.0, 0.5);
    let early = IntegerStop::with_shape(Speed::from_m_per_s(0.5), TimeSpan::from_ms(-1), &shape, tick);
    assert!(matches!(early, Err(IntegerStopError::Stop { .. })));
    // Too many ticks of 1 ns; with ticks of 2 ns, half of the stop is as exact as with any other tick.
    assert!(matches!(made(0.544, 0.16, TimeSpan::from_ns(1)), Err(IntegerStopError::Stop { .. })));
    let stop = made(0.544, 0.16, TimeSpan::from_ns(2)).expect("a stop of 3.4 s");
    assert_eq!(stop.run_since_command(850_000_000), 6_936, "924.8 mm less 231.2 mm");
    // All nine constants are needed, in order.
    let [speed, point, delay, rest @ ..] = stop.constants();
    let [ramp, lag, tail, rate, rate_point, time] = rest;
    let shuffled = [speed, point, ramp, delay, lag, tail, rate_point, rate, time];
    assert_eq!(IntegerStop::from_constants(shuffled), Err(UnusableConstants));
    assert_eq!(IntegerStop::from_constants([0; 9]), Err(UnusableConstants));
}

proptest! {
    #![proptest_config(ProptestConfig { max_global_rejects: 40_000, ..ProptestConfig::with_cases(2_000) })]

    #[test]
    fn no_query_panics_and_the_distance_grows_with_time(
        speed in 0.001..20.0_f64,
        delay in 0.0..5.0_f64,
        ramp in 0.0..10.0_f64,
        lag in 0.0..10.0_f64,
        tick in prop_oneof![Just(1_000_i64), Just(10_000_000)],
        ticks in prop_oneof![any::<i64>(), 0..20_000_000_i64, Just(i64::MIN), Just(i64::MAX)],
        distance in prop_oneof![any::<i32>(), Just(i32::MIN), Just(i32::MAX)],
    ) {
        let (delay, tick) = (TimeSpan::from_s(delay), TimeSpan::from_ns(tick));
        let speed = Speed::from_m_per_s(speed);
        let stop = IntegerStop::with_shape(speed, delay, &RampedLag::new(ramp, lag), tick).expect("a stop");
        let later = ticks.saturating_add(1_000);
        prop_assert!(stop.run(ticks) <= stop.run(later));
        prop_assert!(stop.run_since_command(ticks) <= stop.run_since_command(later));
        prop_assert!(stop.run_since_command(ticks) <= stop.stopping_distance());
        prop_assert!(stop.command_in(distance) <= stop.ticks_to(distance));
        prop_assert_eq!(stop.overrun(distance) > 0, distance < stop.stopping_distance());
    }

    /// Constants are read from a cable or from worn memory.
    #[test]
    fn accepted_constants_answer_every_query(
        digits in [1_i64 << 52..1 << 53, 1_i64 << 52..1 << 53],
        points in (38..75_i64, 25..103_i64),
        times in any::<[i64; 5]>(),
        shifts in [1..63_u32, 1..63_u32, 1..63_u32, 1..63_u32, 0..3_u32],
        ticks in prop_oneof![any::<i64>(), 0..1_i64 << 34],
        distance: i32,
    ) {
        let [delay, ramp, lag, tail, time] = core::array::from_fn(|at| (times[at] & i64::MAX) >> shifts[at]);
        let constants = [digits[0], points.0, delay, ramp, lag, tail, digits[1], points.1, time];
        let stop = IntegerStop::from_constants(constants);
        prop_assume!(stop.is_ok());
        let stop = stop.expect("assumed");
        prop_assert_eq!(stop.constants(), constants);
        prop_assert!(stop.run_since_command(ticks) <= stop.stopping_distance());
        prop_assert!(stop.command_in(distance) <= stop.ticks_to(distance));
        let _ = (stop.run(ticks), stop.overrun(distance), stop.stopping_time());
    }

    #[test]
    fn any_constants_are_rejected_or_answer(
        nine in any::<[i64; 9]>(),
        ticks: i64,
        distance: i32,
    ) {
        if let Ok(stop) = IntegerStop::from_constants(nine) {
            let _ = (stop.run_since_command(ticks), stop.command_in(distance));
        }
    }
}
