//! Automatic calibration: learns the motion model of a train that is somewhere on the layout.
//!
//! Experiments have no evaluation of their own: [`MotionFit`](crate::model::MotionFit) learns from the whole chain of
//! commands and reports. The calibrator only drives:
//! - `finding.rs`: locates the train, finds its direction, brings it to a [`Circuit`](crate::track::Circuit);
//! - `planner.rs`: chooses the next experiment by its expected [`gain`] for its time;
//! - `running.rs`: carries it out: run, stop short of a sensor, creep on to it;
//! - `tracker.rs`: finds the reports that the train caused; `faults.rs`: handles a train that stalls, is lifted or lost;
//! - `learning.rs`: goes on learning while a session drives;
//! - `circuits.rs`: chooses circuits, and finds the turnouts and track ends around the train.

mod accuracy;
mod activity;
mod calibrator;
mod circuits;
mod experiment;
mod faults;
mod finding;
mod identity;
mod learning;
mod notice;
mod planner;
#[cfg(test)]
mod promises;
mod running;
#[cfg(test)]
mod scripted_train;
mod settings;
mod tracker;

pub use accuracy::{StepAccuracy, usable_steps};
pub use calibrator::Calibrator;
pub use experiment::{Experiment, Why, gain, objective};
pub use learning::Learning;
pub use notice::{CalibrationNotice, CalibrationPhase, Done, Ending, Fault, Progress};
pub use settings::CalibratorSettings;
