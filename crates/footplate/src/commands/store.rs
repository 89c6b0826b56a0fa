//! `footplate store`: what was measured, kept for ever in one file.

mod changes;
mod import;
mod mark;
mod salvage;
mod show;

use std::io::Write;
use std::path::PathBuf;

use clap::{Args, Subcommand};

use super::Outcome;
pub(super) use show::words;

/// Keep measurements: show, import, exclude, restore, explain and salvage them.
#[derive(Args)]
#[command(after_help = "Example: footplate store import testdata/sensor-logs/*.csv --store railway.db")]
pub(crate) struct Arguments {
    /// The store.
    #[arg(long, value_name = "FILE", global = true, default_value = "footplate.db")]
    store: PathBuf,
    #[command(subcommand)]
    task: Task,
}

#[derive(Subcommand)]
enum Task {
    Show(show::Arguments),
    Import(import::Arguments),
    /// Exclude events from every calibration from now on.
    #[command(after_help = "Example: footplate store exclude 17 20-29 --reason \"a child lifted the train\"")]
    Exclude(mark::Arguments),
    /// Take events in again that were excluded.
    #[command(after_help = "Example: footplate store restore 17 --reason \"it was the other train\"")]
    Restore(mark::Arguments),
    Changes(changes::Arguments),
    Salvage(salvage::Arguments),
}

impl Arguments {
    pub(crate) fn run(self, output: &mut dyn Write) -> anyhow::Result<Outcome> {
        let store = self.store.as_path();
        match self.task {
            Task::Show(arguments) => arguments.run(store, output),
            Task::Import(arguments) => arguments.run(store, output),
            Task::Exclude(arguments) => arguments.exclude(store, output),
            Task::Restore(arguments) => arguments.restore(store, output),
            Task::Changes(arguments) => arguments.run(store, output),
            Task::Salvage(arguments) => arguments.run(store, output),
        }
    }
}
