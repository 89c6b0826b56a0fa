//! `footplate convert`: converts a sensor log, a train or a line from any known format to Footplate's own.

use std::io::Write;
use std::path::PathBuf;

use anyhow::{Context, bail};
use clap::Args;
use footplate_core::TrainId;
use footplate_store::{
    Described, LogContext, layout_named, read_described, write_line, write_sensor_log, write_train,
    write_whole,
};
use serde_json::json;

use super::Outcome;
use super::log_file::LogFile;
use super::output_files::check_outputs;
use crate::counted::counted;

/// Convert a sensor log, a train or a line to Footplate's own format.
///
/// The extension selects the kind: .csv is a sensor log; .json, .yaml and .toml are a full-size train or line. Repeated
/// reports, stale reports and runs without a report are kept like all others; oddities are reported on standard error.
/// docs/formats/sensor-log.md, docs/formats/train.md and docs/formats/line.md describe the formats.
#[derive(Args)]
#[command(
    after_help = "Examples: footplate convert testdata/sensor-logs/eadanila_2020_track_a.csv --out laps.csv
          footplate convert testdata/trains/ttobench_CH_Stadler_FLIRT_TPF.json --out flirt.toml"
)]
pub(crate) struct Arguments {
    /// The log, train or line.
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// The file to write.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// The layout of a log's sensors: a built-in layout (track-a, track-b, oval-blocks) or a layout file.
    /// track-a unless given.
    #[arg(long, value_name = "LAYOUT")]
    layout: Option<String>,
    /// The train of a log that names none.
    #[arg(long, value_name = "N")]
    train: Option<u16>,
    /// Which of several trains or lines in the file.
    #[arg(long, value_name = "ID")]
    name: Option<String>,
    /// Report as JSON.
    #[arg(long)]
    json: bool,
}

impl Arguments {
    pub(crate) fn run(self, output: &mut dyn Write) -> anyhow::Result<Outcome> {
        check_outputs([self.file.as_path()], &[("--out", Some(&self.out))])?;
        let extension = self.file.extension().and_then(|end| end.to_str()).unwrap_or_default();
        if ["json", "yaml", "yml", "toml"].contains(&extension.to_ascii_lowercase().as_str()) {
            self.convert_described(output)
        } else {
            self.convert_log(output)
        }
    }

    /// Whether the file to write can hold what is written: a file without an ending says nothing else.
    fn check_ending(&self, right: &str, why: &str) -> anyhow::Result<()> {
        match self.out.extension() {
            Some(ending) if !ending.eq_ignore_ascii_case(right) => {
                bail!("--out {}: {why}; let the name end with .{right}", self.out.display())
            }
            _ => Ok(()),
        }
    }

    fn write(&self, text: &[u8]) -> anyhow::Result<()> {
        write_whole(&self.out, text).with_context(|| format!("writing {}", self.out.display()))
    }

    fn convert_described(self, output: &mut dyn Write) -> anyhow::Result<Outcome> {
        for (option, is_given) in [("--layout", self.layout.is_some()), ("--train", self.train.is_some())] {
            if is_given {
                bail!(
                    "{option} is for sensor logs, and {} is a train or a line: leave it out",
                    self.file.display()
                );
            }
        }
        self.check_ending("toml", "a train or a line is written as TOML")?;
        let (form, kind, name, text) = match read_described(&self.file, self.name.as_deref())? {
            Described::Train(file) => {
                (file.form.name(), "train", file.train.name.clone(), write_train(&file.train, &file.about))
            }
            Described::Line(file) => {
                (file.form.name(), "line", file.line.name().to_owned(), write_line(&file.line, &file.about))
            }
        };
        self.write(text.as_bytes())?;
        if self.json {
            writeln!(output, "{}", json!({ "file": self.out, "form": form, kind: name }))?;
        } else {
            writeln!(output, "{}: {kind} {name}, from format {form}", self.out.display())?;
        }
        Ok(Outcome::Done)
    }

    fn convert_log(self, output: &mut dyn Write) -> anyhow::Result<Outcome> {
        self.check_ending("csv", "a sensor log is written as CSV")?;
        let layout = layout_named(self.layout.as_deref().unwrap_or("track-a"))?.layout;
        let context = LogContext { sensors: &layout, train: self.train.map(TrainId) };
        let recording = LogFile::read(&self.file, context)?.recording;
        let mut text = Vec::new();
        write_sensor_log(&recording, &layout, &mut text)?;
        self.write(&text)?;
        let events: usize = recording.runs.iter().map(|run| run.events.len()).sum();
        if self.json {
            let notes: Vec<String> = recording.notes.iter().map(ToString::to_string).collect();
            let report = json!({
                "file": self.out,
                "form": recording.form.name(),
                "runs": recording.runs.len(),
                "events": events,
                "notes": notes,
            });
            writeln!(output, "{report}")?;
        } else {
            let (runs, events) = (counted(recording.runs.len(), "run"), counted(events, "event"));
            let (out, form) = (self.out.display(), recording.form);
            writeln!(output, "{out}: {runs} with {events}, from format {form}")?;
        }
        Ok(Outcome::Done)
    }
}
