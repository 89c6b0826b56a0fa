//! Profiles have the shape that follows from their limits, keep the limits, and are optimal from any of their points.

#![expect(clippy::panic, reason = "a refusal where none was expected ends a test, with all its numbers")]

use footplate_core::kinematics::{
    Limits, Motion, MotionState, ProfileError, Running, SCurve, Stretch, Trapezoid,
};
use footplate_core::{Acceleration, Jerk, Length, Speed, TimeSpan};
use proptest::prelude::*;

use Running::{Accelerating, Cruising, Decelerating};

use crate::draw::Draw;
use crate::motion_checks::{assert_integrals_agree, assert_inverse_leads_back, assert_no_step, grain};

fn limits(speed: f64, acceleration: f64, deceleration: f64, jerk: f64) -> Limits {
    Limits {
        speed: Speed::from_m_per_s(speed),
        acceleration: Acceleration::from_m_per_s2(acceleration),
        deceleration: Acceleration::from_m_per_s2(deceleration),
        jerk: Jerk::from_m_per_s3(jerk),
    }
}

fn state(distance: f64, speed: f64, acceleration: f64) -> MotionState {
    MotionState {
        distance: Length::from_m(distance),
        speed: Speed::from_m_per_s(speed),
        acceleration: Acceleration::from_m_per_s2(acceleration),
    }
}

fn at_rest(distance: f64) -> MotionState {
    state(distance, 0.0, 0.0)
}

fn shape(stretches: impl Iterator<Item = Stretch>) -> Vec<Running> {
    stretches.map(|stretch| stretch.running).collect()
}

/// Ends of all stretches in milliseconds.
fn ends(stretches: impl Iterator<Item = Stretch>) -> Vec<f64> {
    stretches.map(|stretch| stretch.end.as_ms()).collect()
}

// ---- shape ---------------------------------------------------------------------------------------------------

#[test]
fn a_long_run_cruises_and_a_short_one_does_not() {
    let (from, to, limits) = (at_rest(10.0), at_rest(110.0), limits(10.0, 1.0, 2.0, 1.0));
    let (even, curved) =
        (Trapezoid::between(from, to, limits).unwrap(), SCurve::between(from, to, limits).unwrap());
    assert_eq!(shape(even.stretches()), [Accelerating, Cruising, Decelerating]);
    assert_eq!(shape(curved.stretches()), [Accelerating, Cruising, Decelerating]);
    let to = at_rest(15.0);
    assert_eq!(
        shape(Trapezoid::between(from, to, limits).unwrap().stretches()),
        [Accelerating, Decelerating]
    );
    assert_eq!(shape(SCurve::between(from, to, limits).unwrap().stretches()), [Accelerating, Decelerating]);
}

#[test]
fn a_train_above_the_limit_slows_down_to_it_first() {
    let (from, to, limits) = (state(0.0, 15.0, 0.5), at_rest(500.0), limits(10.0, 1.0, 1.0, 0.5));
    let even = Trapezoid::between(from, to, limits).unwrap();
    assert_eq!(shape(even.stretches()), [Decelerating, Cruising, Decelerating]);
    let curved = SCurve::between(from, to, limits).unwrap();
    assert_eq!(
        shape(curved.stretches()),
        [Accelerating, Decelerating, Cruising, Decelerating],
        "it still speeds up"
    );
}

#[test]
fn a_braking_train_eases_off_only_as_far_as_the_distance_allows() {
    let limits = limits(20.0, 1.0, 1.0, 0.5);
    let from = state(0.0, 10.0, -0.6);
    let far = SCurve::between(from, at_rest(200.0), limits).unwrap();
    assert_eq!(shape(far.stretches()), [Decelerating, Accelerating, Decelerating]);
    let shortest = match SCurve::between(from, at_rest(1.0), limits) {
        Err(ProfileError::TooNear { shortest, .. }) => shortest.as_m(),
        other => panic!("{other:?}"),
    };
    let near = SCurve::between(from, at_rest(shortest + 1.0), limits).unwrap();
    assert_eq!(shape(near.stretches()), [Decelerating]);
    let largest = (0..100).map(|ms| near.state_at(TimeSpan::from_ms(20 * ms)).acceleration.as_m_per_s2());
    let eased = largest.fold(f64::NEG_INFINITY, f64::max);
    assert!((-0.59..-0.01).contains(&eased), "eases off to {eased} m/s²");
}

