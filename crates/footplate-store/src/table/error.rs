//! What can be wrong with a table: where, what stands there and what would be right.

use std::io;

use super::rows::LONGEST_LINE;

/// How much of a wrong value a message repeats, in characters.
const LONGEST_SHOWN: usize = 60;

/// Why a table could not be read: where, what stands there and what would be right.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TableError {
    /// The file could not be opened or read.
    #[error("{file}: cannot be read: {source}")]
    Read {
        /// The file.
        file: String,
        /// What the system said.
        source: io::Error,
    },
    /// The file has no line at all.
    #[error("{0}: the file is empty; its first line should name the columns")]
    Empty(String),
    /// A line longer than [`LONGEST_LINE`].
    #[error(
        "{file}, line {line}: the line is longer than {LONGEST_LINE} bytes; is this a CSV file with a row a line?"
    )]
    LineTooLong {
        /// The file.
        file: String,
        /// The line.
        line: u64,
    },
    /// Bytes that are no UTF-8.
    #[error("{file}, line {line}: byte {byte} of the line is not UTF-8; save the file as UTF-8")]
    NotText {
        /// The file.
        file: String,
        /// The line.
        line: u64,
        /// The byte in the line, counted from 1.
        byte: usize,
    },
    /// The last line breaks off.
    #[error("{file}, line {line}: the line breaks off; complete it or delete it")]
    CutOff {
        /// The file.
        file: String,
        /// The line.
        line: u64,
    },
    /// A quote without its partner.
    #[error("{file}, line {line}: a quote is opened and not closed on the same line")]
    QuoteNotClosed {
        /// The file.
        file: String,
        /// The line.
        line: u64,
    },
    /// A row with too few or too many fields.
    #[error("{file}, line {line}: {found} fields where the header names {expected} columns")]
    FieldCount {
        /// The file.
        file: String,
        /// The line.
        line: u64,
        /// How many fields it has.
        found: usize,
        /// How many columns there are.
        expected: usize,
    },
    /// Two columns of one name.
    #[error("{file}, line {line}: two columns are called `{name}`; give each its own name")]
    ColumnTwice {
        /// The file.
        file: String,
        /// The line of the header.
        line: u64,
        /// The name.
        name: String,
    },
    /// A row of this kind needs a column that the file does not have.
    #[error("{file}, line {line}: {row} needs the column `{column}`, which the header does not name")]
    RowNeedsColumn {
        /// The file.
        file: String,
        /// The line.
        line: u64,
        /// What kind of row it is, with its article.
        row: &'static str,
        /// The column.
        column: &'static str,
    },
    /// A field that is not what it should be.
    #[error("{file}, line {line}, column {number} ({column}): `{value}` should be {expected}")]
    Field {
        /// The file.
        file: String,
        /// The line.
        line: u64,
        /// The column, counted from 1.
        number: usize,
        /// The name of the column.
        column: String,
        /// What stands there, shortened if long.
        value: String,
        /// What would be right.
        expected: String,
    },
}

/// A value as messages repeat it: on one line and not too long.
pub(crate) fn shown(value: &str) -> String {
    let mut text: String = value.chars().take(LONGEST_SHOWN).flat_map(char::escape_debug).collect();
    if value.chars().nth(LONGEST_SHOWN).is_some() {
        text.push('…');
    }
    text
}
