//! `footplate store import`: sensor logs into the store, each once.

use std::io::Write;
use std::path::{Path, PathBuf};

use clap::Args;
use footplate_core::TrainId;
use footplate_store::{Import, Store, layout_named};
use serde_json::json;

use crate::clock::{local, now, rfc3339};
use crate::commands::Outcome;
use crate::commands::log_file::LogFile;
use crate::counted::counted;
use crate::standard_error::say;

/// Import sensor logs of any form. A file that is in the store already is left alone.
#[derive(Args)]
#[command(after_help = "Example: footplate store import testdata/sensor-logs/*.csv --layout track-a")]
pub(super) struct Arguments {
    /// The logs.
    #[arg(required = true)]
    logs: Vec<PathBuf>,
    /// Whose sensors the logs name: a built-in layout (track-a, track-b, oval-blocks) or a layout file.
    #[arg(long, default_value = "track-a")]
    layout: String,
    /// The train of logs that name none.
    #[arg(long, value_name = "N")]
    train: Option<u16>,
    /// Report as JSON, a line for each log.
    #[arg(long)]
    json: bool,
}

impl Arguments {
    pub(super) fn run(self, store: &Path, output: &mut dyn Write) -> anyhow::Result<Outcome> {
        let layout = layout_named(&self.layout)?.layout;
        // All are read before the first is stored: a wrong one stops the import before it begins.
        let logs = LogFile::read_each(&self.logs, &layout, self.train.map(TrainId))?;
        let mut store = Store::open_or_create(store)?;
        let mut ending = Outcome::Done;
        for log in &logs {
            let outcome = store.import(&log.recording, log.content, layout.name(), now())?;
            self.report(&log.path, log, outcome, output)?;
            if let Import::AlreadyThere { recording, .. } = outcome
                && let Some(kept) = log.kept_otherwise(&store, recording, &layout)?
            {
                say!("{kept}");
                ending = Outcome::FallsShort;
            }
        }
        Ok(ending)
    }

    fn report(
        &self,
        path: &Path,
        log: &LogFile,
        outcome: Import,
        output: &mut dyn Write,
    ) -> std::io::Result<()> {
        let runs = log.recording.runs.len();
        let events: usize = log.recording.runs.iter().map(|run| run.events.len()).sum();
        let (recording, there_since) = match outcome {
            Import::New { recording } => (recording, None),
            Import::AlreadyThere { recording, stored_at } => (recording, Some(stored_at)),
        };
        if self.json {
            let notes: Vec<String> = log.recording.notes.iter().map(ToString::to_string).collect();
            let report = json!({
                "file": path,
                "recording": recording.0,
                "form": log.recording.form.name(),
                "runs": runs,
                "events": events,
                "there_since": there_since.map(rfc3339),
                "notes": notes,
            });
            return writeln!(output, "{report}");
        }
        let path = path.display();
        match there_since {
            None => {
                let (runs, events) = (counted(runs, "run"), counted(events, "event"));
                writeln!(output, "{path}: recording {recording}, {runs} with {events}")
            }
            Some(since) => {
                let since = local(since);
                writeln!(output, "{path}: in the store since {since} as recording {recording}; nothing added")
            }
        }
    }
}
