//! A store: one SQLite file that keeps every measurement for ever, with marks of people and models of trains.
//!
//! Raw events are appended and never changed; triggers in the file enforce this. A mark of a person and a calibration are
//! rows of their own, with dates. So the state at any date can be read again, and every change since can be listed. Time
//! is an argument.
//!
//! ```text
//! file          opens, creates and migrates the file; write access
//! keys          numbers of recordings, runs and events
//! recordings    imports recordings, appends the events of a live session
//! journal       a live session from its beginning to its end
//! decisions     inputs and decisions of a machine, for a replay
//! archives      the same, many in a row and compressed
//! history       the state at a date, and the changes between two dates
//! marks         excludes and restores events
//! calibrations  models of trains by date
//! profiles      speeds from other programs, the prior of a train
//! schedules     scripts that owners saved
//! directions    the direction that each decoder was commanded in last
//! replays       the state of a replay of all sessions, from which the next one continues
//! checksum      checksums of rows, which detect changed values
//! packed_body   long JSON texts, compressed
//! unfinished    the session that was running when the program died
//! write_ahead_log  what SQLite does not read of a damaged log
//! salvage       copies the readable rows of a damaged file into a new one
//! ```

mod archives;
mod assigned;
mod calibrations;
mod checksum;
mod decisions;
mod directions;
mod error;
mod file;
mod history;
mod journal;
mod keys;
mod marks;
mod packed_body;
mod profiles;
mod recordings;
mod replays;
mod row;
mod salvage;
mod schedules;
mod unfinished;
mod write_ahead_log;

pub use assigned::AssignedDetections;
pub use calibrations::{Calibration, NewCalibration};
pub use decisions::{MachineKey, NewMachine, Side, StoredMachine, Traced};
pub use directions::Direction;
pub use error::StoreError;
pub use file::Store;
pub use history::{Change, StoredEvent, StoredRecording, StoredRun};
pub use journal::{Journal, JournalEntry};
pub use keys::{EventKey, RecordingKey, RunKey};
pub use marks::{Mark, MarkKind};
pub use recordings::Import;
pub(crate) use replays::KeptReplay;
pub use salvage::{Salvaged, SalvagedTable, salvage};
pub use schedules::Schedule;
pub use unfinished::UnfinishedSession;
