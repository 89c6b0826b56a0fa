//! Everything Footplate knows about how trains move, as functions of what went in.
//!
//! No std, no input or output, no clock, no randomness: time is an argument, and the same input gives the
//! same bytes on every machine. Layers from top to bottom; a module imports only from rows below its own,
//! or from its own folder (checked by `tests/architecture/`):
//!
//! ```text
//! control        when to tell the trains what: calibration that plans itself, exact stops
//! estimation     what the next report will be, learnt from the last
//! calibration    speeds, laws of speed change, stops, edge lengths: numbers with uncertainty
//! kinematics  latency  track  wheels
//! event
//! units  time  ids  linalg  estimate
//! ```
//!
//! The journey of one sensor report is traced through the files in `ARCHITECTURE.md`.
#![no_std]

extern crate alloc;
#[cfg(test)]
extern crate std;

pub mod calibration;
pub mod control;
mod estimate;
pub mod estimation;
mod event;
mod ids;
pub mod kinematics;
pub mod latency;
pub mod linalg;
mod time;
pub mod track;
mod units;
pub mod wheels;

pub use estimate::{Estimate, HALF_95};
pub use event::{Approach, Command, Event, EventKind, Report};
pub use ids::{EdgeId, NodeId, RunId, SensorId, SpeedStep, StretchId, TrainId, TurnoutId};
pub use time::{TimeSpan, Timestamp};
pub use units::{Acceleration, Jerk, Length, Ratio, Speed};
