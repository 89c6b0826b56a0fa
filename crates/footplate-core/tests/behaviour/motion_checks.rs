//! Properties of every motion law: continuous distance, each quantity the integral of the next, and a consistent
//! inverse.

use footplate_core::kinematics::{Motion, MotionState};
use footplate_core::{Length, TimeSpan};

/// Largest number of roundings in a distance, in units in the last place.
const ROUNDINGS: f64 = 16.0;

/// The precision of a state's distance.
pub(crate) fn grain(motion: &impl Motion, state: MotionState) -> f64 {
    let largest = state.distance.abs().max(motion.distance().abs()).max(Length::from_m(f64::MIN_POSITIVE));
    ROUNDINGS * f64::EPSILON * largest.as_m()
}

/// The highest speed at a moment and at both ends (m/s).
fn fastest(motion: &impl Motion, state: MotionState) -> f64 {
    let ends = [TimeSpan::ZERO, motion.duration()].map(|time| motion.state_at(time));
    [ends[0], ends[1], state].map(|state| state.speed.abs().as_m_per_s()).into_iter().fold(0.0, f64::max)
}

/// The time at the distance of a moment is that moment, within the precision of the distance.
pub(crate) fn assert_inverse_leads_back(motion: &(impl Motion + core::fmt::Debug), time: TimeSpan) {
    let state = motion.state_at(time);
    let speed = state.speed.abs().as_m_per_s();
    // Half a nanosecond each for two roundings of a time, and the precision of the distance.
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
    let (mut distance, mut gained, mut steepest) = (0.0, 0.0, 0.0_f64);
    for (at, weight) in WEIGHTS {
        let state = motion.state_at(start + TimeSpan::from_s(at * span));
        distance += weight * span * state.speed.as_m_per_s();
        gained += weight * span * state.acceleration.as_m_per_s2();
        steepest = steepest.max(state.acceleration.abs().as_m_per_s2());
    }
    let rounded = 1e-9 * span * steepest;
    let distance_error = ((last.distance - first.distance).as_m() - distance).abs();
    let allowed = tolerance * distance.abs() + rounded + grain(motion, last);
    assert!(
        distance_error <= allowed,
        "distance is {distance_error} m off the integral of speed from {start:?} to {end:?}"
    );
    let gain_error = ((last.speed - first.speed).as_m_per_s() - gained).abs();
    let allowed =
        tolerance * gained.abs() + 4e-9 * steepest + ROUNDINGS * f64::EPSILON * fastest(motion, last);
    assert!(
        gain_error <= allowed,
        "speed is {gain_error} m/s off the integral of acceleration from {start:?} to {end:?}"
    );
}

/// Distance and speed are continuous at a moment.
pub(crate) fn assert_no_step(motion: &(impl Motion + core::fmt::Debug), time: TimeSpan) {
    let nanosecond = TimeSpan::from_ns(1);
    let states = [time - nanosecond, time, time + nanosecond].map(|time| motion.state_at(time));
    let [before, now, after] = states;
    let fastest = fastest(motion, now);
    let steepest = states.map(|state| state.acceleration.abs().as_m_per_s2()).into_iter().fold(0.0, f64::max);
    let moved = (after.distance - before.distance).abs().as_m();
    assert!(moved <= 4e-9 * fastest + grain(motion, after), "jumps {moved} m at {time:?} of {motion:?}");
    let gained = (after.speed - before.speed).abs().as_m_per_s();
    // The precision of the distance, as a speed: v dv = a ds.
    let grain = steepest * grain(motion, after) / fastest.max(f64::MIN_POSITIVE);
    let allowed = 4e-9 * steepest + ROUNDINGS * f64::EPSILON * fastest + grain;
    assert!(gained <= allowed, "speed jumps {gained} m/s at {time:?} of {motion:?}");
}
