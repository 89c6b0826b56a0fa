//! What stands in one field of a written table.

use footplate_core::Timestamp;

/// What a column holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    /// Seconds.
    Time,
    /// Seconds, or nothing.
    OptionalTime,
    /// A whole number, or nothing.
    Whole,
    /// A number in every row.
    Number,
    /// A number, or nothing.
    OptionalNumber,
    /// A text in every row.
    Text,
}

/// What stands in one field.
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
