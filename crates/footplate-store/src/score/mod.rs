//! How good the forecasts of a recording are: walked once, never looking ahead, beside what others would say.
//!
//! [`score_recording`] walks a recording through the estimator and the [`Baselines`] (a constant table, running
//! averages, the last lap), lets an oracle that knows the whole recording forecast the same hits, and keeps a
//! [`ScoredHit`] for every passage of a contact. [`Comparison`] sums up any selection of them. Light gates,
//! where a recording has them, are a truth that no estimator sees: [`GateCheck`].

mod baselines;
mod comparison;
mod coverage;
mod forecast_score;
mod gate_check;
mod oracle;
mod replay;
mod rival;
mod scored_hit;
mod scorer;
mod shift_average;

pub use baselines::Baselines;
pub use comparison::{Comparison, RivalScore};
pub use coverage::Coverage;
pub use forecast_score::{ForecastScore, LEVELS};
pub use gate_check::{GATE_DISTANCE, GATE_TICK, GateAgreement, GateCheck};
pub use replay::{ReplayContext, ReplayError, replay_run};
pub use rival::{BASELINES, Rival};
pub use scored_hit::ScoredHit;
pub use scorer::{Knowledge, ScoredRecording, score_recording};
