//! Recordings through the odometer: what each run comes to, and how good that is where the truth is known.
//!
//! An [`OdometryRun`] takes the rows of one run and returns an estimate for each. If it is to score, it walks
//! both presets and what others would do beside it, and compares all of them with the truth.

mod counted_distances;
mod detection;
mod oracle;
mod placed_run;
mod result_rows;
mod rival;
mod run;
mod score;
mod simulated;
mod summary;
mod world_score;
mod worst_moment;

pub use counted_distances::{CountedDistances, DistanceCounter};
pub use result_rows::{LiveResult, ResultWriter};
pub use rival::Rival;
pub use run::{OdometryRun, Preset, RunContext, RunScores};
pub use score::OdometryScore;
pub use simulated::{simulated_columns, simulated_rows, simulated_vehicle};
pub use summary::{FlagCounts, ModeCounts, RunSummary};
pub use world_score::{WheelPhase, WorldOdometer, WorldScores};
pub use worst_moment::WorstMoment;
