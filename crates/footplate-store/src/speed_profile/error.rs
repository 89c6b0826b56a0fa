//! Why a speed profile could not be read or written: where, what stands there and what would be right.

use super::profile::FASTEST_MM_S;
use crate::table::TableError;
use crate::text_file::{TextFileError, TextPlace};

/// A speed profile that could not be read or written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ProfileError {
    /// It is no such text.
    #[error(transparent)]
    Text(#[from] TextFileError),
    /// Bytes that are not UTF-8.
    #[error("{0}: not UTF-8; save the file as UTF-8")]
    NotText(TextPlace),
    /// Something in an XML file is wrong.
    #[error("{place}: {problem}")]
    Wrong {
        /// Where.
        place: TextPlace,
        /// What.
        problem: ProfileProblem,
    },
    /// A line or a field of a table is wrong.
    #[error(transparent)]
    Table(#[from] TableError),
    /// No form that is read.
    #[error(
        "{0}: not a speed profile; give a roster entry of JMRI (XML), mvtrack.csv of Rocrail, or a CSV with the columns step, \
         forward_mm_s and reverse_mm_s"
    )]
    Form(String),
    /// There is no usable speed.
    #[error(
        "{0}: no speed was measured in this profile; measure speeds in the program that wrote it, or choose another file"
    )]
    NoSpeeds(String),
    /// All speeds are too fast for a model.
    #[error(
        "{0}: every speed is above {FASTEST_MM_S:.0} mm/s, which no model train reaches; if these are speeds of the full-size \
         train, divide them by the scale (87 for H0)"
    )]
    OtherUnit(String),
    /// Several locomotives, of which none was named.
    #[error("{file}: measurements of several locomotives ({found}); choose one with --loco")]
    Which {
        /// The file.
        file: String,
        /// Their names.
        found: String,
    },
    /// The scale is needed.
    #[error(
        "{file}: speeds of the full-size train (column {column}); give the scale, such as --scale 87 for H0"
    )]
    NeedsScale {
        /// The file.
        file: String,
        /// The column.
        column: String,
    },
}

/// What is wrong with an XML file.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ProfileProblem {
    /// Not XML.
    #[error("{0}")]
    Xml(String),
    /// An element that is missing.
    #[error("<{of}> lacks <{element}>")]
    Missing {
        /// The element that lacks it.
        of: &'static str,
        /// The missing element.
        element: &'static str,
    },
    /// A root of another kind.
    #[error(
        "<{0}> is not the roster entry of a locomotive (<locomotive-config>); JMRI keeps one file per locomotive in the folder \
         `roster`"
    )]
    Root(String),
    /// A value that cannot be.
    #[error("<{element}> is `{value}`; it should be {expected}")]
    Value {
        /// The element.
        element: &'static str,
        /// The value, shortened.
        value: String,
        /// What would be right.
        expected: &'static str,
    },
    /// More entries than any decoder has steps.
    #[error("more than {0} speeds; a decoder has 126 steps")]
    TooMany(usize),
}
