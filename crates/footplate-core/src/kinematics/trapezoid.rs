//! The profile of constant acceleration: speed up, cruise, slow down.

#![expect(clippy::indexing_slicing, reason = "a phase's index is a count of the borders passed")]

use super::ahead::{Ahead, grain};
use super::limits::{Limits, ProfileError};
use super::motion::{Motion, MotionState, Stretch, seconds, span_of, stretches};
use super::phase::even_time;
use crate::time::TimeSpan;
use crate::units::{Acceleration, Length, Speed};

/// The time-optimal motion from one state to another within limits of speed, acceleration and deceleration; a
/// trapezium when drawn as speed over time.
///
/// Distances count as in the states given. Acceleration jumps, so the accelerations of the states are ignored.
/// A train that is faster than the limit slows down to it first. Before the start the state is the initial one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Trapezoid {
    direction: f64,
    origin: f64,
    /// End of each phase in s since the start, and the distance there in m; the last is the end of the profile.
    times: [f64; PHASES],
    distances: [f64; PHASES],
    /// One more than phases, for the time after the end.
    phases: [EvenPhase; PHASES + 1],
}

/// Speeding up or slowing down to the highest speed, cruising at it, and slowing down.
const PHASES: usize = 3;

/// A phase of constant acceleration, counted from its slow end (see `phase.rs`).
#[derive(Debug, Clone, Copy, PartialEq)]
struct EvenPhase {
    time: f64,
    distance: f64,
    speed: f64,
    acceleration: f64,
}

impl Trapezoid {
    /// The profile from the current state to the target.
    ///
    /// # Errors
    ///
    /// If a limit or a state is invalid, or the target is too near to reach its speed.
    #[inline]
    pub fn between(current: MotionState, target: MotionState, limits: Limits) -> Result<Self, ProfileError> {
        let ahead = Ahead::new(&current, &target);
        let possible = ahead.is_sound(&limits) && ahead.distance >= shortest_distance(&ahead, &limits);
        if !possible {
            check(&current, &target, &limits)?;
        }
        Ok(Self::laid_out(&ahead, current.distance, &limits))
    }

    #[inline(always)]
    fn laid_out(ahead: &Ahead, origin: Length, limits: &Limits) -> Self {
        let Ahead { direction, speed: start, distance, target_speed: end, .. } = *ahead;
        let (speeding, braking) = (limits.acceleration.as_m_per_s2(), limits.deceleration.as_m_per_s2());
        let highest = limits.speed.as_m_per_s();
        // d = (v² − v₁²)/2a + (v² − v₂²)/2b for the peak speed v.
        let square = (2.0 * speeding * braking * distance + braking * start * start + speeding * end * end)
            / (speeding + braking);
        let peak = libm::sqrt(square).max(start.max(end)).min(highest);
        let first = if start > peak { -braking } else { speeding };
        let (first_time, last_time) = ((peak - start) / first, (peak - end) / braking);
        let (first_distance, last_distance) =
            (0.5 * (peak + start) * first_time, 0.5 * (peak + end) * last_time);
        let cruise_distance = (distance - first_distance - last_distance).max(0.0);
        let cruise_time = if cruise_distance > 0.0 { cruise_distance / peak } else { 0.0 };
        let (cruise_end, whole) = (first_time + cruise_time, first_time + cruise_time + last_time);
        let even = |time, distance, speed, acceleration| EvenPhase { time, distance, speed, acceleration };
        Self {
            direction,
            origin: origin.as_m(),
            times: [first_time, cruise_end, whole],
            distances: [first_distance, distance - last_distance, distance],
            phases: [
                if first < 0.0 {
                    even(first_time, first_distance, peak, first)
                } else {
                    even(0.0, 0.0, start, first)
                },
                even(first_time, first_distance, peak, 0.0),
                even(whole, distance, end, -braking),
                even(whole, distance, end, 0.0),
            ],
        }
    }

    /// The intervals in which it speeds up, cruises and slows down.
    pub fn stretches(&self) -> impl Iterator<Item = Stretch> {
        stretches(self.times.into_iter().zip(self.phases.map(|phase| phase.acceleration)))
    }
}

/// The distance of a direct change from one end's speed to the other's.
#[inline(always)]
fn shortest_distance(ahead: &Ahead, limits: &Limits) -> f64 {
    let Ahead { speed: start, target_speed: end, .. } = *ahead;
    let rate = if end > start { limits.acceleration } else { limits.deceleration };
    0.5 * (end - start).abs() * (end + start) / rate.as_m_per_s2()
}

/// Rejects a target that cannot be reached, unless only by rounding.
#[cold]
fn check(current: &MotionState, target: &MotionState, limits: &Limits) -> Result<(), ProfileError> {
    let ahead = Ahead::new(current, target);
    ahead.check(current, target, limits)?;
    ahead.refuse_nearer_than(shortest_distance(&ahead, limits), grain(current, target))
}

impl Motion for Trapezoid {
    #[inline]
    fn state_at(&self, time: TimeSpan) -> MotionState {
        let time = seconds(time).max(0.0);
        let passed: usize = self.times.iter().map(|&end| usize::from(time >= end)).sum();
        let phase = &self.phases[passed];
        let t = time - phase.time;
        let gained = phase.acceleration * t;
        let distance = phase.distance + t * (phase.speed + 0.5 * gained);
        MotionState {
            distance: Length::from_m(self.origin + self.direction * distance),
            speed: Speed::from_m_per_s(self.direction * (phase.speed + gained)),
            acceleration: Acceleration::from_m_per_s2(self.direction * phase.acceleration),
        }
    }

    #[inline]
    fn time_at(&self, distance: Length) -> Option<TimeSpan> {
        let distance = self.direction * (distance.as_m() - self.origin);
        // The end itself belongs to the last phase: it may have no speed.
        let passed: usize = self.distances.iter().map(|&end| usize::from(distance > end)).sum();
        let phase = &self.phases[passed];
        let time =
            (phase.time + even_time(distance - phase.distance, phase.speed, phase.acceleration)).max(0.0);
        (distance >= 0.0 && time.is_finite()).then(|| span_of(time))
    }

    fn duration(&self) -> TimeSpan {
        let [.., whole] = self.times;
        TimeSpan::from_s(whole)
    }

    fn distance(&self) -> Length {
        let [.., whole] = self.distances;
        Length::from_m(self.direction * whole)
    }
}
