//! What a run comes to, without any truth.

use footplate_core::odometry::{Mode, MotionEstimate, OdometerAccuracy, WheelState};
use footplate_core::{Speed, TimeSpan, Timestamp};
use serde::Serialize;

/// What a run comes to.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct RunSummary {
    /// How many periods it has.
    pub periods: u64,
    /// When the first of them ended.
    pub begin: Option<Timestamp>,
    /// The estimate of the last one.
    pub last: Option<MotionEstimate>,
    /// The highest speed, in either direction.
    pub top_speed: Speed,
    /// How many periods were of each mode.
    pub modes: ModeCounts,
    /// For each wheelset, in how many periods it was flagged how.
    pub flags: [FlagCounts; 2],
    /// The worst that ETCS says of the accuracy of its distances, by the guaranteed bounds.
    pub accuracy: OdometerAccuracy,
    /// When it became so; `None` if it was sound throughout.
    pub accuracy_since: Option<Timestamp>,
}

/// How many periods were of each mode.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct ModeCounts {
    /// [`Mode::Normal`].
    pub normal: u64,
    /// [`Mode::OneSlip`].
    pub one_slip: u64,
    /// [`Mode::Correction`].
    pub correction: u64,
    /// [`Mode::Ambiguous`].
    pub ambiguous: u64,
    /// [`Mode::Degraded`].
    pub degraded: u64,
}

/// In how many periods a wheelset was flagged how.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct FlagCounts {
    /// [`WheelState::Spin`].
    pub spin: u64,
    /// [`WheelState::Slide`].
    pub slide: u64,
    /// [`WheelState::Excluded`].
    pub excluded: u64,
}

impl RunSummary {
    /// Takes in the estimate of a period.
    #[inline]
    pub(super) fn see(&mut self, estimate: &MotionEstimate, accuracy: OdometerAccuracy) {
        self.periods += 1;
        self.begin.get_or_insert(estimate.time);
        self.last = Some(*estimate);
        self.top_speed = self.top_speed.max(estimate.speed.abs());
        if accuracy > self.accuracy {
            (self.accuracy, self.accuracy_since) = (accuracy, Some(estimate.time));
        }
        let modes = &mut self.modes;
        *match estimate.mode {
            Mode::Normal => &mut modes.normal,
            Mode::OneSlip => &mut modes.one_slip,
            Mode::Correction => &mut modes.correction,
            Mode::Ambiguous => &mut modes.ambiguous,
            Mode::Degraded => &mut modes.degraded,
        } += 1;
        for (flags, state) in self.flags.iter_mut().zip(estimate.wheels) {
            match state {
                WheelState::Rolling => {}
                WheelState::Spin => flags.spin += 1,
                WheelState::Slide => flags.slide += 1,
                WheelState::Excluded => flags.excluded += 1,
            }
        }
    }

    /// From the first period to the last.
    #[must_use]
    pub fn duration(&self) -> TimeSpan {
        match (self.begin, self.last) {
            (Some(begin), Some(last)) => last.time - begin,
            _ => TimeSpan::ZERO,
        }
    }
}
