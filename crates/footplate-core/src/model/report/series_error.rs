//! Why a series of positions says nothing of a change of speed.

use super::position_series::FEWEST_POINTS;
use crate::units::{Length, Speed};

/// Why a series says nothing of a change of speed.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum SeriesError {
    /// There are too few positions.
    TooFew {
        /// How many there are.
        found: usize,
    },
    /// A time is not later than the one before.
    NotLater {
        /// Number of the point, from 0.
        point: usize,
    },
    /// The train stands all the time.
    Standing {
        /// How far it moved in all.
        moved: Length,
    },
    /// The train moves at both ends, or at neither.
    NotOneChange {
        /// Speed in the first tenth.
        first: Speed,
        /// Speed in the last tenth.
        last: Speed,
    },
    /// The positions leave the law's numbers open.
    NotDetermined,
}

impl core::fmt::Display for SeriesError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::TooFew { found } => {
                write!(f, "{found} positions are too few for a law: measure {FEWEST_POINTS} or more")
            }
            Self::NotLater { point } => {
                write!(
                    f,
                    "the time of position {} is not after the one before: sort the rows by time",
                    point + 1
                )
            }
            Self::Standing { moved } => write!(
                f,
                "the train moved only {:.1} mm, so that it stood all the time: measure a start or a stop",
                moved.as_mm()
            ),
            Self::NotOneChange { first, last } => write!(
                f,
                "the train runs at {:.0} mm/s at the beginning and {:.0} mm/s at the end: one of them should be standstill, \
                 so cut the series to one start or one stop",
                first.as_mm_per_s(),
                last.as_mm_per_s()
            ),
            Self::NotDetermined => {
                write!(f, "the positions leave the law open: measure more of them while the speed changes")
            }
        }
    }
}

impl core::error::Error for SeriesError {}
