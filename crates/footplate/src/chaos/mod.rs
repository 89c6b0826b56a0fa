//! Deterministic simulation of the whole program in one process, while everything around it fails.
//!
//! The program itself runs: its loop ([`Runtime`](crate::runtime::Runtime)), its session with the station, its dispatcher
//! and estimators, its journal in a store on disk, and what its guardian decides and says to it. The railway, the station,
//! the line, the disk, the clocks and the death of processes are simulated. No thread and no clock of this computer takes
//! part: the same seed gives the same story.
//!
//! ```text
//! plan       what a seed draws: a station, failures with their times, and how each life of the program ends
//! life       one life of the program: its steps, and the step at which it dies
//! transport  how the bytes of a station travel: singly, in datagrams, or over a connection
//! line       the line to the station, which loses, delays, garbles and breaks
//! pair       the program and its guardian as two processes, the bytes between them, and how either hangs and dies
//! disk       the journal on a slow, full or failing disk, and what a power cut leaves of it
//! files      the files of a store as SQLite sees them: writes cut short, waits for the disk that fail, power cuts
//! people     the operator, who sends trains to places and helps them, and the checks of every step
//! promises   what was promised in a story, and how much of it was kept
//! story      all lives of one seed, and their result
//! burial     the end of a life: what its disk kept, and how soon trains were stopped
//! failure    what must not happen in a story
//! selection  some of the troubles of a story: the least with which it still fails
//! ```

mod burial;
mod disk;
mod failure;
mod files;
mod life;
mod line;
mod pair;
mod people;
mod plan;
mod promises;
mod selection;
mod story;
mod transport;

pub(crate) use failure::FailureKind;
pub(crate) use plan::NO_GUARDIAN_HANGS_UNTIL;
pub(crate) use promises::Promises;
pub(crate) use selection::Selection;
pub(crate) use story::{Fate, STORIES_A_STAGE, Stage, story};
