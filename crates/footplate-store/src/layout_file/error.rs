//! Errors in layout files: where, what is wrong, and what would be right.

use footplate_core::track::LayoutError;

use crate::text_file::{TextFileError, TextPlace};

/// A layout file that could not be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LayoutFileError {
    /// It is no such text.
    #[error(transparent)]
    Text(#[from] TextFileError),
    /// The file is not UTF-8.
    #[error("{file}, line {line}: byte {byte} of the line is not UTF-8; save the file as UTF-8")]
    NotText {
        /// The file.
        file: String,
        /// The line, counted from 1.
        line: usize,
        /// The byte in the line, counted from 1.
        byte: usize,
    },
    /// The text has an error.
    #[error("{place}: {problem}")]
    Wrong {
        /// The place of the error.
        place: TextPlace,
        /// The error.
        problem: LayoutProblem,
    },
    /// Neither a built-in layout nor a file.
    #[error("there is no layout `{name}`: give {built_in}, or the path of a layout file")]
    Unknown {
        /// The name that was given.
        name: String,
        /// The names of the built-in layouts.
        built_in: String,
    },
}

/// An error in the text of a layout.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LayoutProblem {
    /// It is not TOML, or has keys that a layout does not have.
    #[error("{0}")]
    Toml(String),
    /// A newer format.
    #[error("format {found} is not known to this version of Footplate, which reads format {known}")]
    Format {
        /// The format of the file.
        found: i64,
        /// The format that this version reads.
        known: i64,
    },
    /// The end of an edge is more than a name and a leg.
    #[error(
        "`{0}` is not an end of an edge: write a name like `C13`, or `BR6 straight` or `BR6 \
             curved`"
    )]
    RailEnd(String),
    /// A sensor without a number whose name does not imply one.
    #[error(
        "`{0}` does not imply the sensor's number: add `numbers = [.., ..]`, `number = ..` if it reports the same number for \
         both directions, or call it A1 to E16"
    )]
    SensorNumber(String),
    /// A sensor with two numbers that are equal.
    #[error(
        "numbers = [{0}, {0}] are one number: write `number = {0}` if the sensor reports both directions under it"
    )]
    EqualNumbers(u16),
    /// A sensor with one number for both directions and one for each.
    #[error(
        "`{0}` has `number` and `numbers`: keep `number` if it reports the same number for both directions, `numbers` if it \
         reports one for each"
    )]
    NumberAndNumbers(String),
    /// An uncertainty without a length.
    #[error("an uncertainty without a length: add `mm`, or leave out `uncertainty_mm`")]
    UncertaintyOfNothing,
    /// An edge in a zone that is not defined.
    #[error("no zone is called `{0}`: add `{{ name = \"{0}\", max_mm_s = .. }}` to `zones`")]
    UnknownZone(String),
    /// A crossing on an edge that is not in the file.
    #[error("no edge leads from `{from}` to `{to}`: name it as it is written in `edges`")]
    UnknownEdge {
        /// Where the edge should begin.
        from: String,
        /// Where it should end.
        to: String,
    },
    /// A crossing before the start or beyond the end of an edge.
    #[error(
        "`mm` of a crossing is not on its edge: write the distance from the start of the edge to the crossing"
    )]
    CrossingOffEdge,
    /// Coordinates out of range.
    #[error("[{x}, {y}] is out of range: coordinates are between -{limit} and {limit}")]
    Point {
        /// Its first coordinate.
        x: f64,
        /// Its second coordinate.
        y: f64,
        /// The limit.
        limit: f64,
    },
    /// The layout is inconsistent.
    #[error(transparent)]
    Layout(#[from] LayoutError),
}
