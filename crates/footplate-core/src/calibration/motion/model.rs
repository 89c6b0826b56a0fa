//! How one train moves, as far as is known, and what follows from it.

use crate::calibration::SectionIndex;
use crate::estimate::Estimate;
use crate::event::Approach;
use crate::ids::{SpeedStep, TrainId};
use crate::time::{TimeSpan, Timestamp};
use crate::track::Hop;
use crate::units::{Length, Speed};

/// Whether a step moves the train.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StepUse {
    /// Never tried.
    Untried,
    /// It moves the train.
    Moves,
    /// The train did not start, or stalled, at this step: not to be relied upon.
    Unreliable,
}

/// The way and time to rest from a steady speed, counted from when the command left the line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StopForecast {
    /// The way, as the train feels it.
    pub distance: Length,
    /// One standard deviation of what is not known of it.
    pub doubt: Length,
    /// One standard deviation of single stops about it.
    pub scatter: Length,
    /// The time.
    pub time: TimeSpan,
}

/// How one train answers its commands on one layout.
#[derive(Debug, Clone, PartialEq)]
pub struct MotionModel {
    train: TrainId,
    highest: SpeedStep,
}

impl MotionModel {
    /// What all model trains have in common, and nothing of this one.
    #[must_use]
    pub fn unknown(train: TrainId, highest: SpeedStep) -> Self {
        Self { train, highest }
    }

    /// The train.
    #[must_use]
    pub const fn train(&self) -> TrainId {
        self.train
    }

    /// The highest step of its decoder.
    #[must_use]
    pub const fn highest(&self) -> SpeedStep {
        self.highest
    }

    /// Its steady speed at a step; the count is of contacts passed at it.
    #[must_use]
    pub fn speed(&self, step: SpeedStep, approach: Approach) -> Estimate<Speed> {
        let _ = approach;
        let value = Speed::from_mm_per_s(40.0 * f64::from(step.get()));
        Estimate { value, uncertainty: 0.5 * value, count: 0, date: Timestamp::ZERO }
    }

    /// What experience says of a step.
    #[must_use]
    pub fn uses(&self, step: SpeedStep) -> StepUse {
        let _ = step;
        StepUse::Untried
    }

    /// Keeps in mind whether a step moved the train.
    pub fn note_use(&mut self, step: SpeedStep, found: StepUse) {
        let _ = (step, found);
    }

    /// How it stops from its steady speed at a step.
    #[must_use]
    pub fn stop(&self, step: SpeedStep, approach: Approach) -> StopForecast {
        let speed = self.speed(step, approach).value;
        let distance = speed * TimeSpan::from_ms(1_500);
        StopForecast {
            distance,
            doubt: 0.5 * distance,
            scatter: 0.02 * distance,
            time: TimeSpan::from_s(3.0),
        }
    }

    /// How long it takes to be steady at a step from another.
    #[must_use]
    pub fn settles_within(&self, from: SpeedStep, to: SpeedStep) -> TimeSpan {
        let _ = (from, to);
        TimeSpan::from_s(3.0)
    }

    /// The way over a hop as the train feels it, and one standard deviation of it.
    #[must_use]
    pub fn length(&self, sections: &SectionIndex, hop: &Hop<'_>) -> [Length; 2] {
        let survey = sections.section(hop.id).map_or(0.0, |section| sections.survey_variance(section));
        [hop.length, Length::from_m(libm::sqrt(survey))]
    }
}
