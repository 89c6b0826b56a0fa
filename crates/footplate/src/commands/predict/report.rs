//! The summary as Markdown tables, by team and train, with the targets beside them.
//!
//! Logs whose names begin with the same word, up to the first `_`, are taken to be of one team.

use std::collections::BTreeMap;
use std::io::{self, Write};

use footplate_core::TrainId;
use footplate_core::track::Layout;
use footplate_core::tracking::ForecastPhase;
use footplate_store::score::{
    BASELINES, Comparison, Coverage, ForecastScore, GateAgreement, GateCheck, LEVELS, ReferenceForecaster,
    ReferenceScore, ScoredHit, ScoredRecording,
};

use super::figures::{Hits, PHASES, by_step, in_phase, one_decimal, per_cent, ratio};

/// In steady running after the first lap the median error is at most this, ...
const STEADY_MEDIAN_MM: f64 = 12.0;
/// ... and at most this many times that of the oracle.
const ORACLE_RATIO: f64 = 1.15;
/// Through starts and changes of speed the median error is at most this.
const CHANGE_MEDIAN_MM: f64 = 30.0;
/// The parts of reports that intervals of [`LEVELS`] are to hold.
const COVERAGE: [(f64, f64); LEVELS.len()] = [(0.45, 0.55), (0.87, 0.93), (0.98, 1.0)];

/// Hits of one train of one team, in one log or in all of the team's.
struct Group<'a> {
    team: &'a str,
    train: TrainId,
    log: &'a str,
    hits: Hits<'a>,
}

/// Writes the page.
pub(super) fn write(
    output: &mut dyn Write,
    layout: &Layout,
    recordings: &[ScoredRecording],
) -> io::Result<()> {
    let groups = groups(recordings);
    let all: Hits<'_> = recordings.iter().flat_map(|recording| &recording.hits).collect();
    write!(
        output,
        "# How good predictions are\n\n\
         Written by `footplate predict LOG… --layout {} --markdown`. Every log was walked once, never looking\n\
         ahead, and began with nothing known. An error is the time by which a report came later or earlier than\n\
         forecast, times the speed that was forecast there; medians and 90th percentiles are of its amount, in mm.\n\
         Below a coverage stands which true probabilities are in keeping with it at 95 % (binomial). *Ratio* is our\n\
         median over the other's on the hits that both forecast.\n",
        layout.name()
    )?;
    steady(output, &groups, &all)?;
    for (phase, title, target) in [
        (ForecastPhase::FirstLap, "First lap at a step", None),
        (ForecastPhase::Change, "Starts and changes of speed", Some(CHANGE_MEDIAN_MM)),
    ] {
        other_phase(output, phase, title, target, &groups, &all)?;
    }
    steps(output, &all)?;
    everybody(output, &all)?;
    gates(output, recordings)
}

/// By team and train: all logs of the two first, if there are several, then each.
fn groups(recordings: &[ScoredRecording]) -> Vec<Group<'_>> {
    let mut logs: BTreeMap<(&str, TrainId), Vec<Group<'_>>> = BTreeMap::new();
    for recording in recordings {
        let team = recording.name.split('_').next().unwrap_or_default();
        for train in recording.trains() {
            let hits = recording.hits.iter().filter(|hit| hit.train == train).collect();
            let group = Group { team, train, log: &recording.name, hits };
            logs.entry((team, train)).or_default().push(group);
        }
    }
    let mut groups = Vec::new();
    for ((team, train), logs) in logs {
        if logs.len() > 1 {
            let hits = logs.iter().flat_map(|group| group.hits.iter().copied()).collect();
            groups.push(Group { team, train, log: "all", hits });
        }
        groups.extend(logs);
    }
    groups
}

