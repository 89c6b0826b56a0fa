//! Scores as they are written: for people, for the documentation, for machines, and as rates with their intervals.

use std::io::{self, Write};

use clap::Args;

use super::driving::figures::binomial_interval;
use super::seeds::FRESH;

const OF_FRESH_SEEDS: &str =
    "The seeds are fresh: the commit behind the `@` drew them, and nobody chose them.";
const OF_REGRESSION_SEEDS: &str = "The seeds are regression seeds: they were looked at while the program was made. `./ci.sh fresh` draws others.";

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

/// How often something happened that should not.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Rate {
    what: String,
    times: usize,
    of: usize,
    is_grief: bool,
}

impl Rate {
    /// So many times of so many.
    pub(super) fn new(what: impl Into<String>, times: usize, of: usize) -> Self {
        Self { what: what.into(), times, of, is_grief: false }
    }

    /// So many times of so many something was broken: trains that touched, derailed or ran off the track.
    pub(super) fn grief(times: usize, of: usize) -> Self {
        Self { is_grief: true, ..Self::new("came to grief", times, of) }
    }

    /// A row: who scored, what, how often, of how many, the share and its interval in percent. `./ci.sh fresh` looks for
    /// rows of grief.
    fn row(&self, scorer: &str) -> String {
        let [low, high] = binomial_interval(self.times, self.of).map(|share| 100.0 * share);
        let share = 100.0 * self.times as f64 / self.of.max(1) as f64;
        let mark = if self.is_grief && self.times > 0 { "**" } else { "" };
        let Self { what, times, of, .. } = self;
        format!("| {scorer} | {mark}{what}{mark} | {times} | {of} | {share:.2} | {low:.2} to {high:.2} |")
    }
}

/// What a scorer found.
pub(super) trait WrittenScores {
    /// The name of the scorer on the command line.
    const SCORER: &'static str;
    /// What stands above the text on a page of the documentation, the command that makes it included.
    fn head(&self) -> String;
    fn write_text(&self, output: &mut dyn Write) -> io::Result<()>;
    fn write_json(&self, output: &mut dyn Write) -> io::Result<()>;
    /// How often happened what should not.
    fn rates(&self) -> Vec<Rate>;
}

/// Who chose the seeds of a page.
pub(super) const fn seeds_sentence(are_fresh: bool) -> &'static str {
    if are_fresh { OF_FRESH_SEEDS } else { OF_REGRESSION_SEEDS }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rate_has_its_interval_and_grief_stands_out() {
        // Wilson's interval for 10 of 100, as in any table: 5.5 to 17.4 %.
        let row = Rate::new("orders not carried out", 10, 100).row("driving");
        assert_eq!(row, "| driving | orders not carried out | 10 | 100 | 10.00 | 5.52 to 17.44 |");
        assert!(Rate::grief(1, 64).row("pacing").contains("| **came to grief** | 1 | 64 |"));
        assert!(Rate::grief(0, 64).row("pacing").contains("| came to grief | 0 | 64 | 0.00 | 0.00 to 5."));
    }
}
