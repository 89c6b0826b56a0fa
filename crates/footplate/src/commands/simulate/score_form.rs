//! The form in which scores are written.

use std::io::{self, Write};

use clap::Args;
use footplate_eval::seeds::{FRESH, seeds_sentence};
use footplate_eval::written_scores::WrittenScores;

/// The form that was asked for; a text for people without a word.
#[derive(Debug, Clone, Copy, Args)]
pub(super) struct ScoreForm {
    /// Write the scores as a page of the documentation.
    #[arg(long, conflicts_with = "json")]
    markdown: bool,
    /// Write the scores as JSON.
    #[arg(long)]
    json: bool,
    /// Write only how often what must not happen did, as rows of a table, each with its 95 % interval (Wilson).
    #[arg(long, conflicts_with_all = ["json", "markdown"])]
    rates: bool,
}

impl ScoreForm {
    pub(super) fn write<S: WrittenScores>(self, scores: &S, output: &mut dyn Write) -> io::Result<()> {
        if self.rates {
            return scores.rates().iter().try_for_each(|rate| writeln!(output, "{}", rate.row(S::SCORER)));
        }
        if self.json {
            return scores.write_json(output);
        }
        if self.markdown {
            let head = scores.head();
            writeln!(output, "{head}\n{}\n", seeds_sentence(head.contains(FRESH)))?;
        }
        scores.write_text(output)
    }
}
