//! `footplate predict`: walks recorded sensor logs, forecasts every report and says how good that was.

mod figures;
mod hit_rows;
mod json;
mod picture;
mod report;
mod tables;

use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;

use anyhow::{Context, bail};
use clap::Args;
use footplate_core::model::MotionModel;
use footplate_core::track::{Layout, Leg};
use footplate_core::{TrainId, TurnoutId};
use footplate_store::score::{Forecasters, ReplayContext, ScoredRecording, score_recording};
use footplate_store::{MotionFile, Recording, layout_named};

use super::Outcome;
use super::log_file::LogFile;
use super::output_files::check_outputs;
use super::plot::PictureFile;
use crate::layout_check::{LengthWarning, check_runs};
use crate::progress::with_progress;
use crate::standard_error::say;

/// Forecast every next sensor of recorded logs, and score that.
///
/// A log is walked in the order of time, never looking ahead: each report is forecast with an interval, compared,
/// and learnt from. Beside ours stand the forecasts that others would make of the same reports: a constant table
/// (speeds of the first lap), running averages of the speed of a step (EWMA), the last lap; and two that know the
/// whole log beforehand, the oracle and the hindsight table. Each log begins with nothing known, unless
/// `--carry-on` or `--calibration` says otherwise.
#[derive(Args)]
#[command(
    after_help = "Example: footplate predict testdata/sensor-logs/eadanila_2020_track_a.csv --layout track-a\n\
                  Picture: footplate predict testdata/sensor-logs/*.csv --layout track-a --summary --plot errors.svg"
)]
pub(crate) struct Arguments {
    /// Sensor logs, in any of the forms of docs/formats/sensor-log.md.
    #[arg(required = true, value_name = "LOG")]
    logs: Vec<PathBuf>,
    /// The layout: the name of a built-in one or a layout file.
    #[arg(long, default_value = "track-a")]
    layout: String,
    /// Only this train; also the train of logs that name none, in their rows or their file name.
    #[arg(long, value_name = "N")]
    train: Option<u16>,
    /// How a turnout lies when runs begin, such as 6=straight; may be repeated.
    #[arg(long = "turnout", value_name = "N=LEG", value_parser = turnout_state)]
    turnouts: Vec<(TurnoutId, Leg)>,
    /// Begin with what a calibration says (TOML or JSON, as `footplate calibrate --out` writes it).
    #[arg(long, value_name = "FILE")]
    calibration: Option<PathBuf>,
    /// Keep what one log taught for the next, in the order given.
    #[arg(long)]
    carry_on: bool,
    /// Draw how far everybody's forecasts were off to this file, SVG or PNG by its ending.
    #[arg(long, value_name = "FILE")]
    plot: Option<PictureFile>,
    /// Leave out the hits, print only what sums them up.
    #[arg(long)]
    summary: bool,
    /// Write JSON.
    #[arg(long)]
    json: bool,
    /// Write the summary as Markdown tables with the targets beside them.
    #[arg(long, conflicts_with = "json")]
    markdown: bool,
}

impl Arguments {
    pub(crate) fn run(self, output: &mut dyn Write) -> anyhow::Result<Outcome> {
        let inputs = self.logs.iter().chain(&self.calibration).map(PathBuf::as_path);
        check_outputs(inputs, &[("--plot", self.plot.as_ref().map(PictureFile::path))])?;
        let layout = layout_named(&self.layout)?.layout;
        let logs = LogFile::read_each(&self.logs, &layout, self.train.map(TrainId))?;
        let warning = check_runs(&layout, logs.iter().flat_map(|log| &log.recording.runs))?;
        let outcome = LengthWarning::outcome(warning.as_ref());
        for (turnout, _) in &self.turnouts {
            if layout.branch(*turnout).is_none() {
                bail!("--turnout: {} has no turnout {turnout}", layout.name());
            }
        }
        let known = self.calibration.as_deref().map(|path| calibration(path, &layout)).transpose()?;
        let scored = self.score(&layout, &logs, known)?;
        if let Some(plot) = &self.plot {
            let picture = picture::of(&layout, &scored).with_context(|| {
                format!(
                    "{}: nothing could be predicted, so there is nothing to draw; a train has to pass \
                     three sensors at one step",
                    plot.path().display()
                )
            })?;
            plot.write(&picture)?;
        }
        if self.json {
            let mut value = json::scores(&layout, &scored, !self.summary);
            value["warnings"] = warning.iter().map(|warning| warning.english.as_str()).collect();
            writeln!(output, "{}", serde_json::to_string_pretty(&value)?)?;
            return Ok(outcome);
        }
        if let Some(warning) = warning {
            writeln!(output, "WARNING: {}\n", warning.english)?;
        }
        if self.markdown {
            report::write(output, &layout, &scored)?;
        } else {
            for recording in scored.iter().filter(|_| !self.summary) {
                hit_rows::write(output, &layout, recording)?;
            }
            tables::write(output, &scored)?;
        }
        Ok(outcome)
    }

    fn score(
        &self,
        layout: &Layout,
        logs: &[LogFile],
        calibration: Option<MotionModel>,
    ) -> anyhow::Result<Vec<ScoredRecording>> {
        let context = ReplayContext { layout, turnouts: &self.turnouts };
        let events = |recording: &Recording| recording.runs.iter().map(|run| run.events.len()).sum::<usize>();
        with_progress("scoring", logs.iter().map(|log| events(&log.recording)).sum(), |done| {
            let mut before = Forecasters::of_layout(layout);
            if let Some(calibration) = calibration {
                before.predictor.know(calibration);
            }
            let mut forecasters = before.clone();
            let (mut scored, mut absent) = (Vec::new(), Vec::new());
            for LogFile { path, recording, .. } in logs {
                if !self.carry_on {
                    forecasters = before.clone();
                }
                let only = self.train.map(TrainId);
                let score = score_recording(context, recording, only, &mut forecasters)
                    .with_context(|| path.display().to_string())?;
                if score.runs == 0 {
                    absent.push(format!(
                        "{}: no run of train {}",
                        path.display(),
                        self.train.unwrap_or_default()
                    ));
                } else {
                    scored.push(score);
                }
                done.fetch_add(events(recording) as u64, Ordering::Relaxed);
            }
            if scored.is_empty() {
                bail!("{}", absent.join("\n       "));
            }
            for absent in absent {
                say!("{absent}, so it is left out");
            }
            Ok(scored)
        })
    }
}

/// The model of a file, if it was made on the layout.
fn calibration(path: &Path, layout: &Layout) -> anyhow::Result<MotionModel> {
    let file = MotionFile::read(path)?;
    if file.layout != layout.name() {
        bail!(
            "{}: a model made on {}, and the recordings are of {}: use a model made on {}",
            path.display(),
            file.layout,
            layout.name(),
            layout.name()
        );
    }
    file.model(layout).with_context(|| path.display().to_string())
}

/// Reads `6=straight`.
pub(super) fn turnout_state(text: &str) -> Result<(TurnoutId, Leg), String> {
    let wanted =
        || format!("`{text}` should be the number of a turnout and its leg, such as 6=straight or 7=curved");
    let (number, leg) = text.split_once('=').ok_or_else(wanted)?;
    let leg = match leg {
        "straight" => Leg::Straight,
        "curved" => Leg::Curved,
        _ => return Err(wanted()),
    };
    Ok((TurnoutId(number.parse().map_err(|_| wanted())?), leg))
}
