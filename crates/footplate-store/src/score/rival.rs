//! Those whose forecasts stand beside ours.

use core::fmt;

/// Another way to forecast the same report.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Rival {
    /// Our own estimator again, naming the poll that will report instead of the mean time.
    AtPoll,
    /// Our own estimator, told beforehand what the whole recording says.
    Oracle,
    /// A table of lengths and speeds, run by run, made from the whole recording beforehand.
    HindsightTable,
    /// The speed of a step is measured over the first lap at it and never again.
    ConstantTable,
    /// A running average of the speed of a step that takes 1/256 of every hop, in integers.
    SlowAverage,
    /// The same with a tenth.
    MiddleAverage,
    /// The same with half.
    FastAverage,
    /// The hop takes as long as it took last time at this step.
    LastLap,
}

/// What courses and clubs use: all that learn as they go.
pub const BASELINES: [Rival; 5] =
    [Rival::ConstantTable, Rival::SlowAverage, Rival::MiddleAverage, Rival::FastAverage, Rival::LastLap];

impl Rival {
    /// All of them, in the order of their declaration.
    pub const ALL: [Self; 8] = [
        Self::AtPoll,
        Self::Oracle,
        Self::HindsightTable,
        Self::ConstantTable,
        Self::SlowAverage,
        Self::MiddleAverage,
        Self::FastAverage,
        Self::LastLap,
    ];

    /// Its name in files.
    #[must_use]
    pub const fn key(self) -> &'static str {
        match self {
            Self::AtPoll => "at_poll",
            Self::Oracle => "oracle",
            Self::HindsightTable => "hindsight_table",
            Self::ConstantTable => "constant_table",
            Self::SlowAverage => "ewma_1_256",
            Self::MiddleAverage => "ewma_0_1",
            Self::FastAverage => "ewma_0_5",
            Self::LastLap => "last_lap",
        }
    }
}

/// Its name for people.
impl fmt::Display for Rival {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::AtPoll => "ours, at a poll",
            Self::Oracle => "oracle",
            Self::HindsightTable => "hindsight table",
            Self::ConstantTable => "constant table",
            Self::SlowAverage => "EWMA 1/256",
            Self::MiddleAverage => "EWMA 0.1",
            Self::FastAverage => "EWMA 0.5",
            Self::LastLap => "last lap",
        })
    }
}
