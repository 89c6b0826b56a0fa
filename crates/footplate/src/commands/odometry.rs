//! `footplate odometry`: tachometer recordings to speed, distance and bounds that hold.

mod block_stream;
mod imu;
pub(super) mod json;
mod recording;
mod report;
mod results;
mod run_series;
mod tables;
mod uploaded;
mod walked;
mod watched_slide;

use std::io::Write;
use std::path::PathBuf;

use anyhow::{Context, bail};
use clap::{Args, ValueEnum};
use footplate_store::odometry::{Preset, RunContext};
use footplate_store::{ColumnMapping, default_vehicle, read_vehicle};

use super::Outcome;
use super::output_files::check_outputs;
use super::plot::PictureFile;
use super::web_page::Language;
use crate::standard_error::say;
use recording::{Mapped, OpenRecording, WalkedRecording};
use results::Results;
pub(super) use uploaded::{PassingFolder, uploaded_page};
pub(super) use walked::SPEED_INSIDE_PCT;
use walked::{Walked, no_vehicle};
pub(super) use watched_slide::WatchedSlide;

/// Estimate speed and distance, with bounds, from what two wheelsets counted.
///
/// Recordings are CSV or Parquet with the columns t_s, pulses_1, pulses_2 (or counter_1, counter_2) and those that
/// docs/formats/tachometer-recording.md lists; `-` is standard input, whose every line is answered at once with
/// `--out -`. Runs that are distinguished by `run_id` are independent of each other. With `--score`, estimates are
/// compared with the truth in the recording (true_speed_m_s, true_distance_m), and so are both presets and what
/// simpler odometers make of the same counts.
#[derive(Args)]
#[command(
    after_help = "Example: footplate odometry run.csv --vehicle train.toml --score --out result.parquet\n\
                  Charts:  footplate odometry run.csv --vehicle train.toml --report run.html\n\
                  Picture: footplate odometry run.csv --vehicle train.toml --plot run.svg\n\
                  Live:    tachometer | footplate odometry - --out -\n\
                  Phone:   footplate odometry --imu trip_accel.csv --score\n\
                  Foreign: footplate odometry drive.csv --vehicle tram.toml --map t_ms=time --map speed_1_km_h=v1\n\n\
                  Exit status: 0 done, 1 the truth left the guaranteed bounds (--score), a claim of the
                  vehicle file does not hold, or there is no vehicle file, 2 wrong usage or input."
)]
pub(crate) struct Arguments {
    /// Tachometer recordings, CSV or Parquet; `-` for standard input, but with --imu.
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    /// What is known of the train (docs/formats/vehicle.md). Without it every figure is that of a train with two powered
    /// wheelsets of 80 teeth, and the exit status is 1.
    #[arg(long, value_name = "V.toml")]
    vehicle: Option<PathBuf>,
    /// Which column holds what, where they have other names, units or separators than ours (CSV only): our name=theirs, as in
    /// speed_1_km_h=v1; also separator, decimal and period_s (docs/formats/column-mapping.md).
    #[arg(long, value_name = "NAME=COLUMN")]
    map: Vec<String>,
    /// The same pairs in a TOML file; pairs of the command line replace them.
    #[arg(long, value_name = "M.toml")]
    map_file: Option<PathBuf>,
    /// Which method of estimation.
    #[arg(long, value_enum, default_value_t = PresetName::Recommended)]
    preset: PresetName,
    /// Probability that the truth lies within the confidence interval.
    #[arg(long, value_name = "P", default_value_t = 0.9999, value_parser = confidence)]
    confidence: f64,
    /// Write an estimate a period to this file, CSV or Parquet by its ending; `-` for CSV on standard output.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Write a page with charts to this file (HTML), to open in any browser without a network.
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,
    /// The language of that page.
    #[arg(long, value_enum, default_value_t, requires = "report")]
    language: Language,
    /// Draw the first run to this file, SVG or PNG by its ending.
    #[arg(long, value_name = "FILE")]
    plot: Option<PictureFile>,
    /// The files are recordings of an accelerometer alone: find standstills and the hops between them
    /// (docs/formats/accelerometer-recording.md). With `--score`, beside the stops marked in `x_stops.csv`.
    #[arg(long, conflicts_with_all = ["vehicle", "map", "map_file", "out", "report", "plot", "preset", "confidence", "language"])]
    imu: bool,
    /// With --imu --score: print the score as a table for documentation.
    #[arg(long, requires_all = ["imu", "score"], conflicts_with = "json")]
    markdown: bool,
    /// Compare with the truth that the recording holds.
    #[arg(long)]
    score: bool,
    /// Write JSON.
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum PresetName {
    /// The published algorithm, read so that its printed figures come out.
    Paper,
    /// The published algorithm to the letter.
    Literal,
    /// What is best on every scenario.
    Recommended,
}

impl From<PresetName> for Preset {
    fn from(name: PresetName) -> Self {
        match name {
            PresetName::Paper => Self::Paper,
            PresetName::Literal => Self::Literal,
            PresetName::Recommended => Self::Recommended,
        }
    }
}

/// The highest probability of an interval: beyond it a Gaussian says nothing of real trains.
const MOST_CONFIDENCE: f64 = 0.999_999_999;

/// Reads a probability.
fn confidence(text: &str) -> Result<f64, String> {
    let value: f64 = text.parse().map_err(|_| format!("`{text}` is not a number"))?;
    if (0.5..=MOST_CONFIDENCE).contains(&value) {
        Ok(value)
    } else {
        Err(format!("{value} should lie between 0.5 and {MOST_CONFIDENCE}, as 0.9999 for 99.99 %"))
    }
}

/// The name that stands for standard input and output.
const STANDARD: &str = "-";

impl Arguments {
    pub(crate) fn run(self, output: &mut dyn Write) -> anyhow::Result<Outcome> {
        if self.imu {
            if self.files.iter().any(|file| file.as_os_str() == STANDARD) {
                bail!("--imu reads files, not standard input: write the recording to a file first");
            }
            let style = match (self.json, self.markdown) {
                (true, _) => imu::Style::Json,
                (_, true) => imu::Style::Markdown,
                _ => imu::Style::Text,
            };
            return imu::run(&self.files, self.score, style, output);
        }
        let inputs = self.files.iter().chain(&self.vehicle).chain(&self.map_file).map(PathBuf::as_path);
        check_outputs(
            inputs,
            &[
                ("--out", self.out.as_deref()),
                ("--report", self.report.as_deref()),
                ("--plot", self.plot.as_ref().map(PictureFile::path)),
            ],
        )?;
        let to_standard = self.out.as_ref().is_some_and(|out| out.as_os_str() == STANDARD);
        if to_standard && (self.json || self.score) {
            bail!(
                "--out - fills standard output with estimates; write them to a file beside --json or --score"
            );
        }
        if self.files.iter().filter(|file| file.as_os_str() == STANDARD).count() > 1 {
            bail!("`-` is given twice, and there is only one standard input");
        }
        let vehicle = match &self.vehicle {
            Some(path) => read_vehicle(path)?,
            None => default_vehicle()?,
        };
        let preset = Preset::from(self.preset);
        let context =
            RunContext { vehicle: vehicle.vehicle, preset, score: self.score, confidence: self.confidence };
        let mapping = self.mapping()?;
        let recordings = self.walk(&context, mapping.as_ref(), output)?;
        let walked = Walked {
            vehicle: vehicle.name,
            preset,
            recordings,
            has_vehicle: self.vehicle.is_some(),
            confidence: self.confidence,
            language: self.language,
            is_scored: self.score,
        };
        if let Some(page) = &self.report {
            report::write(page, &walked).with_context(|| format!("writing {}", page.display()))?;
        }
        if let Some(plot) = &self.plot {
            let picture = report::still(&walked)
                .with_context(|| format!("{}: there is no run to draw", plot.path().display()))?;
            plot.write(&picture)?;
        }
        let outcome = if walked.falls_short() { Outcome::FallsShort } else { Outcome::Done };
        if to_standard {
            for warning in walked.warnings(Language::English) {
                say!("{warning}");
            }
            return Ok(outcome);
        }
        if self.json {
            writeln!(output, "{}", serde_json::to_string_pretty(&json::walked(&walked))?)?;
        } else {
            tables::write(output, &walked)?;
        }
        Ok(outcome)
    }

