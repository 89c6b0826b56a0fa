//! `footplate store changes`: why numbers of today differ from those of last week.

use std::io::Write;
use std::path::Path;

use clap::Args;
use footplate_core::Timestamp;
use footplate_store::{Change, MarkKind, Store};
use serde_json::{Value, json};

use crate::clock::{Moment, local, now, rfc3339};
use crate::commands::Outcome;
use crate::counted::counted;

/// List what may have changed the numbers: events that came in, marks, calibrations.
#[derive(Args)]
#[command(after_help = "Example: footplate store changes --after 2026-11-14 --until 2026-11-21")]
pub(super) struct Arguments {
    /// Only what came after this date [default: the beginning].
    #[arg(long, value_name = "DATE")]
    after: Option<Moment>,
    /// Only what came until this date [default: now].
    #[arg(long, value_name = "DATE")]
    until: Option<Moment>,
    /// Write JSON, a line for each change.
    #[arg(long)]
    json: bool,
}

impl Arguments {
    pub(super) fn run(self, store: &Path, output: &mut dyn Write) -> anyhow::Result<Outcome> {
        let after = self.after.map_or(Timestamp::from_ns(i64::MIN), |moment| moment.0);
        let until = self.until.map_or_else(now, |moment| moment.0);
        for change in Store::open_to_read(store)?.changes(after, until)? {
            if self.json {
                writeln!(output, "{}", value(&change))?;
            } else {
                writeln!(output, "{}  {}", local(change.at()), words(&change))?;
            }
        }
        Ok(Outcome::Done)
    }
}

fn words(change: &Change) -> String {
    match change {
        Change::Measured { recording, name, events, .. } => {
            format!("{} came into recording {recording}, {name}", counted(*events, "event"))
        }
        Change::Marked(mark) => format!("event {} was {}: {}", mark.event, mark_word(mark.kind), mark.reason),
        Change::Calibrated { train, model_version, .. } => {
            format!("train {train} was calibrated by model {model_version}")
        }
    }
}

fn value(change: &Change) -> Value {
    let at = rfc3339(change.at());
    match change {
        Change::Measured { recording, name, events, .. } => {
            json!({ "at": at, "change": "measured", "recording": recording.0, "name": name, "events": events })
        }
        Change::Marked(mark) => {
            let (event, reason) = (mark.event.0, &mark.reason);
            json!({ "at": at, "change": mark_word(mark.kind), "event": event, "reason": reason })
        }
        Change::Calibrated { train, model_version, .. } => {
            json!({ "at": at, "change": "calibrated", "train": train, "model_version": model_version })
        }
    }
}

const fn mark_word(kind: MarkKind) -> &'static str {
    match kind {
        MarkKind::Excluded => "excluded",
        MarkKind::Restored => "restored",
    }
}
