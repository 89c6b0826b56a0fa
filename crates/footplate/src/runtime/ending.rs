//! How a run ends, and what a person has to know then.

use std::fmt::{Display, Formatter, Result as FmtResult};
use std::time::Duration;

use footplate_core::TimeSpan;

use crate::link::Lost;

/// For how long the end may take: a poll to wait out, a turnout to let go, and every train to be told. A line that is
/// in order needs a third of it.
pub(super) const WITHIN: TimeSpan = TimeSpan::from_ms(5_000);

/// After a station was called silent, it has so long to answer after all.
pub(super) const SECOND_CHANCE: TimeSpan = TimeSpan::from_ms(3_000);

/// How long a lost line is tried to be opened again, in real time: long enough for a plug to be pushed back in.
pub(super) const REOPEN_WITHIN: Duration = Duration::from_secs(5);

/// Why a run has ended.
#[derive(Debug)]
pub(crate) enum Ended {
    /// The attendant had no more wishes.
    Finished,
    /// Somebody pressed Ctrl-C, or a signal came.
    Interrupted,
    /// The line is gone and did not come back.
    LineLost(Lost),
    /// The station does not answer, or is not ready; what was said of it.
    NoAnswer(String),
}

impl Display for Ended {
    fn fmt(&self, f: &mut Formatter<'_>) -> FmtResult {
        match self {
            Self::Finished => f.write_str("finished"),
            Self::Interrupted => f.write_str("interrupted"),
            Self::LineLost(lost) => {
                write!(f, "{lost}; trains may still be running: switch the track power off by hand")
            }
            Self::NoAnswer(why) => f.write_str(why),
        }
    }
}
