//! Why the future is no longer like the past.

use core::fmt;

use crate::calibration::Drift;
use crate::ids::SensorId;

/// What was noticed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Alarm {
    /// Contacts close later and later than they should, or earlier and earlier.
    Drift(Drift),
    /// Nobody knows any more where the train is.
    Lost,
    /// The train came to a contact where it cannot have run to.
    Elsewhere(SensorId),
    /// The train came to a contact so early or so late that something was done to it on the way there.
    Untimely(SensorId),
    /// One contact after the other did not report the train.
    Misses,
    /// The station does not answer.
    LinkSilent,
    /// A command to stop has not left in time.
    StopUnconfirmed,
    /// The train has been told to stand and still closes contacts.
    DoesNotStop(SensorId),
    /// Whoever is above does not trust it.
    Distrusted,
}

impl fmt::Display for Alarm {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Drift(Drift::Slower) => "it has become slower than it was",
            Self::Drift(Drift::Faster) => "it has become faster than it was",
            Self::Lost => "it is lost",
            Self::Elsewhere(_) => "it has turned up where it cannot have run to",
            Self::Untimely(_) => "it has come to a contact when it cannot have run there by itself",
            Self::Misses => "one contact after the other has not reported it",
            Self::LinkSilent => "the station does not answer",
            Self::StopUnconfirmed => "it could not be told to stop",
            Self::DoesNotStop(_) => "it was told to stop and still closes contacts",
            Self::Distrusted => "it is not trusted any more",
        })
    }
}
