//! One SQLite file that keeps every measurement for ever, and what people and models made of them.
//!
//! Raw events are appended and never changed: triggers in the file refuse it, whoever asks. What a person thinks of
//! an event is a mark beside it, a calibration is a row beside them, both with their date; so the state of any
//! date can be had again, and every change since be listed. Time is an argument: the program knows what time it is.
//!
//! ```text
//! file          opening, creating, migrating; who may write
//! recordings    importing a recording, appending the events of a live session
//! journal       a live session from its beginning to its end
//! decisions     what a machine was told and decided, so that it can be made to decide again
//! history       reading back what was there at a date, and what changed between two
//! marks         excluding events and restoring them
//! calibrations  keeping them and finding the one in force
//! profiles      speeds of other programs, with which a train begins
//! schedules     scripts that owners saved
//! replays       how far a replay of all sessions came, so that the next one goes on from there
//! checksum      of each row, so that a changed value is noticed
//! unfinished    the session that was running when the program died
//! salvage       what can still be read of a damaged file, into a new one
//! ```

mod calibrations;
mod checksum;
mod decisions;
mod error;
mod file;
mod history;
mod journal;
mod marks;
mod profiles;
mod recordings;
mod replays;
mod row;
mod salvage;
mod schedules;
mod unfinished;

pub use calibrations::{Calibration, NewCalibration};
pub use decisions::{MachineKey, NewMachine, Side, StoredMachine, Traced};
pub use error::StoreError;
pub use file::Store;
pub use history::{Change, StoredEvent, StoredRecording, StoredRun};
pub use journal::{Journal, JournalEntry};
pub use marks::{Mark, MarkKind};
pub use recordings::{EventKey, Import, RecordingKey, RunKey};
pub(crate) use replays::KeptReplay;
pub use salvage::{Salvaged, SalvagedTable, salvage};
pub use schedules::Schedule;
pub use unfinished::UnfinishedSession;
