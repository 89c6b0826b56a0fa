//! `footplate convert`: any sensor log to Footplate's own form.

use std::io::Write;
use std::path::PathBuf;

use anyhow::Context;
use clap::Args;
use footplate_core::TrainId;
use footplate_store::{LogContext, layout_named, write_sensor_log, write_whole};
use serde_json::json;

use super::Outcome;
use super::log_file::LogFile;
use crate::counted::counted;

/// Convert a sensor log of any form to Footplate's own.
///
/// Nothing is lost but what was odd, which is said on standard error: repeats, stale contacts and runs without a
/// report are measurements like any other. docs/formats/sensor-log.md describes the forms.
#[derive(Args)]
#[command(
    after_help = "Example: footplate convert testdata/sensor-logs/eadanila_2020_track_a.csv --out laps.csv"
)]
pub(crate) struct Arguments {
    /// The log.
    log: PathBuf,
    /// The file to write.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Whose sensors the log names: a built-in layout (track-a, track-b) or a layout file.
    #[arg(long, default_value = "track-a")]
    layout: String,
    /// The train of a log that names none.
    #[arg(long, value_name = "N")]
    train: Option<u16>,
    /// Report as JSON.
    #[arg(long)]
    json: bool,
}

impl Arguments {
    pub(crate) fn run(self, output: &mut dyn Write) -> anyhow::Result<Outcome> {
        let layout = layout_named(&self.layout)?.layout;
        let context = LogContext { sensors: &layout, train: self.train.map(TrainId) };
        let recording = LogFile::read(&self.log, context)?.recording;
        let mut text = Vec::new();
        write_sensor_log(&recording, &layout, &mut text)?;
        write_whole(&self.out, &text).with_context(|| format!("writing {}", self.out.display()))?;
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
            writeln!(output, "{out}: {runs} with {events}, from the form {form}")?;
        }
        Ok(Outcome::Done)
    }
}
