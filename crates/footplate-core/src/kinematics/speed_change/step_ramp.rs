//! Momentum of a DCC decoder (CV 3 and CV 4), a fixed time per throttle step, through the speed table of its train.

#![expect(clippy::indexing_slicing, reason = "every index is clamped to the table's last step")]

use super::ends::Ends;
use crate::ids::SpeedStep;
use crate::kinematics::motion::{Motion, MotionState};
use crate::time::TimeSpan;
use crate::units::{Length, Speed};

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

/// One entry for standstill and one for each speed of a decoder.
const MOST_STEPS: usize = SpeedStep::HIGHEST as usize + 1;

/// Speeds by throttle step, from step 0 on without a gap, interpolated linearly.
#[derive(Debug, Clone, PartialEq)]
pub struct StepTable {
    /// In m/s, not negative.
    speeds: [f64; MOST_STEPS],
    /// Area under the speeds from step 0 to each step, in m/s times steps.
    areas: [f64; MOST_STEPS],
    last: usize,
}

/// Why a speed table is invalid.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum StepTableError {
    /// A table needs a speed for step 0 and at least one more, and no more than decoders have.
    WrongLength {
        /// How many speeds there were.
        found: usize,
    },
    /// Speeds in a table are finite and not negative; they have no direction.
    NoSpeed {
        /// The step in question.
        step: usize,
        /// Its speed.
        found: Speed,
    },
}

impl core::fmt::Display for StepTableError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::WrongLength { found } => {
                write!(
                    f,
                    "a table of speeds by step has 2 to {MOST_STEPS} entries, the first for step 0, not {found}"
                )
            }
            Self::NoSpeed { step, found } => {
                let found = found.as_mm_per_s();
                write!(f, "the speed at step {step} should be zero or more, not {found} mm/s")
            }
        }
    }
}

impl core::error::Error for StepTableError {}

impl StepTable {
    /// From the speeds at steps 0, 1, 2 …
    ///
    /// # Errors
    ///
    /// If there are too few or too many, or one of them is negative or not finite.
    pub fn new(speeds: &[Speed]) -> Result<Self, StepTableError> {
        if !(2..=MOST_STEPS).contains(&speeds.len()) {
            return Err(StepTableError::WrongLength { found: speeds.len() });
        }
        let mut table = Self { speeds: [0.0; MOST_STEPS], areas: [0.0; MOST_STEPS], last: speeds.len() - 1 };
        for (step, &found) in speeds.iter().enumerate() {
            if !found.is_finite() || found < Speed::ZERO {
                return Err(StepTableError::NoSpeed { step, found });
            }
            table.speeds[step] = found.as_m_per_s();
            if step > 0 {
                let mean = 0.5 * (table.speeds[step - 1] + table.speeds[step]);
                table.areas[step] = table.areas[step - 1] + mean;
            }
        }
        Ok(table)
    }

    /// The highest step that has a speed.
    pub fn last(&self) -> SpeedStep {
        // At most `SpeedStep::HIGHEST` by construction.
        SpeedStep::new(self.last as u8).unwrap_or_default()
    }

    /// The speed at a step; a step above the last counts as the last.
    pub fn speed(&self, step: SpeedStep) -> Speed {
        Speed::from_m_per_s(self.speeds[self.index(step)])
    }

    pub(super) fn index(&self, step: SpeedStep) -> usize {
        usize::from(step.get()).min(self.last)
    }

    /// The interval of a fractional step: the index of its lower end and the fraction into it.
    fn interval(&self, step: f64) -> (usize, f64) {
        // A float that is too large, negative or NaN becomes the nearest index or 0.
        let lower = (step as usize).min(self.last - 1);
        (lower, step - lower as f64)
    }

    /// Speed, area since step 0, and slope of the speed, at a fractional step.
    pub(super) fn at(&self, step: f64) -> (f64, f64, f64) {
        let (lower, part) = self.interval(step);
        let slope = self.speeds[lower + 1] - self.speeds[lower];
        let area = self.areas[lower] + part * (self.speeds[lower] + 0.5 * part * slope);
        (self.speeds[lower] + part * slope, area, slope)
    }

    /// The fractional step at which the area since step 0 is reached. Steps with zero speed share one area: the
    /// result is the lowest of them, or the highest if the ramp runs `down`.
    pub(super) fn step_at_area(&self, area: f64, down: bool) -> f64 {
        let reached =
            self.areas[1..=self.last].partition_point(|&there| there < area || (down && there == area));
        let lower = reached.min(self.last - 1);
        let (left, right) = (self.speeds[lower], self.speeds[lower + 1]);
        // Within an interval the area is that under a straight line; counted from its slow end there is no
        // cancellation.
        let part = if right >= left {
            part_at_area(left, right - left, area - self.areas[lower])
        } else {
            1.0 - part_at_area(right, left - right, self.areas[lower + 1] - area)
        };
        lower as f64 + part
    }
}

/// The fraction of an interval over which a line from `low` with rise `rise` covers an area.
fn part_at_area(low: f64, rise: f64, area: f64) -> f64 {
    let sum = low + libm::sqrt(low * low + 2.0 * rise * area);
    if area > 0.0 { (2.0 * area / sum).min(1.0) } else { 0.0 }
}
