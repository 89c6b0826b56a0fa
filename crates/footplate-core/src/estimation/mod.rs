//! What the next report will be, learnt from the last.
//!
//! [`Predictor`] walks a recording entry by entry and never looks ahead. At every passage of a contact it
//! compares what it had forecast with what happened ([`Hit`]), and learns: where the train is and how fast
//! (`belief`), what the step means ([`SpeedTable`](crate::calibration::SpeedTable)), how long the hop is,
//! and how the train changes speed. Each forecast is a distribution ([`Forecast`]) whose intervals hold as
//! often as they say.
//!
//! [`Locator`] follows a train that is driven: with a [`MotionModel`](crate::calibration::motion::MotionModel) it knows
//! where the train is at any moment, and where it would come to rest if told to stop at another.

mod belief;
mod claim;
mod contact_scatter;
mod felt_way;
mod forecast;
mod foresight;
mod ground;
mod law_memory;
mod locator;
pub mod odometry;
mod outlook;
mod polls;
mod predictor;
mod shown_length;
mod speed_watch;
mod train_model;
mod transition;
mod way_memory;

pub use felt_way::{landmark_of, place_of, way_to, way_to_landmark};
pub use forecast::{Forecast, Phase};
pub(crate) use foresight::Foresight;
pub use ground::Ground;
pub use law_memory::{KnownLaw, LawMemory};
pub use locator::{DueContact, Located, Locator, PassedContact, Rest, WayPoint};
pub(crate) use outlook::Outlook;
pub use predictor::{Hit, Predictor, Verdict};
pub use speed_watch::WatchedSpeed;
pub use train_model::TrainModel;