#[test]
fn a_train_that_arrives_with_a_speed_keeps_it() {
    let limits = limits(10.0, 1.0, 1.0, 0.5);
    let to = MotionState::cruising(Length::from_m(300.0), Speed::from_m_per_s(4.0));
    let profile = SCurve::between(at_rest(0.0), to, limits).unwrap();
    let later = profile.state_at(profile.duration() + TimeSpan::from_s(2.5));
    assert!((later.distance.as_m() - 310.0).abs() < 1e-8 && later.speed == to.speed);
    let at = profile.time_at(Length::from_m(310.0)).unwrap();
    assert!((at - profile.duration() - TimeSpan::from_s(2.5)).abs() <= TimeSpan::from_ns(1));
}

// ---- where it changes ----------------------------------------------------------------------------------------

#[test]
fn a_trapezoid_changes_where_the_textbook_says() {
    // 10 m/s at 1 m/s² takes 10 s and 50 m, at 2 m/s² 5 s and 25 m; 25 m are left to cruise.
    let profile = Trapezoid::between(at_rest(10.0), at_rest(110.0), limits(10.0, 1.0, 2.0, 1.0)).unwrap();
    assert_eq!(ends(profile.stretches()), [10_000.0, 12_500.0, 17_500.0]);
    assert_eq!((profile.duration(), profile.distance()), (TimeSpan::from_ms(17_500), Length::from_m(100.0)));
    assert_eq!(profile.state_at(TimeSpan::from_s(10.0)), state(60.0, 10.0, 0.0));
    let braking = profile.state_at(TimeSpan::from_s(15.0));
    assert!(
        (braking.distance.as_m() - 103.75).abs() < 1e-13 && (braking.speed.as_m_per_s() - 5.0).abs() < 1e-14
    );
    assert_eq!(braking.acceleration, Acceleration::from_m_per_s2(-2.0));
    assert_eq!(profile.time_at(Length::from_m(60.0)), Some(TimeSpan::from_s(10.0)));
    assert_eq!(profile.time_at(Length::from_m(109.0)), Some(TimeSpan::from_s(16.5)));
    assert_eq!(profile.time_at(Length::from_m(110.1)), None);
    assert_eq!(profile.time_at(Length::from_m(9.9)), None);
}

#[test]
fn an_s_curve_changes_where_its_seven_phases_do() {
    // J 1, a 2, v 10: 2 s build-up, 3 s hold, 2 s fade: 7 s and 35 m; 30 m are left to cruise.
    let profile = SCurve::between(at_rest(0.0), at_rest(100.0), limits(10.0, 2.0, 2.0, 1.0)).unwrap();
    assert_eq!(ends(profile.stretches()), [7_000.0, 10_000.0, 17_000.0]);
    let expected = [
        (1.0, state(1.0 / 6.0, 0.5, 1.0)),
        (2.0, state(4.0 / 3.0, 2.0, 2.0)),
        (5.0, state(4.0 / 3.0 + 6.0 + 9.0, 8.0, 2.0)),
        (6.0, state(35.0 - 10.0 + 1.0 / 6.0, 9.5, 1.0)),
        (8.5, state(50.0, 10.0, 0.0)),
        (11.0, state(75.0 - 1.0 / 6.0, 9.5, -1.0)),
        (15.0, state(100.0 - 4.0 / 3.0, 2.0, -2.0)),
        (17.0, state(100.0, 0.0, 0.0)),
        (99.0, state(100.0, 0.0, 0.0)),
    ];
    for (seconds, expected) in expected {
        let found = profile.state_at(TimeSpan::from_s(seconds));
        assert!((found.distance - expected.distance).abs().as_m() < 1e-13, "{found:?} at {seconds} s");
        assert!((found.speed - expected.speed).abs().as_m_per_s() < 1e-14, "{found:?} at {seconds} s");
        assert!(
            (found.acceleration - expected.acceleration).abs().as_m_per_s2() < 1e-14,
            "{found:?} at {seconds} s"
        );
    }
}

#[test]
fn the_shortest_runs_build_up_and_fade_only() {
    // 2 J t³ = 16 m: four phases of 2 s, 4 m/s at the peak.
    let profile = SCurve::between(at_rest(0.0), at_rest(16.0), limits(10.0, 3.0, 2.5, 1.0)).unwrap();
    assert_eq!(profile.duration(), TimeSpan::from_s(8.0));
    let peak = profile.state_at(TimeSpan::from_s(4.0));
    assert!((peak.speed.as_m_per_s() - 4.0).abs() < 1e-14 && (peak.distance.as_m() - 8.0).abs() < 1e-14);
}

