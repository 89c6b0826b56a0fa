//! What recordings come to, for machines.

use footplate_core::odometry::PlacedValue;
use footplate_eval::line::{figure, score_json};
use footplate_store::odometry::{Preset, RunScores};
use serde_json::{Map, Value, json};

use super::recording::{WalkedRecording, WalkedRun};
use super::walked::Walked;
use crate::commands::web_page::Language;

/// Everything, as docs/formats/odometry-result.md describes it.
pub(super) fn walked(walked: &Walked) -> Value {
    let mut whole = Map::new();
    whole.insert("preset".into(), json!(walked.preset.key()));
    whole.insert("vehicle".into(), json!(walked.vehicle));
    whole.insert("warnings".into(), json!(walked.warnings(Language::English)));
    if let Some(scores) = walked.scores() {
        let mut overall = Map::new();
        insert_scores(&mut overall, &scores, walked.preset);
        whole.insert("overall".into(), overall.into());
    }
    whole.insert("recordings".into(), walked.recordings.iter().map(recording).collect());
    let runs = walked
        .recordings
        .iter()
        .flat_map(|recording| recording.runs.iter().map(|each| run(&recording.file, each, walked)));
    whole.insert("runs".into(), runs.collect());
    whole.into()
}

fn recording(recording: &WalkedRecording) -> Value {
    let faults = recording.time_faults;
    json!({
        "file": recording.file,
        "runs": recording.runs.len(),
        "notes": recording.notes.iter().map(ToString::to_string).collect::<Vec<_>>(),
        "time_stood_still": faults.stood_still,
        "time_went_back": faults.went_back,
        "gaps": faults.gaps,
    })
}

fn run(file: &str, run: &WalkedRun, walked: &Walked) -> Value {
    let summary = run.odometry.summary();
    let mut fields = Map::new();
    fields.insert("file".into(), json!(file));
    fields.insert("run_id".into(), json!(run.id));
    fields.insert("periods".into(), json!(summary.periods));
    fields.insert("duration_s".into(), figure(summary.duration().as_s()));
    if let Some(last) = summary.last {
        for (key, value) in [
            ("distance_m", last.distance),
            ("confidence_distance_low_m", last.confidence.distance_low),
            ("confidence_distance_high_m", last.confidence.distance_high),
            ("guaranteed_distance_low_m", last.guaranteed.distance_low),
            ("guaranteed_distance_high_m", last.guaranteed.distance_high),
            ("over_m", last.over),
            ("under_m", last.under),
        ] {
            fields.insert(key.into(), figure(value.as_m()));
        }
    }
    fields.insert("accuracy".into(), json!(summary.accuracy));
    fields.insert(
        "accuracy_since_s".into(),
        summary.accuracy_since.map_or(Value::Null, |at| figure(at.as_s())),
    );
    fields.insert("top_speed_m_s".into(), figure(summary.top_speed.as_m_per_s()));
    let scales = run.odometry.wheel_scales();
    if scales.iter().any(Option::is_some) {
        let scale = |scale: Option<PlacedValue>| {
            scale.map(|scale| json!({ "value": figure(scale.value), "deviation": figure(scale.deviation) }))
        };
        fields.insert("wheel_scales".into(), json!(scales.map(scale)));
    }
    if let Some([passed, wrong]) = run.odometry.places_passed_and_wrong() {
        fields.insert("places".into(), json!({ "passed": passed, "wrong": wrong }));
    }
    fields.insert("modes".into(), json!(summary.modes));
    fields.insert("wheels".into(), json!(summary.flags));
    if let Some(scores) = run.odometry.scores().filter(|_| walked.is_scored) {
        insert_scores(&mut fields, scores, walked.preset);
    }
    fields.into()
}

/// The score of the preset that was asked for, and beside it those of both and of what others would make of it.
fn insert_scores(fields: &mut Map<String, Value>, scores: &RunScores, preset: Preset) {
    if let Value::Object(own) = score_json(&scores.preset(preset)) {
        fields.extend(own);
    }
    let presets = preset
        .scored()
        .into_iter()
        .map(|preset| (preset.key().to_owned(), score_json(&scores.preset(preset))));
    fields.insert("presets".into(), Value::Object(presets.collect()));
    let rivals = scores.rivals().map(|(rival, of)| (rival.key().to_owned(), score_json(&of)));
    fields.insert("baselines".into(), Value::Object(rivals.collect()));
}
