//! Speeds, laws of speed change, stops and lengths: numbers with uncertainty, from reports.

mod calibrate;
mod drift_test;
mod fitted_change;
mod joint_fit;
mod law_family;
mod law_fit;
mod length_table;
mod passage;
mod recent_extremes;
mod run;
mod shift_average;
mod speed_curve;
mod speed_table;
mod stop_fit;
mod transient;

pub use calibrate::{Calibration, Hysteresis};
pub use drift_test::{Drift, DriftTest};
pub use fitted_change::FittedChange;
pub use joint_fit::{FittedPassage, JointFit, SpeedKey};
pub use law_family::{Constant, LawFamily};
pub use law_fit::{FittedLaw, LawComparison, LawKind, compare_laws};
pub use length_table::{LengthTable, SectionIndex};
pub use passage::{Drive, Passage, PassageTracker, Sighting};
pub use recent_extremes::RecentExtremes;
pub use run::{MeasuredStop, RunPassages};
pub use shift_average::ShiftAverage;
pub use speed_curve::SpeedCurve;
pub use speed_table::{Expected, Familiarity, SpeedTable};
pub use stop_fit::{StopEntry, StopMeasurement, StopTable, TwoTermLaw};
pub use transient::{Direction, Transient, TransientPoint, transients};
