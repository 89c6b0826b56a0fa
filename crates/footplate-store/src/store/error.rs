//! Why a store could not do what it was asked, and what a person can do about it.

use std::path::{Path, PathBuf};

use rusqlite::ErrorCode;

use super::keys::{EventKey, RecordingKey};

/// Why a store could not do what it was asked. Whatever it says, what was acknowledged before is still there, and
/// nothing of what failed is.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum StoreError {
    /// There is no such file.
    #[error("there is no store at {}; `footplate store import` makes one", .0.display())]
    Missing(PathBuf),
    /// A file that something else wrote.
    #[error("{} is not a Footplate store", .0.display())]
    NotAStore(PathBuf),
    /// A store that a newer Footplate has migrated.
    #[error(
        "{} has version {found} of the store, and this Footplate knows versions up to {known}; use a newer \
         Footplate",
        file.display()
    )]
    Newer {
        /// The file.
        file: PathBuf,
        /// Its version.
        found: i64,
        /// The newest version known here.
        known: i64,
    },
    /// Somebody else is writing, and went on writing while we waited.
    #[error(
        "the store {} is in use by another process, which has been writing to it for longer than we wait; try again \
         when it has ended",
        .0.display()
    )]
    InUse(PathBuf),
    /// The file is damaged.
    #[error(
        "the store {} is damaged ({what}); `footplate store salvage --store {} --out salvaged.db` copies what can still be \
         read into a new one",
        file.display(),
        file.display()
    )]
    Damaged {
        /// The file.
        file: PathBuf,
        /// What was found.
        what: String,
    },
    /// A file of which a salvage could read nothing.
    #[error("nothing of a store can be read in {}", .0.display())]
    NothingReadable(PathBuf),
    /// No space is left.
    #[error(
        "no space is left for the store {}; nothing of this was stored, and what was stored before is safe",
        .0.display()
    )]
    DiskFull(PathBuf),
    /// The disk took less than it was given: it is failing, or a limit was reached.
    #[error(
        "the disk does not take what is written to the store {} ({source}); nothing of this was stored, and what was \
         stored before is safe",
        file.display()
    )]
    WriteFailed {
        /// The file.
        file: PathBuf,
        /// What SQLite said.
        source: rusqlite::Error,
    },
    /// The file or its folder cannot be written.
    #[error("the store {} cannot be written; is its folder there, and may you write to both?", .0.display())]
    ReadOnly(PathBuf),
    /// A file that should be made exists.
    #[error("{} exists already; name a file that does not", .0.display())]
    Exists(PathBuf),
    /// The system refused something outside SQLite.
    #[error("cannot {doing} {}: {source}", file.display())]
    System {
        /// The file.
        file: PathBuf,
        /// What was being done to it.
        doing: &'static str,
        /// What the system said.
        source: std::io::Error,
    },
    /// SQLite refused.
    #[error("the store {} refuses: {source}", file.display())]
    Refused {
        /// The file.
        file: PathBuf,
        /// What SQLite said.
        source: rusqlite::Error,
    },
    /// An event that is not in the store.
    #[error("there is no event {0}; `footplate store show` lists them")]
    NoEvent(EventKey),
    /// A recording that is not in the store.
    #[error("there is no recording {0}; `footplate store show` lists them")]
    NoRecording(RecordingKey),
    /// An event that a mark would leave as it is.
    #[error("event {event} is {} already: {reason}", if *excluded { "excluded" } else { "restored" })]
    MarkedAlready {
        /// The event.
        event: EventKey,
        /// Whether it is excluded.
        excluded: bool,
        /// The reason that was given then.
        reason: String,
    },
    /// An event that was never excluded cannot be restored.
    #[error("event {0} was never excluded; there is nothing to restore")]
    NeverExcluded(EventKey),
    /// A mark without a reason.
    #[error("a mark needs a reason, so that later readers know why the numbers changed")]
    NoReason,
    /// The body of a calibration is no JSON.
    #[error("the calibration of train {0} is not JSON")]
    NotJson(footplate_core::TrainId),
}

impl StoreError {
    /// What SQLite said about `file`, in the words of this module.
    pub(super) fn of(file: &Path, source: rusqlite::Error) -> Self {
        let file = file.to_owned();
        if let rusqlite::Error::FromSqlConversionFailure(..)
        | rusqlite::Error::IntegralValueOutOfRange(..)
        | rusqlite::Error::InvalidColumnType(..) = source
        {
            return Self::Damaged { file, what: source.to_string() };
        }
        match source.sqlite_error_code() {
            Some(ErrorCode::DatabaseBusy | ErrorCode::DatabaseLocked) => Self::InUse(file),
            Some(ErrorCode::DatabaseCorrupt) => Self::Damaged { file, what: source.to_string() },
            Some(ErrorCode::NotADatabase) => Self::NotAStore(file),
            Some(ErrorCode::DiskFull) => Self::DiskFull(file),
            Some(ErrorCode::SystemIoFailure) if is_write(&source) => Self::WriteFailed { file, source },
            Some(ErrorCode::ReadOnly | ErrorCode::CannotOpen | ErrorCode::PermissionDenied) => {
                Self::ReadOnly(file)
            }
            _ => Self::Refused { file, source },
        }
    }
}

/// Whether it was writing that failed, for any reason.
fn is_write(error: &rusqlite::Error) -> bool {
    use rusqlite::ffi::{
        SQLITE_IOERR_FSYNC, SQLITE_IOERR_SHMMAP, SQLITE_IOERR_SHMSIZE, SQLITE_IOERR_TRUNCATE,
        SQLITE_IOERR_WRITE,
    };
    let codes = [
        SQLITE_IOERR_WRITE,
        SQLITE_IOERR_FSYNC,
        SQLITE_IOERR_TRUNCATE,
        SQLITE_IOERR_SHMSIZE,
        SQLITE_IOERR_SHMMAP,
    ];
    error.sqlite_error().is_some_and(|error| codes.contains(&error.extended_code))
}
