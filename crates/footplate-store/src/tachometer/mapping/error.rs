//! Why a column mapping could not be read: what stands there and what would be right.

use std::io;

use crate::layout_file::TextPlace;

/// A column mapping that could not be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MappingError {
    /// The file could not be opened or read.
    #[error("{file}: cannot be read: {source}")]
    Read {
        /// The file.
        file: String,
        /// What the system said.
        source: io::Error,
    },
    /// More bytes than any mapping has.
    #[error("{file}: the file is longer than {limit} bytes; is it a column mapping?")]
    TooLarge {
        /// The file.
        file: String,
        /// The most that is read.
        limit: usize,
    },
    /// Something in a file is wrong.
    #[error("{place}: {problem}")]
    Wrong {
        /// Where.
        place: TextPlace,
        /// What.
        problem: String,
    },
    /// Something in a pair on the command line is wrong.
    #[error("--map {pair}: {problem}")]
    Pair {
        /// The pair as it was written.
        pair: String,
        /// What is wrong with it.
        problem: String,
    },
}
