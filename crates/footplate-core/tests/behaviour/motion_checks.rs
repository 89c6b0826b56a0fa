//! What holds for every motion whatever its law: no step in distance, each quantity the integral of the next,
//! and an inverse that leads back.

use footplate_core::kinematics::{Motion, MotionState};
use footplate_core::{Length, TimeSpan};

/// Roundings that a distance has gone through at most, in units in its last place.
const ROUNDINGS: f64 = 16.0;

/// How precisely the distance of a state can be known at all.
pub(crate) fn grain(motion: &impl Motion, state: MotionState) -> f64 {
    let largest = state.distance.abs().max(motion.distance().abs()).max(Length::from_m(f64::MIN_POSITIVE));
    ROUNDINGS * f64::EPSILON * largest.as_m()
}

/// The fastest that the train is at a moment or at either end, in m/s.
fn fastest(motion: &impl Motion, state: MotionState) -> f64 {
    let ends = [TimeSpan::ZERO, motion.duration()].map(|time| motion.state_at(time));
    [ends[0], ends[1], state].map(|state| state.speed.abs().as_m_per_s()).into_iter().fold(0.0, f64::max)
}

/// The time at the distance of a moment is that moment, as precisely as the distance tells it.
pub(crate) fn assert_inverse_leads_back(motion: &(impl Motion + core::fmt::Debug), time: TimeSpan) {
    let state = motion.state_at(time);
    let speed = state.speed.abs().as_m_per_s();
    // Half a nanosecond each for the two roundings of a time, and what the grain of the distance hides.
    let tolerance = 1e-9 + grain(motion, state) / speed;
    if tolerance > 1e-3 {
        return; // at standstill every moment has the same distance
    }
    let found = motion.time_at(state.distance);
    let error = found.map(|found| (found - time).abs().as_s());
    assert!(
        error.is_some_and(|error| error <= tolerance),
        "{error:?} s off (tolerance {tolerance}): {found:?} for {time:?} at {state:?} of {motion:?}"
    );
}

/// Between two moments of one phase, distance and speed change by the integrals of speed and acceleration
/// (Gauss and Legendre's three points: exact to the fifth power of the time).
pub(crate) fn assert_integrals_agree(motion: &impl Motion, start: TimeSpan, end: TimeSpan, tolerance: f64) {
    const WEIGHTS: [(f64, f64); 3] =
        [(0.112_701_665_379_258_3, 5.0 / 18.0), (0.5, 8.0 / 18.0), (0.887_298_334_620_741_7, 5.0 / 18.0)];
    // From the points as they are after rounding to nanoseconds.
    let span = (end - start).as_s();
    let (first, last) = (motion.state_at(start), motion.state_at(end));
    let (mut way, mut gained, mut steepest) = (0.0, 0.0, 0.0_f64);
    for (at, weight) in WEIGHTS {
        let state = motion.state_at(start + TimeSpan::from_s(at * span));
        way += weight * span * state.speed.as_m_per_s();
        gained += weight * span * state.acceleration.as_m_per_s2();
        steepest = steepest.max(state.acceleration.abs().as_m_per_s2());
    }
    let rounded = 1e-9 * span * steepest;
    let way_error = ((last.distance - first.distance).as_m() - way).abs();
    let allowed = tolerance * way.abs() + rounded + grain(motion, last);
    assert!(
        way_error <= allowed,
        "distance is {way_error} m off the integral of speed from {start:?} to {end:?}"
    );
    let gain_error = ((last.speed - first.speed).as_m_per_s() - gained).abs();
    let allowed =
        tolerance * gained.abs() + 4e-9 * steepest + ROUNDINGS * f64::EPSILON * fastest(motion, last);
    assert!(
        gain_error <= allowed,
        "speed is {gain_error} m/s off the integral of acceleration from {start:?} to {end:?}"
    );
}

/// On either side of a moment the train is at the same place, and at the same speed.
pub(crate) fn assert_no_step(motion: &(impl Motion + core::fmt::Debug), time: TimeSpan) {
    let nanosecond = TimeSpan::from_ns(1);
    let states = [time - nanosecond, time, time + nanosecond].map(|time| motion.state_at(time));
    let [before, now, after] = states;
    let fastest = fastest(motion, now);
    let steepest = states.map(|state| state.acceleration.abs().as_m_per_s2()).into_iter().fold(0.0, f64::max);
    let moved = (after.distance - before.distance).abs().as_m();
    assert!(moved <= 4e-9 * fastest + grain(motion, after), "jumps {moved} m at {time:?} of {motion:?}");
    let gained = (after.speed - before.speed).abs().as_m_per_s();
    // What the grain of the distance is in speed: v dv = a ds.
    let grain = steepest * grain(motion, after) / fastest.max(f64::MIN_POSITIVE);
    let allowed = 4e-9 * steepest + ROUNDINGS * f64::EPSILON * fastest + grain;
    assert!(gained <= allowed, "speed jumps {gained} m/s at {time:?} of {motion:?}");
}
