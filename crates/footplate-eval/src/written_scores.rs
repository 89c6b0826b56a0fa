//! The outputs of every score: text, a page of the documentation, JSON, and rates with their intervals.

use std::io::{self, Write};

use crate::figures::binomial_interval;

/// A rate of unwanted events.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Rate {
    what: String,
    times: usize,
    of: usize,
    is_grief: bool,
}

impl Rate {
    /// A rate of `times` in `of`.
    pub fn new(what: impl Into<String>, times: usize, of: usize) -> Self {
        Self { what: what.into(), times, of, is_grief: false }
    }

    /// The rate of collisions, derailments and overruns of the track end.
    pub fn grief(times: usize, of: usize) -> Self {
        Self { is_grief: true, ..Self::new("came to grief", times, of) }
    }

    /// A table row: score, event, count, total, share and its interval in percent. `./ci.sh fresh` searches for rows of
    /// grief.
    pub fn row(&self, scorer: &str) -> String {
        let [low, high] = binomial_interval(self.times, self.of).map(|share| 100.0 * share);
        let share = 100.0 * self.times as f64 / self.of.max(1) as f64;
        let mark = if self.is_grief && self.times > 0 { "**" } else { "" };
        let Self { what, times, of, .. } = self;
        format!("| {scorer} | {mark}{what}{mark} | {times} | {of} | {share:.2} | {low:.2} to {high:.2} |")
    }
}

/// The results of a score.
pub trait WrittenScores {
    /// The name of the score on the command line.
    const SCORER: &'static str;
    /// The head of its page in the documentation, with the command that reproduces it.
    fn head(&self) -> String;
    /// Writes the text, which is also that of the page.
    ///
    /// # Errors
    /// Those of the output.
    fn write_text(&self, output: &mut dyn Write) -> io::Result<()>;
    /// Writes JSON.
    ///
    /// # Errors
    /// Those of the output.
    fn write_json(&self, output: &mut dyn Write) -> io::Result<()>;
    /// The rates of unwanted events.
    fn rates(&self) -> Vec<Rate>;
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
