//! A stop in whole numbers decides as the one in floating point does, in a million drawn situations and at the ends of all ranges.

#![expect(clippy::expect_used, reason = "the laws of a test are laws")]

use footplate_core::kinematics::{Braking, FromCommand, IntegerStop, IntegerStopError, Motion, StoppingLaw};
use footplate_core::{Acceleration, Length, Speed, TimeSpan};
use proptest::prelude::*;

use crate::draw::Draw;

/// Situations a test of each kind of braking and tick: four of them make a million.
const SITUATIONS: u32 = 250_000;

/// A law that a model train or a full-size one may have.
fn drawn_law(draw: &mut Draw, is_even: bool) -> StoppingLaw<FromCommand> {
    let braking = if is_even {
        Braking::Constant(Acceleration::from_m_per_s2(draw.within(0.05, 3.0)))
    } else {
        Braking::Exponential(TimeSpan::from_s(draw.within(0.05, 2.0)))
    };
    StoppingLaw::new(TimeSpan::from_s(draw.within(0.0, 1.0)), braking).expect("a law")
}

fn units(length: Length) -> f64 {
    length.as_m() / IntegerStop::UNIT.as_m()
}

/// The largest differences from floating point: lengths in units; times in ticks, or, where a train covers less than a unit
/// in one, as the length that it runs in that time.
fn largest_differences(is_even: bool, tick: TimeSpan, seed: u64) -> [f64; 2] {
    let mut draw = Draw::new(seed);
    let mut worst = [0.0_f64; 2];
    for _ in 0..SITUATIONS {
        let speed = Speed::from_m_per_s(draw.within(0.01, 2.0));
        let law = drawn_law(&mut draw, is_even);
        let stop = IntegerStop::new(speed, &law, tick).expect("usual numbers");
        let ticks = |seconds: f64| seconds / tick.as_s();
        let lengths = |found: i32, wanted: Length| (f64::from(found) - units(wanted)).abs();
        let times = |found: i64, wanted: f64| (found as f64 - wanted).abs();

        let distance = law.distance(speed).length();
        worst[0] = worst[0].max(lengths(stop.stopping_distance(), distance));
        worst[1] = worst[1].max(times(stop.stopping_time(), ticks(law.time(speed).as_s())));

        // A target up to 20 m ahead or 2 m behind, in whole units as a controller has it.
        let target = draw.within(-20_000.0, 200_000.0) as i32;
        let ahead = f64::from(target) * IntegerStop::UNIT;
        let seconds = (ahead - distance).as_m() / speed.as_m_per_s();
        worst[1] = worst[1].max(times(stop.command_in(target), ticks(seconds)));
        worst[1] = worst[1].max(times(stop.ticks_to(target), ticks(ahead.as_m() / speed.as_m_per_s())));
        worst[0] = worst[0].max(lengths(stop.overrun(target), distance - ahead));

        // Somewhere on the way to rest and a little beyond.
        let since = draw.within(-0.1, 1.2) * ticks(law.time(speed).as_s());
        let since = since as i64;
        let time = since as f64 * tick.as_s();
        let braking = (time - law.delay().as_s()).min(if is_even {
            law.change_from(speed).duration().as_s()
        } else {
            f64::INFINITY
        });
        let run = speed.as_m_per_s() * time.min(law.delay().as_s());
        let braked = law.change_from(speed).state_at(TimeSpan::from_s(braking.max(0.0))).distance;
        worst[0] = worst[0].max(lengths(stop.run_since_command(since), Length::from_m(run) + braked));
        worst[0] = worst[0].max(lengths(stop.run(since), Length::from_m(speed.as_m_per_s() * time)));
    }
    worst
}

fn decides_alike(is_even: bool, tick: TimeSpan, seed: u64) {
    let [lengths, times] = largest_differences(is_even, tick, seed);
    println!("largest differences: {lengths:.4} units of 0.1 mm, {times:.4} ticks");
    // Rounding to whole units alone is half a unit.
    assert!(lengths < 0.6, "{lengths} units");
    assert!(times < 0.6, "{times} ticks");
}

#[test]
fn even_braking_in_microseconds() {
    decides_alike(true, TimeSpan::from_ns(1_000), 20_261_123);
}

#[test]
fn even_braking_in_hundredths_of_a_second() {
    decides_alike(true, TimeSpan::from_ms(10), 20_261_124);
}

#[test]
fn exponential_braking_in_microseconds() {
    decides_alike(false, TimeSpan::from_ns(1_000), 20_261_125);
}

#[test]
fn exponential_braking_in_hundredths_of_a_second() {
    decides_alike(false, TimeSpan::from_ms(10), 20_261_126);
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
}

#[test]
fn what_whole_numbers_cannot_hold_is_refused() {
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
    for deceleration in [1e-12, 1e12] {
        assert!(matches!(made(50.0, deceleration, tick), Err(IntegerStopError::Stop { .. })));
    }
}

proptest! {
    #[test]
    fn no_question_panics_and_more_time_is_more_distance(
        speed in 0.001..20.0_f64,
        delay in 0.0..5.0_f64,
        rate in 0.01..10.0_f64,
        is_even: bool,
        tick in prop_oneof![Just(1_000_i64), Just(10_000_000)],
        ticks in any::<i64>(),
        distance in any::<i32>(),
    ) {
        let braking = if is_even {
            Braking::Constant(Acceleration::from_m_per_s2(rate))
        } else {
            Braking::Exponential(TimeSpan::from_s(rate))
        };
        let law = StoppingLaw::new(TimeSpan::from_s(delay), braking).expect("a law");
        let stop = IntegerStop::new(Speed::from_m_per_s(speed), &law, TimeSpan::from_ns(tick));
        if let Ok(stop) = stop {
            prop_assert!(stop.run(ticks) <= stop.run(ticks.saturating_add(1_000)));
            prop_assert!(stop.run_since_command(ticks) <= stop.run_since_command(ticks.saturating_add(1_000)));
            prop_assert!(stop.run_since_command(ticks) <= stop.stopping_distance() || ticks < 0);
            prop_assert!(stop.command_in(distance) <= stop.ticks_to(distance));
            let _ = stop.overrun(distance);
        }
    }
}
