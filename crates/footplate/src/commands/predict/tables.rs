//! The summary for a person: everybody's errors by phase, ours by train and step, light gates.

use std::io::{self, Write};

use footplate_core::TrainId;
use footplate_store::score::{
    Comparison, ForecastScore, GateAgreement, GateCheck, LEVELS, ReferenceForecaster, ScoredHit,
    ScoredRecording,
};

use super::figures::{Hits, PHASES, by_step, by_train, comparison, in_phase, one_decimal, per_cent, ratio};

/// Writes the summary of all recordings.
pub(super) fn write(output: &mut dyn Write, recordings: &[ScoredRecording]) -> io::Result<()> {
    let all: Hits<'_> = recordings.iter().flat_map(|recording| &recording.hits).collect();
    if recordings.len() > 1 {
        for recording in recordings {
            block(output, &recording.name, &recording.hits.iter().collect::<Hits<'_>>())?;
        }
    }
    let trains = by_train(&all);
    if trains.len() > 1 {
        for (train, hits) in &trains {
            block(output, &format!("train {train}"), hits)?;
        }
    }
    let logs = match recordings {
        [only] => only.name.as_str(),
        _ => "all logs",
    };
    let of = match trains.first_key_value() {
        Some((train, _)) if trains.len() == 1 => format!("train {train}"),
        _ => "all trains".to_owned(),
    };
    block(output, &format!("{logs}, {of}"), &all)?;
    steps(output, &all)?;
    gates(output, recordings)
}

/// One selection: a row a forecaster, a group of columns a phase.
fn block(output: &mut dyn Write, name: &str, hits: &[&ScoredHit]) -> io::Result<()> {
    let overall = comparison(hits);
    writeln!(output, "{name}")?;
    write!(output, "  {} hits, {} forecast", overall.ours.hits, overall.ours.scored)?;
    if let Some(right) = overall.named_correctly() {
        write!(output, "; the sensor named as the next was right in {} %", per_cent(right))?;
    }
    let phases = PHASES.map(|(phase, ..)| in_phase(hits, phase));
    write!(output, "\n\n  {:<16}", "error in mm")?;
    for (_, phase, _) in PHASES {
        write!(output, "  {phase:<24}")?;
    }
    write!(output, "\n  {:<16}", "")?;
    for _ in PHASES {
        write!(output, "  {:>5} {:>6} {:>5} {:>5}", "n", "median", "90 %", "we/it")?;
    }
    write!(output, "\n  {:<16}", "Footplate")?;
    for phase in &phases {
        columns(output, &phase.ours, "")?;
    }
    for reference in ReferenceForecaster::ALL {
        write!(output, "\n  {:<16}", reference.to_string())?;
        for phase in &phases {
            if let Some(found) = phase.reference(reference) {
                columns(output, &found.score, &ratio(found.ratio()))?;
            }
        }
    }
    for (place, level) in LEVELS.iter().enumerate() {
        write!(output, "\n  {:<16}", format!("inside {} %", per_cent(*level)))?;
        for phase in &phases {
            write!(output, "  {:>24}", coverage(phase, place))?;
        }
    }
    writeln!(output, "\n")
}

fn columns(output: &mut dyn Write, score: &ForecastScore, ratio: &str) -> io::Result<()> {
    let (median, p90) = (one_decimal(score.median_abs_mm), one_decimal(score.p90_abs_mm));
    write!(output, "  {:>5} {median:>6} {p90:>5} {ratio:>5}", score.scored)
}

/// The part inside the interval at a place of [`LEVELS`], and what it may truly be.
fn coverage(comparison: &Comparison, place: usize) -> String {
    comparison.ours.coverage.map_or_else(
        || "–".to_owned(),
        |coverage| {
            let (low, high) = coverage[place].plausible();
            let part = coverage[place].fraction();
            format!("{} % ({} to {})", per_cent(part), per_cent(low), per_cent(high))
        },
    )
}

/// Ours by train and step.
fn steps(output: &mut dyn Write, hits: &[&ScoredHit]) -> io::Result<()> {
    writeln!(
        output,
        "train step   hits  forecast  median mm   90 % mm   bias mm  median ms   inside 50 %  90 %  99 %"
    )?;
    for (train, hits) in by_train(hits) {
        for (step, hits) in by_step(&hits) {
            let score = ForecastScore::of(hits.into_iter());
            let figures = [score.median_abs_mm, score.p90_abs_mm, score.bias_mm, score.median_abs_ms];
            let [median, p90, bias, ms] = figures.map(one_decimal);
            let [half, most, nearly_all] = score.coverage.map_or_else(
                || LEVELS.map(|_| "–".to_owned()),
                |coverage| coverage.map(|coverage| per_cent(coverage.fraction())),
            );
            writeln!(
                output,
                "{train:>5} {:>4} {:>6}  {:>8}  {median:>9}  {p90:>8}  {bias:>8}  {ms:>9}  {half:>12} {most:>5} \
                 {nearly_all:>5}",
                step.get(),
                score.hits,
                score.scored,
            )?;
        }
    }
    Ok(())
}

/// Light gates, where there are any.
fn gates(output: &mut dyn Write, recordings: &[ScoredRecording]) -> io::Result<()> {
    let checks: Vec<&GateCheck> = recordings.iter().flat_map(|recording| &recording.gates).collect();
    let Some(overall) = GateAgreement::of(checks.iter().copied()) else { return Ok(()) };
    writeln!(output, "\nestimated speed less the speed between the light gates, in % of it (and mm/s)")?;
    writeln!(output, "train  pairs            bias          spread   within a step  of the gates' clock")?;
    for (train, agreement) in GateAgreement::by_train(checks.iter().copied()) {
        gate_row(output, Some(train), agreement)?;
    }
    gate_row(output, None, overall)
}

fn gate_row(output: &mut dyn Write, train: Option<TrainId>, agreement: GateAgreement) -> io::Result<()> {
    let both = |part: f64, mm_per_s: f64| {
        format!("{} ({})", one_decimal(Some(100.0 * part)), one_decimal(Some(mm_per_s)))
    };
    let within = agreement.spread_within.zip(agreement.spread_within_mm_per_s);
    writeln!(
        output,
        "{:>5}  {:>5} {:>15} {:>15} {:>15} {:>20}",
        train.map_or_else(|| "all".to_owned(), |train| train.to_string()),
        agreement.count,
        both(agreement.bias, agreement.bias_mm_per_s),
        both(agreement.spread, agreement.spread_mm_per_s),
        within.map_or_else(|| "–".to_owned(), |(part, mm_per_s)| both(part, mm_per_s)),
        both(agreement.resolution, agreement.resolution_mm_per_s),
    )
}
