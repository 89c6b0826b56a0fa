//! The scores for machines, with the names that the prediction score keeps.

use footplate_core::track::Layout;
use footplate_store::score::{
    BASELINES, Comparison, Coverage, ForecastScore, GateAgreement, GateCheck, LEVELS, ReferenceForecaster,
    ScoredHit, ScoredRecording,
};
use serde_json::{Map, Value, json};

use super::figures::{self, Hits, PHASES, by_step, by_train, in_phase};

/// Everything, with a row for every hit if `with_hits`.
pub(super) fn scores(layout: &Layout, recordings: &[ScoredRecording], with_hits: bool) -> Value {
    let all: Hits<'_> = recordings.iter().flat_map(|recording| &recording.hits).collect();
    let logs = recordings.iter().map(|recording| {
        let hits: Hits<'_> = recording.hits.iter().collect();
        let mut log = Map::new();
        log.insert("log".into(), json!(recording.name));
        log.insert("runs".into(), json!(recording.runs));
        log.extend(selection(&hits));
        log.insert("trains".into(), trains(&hits));
        if with_hits {
            log.insert("rows".into(), hits.iter().map(|hit| row(layout, hit)).collect());
        }
        Value::Object(log)
    });
    json!({
        "layout": layout.name(),
        "overall": selection(&all),
        "trains": trains(&all),
        "logs": logs.collect::<Value>(),
        "gates": gates(recordings),
    })
}

/// A selection over all phases and by phase.
fn selection(hits: &[&ScoredHit]) -> Map<String, Value> {
    let mut fields = comparison(&figures::comparison(hits));
    let phases = PHASES.map(|(phase, _, key)| {
        let fields = comparison(&in_phase(hits, phase));
        (key.to_owned(), Value::Object(fields))
    });
    fields.insert("phases".into(), Value::Object(phases.into_iter().collect()));
    fields
}

fn trains(hits: &[&ScoredHit]) -> Value {
    let trains = by_train(hits).into_iter().map(|(train, hits)| {
        let steps = by_step(&hits).into_iter().map(|(step, hits)| {
            let mut fields = Map::new();
            fields.insert("step".into(), json!(step));
            fields.extend(comparison(&figures::comparison(&hits)));
            Value::Object(fields)
        });
        let mut fields = Map::new();
        fields.insert("train".into(), json!(train));
        fields.extend(selection(&hits));
        fields.insert("steps".into(), steps.collect());
        Value::Object(fields)
    });
    trains.collect()
}

fn comparison(comparison: &Comparison) -> Map<String, Value> {
    let mut fields = score(&comparison.ours);
    let reference_median = |reference: ReferenceForecaster| {
        comparison.reference(reference).and_then(|found| found.score.median_abs_mm)
    };
    fields.insert("oracle_median_abs_mm".into(), figure(reference_median(ReferenceForecaster::Oracle)));
    fields.insert("next_sensor_right".into(), figure(comparison.named_correctly()));
    let others = |references: &[ReferenceForecaster]| {
        let found = references.iter().filter_map(|reference| comparison.reference(*reference));
        let named = found.map(|found| {
            let mut fields = score(&found.score);
            // Ours on the hits that this one forecast, too: the figure to hold its own against.
            fields.insert("footplate_median_abs_mm".into(), figure(found.ours.median_abs_mm));
            (found.reference.key().to_owned(), Value::Object(fields))
        });
        Value::Object(named.collect())
    };
    fields.insert("baselines".into(), others(&BASELINES));
    fields.insert(
        "in_hindsight".into(),
        others(&[ReferenceForecaster::Oracle, ReferenceForecaster::HindsightTable]),
    );
    fields
}

fn score(score: &ForecastScore) -> Map<String, Value> {
    let mut fields = Map::new();
    fields.insert("hits".into(), json!(score.hits));
    fields.insert("scored".into(), json!(score.scored));
    fields.insert("median_abs_mm".into(), figure(score.median_abs_mm));
    fields.insert("p90_abs_mm".into(), figure(score.p90_abs_mm));
    fields.insert("mean_abs_mm".into(), figure(score.mean_abs_mm));
    fields.insert("median_abs_ms".into(), figure(score.median_abs_ms));
    fields.insert("bias_mm".into(), figure(score.bias_mm));
    for (place, level) in LEVELS.iter().enumerate() {
        let coverage = score.coverage.map(|coverage| coverage[place]);
        let name = format!("coverage_{:.0}", 100.0 * level);
        let plausible = coverage.map(|coverage| {
            let (low, high) = coverage.plausible();
            json!([figure(Some(low)), figure(Some(high))])
        });
        fields.insert(format!("{name}_plausible"), plausible.unwrap_or(Value::Null));
        fields.insert(name, figure(coverage.map(Coverage::fraction)));
    }
    fields
}

fn row(layout: &Layout, hit: &ScoredHit) -> Value {
    let passage = &hit.hit.passage;
    let mut fields = json!({
        "run": hit.run,
        "line": hit.line,
        "train": hit.train,
        "step": hit.step(),
        "sensor": layout.sensor_name(passage.sensor),
        "named": hit.hit.named.map(|named| layout.sensor_name(named)),
        "reported_s": figure(Some(hit.reported().as_s())),
        "verdict": hit.hit.verdict,
        "drift": hit.hit.drift,
        "forecast_s": Value::Null,
    });
    if let (Some(forecast), Some(late)) = (hit.hit.forecast, hit.late()) {
        fields["phase"] = json!(forecast.phase);
        fields["forecast_s"] = figure(Some(forecast.time.as_s()));
        fields["late_ms"] = figure(Some(late.as_ms()));
        fields["late_mm"] = figure(hit.distance_mm(late));
        fields["speed_mm_per_s"] = figure(Some(forecast.speed.as_mm_per_s()));
        for level in LEVELS {
            let (low, high) = forecast.interval(level);
            fields[format!("interval_{:.0}_s", 100.0 * level)] =
                json!([figure(Some(low.as_s())), figure(Some(high.as_s()))]);
        }
    }
    fields
}

fn gates(recordings: &[ScoredRecording]) -> Value {
    let checks: Vec<&GateCheck> = recordings.iter().flat_map(|recording| &recording.gates).collect();
    let of_trains = GateAgreement::by_train(checks.iter().copied()).into_iter().map(|(train, found)| {
        let mut fields = gate_agreement(found);
        fields["train"] = json!(train);
        fields
    });
    let trains: Value = of_trains.collect();
    GateAgreement::of(checks.iter().copied())
        .map_or(Value::Null, |overall| json!({ "overall": gate_agreement(overall), "trains": trains }))
}

fn gate_agreement(found: GateAgreement) -> Value {
    json!({
        "pairs": found.count,
        "bias_pct": figure(Some(100.0 * found.bias)),
        "bias_mm_per_s": figure(Some(found.bias_mm_per_s)),
        "spread_pct": figure(Some(100.0 * found.spread)),
        "spread_mm_per_s": figure(Some(found.spread_mm_per_s)),
        "spread_within_step_pct": figure(found.spread_within.map(|part| 100.0 * part)),
        "spread_within_step_mm_per_s": figure(found.spread_within_mm_per_s),
        "resolution_pct": figure(Some(100.0 * found.resolution)),
        "resolution_mm_per_s": figure(Some(found.resolution_mm_per_s)),
    })
}

/// To a nanometre, a nanosecond or a millionth of a part, so that files do not show the rounding of sums.
fn figure(value: Option<f64>) -> Value {
    value.map_or(Value::Null, |value| json!((value * 1e6).round() / 1e6 + 0.0))
}