#[test]
fn a_profile_towards_smaller_distances_is_the_mirror_image() {
    let limits = limits(10.0, 1.0, 2.0, 1.0);
    let ahead = SCurve::between(state(0.0, 3.0, 0.2), state(80.0, 2.0, 0.0), limits).unwrap();
    let back = SCurve::between(state(0.0, -3.0, -0.2), state(-80.0, -2.0, 0.0), limits).unwrap();
    for ms in (0..20_000).step_by(500) {
        let (at, then) = (ahead.state_at(TimeSpan::from_ms(ms)), back.state_at(TimeSpan::from_ms(ms)));
        assert_eq!(
            (at.distance, at.speed, at.acceleration),
            (-then.distance, -then.speed, -then.acceleration)
        );
        assert_eq!(ahead.time_at(at.distance), back.time_at(then.distance));
    }
}

#[test]
fn a_change_of_speed_has_its_exact_distance() {
    // From 1 to 10 m/s with J 1 and a 2: 2 s, 2.5 s, 2 s at a mean of 5.5 m/s.
    let limits = limits(12.0, 2.0, 1.0, 1.0);
    let profile = SCurve::to_speed(state(5.0, 1.0, 0.0), Speed::from_m_per_s(10.0), limits).unwrap();
    assert_eq!(profile.duration(), TimeSpan::from_s(6.5));
    assert!((profile.distance().as_m() - 35.75).abs() < 1e-13);
    // From 10 m/s at a 1 m/s² to standstill: it comes to 10.5 m/s first.
    let stop = SCurve::to_speed(state(5.0, 10.0, 1.0), Speed::ZERO, limits).unwrap();
    assert_eq!(shape(stop.stretches()), [Accelerating, Decelerating]);
    let same_by_distance =
        SCurve::between(state(5.0, 10.0, 1.0), at_rest(5.0 + stop.distance().as_m()), limits).unwrap();
    assert!((stop.duration() - same_by_distance.duration()).abs() < TimeSpan::from_us(1));
}

#[test]
fn playback_gives_the_same_states() {
    let profile =
        SCurve::between(state(0.0, 3.0, -0.3), at_rest(200.0), limits(10.0, 1.0, 2.0, 0.7)).unwrap();
    let period = TimeSpan::from_ms(50);
    for (at, played) in (0..).zip(profile.playback(period).take(1000)) {
        assert_eq!(played, profile.state_at(TimeSpan::from_ms(50 * at)));
    }
}

// ---- impossible profiles --------------------------------------------------------------------------------------

#[test]
fn impossible_profiles_are_rejected_with_possible_values() {
    let wide = limits(10.0, 1.0, 2.0, 1.0);
    let refusal = |from, to, limits| SCurve::between(from, to, limits).unwrap_err();
    let even = Trapezoid::between(state(0.0, 10.0, 0.0), at_rest(20.0), wide).unwrap_err();
    assert_eq!(even.to_string(), "the target is 20 m ahead, and it takes 25 m to get to its speed");
    // With J 1: 2 s build-up, 3 s hold, 2 s fade at a mean of 5 m/s.
    let near = refusal(state(0.0, 10.0, 0.0), at_rest(20.0), wide);
    assert_eq!(near.to_string(), "the target is 20 m ahead, and it takes 35 m to get to its speed");
    let fast = refusal(at_rest(0.0), state(50.0, 11.0, 0.0), wide);
    assert!(matches!(fast, ProfileError::TargetSpeed { .. }));
    assert!(matches!(refusal(state(0.0, -1.0, 0.0), at_rest(5.0), wide), ProfileError::MovesAway { .. }));
    assert!(matches!(refusal(state(0.0, 5.0, 1.5), at_rest(50.0), wide), ProfileError::BeyondLimits { .. }));
    assert!(matches!(refusal(state(0.0, 0.5, -1.5), at_rest(50.0), wide), ProfileError::AtRestFirst { .. }));
    assert!(matches!(
        refusal(at_rest(0.0), state(5.0, 0.0, 0.1), wide),
        ProfileError::TargetAcceleration { .. }
    ));
    assert!(matches!(refusal(at_rest(0.0), at_rest(f64::NAN), wide), ProfileError::NotFinite { .. }));
    let none = refusal(at_rest(0.0), at_rest(5.0), limits(10.0, 1.0, 2.0, 0.0));
    assert_eq!(none.to_string(), "the limit of jerk should be a number above zero, not 0");
}

// ---- random cases --------------------------------------------------------------------------------------------

fn random_limits(draw: &mut Draw) -> Limits {
    let deceleration = draw.magnitude(0.02, 3.0);
    let acceleration = if draw.one_in(3) { deceleration } else { draw.magnitude(0.02, 3.0) };
    limits(draw.magnitude(0.02, 100.0), acceleration, deceleration, draw.magnitude(0.02, 10.0))
}

