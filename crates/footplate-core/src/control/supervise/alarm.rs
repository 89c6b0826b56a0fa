//! Why the future is no longer like the past.

use core::fmt;

use crate::ids::SensorId;
use crate::tracking::Drift;

/// What was noticed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Alarm {
    /// Contacts close later and later than they should, or earlier and earlier.
    Drift(Drift),
    /// The place of the train is unknown.
    Lost,
    /// A sensor reported the train where it cannot have run to.
    Elsewhere(SensorId),
    /// A sensor reported the train so early or so late that a person or a fault must have moved or stopped it.
    Untimely(SensorId),
    /// One sensor after the other did not report the train.
    Misses,
    /// The station does not answer.
    LinkSilent,
    /// A command to stop has not left in time.
    StopUnconfirmed,
    /// The train was commanded to stop, and sensors still report it.
    DoesNotStop(SensorId),
    /// The caller does not trust the train.
    Distrusted,
}

impl fmt::Display for Alarm {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Drift(Drift::Slower) => "it runs slower than calibrated",
            Self::Drift(Drift::Faster) => "it runs faster than calibrated",
            Self::Lost => "its position is lost",
            Self::Elsewhere(_) => "a sensor reported it where it cannot have run to",
            Self::Untimely(_) => "a sensor reported it at a time when it cannot have been there",
            Self::Misses => "several sensors in a row did not report it",
            Self::LinkSilent => "the station does not answer",
            Self::StopUnconfirmed => "the stop command could not be sent",
            Self::DoesNotStop(_) => "it was commanded to stop and sensors still report it",
            Self::Distrusted => "its model no longer fits",
        })
    }
}
