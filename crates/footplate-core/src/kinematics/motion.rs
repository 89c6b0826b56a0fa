//! The interface of every planned or modelled motion, and the intervals in which a profile speeds up, cruises and slows
//! down.

use crate::time::TimeSpan;
use crate::units::{Acceleration, Length, Speed};

/// Distance, speed and acceleration of a train at one moment.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct MotionState {
    /// Distance along the path, from an origin chosen by the caller.
    pub distance: Length,
    /// Speed, positive in the direction in which distance grows.
    pub speed: Speed,
    /// Rate of change of the speed.
    pub acceleration: Acceleration,
}

impl MotionState {
    /// At rest at a distance.
    pub const fn at_rest(distance: Length) -> Self {
        Self { distance, speed: Speed::ZERO, acceleration: Acceleration::ZERO }
    }

    /// Running at a constant speed.
    pub const fn cruising(distance: Length, speed: Speed) -> Self {
        Self { distance, speed, acceleration: Acceleration::ZERO }
    }
}

/// A motion in closed form, never integrated step by step.
pub trait Motion {
    /// The state at a time since the start. After the end the train keeps its final speed.
    fn state_at(&self, time: TimeSpan) -> MotionState;

    /// When the train first reaches a distance; `None` if it never does, or if the distance is not finite.
    ///
    /// Inverse of [`state_at`](Self::state_at) to 1 ns wherever the train moves by more than the rounding
    /// of its distance in that time: the error is about one unit in the last place of the distance divided
    /// by the speed there. Near standstill an `f64` distance does not determine the time better; the last phase
    /// is solved from its end, which loses nothing more.
    fn time_at(&self, distance: Length) -> Option<TimeSpan>;

    /// From the start until the train reaches its final speed.
    fn duration(&self) -> TimeSpan;

    /// Distance covered in that [`duration`](Self::duration), positive in the direction of growing distance.
    fn distance(&self) -> Length;
}

/// Seconds, by a product: within one unit in the last place of the quotient in [`TimeSpan::as_s`], and one nanosecond
/// faster, of the six that evaluating a profile takes.
#[inline(always)]
pub(super) fn seconds(span: TimeSpan) -> f64 {
    span.as_ns() as f64 * 1e-9
}

/// A span of non-negative seconds, to the nearest nanosecond: [`TimeSpan::from_s`] without the branch for negative
/// times, which do not occur within a motion.
#[inline(always)]
pub(super) fn span_of(seconds: f64) -> TimeSpan {
    TimeSpan::from_ns((seconds * 1e9 + 0.5) as i64)
}

/// How the speed of a train changes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Running {
    /// Getting faster.
    Accelerating,
    /// Keeping its speed.
    Cruising,
    /// Getting slower.
    Decelerating,
}

/// An interval of a profile with one sign of acceleration.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Stretch {
    /// How the speed changes.
    pub running: Running,
    /// Since the start of the profile.
    pub start: TimeSpan,
    /// Since the start of the profile; the start of the next stretch.
    pub end: TimeSpan,
}

/// Stretches from phases in order of time, each given as its end and its acceleration (only the sign counts). Phases
/// without duration are omitted; neighbours of the same sign are merged.
pub(super) fn stretches(phases: impl Iterator<Item = (f64, f64)>) -> impl Iterator<Item = Stretch> {
    let mut start = TimeSpan::ZERO;
    let mut phases = phases
        .filter_map(move |(end, acceleration)| {
            let end = TimeSpan::from_s(end);
            let running = if acceleration > 0.0 {
                Running::Accelerating
            } else if acceleration < 0.0 {
                Running::Decelerating
            } else {
                Running::Cruising
            };
            let stretch = Stretch { running, start, end };
            start = end;
            (stretch.start < end).then_some(stretch)
        })
        .peekable();
    core::iter::from_fn(move || {
        let mut stretch = phases.next()?;
        while let Some(next) = phases.next_if(|next| next.running == stretch.running) {
            stretch.end = next.end;
        }
        Some(stretch)
    })
}
