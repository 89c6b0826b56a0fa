//! Runs that failed a check, and the command that does only such a run again.

use std::fmt;

use crate::commands::Outcome;
use crate::standard_error::say;

/// One run of a scorer that did not do what it must.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct FailedRun {
    /// What went wrong, and whose run it was.
    pub(super) what: String,
    /// What the command line says behind `footplate` to run only this one.
    pub(super) again: String,
}

impl fmt::Display for FailedRun {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}; only this again: footplate {}", self.what, self.again)
    }
}

/// More failures than these say nothing new to a person.
const MOST_SAID: usize = 20;

/// Names runs that failed on standard error, where a score does not go; a score with any of them falls short. A line of
/// `testdata/seeds.txt` that is made of one is driven by every test run from then on.
pub(super) fn name_failed(failed: &[FailedRun]) -> Outcome {
    for run in failed.iter().take(MOST_SAID) {
        say!("failed: {run}");
    }
    if failed.len() > MOST_SAID {
        say!("and {} more failed", failed.len() - MOST_SAID);
    }
    if failed.is_empty() { Outcome::Done } else { Outcome::FallsShort }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failed_run_says_how_to_have_it_again() {
        let failed = FailedRun {
            what: "seed 7, law lag: 1 incident".to_owned(),
            again: "simulate driving --seed 7 --law lag".to_owned(),
        };
        assert_eq!(
            failed.to_string(),
            "seed 7, law lag: 1 incident; only this again: footplate simulate driving --seed 7 --law lag"
        );
        assert!(matches!(name_failed(&[failed]), Outcome::FallsShort));
        assert!(matches!(name_failed(&[]), Outcome::Done));
    }
}
