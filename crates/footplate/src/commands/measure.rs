//! `footplate measure`: what only a person can measure, as a measurement like any other.

mod stop;
mod stopped_run;
mod stops_picture;

use std::io::Write;

use clap::{Args, Subcommand};

use super::Outcome;

/// Add a measurement by hand, such as the place of rest of a train, measured with a tape.
#[derive(Args)]
#[command(after_help = "Example: footplate measure stop --store railway.db --train 24 --at C13+120mm")]
pub(crate) struct Arguments {
    #[command(subcommand)]
    what: What,
}

#[derive(Subcommand)]
enum What {
    Stop(stop::Arguments),
}

impl Arguments {
    pub(crate) fn run(self, output: &mut dyn Write) -> anyhow::Result<Outcome> {
        match self.what {
            What::Stop(arguments) => arguments.run(output),
        }
    }
}