    /// What the columns are called, if that is said.
    fn mapping(&self) -> anyhow::Result<Option<ColumnMapping>> {
        if self.map.is_empty() && self.map_file.is_none() {
            return Ok(None);
        }
        let mut mapping = ColumnMapping::default();
        if let Some(file) = &self.map_file {
            mapping.take_file(file)?;
        }
        for pair in &self.map {
            mapping.take_pair(pair)?;
        }
        Ok(Some(mapping))
    }

    /// Walks all recordings and writes what was asked for of their estimates.
    fn walk(
        &self,
        context: &RunContext,
        mapping: Option<&ColumnMapping>,
        output: &mut dyn Write,
    ) -> anyhow::Result<Vec<WalkedRecording>> {
        let mut output = Some(output);
        let mut results = None;
        let is_drawn = self.report.is_some() || self.plot.is_some();
        let mut charts_left = if is_drawn { report::MOST_RUNS } else { 0 };
        let mut walked = Vec::new();
        for file in &self.files {
            let mapped = mapping.map(|mapping| Mapped { mapping, vehicle: &context.vehicle });
            let recording = OpenRecording::open(file, self.score, mapped)?.one_of(self.files.len());
            if let (Some(out), Some(output)) = (&self.out, output.take()) {
                let with_runs = self.files.len() > 1 || recording.has_run_ids();
                let warning = self.vehicle.is_none().then(|| no_vehicle(Language::English));
                results = Some(Results::begin(out, output, with_runs, warning)?);
            }
            // A page says how good it was wherever the truth is there.
            let score = self.score || (is_drawn && recording.has_truth());
            let context = RunContext { score, ..*context };
            walked.push(recording.walk(&context, results.as_mut(), &mut charts_left)?);
        }
        if let (Some(results), Some(out)) = (results, &self.out) {
            results.finish().with_context(|| format!("writing {}", out.display()))?;
        }
        Ok(walked)
    }
}
