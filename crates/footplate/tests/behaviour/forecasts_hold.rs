//! Stated intervals contain the reports as often as they say, for trains of every law.

use std::collections::BTreeMap;

use footplate_core::tracking::{ForecastPhase, Predictor};
use footplate_store::layout_named;

use crate::simulated::{TRAIN, for_each};

/// Probabilities that forecasts gave to reports no later than theirs, by phase.
fn probabilities(scenario: &str) -> BTreeMap<ForecastPhase, Vec<f64>> {
    let layout = layout_named("track-a").expect("built in").layout;
    let mut found: BTreeMap<ForecastPhase, Vec<f64>> = BTreeMap::new();
    for_each(&layout, scenario, 3, |_, recording| {
        let mut predictor = Predictor::new(&layout);
        for run in &recording.runs {
            predictor.begin_run(TRAIN, run.running_at);
            for hit in run.events.iter().filter_map(|event| predictor.take(&layout, event)) {
                if let Some(forecast) = hit.forecast {
                    let report = hit.passage.window.until;
                    found.entry(forecast.phase).or_default().push(forecast.probability_by(report));
                }
            }
        }
    });
    found
}

fn held(probabilities: &[f64], level: f64) -> f64 {
    let inside = probabilities.iter().filter(|p| (*p - 0.5).abs() < level / 2.0).count();
    inside as f64 / probabilities.len() as f64
}

#[test]
fn after_the_first_lap_the_intervals_hold() {
    // Given starts from rest at every step, by trains of six laws,
    let found = probabilities("starts");
    let steady = &found[&ForecastPhase::Steady];
    assert!(steady.len() > 800, "{} forecasts", steady.len());
    // then each stated interval holds as often as the issue asks: 45 to 55, 87 to 93 (and not less than that),
    // and at least 98 per cent. One per cent is left for chance: 800 forecasts scatter by 1 to 1.8 %.
    let [half, ninety, all] = [0.5, 0.9, 0.99].map(|level| held(steady, level));
    assert!((0.44..0.57).contains(&half), "50 %: {half}");
    assert!((0.87..0.96).contains(&ninety), "90 %: {ninety}");
    assert!(all >= 0.98, "99 %: {all}");
}

#[test]
fn through_speed_changes_the_intervals_are_not_too_narrow() {
    let found = probabilities("changes");
    let changing = &found[&ForecastPhase::Change];
    assert!(changing.len() > 1000, "{} forecasts", changing.len());
    // Six laws against three in the live estimator: doubt of the law makes the middle too wide, never the
    // outside too narrow.
    let [half, ninety, all] = [0.5, 0.9, 0.99].map(|level| held(changing, level));
    assert!(half >= 0.45, "50 %: {half}");
    assert!(ninety >= 0.90, "90 %: {ninety}");
    assert!(all >= 0.97, "99 %: {all}");
}
