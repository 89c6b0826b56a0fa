//! What comes out of a line's file, and the forms it can have.

use std::fmt;

use footplate_core::{Length, Speed};
use footplate_sim::line::{LineError, LineParts, LineProfile};

use crate::document::{DocumentProblem, Fault, Place};

pub(super) const KILOMETRES_PER_HOUR: f64 = 3.6;

/// A line and what people should know about it.
#[derive(Debug, Clone, PartialEq)]
pub struct LineFile {
    /// The form it was read from.
    pub form: LineFileForm,
    /// What people should know about it; may be empty.
    pub about: String,
    /// The line.
    pub line: LineProfile,
}

/// A form of a line's file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LineFileForm {
    /// Footplate's own TOML.
    Own,
    /// JSON of TTOBench.
    TtoBench,
    /// YAML after the running-path schema of railtoolkit, as TrainRuns.jl reads it.
    TrainRuns,
}

impl LineFileForm {
    /// What people call the form.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Own => "line",
            Self::TtoBench => "ttobench-track",
            Self::TrainRuns => "railtoolkit-running-path",
        }
    }
}

impl fmt::Display for LineFileForm {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// Limits in km/h as speeds at places.
pub(super) fn limits(steps: &[(f64, f64)]) -> Vec<(Length, Speed)> {
    let limit = |km_h: f64| Speed::from_m_per_s(km_h / KILOMETRES_PER_HOUR);
    steps.iter().map(|(m, km_h)| (Length::from_m(*m), limit(*km_h))).collect()
}

/// Numbers at places.
pub(super) fn at_places(steps: &[(f64, f64)]) -> Vec<(Length, f64)> {
    steps.iter().map(|(m, value)| (Length::from_m(*m), *value)).collect()
}

/// The line of its parts; or what is wrong with them, at the place that `place_of` knows for it.
pub(super) fn built(
    parts: LineParts,
    place_of: impl FnOnce(&LineError) -> Place,
) -> Result<LineProfile, Fault> {
    LineProfile::new(parts).map_err(|error| (place_of(&error), DocumentProblem::Line(error)))
}
