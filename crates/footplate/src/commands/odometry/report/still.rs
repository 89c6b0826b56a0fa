//! A run as a picture: speed with its interval and wheels, and how far off the distance is.

use std::path::Path;

use super::super::run_series::{MOST_POINTS, SeriesForm};
use super::{Walked, tables};
use crate::commands::plot::{Ink, Layer, Panel, Picture, Shape};

/// The first run of the first recording; nothing if there is none.
pub(in crate::commands::odometry) fn still(walked: &Walked) -> Option<Picture> {
    let recording = walked.recordings.first()?;
    let run = recording.runs.iter().find(|run| run.series.is_some())?;
    let form = run.series.as_ref()?.form(MOST_POINTS);
    let file = Path::new(&recording.file)
        .file_name()
        .map_or_else(|| recording.file.clone(), |name| name.display().to_string());
    let runs = recording.runs.len();
    let which = if runs > 1 { format!(", {} of {runs} runs", run.name) } else { String::new() };
    let mut subtitle = format!("{}, preset {}", whose(walked), walked.preset.key());
    if let Some(score) =
        run.odometry.scores().map(|scores| scores.preset(walked.preset)).filter(|score| score.scored > 0)
    {
        subtitle.push_str("; ");
        subtitle.push_str(tables::held(&score));
    }
    let interval = format!("{} % interval", walked.confidence_pct());
    Some(Picture {
        title: format!("Odometry of {file}{which}"),
        subtitle,
        panels: vec![speed(&form, &interval), distance(&form, &interval)],
    })
}

/// Whose figures they are: without a vehicle file those of no train that ran.
fn whose(walked: &Walked) -> &str {
    if walked.has_vehicle { &walked.vehicle } else { "no vehicle file: figures of an example train" }
}

fn speed(form: &SeriesForm, interval: &str) -> Panel {
    let mut layers = Vec::new();
    if let Some(band) = band(form, "confidence_speed_low_m_s", "confidence_speed_high_m_s") {
        layers.push(Layer::new(interval, Ink::First, band));
    }
    let lines = [
        ("wheel_1_m_s", "wheelset 1", Ink::Second),
        ("wheel_2_m_s", "wheelset 2", Ink::Third),
        ("speed_m_s", "estimate", Ink::First),
    ];
    for (line, label, ink) in lines {
        layers.extend(points(form, line).map(|points| Layer::new(label, ink, Shape::Line(points))));
    }
    layers.extend(
        points(form, "true_speed_m_s").map(|points| Layer::new("truth", Ink::Plain, Shape::Dashed(points))),
    );
    Panel { y: "speed (m/s)".to_owned(), height: Some(3), from_zero: true, layers, ..Panel::default() }
}

/// Against the truth where it is known, or else how wide the interval is.
fn distance(form: &SeriesForm, interval: &str) -> Panel {
    let x = "time since the first period (s)".to_owned();
    let (y, layers) =
        match (band(form, "confidence_error_low_m", "confidence_error_high_m"), points(form, "error_m")) {
            (Some(bounds), Some(error)) => (
                "distance beyond the truth (m)",
                vec![
                    Layer::new(interval, Ink::First, bounds),
                    Layer::new("estimate", Ink::First, Shape::Line(error)),
                ],
            ),
            _ => {
                let lines = [
                    ("width_m", "width of the interval", Ink::First),
                    ("over_m", "over-read by at most", Ink::Second),
                    ("under_m", "under-read by at most", Ink::Third),
                ];
                let layer =
                    |(line, label, ink)| Some(Layer::new(label, ink, Shape::Line(points(form, line)?)));
                ("distance (m)", lines.into_iter().filter_map(layer).collect())
            }
        };
    Panel { x, y: y.to_owned(), height: Some(2), from_zero: true, layers }
}

fn points(form: &SeriesForm, line: &str) -> Option<Vec<(f64, f64)>> {
    let values = form.line(line)?;
    Some(form.times().zip(values).map(|(time, value)| (time, value.unwrap_or(f64::NAN))).collect())
}

fn band(form: &SeriesForm, low: &str, high: &str) -> Option<Shape> {
    let both = form.times().zip(form.line(low)?.iter().zip(form.line(high)?));
    Some(Shape::Band(both.filter_map(|(time, (low, high))| Some((time, (*low)?, (*high)?))).collect()))
}
