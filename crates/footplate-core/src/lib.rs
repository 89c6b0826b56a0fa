//! Everything Footplate knows about how trains move: functions and state machines without side effects.
//!
//! No std, no input or output, no clock, no randomness: time is an argument, and the same input gives the
//! same bytes on every machine. Layers from top to bottom; a module imports only from rows below its own,
//! or from its own folder (checked by `tests/architecture/`):
//!
//! ```text
//! control        drives trains: plans stops, dispatches, supervises, learns
//! tracking  odometry
//! model          how one train responds to commands, with uncertainty, and how that is learnt
//! kinematics  link  track
//! event
//! units  time  ids  linalg  estimate
//! ```
//!
//! The journey of one sensor report is traced through the files in `ARCHITECTURE.md`.
#![no_std]

extern crate alloc;
#[cfg(test)]
extern crate std;

pub mod control;
mod estimate;
mod event;
mod ids;
pub mod kinematics;
pub mod linalg;
pub mod link;
pub mod model;
pub mod odometry;
mod time;
pub mod track;
pub mod tracking;
mod units;

pub use estimate::{Estimate, HALF_95};
pub use event::{Approach, Command, Event, EventKind, Report};
pub use ids::{
    DecoderSteps, EdgeId, FunctionNumber, NodeId, RunId, SensorId, SpeedStep, StretchId, TrainId, TurnoutId,
};
pub use time::{TimeSpan, Timestamp};
pub use units::{Acceleration, Jerk, Length, Ratio, Speed};
