//! Why a tachometer recording could not be read: where, what stands there and what would be right.

use crate::table::TableError;

/// A tachometer recording that could not be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TachometerError {
    /// A line or a field of a CSV file is wrong.
    #[error(transparent)]
    Table(#[from] TableError),
    /// Columns that no recording can do without.
    #[error(
        "{file}: missing columns: {}; the header names {found} (docs/formats/tachometer-recording.md)",
        missing.join(", ")
    )]
    MissingColumns {
        /// The file.
        file: String,
        /// What the header names, shortened if long.
        found: String,
        /// What is missing.
        missing: Vec<&'static str>,
    },
    /// Columns that no recording can do without, even with a mapping.
    #[error(
        "{file}: no column is mapped to {}; the header names {found} (docs/formats/column-mapping.md)",
        missing.join(" and to ")
    )]
    MappedColumns {
        /// The file.
        file: String,
        /// What the header names, shortened if long.
        found: String,
        /// What is missing.
        missing: Vec<&'static str>,
    },
    /// A mapping that does not fit the file.
    #[error("{file}: {problem}")]
    Mapping {
        /// The file, and the line if it is of one.
        file: String,
        /// What does not fit, and what to do.
        problem: String,
    },
    /// A mapping for a file that has its units and types in itself.
    #[error(
        "{0}: columns of Parquet files cannot be mapped; rename them where the file is written, or write CSV"
    )]
    MappedParquet(String),
    /// There is a header and nothing below it.
    #[error("{0}: no rows below the header; a recording has at least one")]
    NoRows(String),
    /// The times stand in another column.
    #[error(
        "{file}: `t_s` does not increase from row to row and `{column}` does; are the two columns swapped in the \
         header?"
    )]
    Swapped {
        /// The file.
        file: String,
        /// The column that looks like time.
        column: String,
    },
    /// A Parquet file that cannot be read on.
    #[error(
        "{file}: it begins like Parquet and cannot be read as that: {problem}; was it written and copied to its end?"
    )]
    Parquet {
        /// The file.
        file: String,
        /// What is wrong.
        problem: String,
    },
    /// A column of a Parquet file that would unpack to more memory than its values can need.
    #[error(
        "{file}, column {column}: its {values} values would unpack to {bytes} bytes; at most {most} are read; write the \
         column again with values of its own length"
    )]
    ParquetSize {
        /// The file.
        file: String,
        /// The column.
        column: String,
        /// Its number of values in one row group.
        values: i64,
        /// What they unpack to (bytes).
        bytes: i64,
        /// The most that is read (bytes).
        most: i64,
    },
    /// A column of a Parquet file with a type that cannot hold what it should.
    #[error("{file}, column {column}: its type is {found}; it should be {expected}")]
    ParquetType {
        /// The file.
        file: String,
        /// The column.
        column: String,
        /// Its type.
        found: String,
        /// What would be right.
        expected: &'static str,
    },
    /// A value of a Parquet file that is not what it should be.
    #[error("{file}, row {row}, column {column}: `{value}` should be {expected}")]
    ParquetValue {
        /// The file.
        file: String,
        /// The row, counted from 1.
        row: u64,
        /// The column.
        column: String,
        /// What stands there.
        value: String,
        /// What would be right.
        expected: String,
    },
}
