//! The scores of our estimator and of all reference forecasters over the same detections.

use super::forecast_score::ForecastScore;
use super::reference_forecaster::ReferenceForecaster;
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
