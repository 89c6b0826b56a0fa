//! The scores of our estimator and of all reference forecasters over the same detections.

use core::fmt;

use super::forecast_score::ForecastScore;
use super::scored_hit::ScoredHit;

/// The scores of all forecasters.
#[derive(Debug, Clone, PartialEq)]
pub struct Comparison {
    /// The scores of our estimator.
    pub ours: ForecastScore,
    /// The scores of the references, in the order of [`ReferenceForecaster::ALL`].
    pub references: Vec<ReferenceScore>,
    /// Detections for which the next sensor had been named.
    pub named: usize,
    /// Those whose sensor had been named correctly.
    pub right: usize,
}

/// The score of a reference, and ours on the same detections.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReferenceScore {
    /// The reference.
    pub reference: ReferenceForecaster,
    /// Its score over the detections that both forecast.
    pub score: ForecastScore,
    /// Our score over exactly these.
    pub ours: ForecastScore,
}

impl ReferenceScore {
    /// Our median error over the reference's, on the detections that both forecast: below 1 we are better. Two medians
    /// of zero are equal.
    pub fn ratio(&self) -> Option<f64> {
        let (ours, theirs) = (self.ours.median_abs_mm?, self.score.median_abs_mm?);
        Some(if ours == theirs { 1.0 } else { ours / theirs })
    }
}

impl Comparison {
    /// The scores over a selection.
    pub fn of<'a>(hits: impl Iterator<Item = &'a ScoredHit> + Clone) -> Self {
        let references = ReferenceForecaster::ALL.map(|reference| ReferenceScore {
            reference,
            score: ForecastScore::of_reference(hits.clone(), reference),
            ours: ForecastScore::of_ours_beside(hits.clone(), reference),
        });
        let named = hits.clone().filter(|hit| hit.hit.named.is_some());
        Self {
            ours: ForecastScore::of(hits),
            references: references.into(),
            named: named.clone().count(),
            right: named.filter(|hit| hit.hit.named == Some(hit.hit.passage.sensor)).count(),
        }
    }

    /// The share of correctly named sensors; `None` if none was named.
    pub fn named_correctly(&self) -> Option<f64> {
        (self.named > 0).then(|| self.right as f64 / self.named as f64)
    }

    /// The score of one reference.
    pub fn reference(&self, reference: ReferenceForecaster) -> Option<&ReferenceScore> {
        self.references.iter().find(|score| score.reference == reference)
    }
}

/// A reference forecaster.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum ReferenceForecaster {
    /// Our own estimator, forecasting the poll that will report instead of the mean time.
    AtPoll,
    /// Our own estimator with the results of the whole recording in advance.
    Oracle,
    /// A table of lengths and speeds for each run, made from the whole recording in advance.
    HindsightTable,
    /// The speed of a step is measured over its first lap and never again.
    ConstantTable,
    /// A running average of the speed of a step with α = 1/256 per hop, in integers.
    SlowAverage,
    /// The same with α = 0.1.
    MiddleAverage,
    /// The same with α = 0.5.
    FastAverage,
    /// The hop takes as long as last time at this step.
    LastLap,
}

/// The methods of courses and clubs, which learn while the train runs.
pub const BASELINES: [ReferenceForecaster; 5] = [
    ReferenceForecaster::ConstantTable,
    ReferenceForecaster::SlowAverage,
    ReferenceForecaster::MiddleAverage,
    ReferenceForecaster::FastAverage,
    ReferenceForecaster::LastLap,
];

impl ReferenceForecaster {
    /// All references, in the order of their declaration.
    pub const ALL: [Self; 8] = [
        Self::AtPoll,
        Self::Oracle,
        Self::HindsightTable,
        Self::ConstantTable,
        Self::SlowAverage,
        Self::MiddleAverage,
        Self::FastAverage,
        Self::LastLap,
    ];

    /// Its name in files.
    #[must_use]
    pub const fn key(self) -> &'static str {
        match self {
            Self::AtPoll => "at_poll",
            Self::Oracle => "oracle",
            Self::HindsightTable => "hindsight_table",
            Self::ConstantTable => "constant_table",
            Self::SlowAverage => "ewma_1_256",
            Self::MiddleAverage => "ewma_0_1",
            Self::FastAverage => "ewma_0_5",
            Self::LastLap => "last_lap",
        }
    }
}

/// Its name for people.
impl fmt::Display for ReferenceForecaster {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::AtPoll => "ours, at a poll",
            Self::Oracle => "oracle",
            Self::HindsightTable => "hindsight table",
            Self::ConstantTable => "constant table",
            Self::SlowAverage => "EWMA 1/256",
            Self::MiddleAverage => "EWMA 0.1",
            Self::FastAverage => "EWMA 0.5",
            Self::LastLap => "last lap",
        })
    }
}
