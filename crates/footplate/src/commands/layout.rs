//! `footplate layout`: shows, checks, imports and surveys layouts.

mod check;
mod import;
mod show;
mod survey;

use std::io::Write;

use clap::{Args, Subcommand};

use super::Outcome;

/// Show, check, import or survey a layout.
#[derive(Args)]
#[command(after_help = "Example: footplate layout show track-a")]
pub(crate) struct Arguments {
    #[command(subcommand)]
    task: Task,
}

#[derive(Subcommand)]
enum Task {
    Show(show::Arguments),
    Check(check::Arguments),
    Import(import::Arguments),
    Survey(survey::Arguments),
}

impl Arguments {
    pub(crate) fn run(self, output: &mut dyn Write) -> anyhow::Result<Outcome> {
        match self.task {
            Task::Show(arguments) => arguments.run(output),
            Task::Check(arguments) => arguments.run(output),
            Task::Import(arguments) => arguments.run(output),
            Task::Survey(arguments) => arguments.run(output),
        }
    }
}
