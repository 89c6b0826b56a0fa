//! What series of positions say, as text and as JSON.

use std::io::Write;

use footplate_core::model::report::{SeriesChange, SeriesFit};
use footplate_core::{Acceleration, Estimate, TimeSpan};
use footplate_store::PositionSeries;
use serde_json::{Value, json};

pub(super) fn write(series: &[PositionSeries], is_json: bool, output: &mut dyn Write) -> anyhow::Result<()> {
    let mut forms = Vec::new();
    for series in series {
        let fit = series.fit()?;
        if is_json {
            forms.push(form(series, &fit));
        } else {
            write_text(series, &fit, output)?;
        }
    }
    if is_json {
        writeln!(output, "{}", serde_json::to_string_pretty(&json!({ "series": forms }))?)?;
    }
    Ok(())
}

fn write_text(series: &PositionSeries, fit: &SeriesFit, output: &mut dyn Write) -> anyhow::Result<()> {
    let change = name(fit.change);
    writeln!(output, "{}: a {change}, {} positions", series.file, series.points.len())?;
    let mut line = |name: &str, value: f64, deviation: f64, unit: &str, decimals: usize| {
        writeln!(output, "  {name:<18}{value:>9.decimals$} ± {deviation:.decimals$} {unit}")
    };
    let speed_name = if fit.change == SeriesChange::Stop { "speed before" } else { "speed after" };
    line(speed_name, fit.speed.value.as_mm_per_s(), fit.speed.uncertainty.as_mm_per_s(), "mm/s", 1)?;
    let mut span =
        |name: &str, span: Estimate<TimeSpan>| line(name, span.value.as_s(), span.uncertainty.as_s(), "s", 3);
    span("takes effect at", fit.effect)?;
    span("lag", fit.lag)?;
    span("ramp", fit.ramp)?;
    if let Some(time) = fit.stopping_time {
        span("stopping time", time)?;
    }
    if let Some(friction) = fit.friction {
        let [value, deviation] = [friction.value, friction.uncertainty].map(Acceleration::as_mm_per_s2);
        line("friction", value, deviation, "mm/s²", 1)?;
    }
    if let Some(distance) = fit.stopping_distance {
        line("stopping distance", distance.value.as_mm(), distance.uncertainty.as_mm(), "mm", 1)?;
    }
    writeln!(
        output,
        "  residuals (rms) {:.1} mm; {:.1} mm if the speed changed evenly",
        fit.residual.as_mm(),
        fit.even_residual.as_mm()
    )?;
    writeln!(
        output,
        "  ± of speed, lag, ramp and friction supposes that the train follows this law (docs/formats/position-series.md)"
    )?;
    Ok(())
}

fn form(series: &PositionSeries, fit: &SeriesFit) -> Value {
    let span = |span: Estimate<TimeSpan>| json!({ "value": span.value.as_s(), "uncertainty": span.uncertainty.as_s() });
    json!({
        "file": series.file,
        "change": name(fit.change),
        "positions": series.points.len(),
        "speed_mm_per_s": { "value": fit.speed.value.as_mm_per_s(), "uncertainty": fit.speed.uncertainty.as_mm_per_s() },
        "effect_s": span(fit.effect),
        "lag_s": span(fit.lag),
        "ramp_s": span(fit.ramp),
        "stopping_time_s": fit.stopping_time.map(span),
        "friction_mm_per_s2": fit.friction.map(|friction| json!({
            "value": friction.value.as_mm_per_s2(), "uncertainty": friction.uncertainty.as_mm_per_s2()
        })),
        "stopping_distance_mm": fit.stopping_distance.map(|distance| json!({
            "value": distance.value.as_mm(), "uncertainty": distance.uncertainty.as_mm()
        })),
        "residual_rms_mm": fit.residual.as_mm(),
        "even_residual_rms_mm": fit.even_residual.as_mm(),
        "residual_correlation": fit.correlation,
    })
}

fn name(change: SeriesChange) -> &'static str {
    match change {
        SeriesChange::Start => "start",
        SeriesChange::Stop => "stop",
    }
}
