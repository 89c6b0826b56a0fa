//! How a run ends, and what people have to know then.

use std::fmt::{Display, Formatter, Result as FmtResult};
use std::time::Duration;

use footplate_core::TimeSpan;

use crate::link::Lost;

/// Longest time for the end of a session: one poll, the release of a turnout, and a stop for each train. A line in order
/// takes a third of it.
pub(super) const WITHIN: TimeSpan = TimeSpan::from_ms(5_000);

/// After a station was reported silent, it has this long to answer.
pub(super) const SECOND_CHANCE: TimeSpan = TimeSpan::from_ms(3_000);

/// How long the runtime tries to reopen a lost line, in real time: long enough to push a plug back in.
pub(super) const REOPEN_WITHIN: Duration = Duration::from_secs(5);

/// Why a run has ended.
#[derive(Debug)]
pub(crate) enum Ended {
    /// The attendant ended it.
    Finished,
    /// Ctrl-C or another signal.
    Interrupted,
    /// The line was lost and could not be reopened.
    LineLost(Lost),
    /// The station does not answer or is not ready; the message about it.
    NoAnswer(String),
}

impl Display for Ended {
    fn fmt(&self, f: &mut Formatter<'_>) -> FmtResult {
        match self {
            Self::Finished => f.write_str("finished"),
            Self::Interrupted => f.write_str("interrupted"),
            Self::LineLost(lost) => {
                write!(
                    f,
                    "{lost}; trains that were not commanded to stop since may still be running: switch the track power off by hand"
                )
            }
            Self::NoAnswer(why) => f.write_str(why),
        }
    }
}
