//! The profile of limited jerk: acceleration builds up and fades instead of jumping.
//!
//! From standstill to standstill it has seven phases, of jerk +J, 0, −J, then none, then −J, 0, +J. From any
//! other speed and acceleration one more may precede them. All phases are polynomials in closed form; the peak
//! speed of a run that is too short to cruise is closed too, except where one of the two limits of acceleration
//! is reached and the other is not, which takes a few steps of Newton's method.

#![expect(clippy::indexing_slicing, reason = "a phase's index is a count of the borders passed")]

mod opening;
mod peak;
mod plan;
mod playback;
mod ramp;

pub use playback::Playback;

use self::plan::{Plan, Planner};
use super::limits::{Ahead, Limits, ProfileError};
use super::motion::{Motion, MotionState};
use super::phase::{Phase, Triple};
use super::stretch::{Stretch, stretches};
use crate::time::TimeSpan;
use crate::units::{Acceleration, Length, Speed};

/// The quickest way from one state to another within limits of speed, acceleration, deceleration and jerk.
///
/// Distances are those of the states it was built from. Before the start the state is that of the start.
///
/// The train may be on the move and accelerating when it starts, and may arrive with a speed; it never runs
/// backwards to gain room, nor slower than both ends ask for. If it is above the limit of speed when it starts,
/// it slows down first.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SCurve {
    direction: f64,
    origin: f64,
    /// End of each phase in s since the start, and the way there in m; the last is the end of the profile.
    times: [f64; PHASES],
    ways: [f64; PHASES],
    /// And one more, for the time after the end.
    phases: [Phase; PHASES + 1],
}

/// Easing off, the three phases of a ramp, cruising, and the three of a ramp.
const PHASES: usize = 8;

impl SCurve {
    /// The profile from a state to another.
    ///
    /// # Errors
    ///
    /// If a limit or a state makes no sense, or the target is nearer than its speed can be reached.
    #[inline]
    pub fn between(current: MotionState, target: MotionState, limits: Limits) -> Result<Self, ProfileError> {
        let ahead = Ahead::new(current, target, &limits)?;
        if target.acceleration != Acceleration::ZERO {
            return Err(ProfileError::TargetAcceleration { found: target.acceleration });
        }
        let plan = Planner::new(ahead, &limits)?.plan()?;
        Ok(Self::from_plan(&plan, current.distance, &ahead))
    }

    /// The profile from a state to a speed, wherever that is reached.
    ///
    /// # Errors
    ///
    /// If a limit or the state makes no sense, or the speed is not between zero and the limit.
    pub fn to_speed(current: MotionState, speed: Speed, limits: Limits) -> Result<Self, ProfileError> {
        let ahead = Ahead::new(current, MotionState::cruising(current.distance, speed), &limits)?;
        let plan = Planner::new(ahead, &limits)?.at_once();
        let (_, way) = plan.opening.end();
        Ok(Self::from_plan(&plan, current.distance, &Ahead { way, ..ahead }))
    }

    /// Where it speeds up, cruises and slows down.
    pub fn stretches(&self) -> impl Iterator<Item = Stretch> {
        let mut start = 0.0;
        let ends = self.times.into_iter().zip(self.phases);
        stretches(ends.map(move |(end, phase)| {
            let (_, _, acceleration) = phase.state_at(0.5 * (start + end));
            start = end;
            (end, acceleration)
        }))
    }

    /// Its states in order, one every period from the start on, for ever.
    ///
    /// Cheaper than [`state_at`](Motion::state_at), because the phase is known from the state before.
    #[must_use]
    pub fn playback(&self, period: TimeSpan) -> Playback<'_> {
        Playback::new(self, period)
    }

    #[inline]
    fn from_plan(plan: &Plan, origin: Length, ahead: &Ahead) -> Self {
        let Plan { opening, closing, level, .. } = plan;
        let (opened, opened_way) = opening.end();
        let speed = opening.speed;
        let closing_way = level.1 + closing.way;
        let cruise_way = (ahead.way - opened_way - closing_way).max(0.0);
        let cruise = if plan.cruises && cruise_way > 0.0 { cruise_way / speed } else { 0.0 };
        let closes = opened + cruise;
        let (end, way) = (closes + level.0 + closing.time, ahead.way);
        let ([build_up, hold, fade], [built_up, held]) = closing.downwards(end, way);
        let steady = |time, distance, speed| Phase { time, distance, speed, ..Phase::default() };
        let [t0, t1, t2, t3] = opening.times;
        let [w0, w1, w2, w3] = opening.ways;
        let [ease, rise, top, settle] = opening.phases;
        Self {
            direction: ahead.direction,
            origin: origin.as_m(),
            times: [t0, t1, t2, t3, closes, built_up.0, held.0, end],
            ways: [w0, w1, w2, w3, way - closing_way, built_up.1, held.1, way],
            phases: [
                ease,
                rise,
                top,
                settle,
                steady(opened, opened_way, speed),
                build_up,
                hold,
                fade,
                steady(end, way, ahead.target_speed),
            ],
        }
    }

    /// From way, speed and acceleration ahead to those along the line.
    #[inline]
    fn turned(&self, (way, speed, acceleration): Triple) -> MotionState {
        MotionState {
            distance: Length::from_m(self.origin + self.direction * way),
            speed: Speed::from_m_per_s(self.direction * speed),
            acceleration: Acceleration::from_m_per_s2(self.direction * acceleration),
        }
    }
}

impl Motion for SCurve {
    #[inline]
    fn state_at(&self, time: TimeSpan) -> MotionState {
        let time = time.as_s().max(0.0);
        let passed: usize = self.times.iter().map(|&end| usize::from(time >= end)).sum();
        self.turned(self.phases[passed].state_at(time))
    }

    #[inline]
    fn time_at(&self, distance: Length) -> Option<TimeSpan> {
        let way = self.direction * (distance.as_m() - self.origin);
        // The end itself belongs to the last phase: it may have no speed.
        let passed: usize = self.ways.iter().map(|&end| usize::from(way > end)).sum();
        let start = if passed > 0 { self.times[passed - 1] } else { 0.0 };
        let longest = if passed < PHASES { self.times[passed] - start } else { f64::INFINITY };
        let time = self.phases[passed].time_at(way, longest).max(0.0);
        (way >= 0.0 && time.is_finite()).then(|| TimeSpan::from_s(time))
    }

    fn duration(&self) -> TimeSpan {
        let [.., end] = self.times;
        TimeSpan::from_s(end)
    }

    fn distance(&self) -> Length {
        let [.., way] = self.ways;
        Length::from_m(self.direction * way)
    }
}
