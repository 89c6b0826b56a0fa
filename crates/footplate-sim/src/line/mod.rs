//! Full-size trains on full-size lines.
//!
//! A [`Train`] is a body with a [`Resistance`], a [`TractiveEffort`] and a [`Brake`]; a [`LineProfile`] says how
//! steep, how curved and how fast the line is and where trains stop. A [`Driver`] gives an effort for what the train
//! does now. [`Journey`] puts the three together as one body, for running times; a world with wheels on rails steps
//! the same driver through its own integration.
//!
//! ```text
//! journey          running times, energy
//! driver           effort from what the train does and what lies ahead
//! train  profile   what it is, where it runs
//! resistance  tractive_effort  stepped
//! ```

mod driver;
mod journey;
mod profile;
mod resistance;
mod stepped;
mod tractive_effort;
mod train;

pub use driver::{Command, Driver, Phase, State, Style};
pub use journey::{Call, Journey, JourneyError, Moment, Work};
pub use profile::{
    LineError, LineParts, LineProblem, LineProfile, STEEPEST_PER_MILLE, Stop, TIGHTEST_PER_MILLE,
};
pub use resistance::{PerMille, Resistance};
pub use stepped::Stepped;
pub use tractive_effort::TractiveEffort;
pub use train::{Brake, Train, TrainError};
