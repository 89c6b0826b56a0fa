//! The motion between two contacts: running on, or changing speed on the way.
//!
//! Plain numbers in SI units: times in seconds on the run's clock, distances in metres from an arbitrary
//! place, speeds in m/s.

use crate::calibration::LawFamily;
use crate::kinematics::{Motion, SpeedChange};
use crate::time::TimeSpan;
use crate::units::{Length, Speed};

/// A train runs at one speed until a command takes effect, and changes to another by a law.
#[derive(Debug, Clone, Copy)]
pub(super) struct Transition {
    /// When the decoder begins to change the speed.
    pub(super) begins: f64,
    /// The speed before.
    pub(super) from: f64,
    change: SpeedChange<'static>,
}

impl Transition {
    pub(super) fn new(family: LawFamily, pace: f64, begins: f64, from: f64, to: f64) -> Self {
        let change = family.change(pace, Speed::from_m_per_s(from), Speed::from_m_per_s(to));
        Self { begins, from, change }
    }

    /// Distance since the change began; negative before.
    pub(super) fn distance_at(&self, time: f64) -> f64 {
        let since = time - self.begins;
        if since <= 0.0 {
            return self.from * since;
        }
        self.change.state_at(TimeSpan::from_s(since)).distance.as_m()
    }

    pub(super) fn speed_at(&self, time: f64) -> f64 {
        let since = time - self.begins;
        if since <= 0.0 {
            return self.from;
        }
        self.change.state_at(TimeSpan::from_s(since)).speed.as_m_per_s()
    }

    /// When the train is at a distance since the change began; `None` if it stops short of it.
    pub(super) fn time_at(&self, distance: f64) -> Option<f64> {
        if distance <= 0.0 {
            return (self.from > 0.0).then(|| self.begins + distance / self.from);
        }
        self.change.time_at(Length::from_m(distance)).map(|since| self.begins + since.as_s())
    }

    /// When the new speed is reached.
    pub(super) fn settled(&self) -> f64 {
        self.begins + self.change.duration().as_s()
    }
}
