//! One passage of a contact, with everything that was forecast of it.

use footplate_core::tracking::{Hit, Phase};
use footplate_core::{RunId, SpeedStep, TimeSpan, Timestamp, TrainId};

use super::rival::Rival;

/// A passage and the forecasts of its report.
///
/// A forecast says when the contact that did report would, if it is the next to report: the way is taken from
/// the report, its time never. Whether that contact had been named as the next is distinguished, by `hit.named`.
#[derive(Debug, Clone, PartialEq)]
pub struct ScoredHit {
    /// The run.
    pub run: RunId,
    /// The line of the file that reports it.
    pub line: u64,
    /// The train.
    pub train: TrainId,
    /// The passage and our forecast.
    pub hit: Hit,
    /// When each rival expected the report, in the order of [`Rival::ALL`].
    pub(super) rivals: [Option<Timestamp>; Rival::ALL.len()],
}

impl ScoredHit {
    /// When the contact was reported.
    #[must_use]
    pub const fn reported(&self) -> Timestamp {
        self.hit.passage.window.until
    }

    /// The step the train had been told.
    #[must_use]
    pub const fn step(&self) -> SpeedStep {
        self.hit.passage.drive.step
    }

    /// What the train did on the way; `None` where nothing could be forecast.
    #[must_use]
    pub fn phase(&self) -> Option<Phase> {
        self.hit.forecast.map(|forecast| forecast.phase)
    }

    /// How much later than we forecast it was reported.
    #[must_use]
    pub fn late(&self) -> Option<TimeSpan> {
        self.hit.forecast.map(|forecast| forecast.contact_error(self.reported()))
    }

    /// How much later than a rival forecast it was reported.
    #[must_use]
    pub fn late_by(&self, rival: Rival) -> Option<TimeSpan> {
        let expected = self.rivals.get(rival as usize).copied().flatten()?;
        Some(self.reported() - expected)
    }

    /// A delay at this contact in millimetres of way: at the speed that we forecast there, for us and for every
    /// rival, so that all are measured with one rule.
    #[must_use]
    pub fn way_mm(&self, late: TimeSpan) -> Option<f64> {
        self.hit.forecast.map(|forecast| (forecast.speed * late).as_mm())
    }

    /// How central the report lay in our forecast: the probability level of the narrowest central interval that
    /// holds it, 0 in the middle and 1 far outside.
    #[must_use]
    pub fn level(&self) -> Option<f64> {
        self.hit.forecast.map(|forecast| (2.0 * forecast.probability_by(self.reported()) - 1.0).abs())
    }
}
