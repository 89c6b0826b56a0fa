//! The rows of a CSV file, one bounded line at a time, every field with its place.
//!
//! Quotes as in RFC 4180, except that a field may not run over several lines: a quote that someone forgot to
//! close is then found where it is, and a file of any size is read in constant memory. A byte order mark,
//! CRLF and empty lines are passed over.

mod error;
mod fields;
mod rows;

pub use error::TableError;
pub(crate) use error::shown;
pub(crate) use fields::{Fields, SplitError};
pub use rows::LONGEST_LINE;
pub(crate) use rows::{Column, LastLine, Row, Table};
