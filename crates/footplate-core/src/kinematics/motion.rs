//! What can be asked of any planned or modelled motion, whatever law it follows.

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
    /// Standing still at a distance.
    #[must_use]
    pub const fn at_rest(distance: Length) -> Self {
        Self { distance, speed: Speed::ZERO, acceleration: Acceleration::ZERO }
    }

    /// Running at a speed that does not change.
    #[must_use]
    pub const fn cruising(distance: Length, speed: Speed) -> Self {
        Self { distance, speed, acceleration: Acceleration::ZERO }
    }
}

/// A motion known in closed form: asked as often as wanted, never integrated step by step.
pub trait Motion {
    /// The state at a time since the start. After the end the train runs on at the speed of the end.
    fn state_at(&self, time: TimeSpan) -> MotionState;

    /// When the train is first at a distance; `None` if it never gets there, and for a distance that is
    /// not finite.
    ///
    /// Inverse of [`state_at`](Self::state_at) to 1 ns wherever the train moves by more than the rounding
    /// of its distance in that time: the error is about one unit in the last place of the distance divided
    /// by the speed there. Closer to standstill no `f64` distance can tell the time better; the last phase
    /// is solved from its end, so that nothing is lost beyond that.
    fn time_at(&self, distance: Length) -> Option<TimeSpan>;

    /// From the start until the speed of the end is reached.
    fn duration(&self) -> TimeSpan;

    /// How far the train gets in that [`duration`](Self::duration), in the direction of growing distance.
    fn distance(&self) -> Length;
}

/// Seconds, by a product: within one unit in the last place of the quotient that [`TimeSpan::as_s`] gives, and
/// one nanosecond sooner, of the six that evaluating a profile takes.
#[inline(always)]
pub(super) fn seconds(span: TimeSpan) -> f64 {
    span.as_ns() as f64 * 1e-9
}

/// A span of seconds that are not negative, to the nearest nanosecond: [`TimeSpan::from_s`] without the side of
/// the sign that times within a motion do not have.
#[inline(always)]
pub(super) fn span_of(seconds: f64) -> TimeSpan {
    TimeSpan::from_ns((seconds * 1e9 + 0.5) as i64)
}
