//! Speeds, laws of speed change, stops and lengths: numbers with uncertainty, from reports.

mod drift_test;
mod law_family;
mod length_table;
mod passage;
mod recent_extremes;
mod shift_average;
mod speed_table;

pub use drift_test::{Drift, DriftTest};
pub use law_family::{Constant, LawFamily};
pub use length_table::{LengthTable, SectionIndex};
pub use passage::{Drive, Passage, PassageTracker, Sighting};
pub use recent_extremes::RecentExtremes;
pub use shift_average::ShiftAverage;
pub use speed_table::{Expected, Familiarity, SpeedTable};