/// From a position and a speed to another; some of them at rest, some above the limit, some accelerating.
fn random_ends(draw: &mut Draw, limits: &Limits) -> (MotionState, MotionState) {
    let highest = limits.speed.as_m_per_s();
    let speed = if draw.one_in(3) { 0.0 } else { draw.within(0.0, 1.2 * highest) };
    let span = draw.within(-limits.deceleration.as_m_per_s2(), limits.acceleration.as_m_per_s2());
    let acceleration = if speed == 0.0 || draw.one_in(3) { 0.0 } else { span };
    let origin = if draw.one_in(2) { 0.0 } else { draw.within(-1e4, 1e4) };
    let target_speed = if draw.one_in(2) { 0.0 } else { draw.within(0.0, highest) };
    (state(origin, speed, acceleration), state(origin + draw.magnitude(1e-3, 1e4), target_speed, 0.0))
}

/// The profile to the target, or to one as far as the error requires, or a little farther.
fn feasible<P>(
    draw: &mut Draw,
    (from, to): (MotionState, MotionState),
    between: impl Fn(MotionState, MotionState) -> Result<P, ProfileError>,
) -> Option<(P, MotionState)> {
    match between(from, to) {
        Ok(profile) => Some((profile, to)),
        Err(ProfileError::TooNear { shortest, .. }) => {
            let farther = if draw.one_in(4) { 1.0 } else { 1.0 + draw.magnitude(1e-6, 1.0) };
            let to = MotionState { distance: from.distance + shortest * farther, ..to };
            match between(from, to) {
                Ok(profile) => Some((profile, to)),
                // The distances of the states cannot express so short a distance.
                Err(ProfileError::TooNear { .. }) if shortest * 1e-6 < from.distance.abs() * f64::EPSILON => {
                    None
                }
                Err(refused) => panic!("{refused} from {from:?} to {to:?}, as far as had been asked for"),
            }
        }
        Err(ProfileError::AtRestFirst { .. }) => None,
        Err(refused) => panic!("{refused} from {from:?} to {to:?}"),
    }
}

/// The speed that a train reaches if its acceleration fades at the jerk limit (m/s).
fn leveled_speed(state: MotionState, limits: &Limits) -> f64 {
    let acceleration = state.acceleration.as_m_per_s2();
    state.speed.as_m_per_s() + 0.5 * acceleration * acceleration.abs() / limits.jerk.as_m_per_s3()
}

/// Speed and acceleration are within the limits at a time, or approach them from a start beyond.
fn assert_limits_hold(profile: &impl Motion, time: TimeSpan, from: MotionState, limits: &Limits) {
    let now = profile.state_at(time);
    let highest = limits.speed.max(from.speed).as_m_per_s().max(leveled_speed(from, limits));
    let speed = now.speed.as_m_per_s();
    assert!(
        (-1e-12 * highest..=highest * (1.0 + 1e-12)).contains(&speed),
        "{speed} m/s at {time:?}, limit {highest}"
    );
    let rounding = 1.0 + 1e-9;
    assert!(now.acceleration <= limits.acceleration * rounding, "{now:?} at {time:?} with {limits:?}");
    assert!(now.acceleration >= -limits.deceleration * rounding, "{now:?} at {time:?} with {limits:?}");
}

fn assert_ends_where_it_should(profile: &impl Motion, from: MotionState, to: MotionState) {
    let (first, last) = (profile.state_at(TimeSpan::ZERO), profile.state_at(profile.duration()));
    let rounding = Length::from_m(grain(profile, from));
    // Half a nanosecond of rounding in the duration.
    let late = (from.speed.max(to.speed)) * TimeSpan::from_ns(2);
    assert!((first.distance - from.distance).abs() <= rounding, "starts at {first:?}, not {from:?}");
    assert!((last.distance - to.distance).abs() <= rounding + late, "ends at {last:?}, not {to:?}");
    assert!((first.speed - from.speed).abs().as_m_per_s() <= 1e-9, "starts at {first:?}, not {from:?}");
    assert!((last.speed - to.speed).abs().as_m_per_s() <= 1e-8, "ends at {last:?}, not {to:?}");
}

