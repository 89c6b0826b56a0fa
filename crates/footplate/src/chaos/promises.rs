//! What was promised in a story, and how much of it was kept.

use std::ops::AddAssign;

use footplate_core::HALF_95;
use footplate_core::control::Finished;
use footplate_core::track::Layout;
use footplate_core::tracking::PassedSensor;
use footplate_eval::traffic::rest_error;
use footplate_sim::LivingLayout;

/// Intervals of 95 %, and those of them that held the truth.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Promises {
    pub(crate) made: usize,
    pub(crate) kept: usize,
}

impl Promises {
    fn judge(&mut self, is_kept: bool) {
        self.made += 1;
        self.kept += usize::from(is_kept);
    }

    /// Judges the place of a stop, which was promised when it was commanded, by where the train really is.
    pub(super) fn judge_stop(&mut self, layout: &Layout, world: &LivingLayout<'_>, finished: &Finished) {
        let Some((promise, achieved)) = finished.promise.zip(finished.achieved) else { return };
        let mistaken = rest_error(layout, world, finished);
        if let Some((error, mistaken)) = achieved.error.zip(mistaken) {
            self.judge((promise.low..=promise.high).contains(&(error + mistaken)));
        }
    }

    /// Judges the time at which a sensor was predicted to report a train.
    pub(super) fn judge_time(&mut self, passed: &PassedSensor) {
        if let Some([late, deviation]) = passed.late {
            self.judge(late.as_s().abs() <= HALF_95 * deviation.as_s());
        }
    }
}

impl AddAssign for Promises {
    fn add_assign(&mut self, other: Self) {
        self.made += other.made;
        self.kept += other.kept;
    }
}

#[cfg(test)]
mod tests {
    use footplate_core::link::DetectionWindow;
    use footplate_core::{SensorId, TimeSpan, Timestamp};

    use super::*;

    #[test]
    fn a_time_is_kept_inside_its_95_percent_interval() {
        let at = Timestamp::from_s(1.0);
        let passed = |late_ms| PassedSensor {
            sensor: SensorId(1),
            window: DetectionWindow { after: at, until: at },
            at,
            late: Some([TimeSpan::from_s(1e-3 * late_ms), TimeSpan::from_s(0.1)]),
            short: None,
            missed: 0,
            is_origin: false,
        };
        let mut promises = Promises::default();
        for late_ms in [0.0, -195.0, 195.0, 197.0, -197.0] {
            promises.judge_time(&passed(late_ms));
        }
        // The first sensor of a train that was lost was not predicted.
        promises.judge_time(&PassedSensor { late: None, ..passed(0.0) });
        assert_eq!(promises, Promises { made: 5, kept: 3 });
    }
}
