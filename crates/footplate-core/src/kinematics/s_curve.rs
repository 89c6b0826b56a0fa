//! The profile of limited jerk: acceleration builds up and fades instead of jumping.
//!
//! From standstill to standstill it has seven phases, of jerk +J, 0, −J, then none, then −J, 0, +J. From any
//! other speed and acceleration one more may precede them. All phases are polynomials in closed form. The peak speed
//! of a run that is too short to cruise has a closed form if both limits of acceleration are reached, and between
//! standstills also if neither is; otherwise two or three steps of Newton's method find it.

#![expect(clippy::indexing_slicing, reason = "a phase's index is the number of knots passed")]

mod peak;
mod plan;
mod ramp;

use self::plan::{Plan, Planner};
use self::ramp::Knot;
use super::ahead::{Ahead, grain};
use super::limits::{Limits, ProfileError};
use super::motion::{Motion, MotionState, Stretch, seconds, span_of, stretches};
use super::phase::{Phase, SIXTH, Triple};
use crate::time::TimeSpan;
use crate::units::{Acceleration, Length, Speed};

/// The time-optimal motion from one state to another within limits of speed, acceleration, deceleration and jerk.
///
/// Distances count as in the states given. Before the start the state is the initial one.
///
/// The train may be moving and accelerating at the start, and may arrive with a speed. It never runs backwards to gain
/// distance, nor slower than both of its ends. A train above the speed limit slows down first.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SCurve {
    direction: f64,
    origin: f64,
    sixth_jerk: f64,
    /// Slow end and sign of jerk of each phase.
    pattern: &'static Pattern,
    /// The states at the knots: time in s since the start, distance in m, speed, and half the acceleration.
    times: [f64; KNOTS],
    distances: [f64; KNOTS],
    speeds: [f64; KNOTS],
    half_accelerations: [f64; KNOTS],
}

/// Easing off, three phases of a ramp, cruising, and three of another ramp.
const PHASES: usize = 8;

/// Knots: the boundaries of the phases.
const KNOTS: usize = PHASES + 1;

/// For each phase the knot at its slow end, and the sign of its jerk; one more for the time after the end.
type Pattern = [(usize, f64); PHASES + 1];

static SPEEDING_UP_FIRST: Pattern =
    [(1, 1.0), (1, 1.0), (2, 0.0), (3, -1.0), (4, 0.0), (6, -1.0), (7, 0.0), (8, 1.0), (8, 0.0)];

static SLOWING_DOWN_FIRST: Pattern =
    [(0, -1.0), (2, -1.0), (3, 0.0), (4, 1.0), (4, 0.0), (6, -1.0), (7, 0.0), (8, 1.0), (8, 0.0)];

impl SCurve {
    /// The profile from the current state to the target.
    ///
    /// # Errors
    ///
    /// If a limit or a state is invalid, or the target is too near to reach its speed.
    #[inline]
    pub fn between(current: MotionState, target: MotionState, limits: Limits) -> Result<Self, ProfileError> {
        let ahead = Ahead::new(&current, &target);
        let ends_level = target.acceleration == Acceleration::ZERO;
        if ends_level && let Some(plan) = Plan::from_rest_to_rest(&ahead, &limits) {
            return Ok(Self::laid_out(&plan, current.distance, &ahead, &limits));
        }
        let planner = Planner::new(&ahead, &limits);
        if ends_level && ahead.is_sound(&limits) && planner.is_ordinary() {
            return Ok(Self::laid_out(&planner.ordinary(), current.distance, &ahead, &limits));
        }
        Self::out_of_the_ordinary(current, target, limits)
    }

    /// All other problems. It starts again: results passed on would have to be written to memory for ordinary problems,
    /// too.
    #[cold]
    fn out_of_the_ordinary(
        current: MotionState,
        target: MotionState,
        limits: Limits,
    ) -> Result<Self, ProfileError> {
        let ahead = Ahead::new(&current, &target);
        ahead.check(&current, &target, &limits)?;
        if target.acceleration != Acceleration::ZERO {
            return Err(ProfileError::TargetAcceleration { found: target.acceleration });
        }
        let planner = Planner::new(&ahead, &limits).checked(ahead.direction)?;
        let plan = planner.any(grain(&current, &target))?;
        Ok(Self::laid_out(&plan, current.distance, &ahead, &limits))
    }

    /// The shortest profile from a state to a speed, over whatever distance it takes.
    ///
    /// # Errors
    ///
    /// If a limit or the state is invalid, or the speed is not between zero and the limit.
    pub fn to_speed(current: MotionState, speed: Speed, limits: Limits) -> Result<Self, ProfileError> {
        let target = MotionState::cruising(current.distance, speed);
        let ahead = Ahead::new(&current, &target);
        ahead.check(&current, &target, &limits)?;
        let plan = Planner::new(&ahead, &limits).checked(ahead.direction)?.at_once();
        let distance = plan.opening.end().distance;
        Ok(Self::laid_out(&plan, current.distance, &Ahead { distance, ..ahead }, &limits))
    }

