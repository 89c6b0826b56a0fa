//! Scores the forecasts of a recording, walked once without looking ahead, beside reference forecasters.
//!
//! [`score_recording`] feeds a recording to the estimator and to the [`Baselines`] (a constant table, running averages,
//! the last lap), has an oracle that knows the whole recording forecast the same detections, and returns a
//! [`ScoredHit`] for every passage of a sensor. [`Comparison`] summarises any selection of them. If the recording has
//! light gates, [`GateCheck`] compares the estimates with them.

mod baselines;
mod comparison;
mod forecast_score;
mod gate_check;
mod oracle;
mod reference_forecaster;
mod replay;
mod scored_hit;
mod scorer;
mod shift_average;

pub use baselines::Baselines;
pub use comparison::{Comparison, ReferenceScore};
pub use forecast_score::{Coverage, ForecastScore, LEVELS};
pub use gate_check::{GATE_DISTANCE, GATE_TICK, GateAgreement, GateCheck};
pub use reference_forecaster::{BASELINES, ReferenceForecaster};
pub use replay::{ReplayContext, ReplayError, replay_run};
pub use scored_hit::ScoredHit;
pub use scorer::{Forecasters, ScoredRecording, score_recording};
