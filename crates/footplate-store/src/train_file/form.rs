//! The content of a train file, and its formats.

use std::fmt;

use footplate_sim::line::{Brake, Train, TrainError};

use crate::document::{DocumentProblem, Fault, Place};

/// A train with its description.
#[derive(Debug, Clone, PartialEq)]
pub struct TrainFile {
    /// The format it was read from.
    pub form: TrainFileForm,
    /// Its description; may be empty.
    pub about: String,
    /// The train.
    pub train: Train,
}

/// A format of train files.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TrainFileForm {
    /// Footplate's own TOML.
    Own,
    /// JSON of TTOBench.
    TtoBench,
    /// YAML of the rolling-stock schema of railtoolkit, as read by TrainRuns.jl.
    TrainRuns,
    /// JSON of rolling stock in OSRD.
    Osrd,
}

impl TrainFileForm {
    /// The name of the format.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Own => "train",
            Self::TtoBench => "ttobench-train",
            Self::TrainRuns => "railtoolkit-rolling-stock",
            Self::Osrd => "osrd-rolling-stock",
        }
    }
}

impl fmt::Display for TrainFileForm {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// The train, if it is valid; otherwise the invalid value, at the place given by `place_of`.
pub(super) fn checked(train: Train, place_of: impl FnOnce(&TrainError) -> Place) -> Result<Train, Fault> {
    match train.check() {
        Ok(()) => Ok(train),
        Err(error) => Err((place_of(&error), DocumentProblem::Train(error))),
    }
}

/// The full brake force (N) if only the planned deceleration (m/s²) is known.
pub(super) fn full_brake_n(inertia_kg: f64, service_m_per_s2: f64) -> f64 {
    Brake::FULL_OVER_SERVICE * service_m_per_s2 * inertia_kg
}
