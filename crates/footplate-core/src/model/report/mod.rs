//! Runs beside the model, for people: steady speeds, laws of speed change, stops, accelerations and short moves.

mod fitted_change;
mod law_family;
mod law_fit;
mod position_series;
mod review;
mod run;
mod series_error;
mod settled;
mod short_move_fit;
mod taped_stop;
mod transient;
mod two_sensor_change;

pub use fitted_change::FittedChange;
pub use law_family::{Constant, LawFamily};
pub use law_fit::{FittedLaw, LawComparison, LawKind, compare_laws};
pub use position_series::{PositionPoint, SeriesChange, SeriesFit};
pub use review::Review;
pub use run::{MeasuredStop, RunPassages};
pub use series_error::SeriesError;
pub use settled::{SettledPassage, SettledRunning, path_length};
pub use short_move_fit::{PredictedMove, ShortMoveFit, ShortMoveFitError};
pub use taped_stop::TapedStop;
pub use transient::{Direction, Transient, TransientPoint};
pub use two_sensor_change::{TwoSensorChange, TwoSensorMean};