#[test]
fn two_hundred_thousand_random_trapezoids_hold() {
    let mut draw = Draw::new(11);
    for _ in 0..200_000 {
        let limits = random_limits(&mut draw);
        let ends = random_ends(&mut draw, &limits);
        let Some((profile, to)) = feasible(&mut draw, ends, |from, to| Trapezoid::between(from, to, limits))
        else {
            continue;
        };
        let from = MotionState { acceleration: Acceleration::ZERO, ..ends.0 };
        assert_ends_where_it_should(&profile, from, to);
        let time = draw.moment(profile.duration());
        assert_limits_hold(&profile, time, from, &limits);
        assert_inverse_leads_back(&profile, time);
        let stretches: Vec<Stretch> = profile.stretches().collect();
        for stretch in &stretches {
            assert_no_step(&profile, stretch.end);
            if stretch.end - stretch.start > TimeSpan::from_us(10) {
                let inset = TimeSpan::from_us(1);
                assert_integrals_agree(&profile, stretch.start + inset, stretch.end - inset, 1e-10);
            }
        }
    }
}

#[test]
fn three_hundred_thousand_random_s_curves_hold() {
    let mut draw = Draw::new(12);
    let mut eased_off = 0;
    for _ in 0..300_000 {
        let limits = random_limits(&mut draw);
        let ends = random_ends(&mut draw, &limits);
        let Some((profile, to)) = feasible(&mut draw, ends, |from, to| SCurve::between(from, to, limits))
        else {
            continue;
        };
        let from = ends.0;
        eased_off +=
            u32::from(shape(profile.stretches()) == [Decelerating] && from.acceleration < Acceleration::ZERO);
        assert_ends_where_it_should(&profile, from, to);
        for _ in 0..2 {
            let time = draw.moment(profile.duration());
            assert_limits_hold(&profile, time, from, &limits);
            assert_inverse_leads_back(&profile, time);
            assert_no_step(&profile, time);
            // Acceleration is continuous, too: within a microsecond it changes by no more than the jerk limit.
            let (before, after) = (
                profile.state_at(time - TimeSpan::from_us(1)),
                profile.state_at(time + TimeSpan::from_us(1)),
            );
            let bent = (after.acceleration - before.acceleration).abs().as_m_per_s2();
            let allowed = 2.001e-6 * limits.jerk.as_m_per_s3()
                + 1e-9 * limits.acceleration.max(limits.deceleration).as_m_per_s2();
            assert!(
                bent <= allowed,
                "acceleration jumps by {bent} at {time:?} from {from:?} to {to:?} with {limits:?}"
            );
        }
        for stretch in profile.stretches() {
            assert_no_step(&profile, stretch.end);
        }
    }
    assert!(eased_off > 1000, "the rarest case came up {eased_off} times");
}

#[test]
fn the_rest_of_an_optimal_profile_is_optimal() {
    let mut draw = Draw::new(13);
    for _ in 0..100_000 {
        let limits = random_limits(&mut draw);
        let ends = random_ends(&mut draw, &limits);
        if leveled_speed(ends.0, &limits) > limits.speed.as_m_per_s() {
            continue; // above the limit what comes first is to get below it
        }
        let Some((profile, to)) = feasible(&mut draw, ends, |from, to| SCurve::between(from, to, limits))
        else {
            continue;
        };
        let time = draw.moment(profile.duration());
        let midway = profile.state_at(time);
        let again = SCurve::between(midway, to, limits)
            .unwrap_or_else(|refused| panic!("{refused} from {midway:?} to {to:?} with {limits:?}"));
        let difference = (again.duration() + time - profile.duration()).as_s();
        // The precision of the distance must be made up for, starting and ending without acceleration.
        let grain = grain(&profile, midway) / limits.jerk.as_m_per_s3();
        let tolerance = 1e-6 + 8.0 * grain.cbrt();
        assert!(
            difference.abs() < tolerance,
            "{difference} s from {midway:?} to {to:?} with {limits:?}, first from {:?}",
            ends.0
        );
    }
}

proptest! {
    #[test]
    fn any_numbers_give_a_profile_or_an_error(numbers in any::<[f64; 10]>(), at in any::<i64>(), place in any::<f64>()) {
        let [s, v, a, to, to_v, to_a, speed, up, down, jerk] = numbers;
        for limits in [limits(speed, up, down, jerk), limits(speed.abs(), up.abs(), down.abs(), jerk.abs())] {
            let (from, to) = (state(s, v, a), state(to, to_v, to_a));
            if let Ok(profile) = Trapezoid::between(from, to, limits) {
                let _ = (profile.state_at(TimeSpan::from_ns(at)), profile.time_at(Length::from_m(place)));
            }
            if let Ok(profile) = SCurve::between(state(s, v, 0.0), state(to.distance.as_m(), 0.0, 0.0), limits) {
                let _ = (profile.state_at(TimeSpan::from_ns(at)), profile.time_at(Length::from_m(place)));
            }
            let _ = SCurve::between(from, to, limits);
            let _ = SCurve::to_speed(from, to.speed, limits);
        }
    }
}
