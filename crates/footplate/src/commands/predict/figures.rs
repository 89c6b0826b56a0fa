//! The selections and phases that every form of output shows, and figures as text.

use std::collections::BTreeMap;

use footplate_core::tracking::ForecastPhase;
use footplate_core::{SpeedStep, TrainId};
use footplate_store::score::{Comparison, ScoredHit};

/// The phases in the order of a train's day, with their names for people and for files.
pub(super) const PHASES: [(ForecastPhase, &str, &str); 3] = [
    (ForecastPhase::Steady, "steady", "steady"),
    (ForecastPhase::FirstLap, "first lap", "first_lap"),
    (ForecastPhase::Change, "change", "change"),
];

/// A selection of hits.
pub(super) type Hits<'a> = Vec<&'a ScoredHit>;

/// Those of the hits that are wanted.
pub(super) fn only<'a>(hits: &[&'a ScoredHit], wanted: impl Fn(&ScoredHit) -> bool) -> Hits<'a> {
    hits.iter().copied().filter(|hit| wanted(hit)).collect()
}

/// Everybody's figures over a selection.
pub(super) fn comparison(hits: &[&ScoredHit]) -> Comparison {
    Comparison::of(hits.iter().copied())
}

/// Everybody's figures over the hits of one phase.
pub(super) fn in_phase(hits: &[&ScoredHit], phase: ForecastPhase) -> Comparison {
    comparison(&only(hits, |hit| hit.phase() == Some(phase)))
}

/// The hits of each train, by number.
pub(super) fn by_train<'a>(hits: &[&'a ScoredHit]) -> BTreeMap<TrainId, Hits<'a>> {
    by(hits, |hit| hit.train)
}

/// The hits at each step, from the lowest.
pub(super) fn by_step<'a>(hits: &[&'a ScoredHit]) -> BTreeMap<SpeedStep, Hits<'a>> {
    by(hits, ScoredHit::step)
}

fn by<'a, K: Ord>(hits: &[&'a ScoredHit], key: impl Fn(&ScoredHit) -> K) -> BTreeMap<K, Hits<'a>> {
    let mut groups: BTreeMap<K, Hits<'a>> = BTreeMap::new();
    for hit in hits {
        groups.entry(key(hit)).or_default().push(hit);
    }
    groups
}

/// A figure with one decimal, or a dash.
pub(super) fn one_decimal(figure: Option<f64>) -> String {
    // Rounding first keeps a small negative figure from being shown as -0.0.
    figure.map_or_else(|| "–".to_owned(), |figure| format!("{:.1}", (figure * 10.0).round() / 10.0 + 0.0))
}

/// A ratio with two decimals; a dash for what is some hundred times worse.
pub(super) fn ratio(figure: Option<f64>) -> String {
    match figure {
        None => "–".to_owned(),
        Some(figure) if figure >= 10.0 => "> 10".to_owned(),
        Some(figure) => format!("{figure:.2}"),
    }
}

/// A part as whole per cent.
pub(super) fn per_cent(part: f64) -> String {
    format!("{:.0}", 100.0 * part)
}
