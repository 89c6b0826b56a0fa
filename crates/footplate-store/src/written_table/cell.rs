//! One field of a table, and the type of its column.

use footplate_core::Timestamp;

/// The type of a column.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    /// Seconds.
    Time,
    /// Seconds, or empty.
    OptionalTime,
    /// A whole number, or empty.
    Whole,
    /// A number in every row.
    Number,
    /// A number, or empty.
    OptionalNumber,
    /// A text in every row.
    Text,
}

/// The value of a field.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Cell<'c> {
    Missing,
    Time(Timestamp),
    Whole(i64),
    Number(f64),
    Text(&'c str),
}

impl Cell<'_> {
    pub(crate) fn optional_number(value: Option<f64>) -> Self {
        value.map_or(Self::Missing, Self::Number)
    }
}
