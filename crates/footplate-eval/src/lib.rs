//! Scores: code that knows the truth of a simulation and measures how well the program does without it.
//!
//! Each score has a result per seed, and a page of many results:
//!
//! ```text
//! driving  pacing  zones      trains driven to places, at speeds, to times
//! traffic  disasters          several trains; faults
//! survey                      lengths estimated from runs
//! line                        odometers of full-size trains
//! testbed                     calibrated trains in a simulated world: the start of every score
//! seeds                       seeds and random tasks
//! figures  written_scores     statistics and their output
//! standard_error              lines for people: the lowest crate that writes any
//! ```

#![warn(clippy::print_stderr)]

pub mod disasters;
pub mod driving;
pub mod figures;
pub mod line;
pub mod pacing;
pub mod seeds;
mod standard_error;
pub mod survey;
pub mod testbed;
pub mod traffic;
pub mod written_scores;
pub mod zones;
