//! The forecasters that our estimator is compared with.

use core::fmt;

/// A reference forecaster.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum ReferenceForecaster {
    /// Our own estimator, forecasting the poll that will report instead of the mean time.
    AtPoll,
    /// Our own estimator with the results of the whole recording in advance.
    Oracle,
    /// A table of lengths and speeds for each run, made from the whole recording in advance.
    HindsightTable,
    /// The speed of a step is measured over its first lap and never again.
    ConstantTable,
    /// A running average of the speed of a step with α = 1/256 per hop, in integers.
    SlowAverage,
    /// The same with α = 0.1.
    MiddleAverage,
    /// The same with α = 0.5.
    FastAverage,
    /// The hop takes as long as last time at this step.
    LastLap,
}

/// The methods of courses and clubs, which learn while the train runs.
pub const BASELINES: [ReferenceForecaster; 5] = [
    ReferenceForecaster::ConstantTable,
    ReferenceForecaster::SlowAverage,
    ReferenceForecaster::MiddleAverage,
    ReferenceForecaster::FastAverage,
    ReferenceForecaster::LastLap,
];

impl ReferenceForecaster {
    /// All references, in the order of their declaration.
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
impl fmt::Display for ReferenceForecaster {
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
