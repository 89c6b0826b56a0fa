//! What is odd in a recording that can be read all the same.

use std::fmt;

use footplate_core::TimeSpan;

/// Where a row stands in its file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RowPlace {
    /// The line of a text, counted from 1, the header included.
    Line(u64),
    /// The row of a table, counted from 1.
    Row(u64),
}

impl fmt::Display for RowPlace {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Line(line) => write!(f, "line {line}"),
            Self::Row(row) => write!(f, "row {row}"),
        }
    }
}

/// Something odd and where it was seen.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TachometerNote {
    /// Where it was seen for the first time; absent if it concerns the whole file.
    pub place: Option<RowPlace>,
    /// What it is.
    pub oddity: TachometerOddity,
}

/// What can be odd in a recording.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum TachometerOddity {
    /// Columns that say nothing to us.
    UnknownColumns(Vec<String>),
    /// A wheelset has both pulses and a running counter.
    CountedTwice {
        /// 1 or 2.
        wheelset: usize,
    },
    /// Wheels are recorded as speeds, which are added up to pulses.
    SpeedsAddedUp,
    /// A row has the time of the row before it.
    TimeStoodStill,
    /// A row is earlier than the row before it.
    TimeWentBack {
        /// By how much.
        by: TimeSpan,
    },
    /// More time than any period has passed since the row before.
    Gap {
        /// How much.
        lasting: TimeSpan,
    },
    /// The last line has all fields and no end; its last digits may be lost.
    LineNotEnded,
    /// The last line breaks off in the middle of its fields and is left out.
    LineCutOff,
}

impl fmt::Display for TachometerNote {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(place) = self.place {
            write!(f, "{place}: ")?;
        }
        self.oddity.fmt(f)
    }
}

impl fmt::Display for TachometerOddity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::UnknownColumns(names) => write!(f, "columns that are not used: {}", names.join(", ")),
            Self::CountedTwice { wheelset } => {
                write!(f, "counter_{wheelset} is not used, because pulses_{wheelset} is there")
            }
            Self::SpeedsAddedUp => write!(
                f,
                "wheel speeds are added up to pulses; bounds of the distance hold as far as these speeds and times are exact"
            ),
            Self::TimeStoodStill => write!(f, "t_s is that of the row before it"),
            Self::TimeWentBack { by } => write!(f, "t_s goes back by {} s", by.as_s()),
            Self::Gap { lasting } => write!(f, "{} s have passed since the row before it", lasting.as_s()),
            Self::LineNotEnded => write!(f, "the last line does not end; its last digits may be lost"),
            Self::LineCutOff => write!(f, "the last line breaks off and is left out"),
        }
    }
}
