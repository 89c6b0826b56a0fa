//! What recordings come to, for people.

use std::io::{self, Write};

use footplate_core::Timestamp;
use footplate_core::odometry::OdometerAccuracy;
use footplate_store::odometry::{OdometryScore, RunScores, RunSummary};

use super::recording::WalkedRun;
use super::walked::Walked;
use crate::commands::web_page::Language;
use crate::counted::counted;

/// Writes a line a run, and the scores if that was asked for.
pub(super) fn write(output: &mut dyn Write, walked: &Walked) -> io::Result<()> {
    for warning in walked.warnings(Language::English) {
        writeln!(output, "WARNING: {warning}\n")?;
    }
    for recording in &walked.recordings {
        let periods: u64 = recording.runs.iter().map(|run| run.odometry.summary().periods).sum();
        let (runs, periods) = (counted(recording.runs.len(), "run"), counted(periods, "period"));
        writeln!(output, "{}: {runs}, {periods}", recording.file)?;
        let faults = recording.time_faults;
        for (count, what) in [
            (faults.stood_still, "with the time of the row before it"),
            (faults.went_back, "earlier than the row before it"),
            (faults.gaps, "after a gap"),
        ] {
            if count > 0 {
                writeln!(output, "  {} {what}", counted(count, "row"))?;
            }
        }
        writeln!(
            output,
            "  {:<16} {:>9} {:>11} {:>11} {:>11} {:>7}  {:>6} {:>6} {:>6} {:>6} {:>6}",
            "run", "s", "m", "at least", "at most", "top m/s", "normal", "slip", "corr.", "ambig.", "degr."
        )?;
        for run in &recording.runs {
            run_row(output, run)?;
        }
        for run in &recording.runs {
            accuracy_note(output, run.odometry.summary())?;
        }
        writeln!(output)?;
    }
    match walked.scores() {
        Some(scores) => score_table(output, walked, &scores),
        None => Ok(()),
    }
}

fn run_row(output: &mut dyn Write, run: &WalkedRun) -> io::Result<()> {
    let summary = run.odometry.summary();
    let RunSummary { modes, top_speed, .. } = summary;
    let distances =
        summary.last.map(|last| [last.distance, last.guaranteed.distance_low, last.guaranteed.distance_high]);
    let [distance, low, high] = distances.map_or_else(
        || [(); 3].map(|()| "–".to_owned()),
        |distances| distances.map(|distance| format!("{:.2}", distance.as_m())),
    );
    let shares = [modes.normal, modes.one_slip, modes.correction, modes.ambiguous, modes.degraded]
        .map(|periods| format!("{:.1} %", 100.0 * periods as f64 / summary.periods.max(1) as f64));
    let [normal, slip, correction, ambiguous, degraded] = shares;
    writeln!(
        output,
        "  {:<16} {:>9.2} {distance:>11} {low:>11} {high:>11} {:>7.2}  {normal:>6} {slip:>6} {correction:>6} \
         {ambiguous:>6} {degraded:>6}",
        run.id.as_deref().unwrap_or("–"),
        summary.duration().as_s(),
        top_speed.as_m_per_s(),
    )
}

/// Whether distances are accurate enough for ETCS (SUBSET-026-3, 3.6.8), where they are not.
fn accuracy_note(output: &mut dyn Write, summary: &RunSummary) -> io::Result<()> {
    let said = match summary.accuracy {
        OdometerAccuracy::Sound => return Ok(()),
        OdometerAccuracy::Impaired => "impaired: more than 250 m may be wrong within 5000 m",
        OdometerAccuracy::Failed => "insufficient: more than 1500 m may be wrong within 5000 m",
    };
    let since = summary.accuracy_since.map_or(0.0, Timestamp::as_s);
    writeln!(
        output,
        "  from {since:.1} s on the accuracy of ETCS (3.6.8) is {said}, by the guaranteed bounds"
    )
}

/// A row an odometer, ours first.
fn score_table(output: &mut dyn Write, walked: &Walked, scores: &RunScores) -> io::Result<()> {
    let runs: usize = walked.recordings.iter().map(|recording| recording.runs.len()).sum();
    let own = scores.preset(walked.preset);
    let confidence = format!("{} %", walked.confidence_pct());
    writeln!(output, "against the truth, {} of {}", counted(own.scored, "period"), counted(runs, "run"))?;
    writeln!(
        output,
        "  {:<12} {:>7} {:>7} {:>9} {:>8} {:>9} {:>9} {:>7} {:>8} {:>7} {:>7} {:>7}",
        "",
        "rms",
        "max",
        "end",
        "end",
        "speed in",
        "dist. in",
        confidence,
        confidence,
        "ETCS v",
        "ETCS s",
        "delay"
    )?;
    writeln!(
        output,
        "  {:<12} {:>7} {:>7} {:>9} {:>8} {:>9} {:>9} {:>7} {:>8} {:>7} {:>7} {:>7}",
        "", "m/s", "m/s", "m", "%", "guar. %", "guar. %", "m/s wide", "m at end", "% out", "% out", "s"
    )?;
    let others = walked.preset.scored().into_iter().filter(|preset| *preset != walked.preset);
    for preset in [walked.preset].into_iter().chain(others) {
        score_row(output, preset.key(), &scores.preset(preset))?;
    }
    for (rival, score) in scores.rivals() {
        score_row(output, rival.title(), &score)?;
    }
    Ok(())
}

fn score_row(output: &mut dyn Write, name: &str, score: &OdometryScore) -> io::Result<()> {
    let text = |value: Option<f64>, decimals: usize| {
        value.map_or_else(|| "–".to_owned(), |value| format!("{value:.decimals$}"))
    };
    writeln!(
        output,
        "  {name:<12} {:>7} {:>7} {:>9} {:>8} {:>9} {:>9} {:>7} {:>8} {:>7} {:>7} {:>7}",
        text(score.speed_rms_m_s, 3),
        text(score.speed_max_m_s, 3),
        text(score.distance_end_m, 2),
        text(score.distance_end_pct, 3),
        text(score.speed_inside_pct, 3),
        text(score.distance_inside_pct, 3),
        text(score.confidence_speed_width_m_s, 3),
        text(score.confidence_distance_width_m, 2),
        text(score.etcs_speed_violation_pct, 2),
        text(score.etcs_distance_violation_pct, 2),
        text(score.detect_delay_s, 2),
    )
}
