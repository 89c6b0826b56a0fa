//! Us and all rivals over one selection of hits.

use super::forecast_score::ForecastScore;
use super::rival::Rival;
use super::scored_hit::ScoredHit;

/// The figures of everybody.
#[derive(Debug, Clone, PartialEq)]
pub struct Comparison {
    /// Ours.
    pub ours: ForecastScore,
    /// The rivals', in the order of [`Rival::ALL`].
    pub rivals: Vec<RivalScore>,
    /// Hits for which a next contact had been named.
    pub named: usize,
    /// Those of them where it was the one that reported.
    pub right: usize,
}

/// A rival's figures, and ours on the same hits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RivalScore {
    /// Who.
    pub rival: Rival,
    /// Its figures over the hits that both forecast.
    pub score: ForecastScore,
    /// Ours over exactly these.
    pub ours: ForecastScore,
}

impl RivalScore {
    /// Our median error over the rival's, on the hits that both forecast: below 1 we are better. Two medians of
    /// nothing are equal.
    #[must_use]
    pub fn ratio(&self) -> Option<f64> {
        let (ours, theirs) = (self.ours.median_abs_mm?, self.score.median_abs_mm?);
        Some(if ours == theirs { 1.0 } else { ours / theirs })
    }
}

impl Comparison {
    /// Sums up a selection.
    #[must_use]
    pub fn of<'a>(hits: impl Iterator<Item = &'a ScoredHit> + Clone) -> Self {
        let rivals = Rival::ALL.map(|rival| RivalScore {
            rival,
            score: ForecastScore::of_rival(hits.clone(), rival),
            ours: ForecastScore::of_us_beside(hits.clone(), rival),
        });
        let named = hits.clone().filter(|hit| hit.hit.named.is_some());
        Self {
            ours: ForecastScore::of(hits),
            rivals: rivals.into(),
            named: named.clone().count(),
            right: named.filter(|hit| hit.hit.named == Some(hit.hit.passage.sensor)).count(),
        }
    }

    /// How often the contact named as the next was the one that reported; `None` where none was named.
    #[must_use]
    pub fn named_right(&self) -> Option<f64> {
        (self.named > 0).then(|| self.right as f64 / self.named as f64)
    }

    /// The figures of one rival.
    #[must_use]
    pub fn rival(&self, rival: Rival) -> Option<&RivalScore> {
        self.rivals.iter().find(|score| score.rival == rival)
    }
}
