//! The whole program in one process, under one seed, while everything around it fails.
//!
//! What runs is the program itself: its loop ([`Runtime`](crate::runtime::Runtime)), its session with the station, its
//! dispatcher and estimators, its journal in a store on disk, and the last will that its guardian carries out. What is
//! simulated is around it: the railway, the station, the line, the disk, the clocks, and the death of processes. No thread and
//! no clock of this computer takes part, so that a seed always tells the same story.
//!
//! ```text
//! plan       what a seed draws: a station, trains, what fails when, and how each life of the program ends
//! life       one life of the program: its steps, and the step at which it dies
//! line       the line to the station, which loses, delays, garbles and breaks; and what a guardian sees of the program
//! disk       a journal on a disk that is slow, full or fails, and what a power cut leaves of it
//! people     who sends trains to places, helps them, and sees whether anything is as it must not be
//! story      all lives of one seed, and what came of them
//! ```

mod disk;
mod life;
mod line;
mod people;
mod plan;
mod story;

pub(crate) use story::{Fate, Stage, story};
