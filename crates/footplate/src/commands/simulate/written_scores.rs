//! Scores as they are written: for people, for the documentation, and for machines.

use std::io::{self, Write};

use clap::Args;

/// The form that was asked for; a text for people without a word.
#[derive(Debug, Clone, Copy, Args)]
pub(super) struct ScoreForm {
    /// Write the scores as a page of the documentation.
    #[arg(long, conflicts_with = "json")]
    markdown: bool,
    /// Write the scores as JSON.
    #[arg(long)]
    json: bool,
}

/// What a scorer found.
pub(super) trait WrittenScores {
    /// What stands above the text on a page of the documentation, the command that makes it included.
    fn head(&self) -> String;
    fn write_text(&self, output: &mut dyn Write) -> io::Result<()>;
    fn write_json(&self, output: &mut dyn Write) -> io::Result<()>;
}

impl ScoreForm {
    pub(super) fn write(self, scores: &impl WrittenScores, output: &mut dyn Write) -> io::Result<()> {
        if self.json {
            return scores.write_json(output);
        }
        if self.markdown {
            writeln!(output, "{}", scores.head())?;
        }
        scores.write_text(output)
    }
}
