//! What every scorer can write: a text for people, a page of the documentation, JSON, and rates with their intervals.

use std::io::{self, Write};

use crate::figures::binomial_interval;

/// How often something happened that should not.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Rate {
    what: String,
    times: usize,
    of: usize,
    is_grief: bool,
}

impl Rate {
    /// So many times of so many.
    pub fn new(what: impl Into<String>, times: usize, of: usize) -> Self {
        Self { what: what.into(), times, of, is_grief: false }
    }

    /// So many times of so many something was broken: trains that touched, derailed or ran off the track.
    pub fn grief(times: usize, of: usize) -> Self {
        Self { is_grief: true, ..Self::new("came to grief", times, of) }
    }

    /// A row: who scored, what, how often, of how many, the share and its interval in percent. `./ci.sh fresh` looks for
    /// rows of grief.
    pub fn row(&self, scorer: &str) -> String {
        let [low, high] = binomial_interval(self.times, self.of).map(|share| 100.0 * share);
        let share = 100.0 * self.times as f64 / self.of.max(1) as f64;
        let mark = if self.is_grief && self.times > 0 { "**" } else { "" };
        let Self { what, times, of, .. } = self;
        format!("| {scorer} | {mark}{what}{mark} | {times} | {of} | {share:.2} | {low:.2} to {high:.2} |")
    }
}

/// What a scorer found.
pub trait WrittenScores {
    /// The name of the scorer on the command line.
    const SCORER: &'static str;
    /// What stands above the text on a page of the documentation, the command that makes it included.
    fn head(&self) -> String;
    /// The text for people, which is that of the page, too.
    ///
    /// # Errors
    /// Those of the output.
    fn write_text(&self, output: &mut dyn Write) -> io::Result<()>;
    /// The same for machines.
    ///
    /// # Errors
    /// Those of the output.
    fn write_json(&self, output: &mut dyn Write) -> io::Result<()>;
    /// How often happened what should not.
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
