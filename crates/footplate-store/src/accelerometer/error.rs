//! Why a recording of an accelerometer, or the marks of its stops, could not be read.

use crate::table::TableError;

/// A recording of an accelerometer, or marks of stops, that could not be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum AccelerometerError {
    /// A line or a field is wrong.
    #[error(transparent)]
    Table(#[from] TableError),
    /// Columns that no recording can do without.
    #[error(
        "{file}: missing columns: {wanted}; the header names {found} (docs/formats/accelerometer-recording.md)"
    )]
    MissingColumns {
        /// The file.
        file: String,
        /// What is missing.
        wanted: &'static str,
        /// What the header names, shortened if long.
        found: String,
    },
    /// There is a header and nothing below it.
    #[error("{file}: no rows below the header; there should be at least one")]
    NoRows {
        /// The file.
        file: String,
    },
    /// More rows than are read.
    #[error("{file}, line {line}: more than {most} rows; cut the recording into trips")]
    TooManyRows {
        /// The file.
        file: String,
        /// The line of the first row too many.
        line: u64,
        /// The most that are read.
        most: usize,
    },
}
