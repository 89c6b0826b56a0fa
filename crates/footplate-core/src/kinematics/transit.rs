//! From one speed to another over a given distance in a given time: a change to a constant speed, and a change from it.
//!
//! Letters: `d` distance, `T` time, `v₁` and `v₂` the speeds at the ends, `R` the time of each change, `c` the
//! constant speed. Every symmetric law has the mean of its two speeds, so
//!
//! ```text
//! d = R (v₁ + c)/2 + (T − 2R) c + R (c + v₂)/2      c = (d − R (v₁ + v₂)/2) / (T − R)
//! ```

use super::motion::{Motion, MotionState};
use super::speed_change::{SpeedChange, SpeedLaw};
use crate::time::TimeSpan;
use crate::units::{Acceleration, Length, Speed};

/// Two changes of speed by one law, with a constant speed between them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Transit {
    law: SpeedLaw,
    /// At the ends.
    speeds: [Speed; 2],
    kept: Speed,
    /// Of each change.
    change: TimeSpan,
    time: TimeSpan,
    distance: Length,
}

impl Transit {
    /// A motion over a distance from one speed to another in a time, with changes by a law that take `change` each.
    /// `None` if that is more than half of the time, or for a law without symmetry.
    pub fn new(
        distance: Length,
        [from, to]: [Speed; 2],
        time: TimeSpan,
        law: SpeedLaw,
        change: TimeSpan,
    ) -> Option<Self> {
        if law == SpeedLaw::Lag || change <= TimeSpan::ZERO || change + change > time {
            return None;
        }
        let changing = (from + to) * change * 0.5;
        let kept = (distance - changing) / (time - change);
        Some(Self { law, speeds: [from, to], kept, change, time, distance })
    }

    fn first(&self) -> SpeedChange<'static> {
        self.law.between(self.speeds[0], self.kept, self.change)
    }

    fn last(&self) -> SpeedChange<'static> {
        self.law.between(self.kept, self.speeds[1], self.change)
    }

    /// When the second change begins.
    fn leaves(&self) -> TimeSpan {
        self.time - self.change
    }

    /// The constant speed between the two changes.
    pub const fn kept(&self) -> Speed {
        self.kept
    }

    /// Where the second change begins.
    fn left_at(&self) -> Length {
        self.distance - self.last().distance()
    }
}

impl Motion for Transit {
    fn state_at(&self, time: TimeSpan) -> MotionState {
        if time <= self.change {
            self.first().state_at(time)
        } else if time <= self.leaves() {
            let distance = self.first().distance() + self.kept * (time - self.change);
            MotionState { distance, speed: self.kept, acceleration: Acceleration::ZERO }
        } else {
            let state = self.last().state_at(time - self.leaves());
            MotionState { distance: self.left_at() + state.distance, ..state }
        }
    }

    fn time_at(&self, distance: Length) -> Option<TimeSpan> {
        let changed = self.first().distance();
        if distance <= changed {
            self.first().time_at(distance)
        } else if distance <= self.left_at() {
            (self.kept > Speed::ZERO).then(|| self.change + (distance - changed) / self.kept)
        } else {
            self.last().time_at(distance - self.left_at()).map(|since| self.leaves() + since)
        }
    }

    fn duration(&self) -> TimeSpan {
        self.time
    }

    fn distance(&self) -> Length {
        self.distance
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_covers_the_distance_in_the_time_by_every_symmetric_law() {
        let speeds = [150.0, 250.0].map(Speed::from_mm_per_s);
        let (distance, time) = (Length::from_m(3.0), TimeSpan::from_s(10.0));
        for law in [SpeedLaw::ConstantAcceleration, SpeedLaw::ConstantJerk, SpeedLaw::Smooth] {
            let transit =
                Transit::new(distance, speeds, time, law, TimeSpan::from_s(2.0)).expect("time enough");
            // By hand: (3000 − 2 · 200)/(10 − 2) = 325 mm/s.
            assert!((transit.kept().as_mm_per_s() - 325.0).abs() < 1e-9);
            let end = transit.state_at(time);
            assert!((end.distance - distance).abs() < Length::from_mm(1e-6), "{law:?}");
            assert!((end.speed - speeds[1]).abs() < Speed::from_mm_per_s(1e-6));
            for mm in [1.0, 400.0, 1500.0, 2800.0, 2999.0] {
                let at = transit.time_at(Length::from_mm(mm)).expect("within the transit");
                assert!((transit.state_at(at).distance.as_mm() - mm).abs() < 1e-3, "{law:?} {mm}");
            }
        }
        assert_eq!(Transit::new(distance, speeds, time, SpeedLaw::Smooth, TimeSpan::from_s(6.0)), None);
    }
}
