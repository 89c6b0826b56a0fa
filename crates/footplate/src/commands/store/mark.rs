//! `footplate store exclude` and `restore`: what a person thinks of an event, with the reason.

use std::io::Write;
use std::ops::RangeInclusive;
use std::path::Path;

use clap::Args;
use footplate_store::{EventKey, MarkKind, Store, StoreError};
use serde_json::json;

use crate::clock::now;
use crate::commands::Outcome;
use crate::counted::counted;

/// The most events that one command marks, chosen: beyond it a slip of the keyboard is likelier than intent.
const MOST_EVENTS: i64 = 100_000;

/// The events and the reason.
#[derive(Args)]
pub(super) struct Arguments {
    /// Events by their number, or from one to another as in 20-29; `footplate store show` lists them.
    #[arg(required = true, value_parser = events)]
    events: Vec<RangeInclusive<i64>>,
    /// Why, for later readers.
    #[arg(long)]
    reason: String,
    /// Report as JSON.
    #[arg(long)]
    json: bool,
}

impl Arguments {
    pub(super) fn exclude(self, store: &Path, output: &mut dyn Write) -> anyhow::Result<Outcome> {
        self.mark(store, MarkKind::Excluded, output)
    }

    pub(super) fn restore(self, store: &Path, output: &mut dyn Write) -> anyhow::Result<Outcome> {
        self.mark(store, MarkKind::Restored, output)
    }

    fn mark(self, store: &Path, kind: MarkKind, output: &mut dyn Write) -> anyhow::Result<Outcome> {
        let events: Vec<EventKey> = self.events.into_iter().flatten().map(EventKey).collect();
        let mut store = Store::open(store)?;
        let mark: fn(&mut Store, &[EventKey], &str, _) -> Result<(), StoreError> = match kind {
            MarkKind::Excluded => Store::exclude,
            MarkKind::Restored => Store::restore,
        };
        mark(&mut store, &events, &self.reason, now())?;
        let word = match kind {
            MarkKind::Excluded => "excluded",
            MarkKind::Restored => "restored",
        };
        if self.json {
            let events: Vec<i64> = events.iter().map(|event| event.0).collect();
            writeln!(output, "{}", json!({ word: events, "reason": self.reason.trim() }))?;
        } else {
            writeln!(output, "{word} {}: {}", counted(events.len(), "event"), self.reason.trim())?;
        }
        Ok(Outcome::Done)
    }
}

/// One event, or all from one to another.
fn events(text: &str) -> Result<RangeInclusive<i64>, String> {
    let (first, last) = text.split_once('-').unwrap_or((text, text));
    match (first.parse::<u32>(), last.parse::<u32>()) {
        (Ok(first), Ok(last)) if first <= last => {
            let range = i64::from(first)..=i64::from(last);
            if range.end() - range.start() < MOST_EVENTS {
                Ok(range)
            } else {
                Err(format!("these are more than {MOST_EVENTS} events; mark them in parts if you mean it"))
            }
        }
        _ => Err("write the number of an event, or two as in 20-29".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn events_are_named_one_by_one_or_from_to() {
        assert_eq!(events("17"), Ok(17..=17));
        assert_eq!(events("20-29"), Ok(20..=29));
        for wrong in ["", "-3", "3-", "9-3", "a", "1-2-3", "1-200000", "99999999999"] {
            assert!(events(wrong).is_err(), "{wrong}");
        }
    }
}
