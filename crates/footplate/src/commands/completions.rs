//! `footplate completions`: shell completion.

use std::io::Write;

use clap::{Args, CommandFactory};
use clap_complete::Shell;

use super::Outcome;

/// Print the completion script of a shell.
#[derive(Args)]
#[command(
    after_help = "Example: footplate completions bash > ~/.local/share/bash-completion/completions/footplate"
)]
pub(crate) struct Arguments {
    /// The shell.
    shell: Shell,
}

impl Arguments {
    pub(crate) fn run(self, output: &mut dyn Write) -> anyhow::Result<Outcome> {
        let mut script = Vec::new();
        clap_complete::generate(self.shell, &mut crate::Footplate::command(), "footplate", &mut script);
        output.write_all(&script)?;
        Ok(Outcome::Done)
    }
}
