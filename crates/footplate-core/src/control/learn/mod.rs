//! Calibration that plans itself: from a train somewhere on the layout to a model of how it moves.
//!
//! There are no experiments with an evaluation of their own: whatever the train does is one chain of commands and
//! reports, from which [`MotionFit`](crate::model::MotionFit) learns. What is left to do is to drive well:
//! - `finding.rs`: find the train, learn which way it faces, get it onto a [`Circuit`](crate::track::Circuit);
//! - `planner.rs`: what to try next, by what it would gain for its time; [`gain`] is the one place that says what that is;
//! - `running.rs`: do it: run, stop short of a contact, crawl on to it;
//! - `tracker.rs`: which reports are of the train; `mishaps.rs`: what to do when it stalls, is lifted or lost;
//! - `surveying.rs`: where lengths are unknown, round by other ways;
//! - `points.rs`: turnouts that may be thrown, and track ends ahead.

mod accuracy;
mod activity;
mod calibrator;
mod experiment;
mod finding;
mod gain;
mod mishaps;
mod notice;
mod planner;
mod points;
#[cfg(test)]
mod promises;
mod running;
#[cfg(test)]
mod scripted_train;
mod settings;
mod surveying;
mod tracker;

pub use accuracy::{StepAccuracy, usable_steps};
pub use calibrator::Calibrator;
pub use experiment::{Experiment, Why};
pub use gain::{gain, objective};
pub use notice::{CalibrationNotice, Done, Ending, Mishap, Phase, Progress};
pub use settings::CalibratorSettings;
