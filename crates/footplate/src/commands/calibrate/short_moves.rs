//! When to command the stop of a short move, by the motion model of a calibrated train or by moves measured with a tape, as
//! text and as JSON.

use std::io::Write;

use anyhow::bail;
use footplate_core::model::report::ShortMoveFit;
use footplate_core::model::{MotionModel, ShortMoveForecast, StepUse};
use footplate_core::{Acceleration, Length, Speed, SpeedStep, TimeSpan, TrainId};
use footplate_store::{Batch, TapedMoves};
use serde_json::{Value, json};

/// Distances (mm) that a time is given for.
const DISTANCES_MM: [f64; 8] = [10.0, 20.0, 37.0, 50.0, 100.0, 200.0, 300.0, 500.0];

/// A train's short move with the least uncertainty.
struct Planned {
    step: SpeedStep,
    time: TimeSpan,
    forecast: ShortMoveForecast,
}

/// What measured moves say.
pub(super) fn write_measured(
    files: &[TapedMoves],
    is_json: bool,
    output: &mut dyn Write,
) -> anyhow::Result<()> {
    let mut forms = Vec::new();
    for file in files {
        if file.trains.is_empty() {
            bail!("{}: there is no short move in it: write a line for each", file.file);
        }
        for (train, moves) in &file.trains {
            let name =
                train.map_or_else(|| file.file.clone(), |train| format!("{}, train {train}", file.file));
            let fit = ShortMoveFit::of(moves).map_err(|why| anyhow::anyhow!("{name}: {why}"))?;
            if is_json {
                forms.push(measured_form(&file.file, *train, &fit));
            } else {
                write_fit(&name, &fit, output)?;
            }
        }
    }
    if is_json {
        writeln!(output, "{}", serde_json::to_string_pretty(&json!({ "short_moves": forms }))?)?;
    }
    Ok(())
}

fn write_fit(name: &str, fit: &ShortMoveFit, output: &mut dyn Write) -> anyhow::Result<()> {
    writeln!(output, "{name}: short moves of {} times", fit.moves.len())?;
    let mut line = |name: &str, value: f64, deviation: f64, unit: &str, decimals: usize| {
        writeln!(output, "  {name:<18}{value:>8.decimals$} ± {deviation:.decimals$} {unit}")
    };
    let of = fit.start_delay;
    line("start delay", of.value.as_s(), of.uncertainty.as_s(), "s longer than that of the stop", 3)?;
    let [value, deviation] = [fit.speed.value, fit.speed.uncertainty].map(Speed::as_mm_per_s);
    line("speed", value, deviation, "mm/s", 0)?;
    for (name, of) in [("acceleration", fit.acceleration), ("deceleration", fit.deceleration)] {
        let [value, deviation] = [of.value, of.uncertainty].map(Acceleration::as_mm_per_s2);
        line(name, value, deviation, "mm/s²", 0)?;
    }
    writeln!(output, "  stop after   measured   by law   by table   (each without this move)")?;
    for one in &fit.moves {
        let by_table =
            one.by_table.map_or_else(|| "–".to_owned(), |distance| format!("{:.0} mm", distance.as_mm()));
        writeln!(
            output,
            "  {:>8.2} s {:>7.0} mm {:>5.0} mm {by_table:>10}",
            one.time.as_s(),
            one.measured.as_mm(),
            one.by_law.as_mm()
        )?;
    }
    let law = fit.law_error().as_mm();
    match (fit.table_error(), &fit.table) {
        (Some(table), _) => {
            let better = if table < fit.law_error() { "the table" } else { "the law" };
            writeln!(
                output,
                "  error (rms) {law:.1} mm by law, {:.1} mm by table: {better} is used below",
                table.as_mm()
            )?;
        }
        (None, Err(why)) => writeln!(output, "  error (rms) {law:.1} mm by law; no table: {why}")?,
        (None, Ok(_)) => writeln!(output, "  error (rms) {law:.1} mm by law; the table needs every move")?,
    }
    for (distance, time) in times(fit) {
        writeln!(
            output,
            "  to move {:>4.0} ± {:.0} mm: command the stop after {:.2} s",
            distance.as_mm(),
            better_error(fit).as_mm(),
            time.as_s()
        )?;
    }
    Ok(())
}

/// How far moves end from where the times of [`times`] are to bring them, one standard deviation.
fn better_error(fit: &ShortMoveFit) -> Length {
    fit.table_error().map_or(fit.law_error(), |table| table.min(fit.law_error()))
}

