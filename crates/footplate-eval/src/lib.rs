//! Scorers: everything that knows the truth, to say how well the program does without it.
//!
//! Each scorer makes a result of a seed, and a page of many results:
//!
//! ```text
//! driving  pacing  zones      trains driven to places, speeds and times
//! traffic  disasters          several trains, and what happens to them
//! survey                      lengths that driving finds
//! line                        odometers of full-size trains
//! rehearsal                   trains calibrated and put down: where every scored drive begins
//! seeds  choice               who draws, and what is asked
//! figures  written_scores     what many results come to, and how that is written
//! ```

pub mod choice;
pub mod disasters;
pub mod driving;
pub mod figures;
pub mod line;
pub mod pacing;
pub mod rehearsal;
pub mod seeds;
pub mod survey;
pub mod traffic;
pub mod written_scores;
pub mod zones;