    /// The intervals in which it speeds up, cruises and slows down.
    pub fn stretches(&self) -> impl Iterator<Item = Stretch> {
        let phases = self.half_accelerations.into_iter().zip(self.half_accelerations.into_iter().skip(1));
        // Half of each end's acceleration is the mean of both.
        stretches(self.times.into_iter().skip(1).zip(phases.map(|(start, end)| start + end)))
    }

    /// Its states in order, one every period from the start, without end.
    ///
    /// Cheaper than [`state_at`](Motion::state_at), because the phase is known from the previous state.
    pub fn playback(&self, period: TimeSpan) -> Playback<'_> {
        Playback::new(self, period)
    }

    #[inline(always)]
    fn laid_out(plan: &Plan, origin: Length, ahead: &Ahead, limits: &Limits) -> Self {
        let Plan { opening, closing, level, .. } = plan;
        let [k0, k1, k2, k3, k4] = opening.knots;
        let closing_distance = level.1 + closing.distance;
        let cruise_distance = ahead.distance - k4.distance - closing_distance;
        let cruise = if plan.cruises && cruise_distance > 0.0 { cruise_distance / k4.speed } else { 0.0 };
        let k5 = Knot { time: k4.time + cruise, distance: ahead.distance - closing_distance, ..k4 };
        let end = k5.time + level.0 + closing.time;
        let [k6, k7, k8] = closing.downwards(end, ahead.distance);
        Self {
            direction: ahead.direction,
            origin: origin.as_m(),
            sixth_jerk: SIXTH * limits.jerk.as_m_per_s3(),
            pattern: if opening.slows { &SLOWING_DOWN_FIRST } else { &SPEEDING_UP_FIRST },
            times: [k0, k1, k2, k3, k4, k5, k6, k7, k8].map(|knot| knot.time),
            distances: [k0, k1, k2, k3, k4, k5, k6, k7, k8].map(|knot| knot.distance),
            speeds: [k0, k1, k2, k3, k4, k5, k6, k7, k8].map(|knot| knot.speed),
            half_accelerations: [k0, k1, k2, k3, k4, k5, k6, k7, k8].map(|knot| knot.half_acceleration),
        }
    }

    /// The phase at an index.
    #[inline(always)]
    fn phase(&self, number: usize) -> Phase {
        let (slow_end, jerk) = self.pattern[number];
        Phase {
            time: self.times[slow_end],
            distance: self.distances[slow_end],
            speed: self.speeds[slow_end],
            half_acceleration: self.half_accelerations[slow_end],
            sixth_jerk: jerk * self.sixth_jerk,
        }
    }

    /// Distance, speed and acceleration in the direction of the caller's distances.
    #[inline]
    fn turned(&self, (distance, speed, acceleration): Triple) -> MotionState {
        MotionState {
            distance: Length::from_m(self.origin + self.direction * distance),
            speed: Speed::from_m_per_s(self.direction * speed),
            acceleration: Acceleration::from_m_per_s2(self.direction * acceleration),
        }
    }
}

impl Motion for SCurve {
    #[inline]
    fn state_at(&self, time: TimeSpan) -> MotionState {
        let time = seconds(time).max(0.0);
        let [_, ends @ ..] = &self.times;
        let passed: usize = ends.iter().map(|&end| usize::from(time >= end)).sum();
        self.turned(self.phase(passed).state_at(time))
    }

    #[inline]
    fn time_at(&self, distance: Length) -> Option<TimeSpan> {
        let distance = self.direction * (distance.as_m() - self.origin);
        // The end itself belongs to the last phase: it may have no speed.
        let [_, ends @ ..] = &self.distances;
        let passed: usize = ends.iter().map(|&end| usize::from(distance > end)).sum();
        let longest =
            if passed < PHASES { self.times[passed + 1] - self.times[passed] } else { f64::INFINITY };
        let time = self.phase(passed).time_at(distance, longest).max(0.0);
        (distance >= 0.0 && time.is_finite()).then(|| span_of(time))
    }

    fn duration(&self) -> TimeSpan {
        let [.., end] = self.times;
        TimeSpan::from_s(end)
    }

    fn distance(&self) -> Length {
        let [.., distance] = self.distances;
        Length::from_m(self.direction * distance)
    }
}

/// The states of a profile, one every period from its start, without end.
#[derive(Debug, Clone)]
pub struct Playback<'p> {
    profile: &'p SCurve,
    period: TimeSpan,
    next: TimeSpan,
    number: usize,
    phase: Phase,
    /// When the next phase begins.
    until: f64,
}

impl<'p> Playback<'p> {
    fn new(profile: &'p SCurve, period: TimeSpan) -> Self {
        let mut playback =
            Self { profile, period, next: TimeSpan::ZERO, number: 0, phase: profile.phase(0), until: 0.0 };
        playback.turn_to(0);
        playback
    }

    fn turn_to(&mut self, number: usize) {
        self.number = number;
        self.phase = self.profile.phase(number);
        self.until = if number < PHASES { self.profile.times[number + 1] } else { f64::INFINITY };
    }
}

impl Iterator for Playback<'_> {
    type Item = MotionState;

    #[inline]
    fn next(&mut self) -> Option<MotionState> {
        let time = seconds(self.next);
        while time >= self.until {
            self.turn_to(self.number + 1);
        }
        self.next += self.period;
        Some(self.profile.turned(self.phase.state_at(time)))
    }
}
