//! The part that all laws of speed change share: a constant speed before the change, another after it.

use crate::kinematics::motion::{MotionState, seconds, span_of};
use crate::kinematics::phase::Triple;
use crate::time::TimeSpan;
use crate::units::{Acceleration, Length, Speed};

/// The two speeds of a change, its duration and its distance, mirrored so that the train runs forwards.
///
/// SI units. A negative duration counts as zero.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Ends {
    /// 1, or −1 for a train that runs towards smaller distances.
    direction: f64,
    pub(super) from: f64,
    pub(super) to: f64,
    pub(super) duration: f64,
    pub(super) distance: f64,
    /// Whether the train reverses during the change, so that it passes distances twice.
    turns_around: bool,
}

impl Ends {
    /// For laws that are symmetric in time, whose mean speed is the mean of the two speeds.
    #[inline]
    pub(super) fn symmetric(from: Speed, to: Speed, duration: TimeSpan) -> Self {
        let (from, to) = (from.as_m_per_s(), to.as_m_per_s());
        let duration = duration.as_s().max(0.0);
        Self::new(from, to, duration, 0.5 * (from + to) * duration)
    }

    #[inline]
    pub(super) fn new(from: f64, to: f64, duration: f64, distance: f64) -> Self {
        let direction = if from + to < 0.0 { -1.0 } else { 1.0 };
        let (from, to, distance) = (direction * from, direction * to, direction * distance);
        Self { direction, from, to, duration, distance, turns_around: from < 0.0 || to < 0.0 }
    }

    /// `numerator` divided by the duration; zero for a change that takes no time.
    #[inline]
    pub(super) fn per_duration(&self, numerator: f64) -> f64 {
        if self.duration > 0.0 { numerator / self.duration } else { 0.0 }
    }

    /// The state at any time, from the law's own state `inside` the change.
    #[inline(always)]
    pub(super) fn state_at(&self, time: TimeSpan, inside: impl Fn(f64) -> Triple) -> MotionState {
        let time = seconds(time);
        self.turned(if time >= 0.0 && time <= self.duration {
            inside(time)
        } else if time < 0.0 {
            (self.from * time, self.from, 0.0)
        } else {
            (self.distance + self.to * (time - self.duration), self.to, 0.0)
        })
    }

    /// The time at any distance, from the law's own time `inside` the change.
    #[inline(always)]
    pub(super) fn time_at(&self, distance: Length, inside: impl Fn(f64) -> f64) -> Option<TimeSpan> {
        let distance = self.direction * distance.as_m();
        if self.turns_around {
            None
        } else if distance >= 0.0 && distance <= self.distance {
            Some(span_of(inside(distance)))
        } else {
            self.time_outside(distance)
        }
    }

    /// The time at a distance before or after the change, where the speed is constant or zero.
    fn time_outside(&self, distance: f64) -> Option<TimeSpan> {
        let seconds = if distance < 0.0 {
            distance / self.from
        } else {
            self.duration + (distance - self.distance) / self.to
        };
        (distance.is_finite() && seconds.is_finite()).then(|| TimeSpan::from_s(seconds))
    }

    pub(super) fn duration(&self) -> TimeSpan {
        TimeSpan::from_s(self.duration)
    }

    pub(super) fn distance(&self) -> Length {
        Length::from_m(self.direction * self.distance)
    }

    /// Mirrors the state back to the train's real direction.
    #[inline]
    fn turned(&self, (distance, speed, acceleration): Triple) -> MotionState {
        MotionState {
            distance: Length::from_m(self.direction * distance),
            speed: Speed::from_m_per_s(self.direction * speed),
            acceleration: Acceleration::from_m_per_s2(self.direction * acceleration),
        }
    }
}