/// Times for the distances between the shortest and the longest measured move.
fn times(fit: &ShortMoveFit) -> Vec<(Length, TimeSpan)> {
    let measured = || fit.moves.iter().map(|one| one.measured);
    let [shortest, longest] = [
        measured().fold(Length::from_m(f64::INFINITY), Length::min),
        measured().fold(Length::ZERO, Length::max),
    ];
    let within = DISTANCES_MM.map(Length::from_mm).into_iter().filter(|of| (shortest..=longest).contains(of));
    within.filter_map(|distance| Some((distance, fit.better().command_time(distance)?))).collect()
}

fn measured_form(file: &str, train: Option<TrainId>, fit: &ShortMoveFit) -> Value {
    let quantity = |value: f64, uncertainty: f64| json!({ "value": value, "uncertainty": uncertainty });
    let acceleration = |of: footplate_core::Estimate<Acceleration>| {
        quantity(of.value.as_mm_per_s2(), of.uncertainty.as_mm_per_s2())
    };
    let moves = fit.moves.iter().map(|one| {
        json!({
            "command_time_s": one.time.as_s(),
            "measured_mm": one.measured.as_mm(),
            "by_law_mm": one.by_law.as_mm(),
            "by_table_mm": one.by_table.map(Length::as_mm),
        })
    });
    let times = times(fit).into_iter().map(|(distance, time)| {
        json!({
            "distance_mm": distance.as_mm(),
            "uncertainty_mm": better_error(fit).as_mm(),
            "command_time_s": time.as_s(),
        })
    });
    json!({
        "file": file,
        "train": train,
        "start_delay_s": quantity(fit.start_delay.value.as_s(), fit.start_delay.uncertainty.as_s()),
        "speed_mm_per_s": quantity(fit.speed.value.as_mm_per_s(), fit.speed.uncertainty.as_mm_per_s()),
        "acceleration_mm_per_s2": acceleration(fit.acceleration),
        "deceleration_mm_per_s2": acceleration(fit.deceleration),
        "law_error_mm": fit.law_error().as_mm(),
        "table_error_mm": fit.table_error().map(Length::as_mm),
        "no_table": fit.table.as_ref().err().map(ToString::to_string),
        "moves": moves.collect::<Vec<_>>(),
        "times": times.collect::<Vec<_>>(),
    })
}

/// Short moves of calibrated trains.
pub(super) fn write_calibrated(batch: &Batch, is_json: bool, output: &mut dyn Write) -> anyhow::Result<()> {
    let mut forms = Vec::new();
    for train in &batch.trains {
        let model = train.replay.fit.model();
        let planned: Vec<(f64, Option<Planned>)> =
            DISTANCES_MM.iter().map(|mm| (*mm, best_move(model, Length::from_mm(*mm)))).collect();
        if is_json {
            forms.push(calibrated_form(model.train(), &planned));
            continue;
        }
        writeln!(output, "Train {}: short moves from standstill", model.train())?;
        writeln!(output, "  distance    step   stop after      error (95 %)")?;
        for (mm, planned) in &planned {
            match planned {
                Some(Planned { step, time, forecast }) => writeln!(
                    output,
                    "  {mm:>5.0} mm {:>7} {:>10.2} s {:>12} mm",
                    step.get(),
                    time.as_s(),
                    format!("±{:.0}", footplate_core::HALF_95 * forecast.deviation().as_mm())
                )?,
                None => writeln!(output, "  {mm:>5.0} mm    no calibrated step gets there")?,
            }
        }
        writeln!(output)?;
    }
    if is_json {
        writeln!(output, "{}", serde_json::to_string_pretty(&json!({ "trains": forms }))?)?;
    } else {
        writeln!(output, "step: the one with the smallest error; stop after: time between the two commands")?;
    }
    Ok(())
}

/// The short move of a distance whose end is least uncertain, of all steps that the train is known to run at.
fn best_move(model: &MotionModel, distance: Length) -> Option<Planned> {
    let steps = (1..=model.highest().get()).filter_map(SpeedStep::new);
    let known = steps.filter(|step| model.uses(*step) == StepUse::Moves);
    let planned = known.filter_map(|step| {
        let time = model.short_move_time(step, distance)?;
        Some(Planned { step, time, forecast: model.short_move(step, time) })
    });
    planned.min_by(|one, other| one.forecast.deviation().as_m().total_cmp(&other.forecast.deviation().as_m()))
}

fn calibrated_form(train: TrainId, planned: &[(f64, Option<Planned>)]) -> Value {
    let moves = planned.iter().map(|(mm, planned)| {
        json!({
            "distance_mm": mm,
            "step": planned.as_ref().map(|of| of.step.get()),
            "command_time_s": planned.as_ref().map(|of| of.time.as_s()),
            "uncertainty_mm": planned.as_ref().map(|of| of.forecast.uncertainty.as_mm()),
            "scatter_mm": planned.as_ref().map(|of| of.forecast.scatter.as_mm()),
        })
    });
    json!({ "train": train, "moves": moves.collect::<Vec<_>>() })
}
