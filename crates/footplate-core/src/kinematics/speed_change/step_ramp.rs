//! Momentum of a DCC decoder (CV 3 and CV 4): a fixed time per throttle step.

use super::ends::Ends;
use super::step_table::StepTable;
use crate::ids::SpeedStep;
use crate::kinematics::motion::{Motion, MotionState};
use crate::time::TimeSpan;
use crate::units::Length;

/// A ramp that is linear in the throttle step; its speed follows the train's speed table.
///
/// Between two steps the speed is taken as a straight line: motor and train smooth the decoder's staircase.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepRamp<'t> {
    ends: Ends,
    table: &'t StepTable,
    from: f64,
    /// 1 while steps are counted up, −1 while they are counted down.
    sense: f64,
    per_step: f64,
}

impl<'t> StepRamp<'t> {
    /// From one step to another, with a time per step; a negative one counts as zero. Steps above the table's last
    /// count as the last.
    #[must_use]
    pub fn new(table: &'t StepTable, from: SpeedStep, to: SpeedStep, per_step: TimeSpan) -> Self {
        let (from, to) = (table.index(from) as f64, table.index(to) as f64);
        let per_step = per_step.as_s().max(0.0);
        let (from_speed, from_area, _) = table.at(from);
        let (to_speed, to_area, _) = table.at(to);
        let distance = per_step * (to_area - from_area).abs();
        let ends = Ends::new(from_speed, to_speed, per_step * (to - from).abs(), distance);
        Self { ends, table, from, sense: if to < from { -1.0 } else { 1.0 }, per_step }
    }

    fn per_step(&self, numerator: f64) -> f64 {
        if self.per_step > 0.0 { numerator / self.per_step } else { 0.0 }
    }
}

impl Motion for StepRamp<'_> {
    fn state_at(&self, time: TimeSpan) -> MotionState {
        let (_, start, _) = self.table.at(self.from);
        self.ends.state_at(time, |t| {
            let (speed, area, slope) = self.table.at(self.from + self.sense * self.per_step(t));
            (self.per_step * (area - start).abs(), speed, self.sense * self.per_step(slope))
        })
    }

    fn time_at(&self, distance: Length) -> Option<TimeSpan> {
        let (_, start, _) = self.table.at(self.from);
        self.ends.time_at(distance, |distance| {
            let step =
                self.table.step_at_area(start + self.sense * self.per_step(distance), self.sense < 0.0);
            (self.per_step * (step - self.from).abs()).min(self.ends.duration)
        })
    }

    fn duration(&self) -> TimeSpan {
        self.ends.duration()
    }

    fn distance(&self) -> Length {
        self.ends.distance()
    }
}