fn steady(output: &mut dyn Write, groups: &[Group<'_>], all: &[&ScoredHit]) -> io::Result<()> {
    write!(
        output,
        "\n## Steady running after the first lap\n\n\
         Targets: median ≤ {STEADY_MEDIAN_MM:.0} mm, ratio to the oracle ≤ {ORACLE_RATIO:.2}, better than every \
         baseline, coverage.\n\
         The last lap repeats stamps of polls, so it is held against our own forecast of the poll, by the mean error\n\
         on the hits that both forecast: medians of both are next to nothing.\n\n\
         | team | train | log | n | median | 90 % | bias | in 50 % | in 90 % | in 99 % | oracle | ratio | best table or \
         average | ratio | mean at a poll | of the last lap | missed |\n\
         |---|--:|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|---|--:|--:|--:|---|\n"
    )?;
    for_each(groups, all, |name, hits| {
        let comparison = in_phase(hits, ForecastPhase::Steady);
        let ours = comparison.ours;
        if ours.scored == 0 {
            return writeln!(output, "| {name} | 0 | | | | | | | | | | | | | |");
        }
        let oracle = comparison.reference(ReferenceForecaster::Oracle);
        let best = best_baseline(&comparison);
        let mut missed = Vec::new();
        missed.extend(ours.median_abs_mm.filter(|mm| *mm > STEADY_MEDIAN_MM).map(|_| "median"));
        missed.extend(
            oracle.and_then(ReferenceScore::ratio).filter(|ratio| *ratio > ORACLE_RATIO).map(|_| "oracle"),
        );
        let lap = lap_comparison(hits);
        let beaten = best.and_then(ReferenceScore::ratio).is_some_and(|ratio| ratio > 1.0);
        let lapped = lap.is_some_and(|[ours, lap]| ours > lap);
        missed.extend((beaten || lapped).then_some("baseline"));
        missed.extend(missed_coverage(&ours));
        let baseline = best.map_or_else(String::new, |best| {
            format!("{} {}", best.reference, one_decimal(best.score.median_abs_mm))
        });
        writeln!(
            output,
            "| {name} | {} | {} | {} | {baseline} | {} | {} | {} | {} |",
            our_cells(&ours),
            one_decimal(oracle.and_then(|oracle| oracle.score.median_abs_mm)),
            ratio(oracle.and_then(ReferenceScore::ratio)),
            ratio(best.and_then(ReferenceScore::ratio)),
            one_decimal(lap.map(|[ours, _]| ours)),
            one_decimal(lap.map(|[_, lap]| lap)),
            missed.join(", "),
        )
    })
}

/// Mean errors of our forecasts of the poll and of the last lap's, on the hits that both forecast.
fn lap_comparison(hits: &[&ScoredHit]) -> Option<[f64; 2]> {
    let both: Hits<'_> =
        hits.iter().filter(|hit| hit.late_by(ReferenceForecaster::LastLap).is_some()).copied().collect();
    let comparison = in_phase(&both, ForecastPhase::Steady);
    let mean = |reference| comparison.reference(reference)?.score.mean_abs_mm;
    Some([mean(ReferenceForecaster::AtPoll)?, mean(ReferenceForecaster::LastLap)?])
}

/// The table or average that we beat least.
fn best_baseline(comparison: &Comparison) -> Option<&ReferenceScore> {
    let averages = BASELINES.iter().filter(|reference| **reference != ReferenceForecaster::LastLap);
    let scored = averages.filter_map(|reference| comparison.reference(*reference));
    let with_ratio = scored.filter_map(|found| Some((found, found.ratio()?)));
    with_ratio.max_by(|(_, one), (_, other)| one.total_cmp(other)).map(|(found, _)| found)
}

fn other_phase(
    output: &mut dyn Write,
    phase: ForecastPhase,
    title: &str,
    target: Option<f64>,
    groups: &[Group<'_>],
    all: &[&ScoredHit],
) -> io::Result<()> {
    let median = target.map_or_else(String::new, |mm| format!("median ≤ {mm:.0} mm, "));
    write!(
        output,
        "\n## {title}\n\nTargets: {median}coverage.\n\n\
         | team | train | log | n | median | 90 % | bias | in 50 % | in 90 % | in 99 % | oracle | missed |\n\
         |---|--:|---|--:|--:|--:|--:|--:|--:|--:|--:|---|\n"
    )?;
    for_each(groups, all, |name, hits| {
        let comparison = in_phase(hits, phase);
        let ours = comparison.ours;
        if ours.scored == 0 {
            return Ok(());
        }
        let mut missed = Vec::new();
        missed.extend(ours.median_abs_mm.zip(target).filter(|(mm, most)| mm > most).map(|_| "median"));
        missed.extend(missed_coverage(&ours));
        let oracle =
            comparison.reference(ReferenceForecaster::Oracle).and_then(|oracle| oracle.score.median_abs_mm);
        writeln!(
            output,
            "| {name} | {} | {} | {} |",
            our_cells(&ours),
            one_decimal(oracle),
            missed.join(", ")
        )
    })
}

/// Calls `row` with the first cells and the hits of every group and of all together.
fn for_each(
    groups: &[Group<'_>],
    all: &[&ScoredHit],
    mut row: impl FnMut(&str, &[&ScoredHit]) -> io::Result<()>,
) -> io::Result<()> {
    for Group { team, train, log, hits } in groups {
        row(&format!("{team} | {train} | {log}"), hits)?;
    }
    row("**all** | | ", all)
}

/// n, median, 90 %, bias and the three coverages.
fn our_cells(ours: &ForecastScore) -> String {
    let coverages = ours.coverage.map(|coverage| coverage.map(coverage_cell).join(" | "));
    format!(
        "{} | {} | {} | {} | {}",
        ours.scored,
        one_decimal(ours.median_abs_mm),
        one_decimal(ours.p90_abs_mm),
        one_decimal(ours.bias_mm),
        coverages.unwrap_or_else(|| " | | ".to_owned()),
    )
}

fn coverage_cell(coverage: Coverage) -> String {
    let (low, high) = coverage.plausible();
    format!("{}<br>{}–{}", per_cent(coverage.fraction()), per_cent(low), per_cent(high))
}

/// The levels whose coverage the count rules out.
fn missed_coverage(ours: &ForecastScore) -> Vec<&'static str> {
    let names = ["50 %", "90 %", "99 %"];
    let Some(coverage) = ours.coverage else { return Vec::new() };
    let rows = names.iter().zip(coverage).zip(COVERAGE);
    rows.filter(|((_, coverage), (least, most))| {
        let (low, high) = coverage.plausible();
        high < *least || low > *most
    })
    .map(|((name, _), _)| *name)
    .collect()
}

/// All trains together by step: coverages that are true in the mean may be so of no step.
fn steps(output: &mut dyn Write, all: &[&ScoredHit]) -> io::Result<()> {
    write!(
        output,
        "\n## By step, all logs\n\n\
         | step | phase | n | median | 90 % | bias | in 50 % | in 90 % | in 99 % | missed |\n\
         |--:|---|--:|--:|--:|--:|--:|--:|--:|---|\n"
    )?;
    for (step, hits) in by_step(all) {
        for (phase, name, _) in PHASES {
            let ours = in_phase(&hits, phase).ours;
            if ours.scored > 0 {
                let missed = missed_coverage(&ours).join(", ");
                writeln!(output, "| {step} | {name} | {} | {missed} |", our_cells(&ours))?;
            }
        }
    }
    Ok(())
}

/// All forecasters side by side.
fn everybody(output: &mut dyn Write, all: &[&ScoredHit]) -> io::Result<()> {
    write!(
        output,
        "\n## Everybody, all logs\n\n\
         Reports come in steps of a poll (some 65 ms, 26 mm at 400 mm/s), so a forecast that repeats an earlier time\n\
         is often right to the millisecond and otherwise a whole step off: its median is next to nothing while its\n\
         mean and its 90th percentile are large.\n\n\
         | phase | forecaster | n | median | mean | 90 % | our median there | ratio |\n\
         |---|---|--:|--:|--:|--:|--:|--:|\n"
    )?;
    for (phase, name, _) in PHASES {
        let comparison = in_phase(all, phase);
        writeln!(output, "| {name} | **Footplate** | {} | | |", score_cells(&comparison.ours))?;
        for found in comparison.references.iter().filter(|found| found.score.scored > 0) {
            let theirs = score_cells(&found.score);
            let ours = one_decimal(found.ours.median_abs_mm);
            writeln!(
                output,
                "| {name} | {} | {theirs} | {ours} | {} |",
                found.reference,
                ratio(found.ratio())
            )?;
        }
    }
    Ok(())
}

fn score_cells(score: &ForecastScore) -> String {
    let [median, mean, p90] = [score.median_abs_mm, score.mean_abs_mm, score.p90_abs_mm].map(one_decimal);
    format!("{} | {median} | {mean} | {p90}", score.scored)
}

/// Light gates, where there are any.
fn gates(output: &mut dyn Write, recordings: &[ScoredRecording]) -> io::Result<()> {
    let checks: Vec<&GateCheck> = recordings.iter().flat_map(|recording| &recording.gates).collect();
    let Some(overall) = GateAgreement::of(checks.iter().copied()) else { return Ok(()) };
    write!(
        output,
        "\n## Light gates\n\n\
         The estimated speed at the end of each lap less the speed between two light gates 20 mm apart, which the\n\
         estimator never sees, in % of the latter. Where the gates stood is not recorded, and trains are faster or\n\
         slower there than on average, each at each step in its own way: that is the bias and most of the spread.\n\
         The spread within a train and step is what to hold against the resolution of the gates' clock (1 ms).\n\n\
         | train | pairs | bias | spread | within a step | resolution |\n|---|--:|--:|--:|--:|--:|\n"
    )?;
    for (train, agreement) in GateAgreement::by_train(checks.iter().copied()) {
        writeln!(output, "| {train} | {} |", gate_cells(agreement))?;
    }
    writeln!(output, "| **all** | {} |", gate_cells(overall))
}

fn gate_cells(agreement: GateAgreement) -> String {
    let per_cent = |part: Option<f64>| one_decimal(part.map(|part| 100.0 * part));
    let [bias, spread, within, resolution] =
        [Some(agreement.bias), Some(agreement.spread), agreement.spread_within, Some(agreement.resolution)]
            .map(per_cent);
    format!("{} | {bias} | {spread} | {within} | {resolution}", agreement.count)
}
