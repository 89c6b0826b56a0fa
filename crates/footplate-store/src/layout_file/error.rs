//! Why a layout file could not be read: where, what stands there and what would be right.

use std::fmt;
use std::io;

use footplate_core::track::LayoutError;

/// A layout file that could not be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LayoutFileError {
    /// The file could not be opened or read.
    #[error("{file}: cannot be read: {source}")]
    Read {
        /// The file.
        file: String,
        /// What the system said.
        source: io::Error,
    },
    /// More bytes than any layout has.
    #[error("{file}: the file is longer than {limit} bytes; is it a layout?")]
    TooLarge {
        /// The file.
        file: String,
        /// The most that is read.
        limit: usize,
    },
    /// Bytes that are no UTF-8.
    #[error("{file}, line {line}: byte {byte} of the line is not UTF-8; save the file as UTF-8")]
    NotText {
        /// The file.
        file: String,
        /// The line, counted from 1.
        line: usize,
        /// The byte in the line, counted from 1.
        byte: usize,
    },
    /// Something in the text is wrong.
    #[error("{place}: {problem}")]
    Wrong {
        /// Where.
        place: TextPlace,
        /// What.
        problem: LayoutProblem,
    },
    /// Neither a built-in layout nor a file.
    #[error("there is no layout `{name}`: give {built_in}, or the path of a layout file")]
    Unknown {
        /// What was asked for.
        name: String,
        /// The names of the built-in layouts.
        built_in: String,
    },
}

/// A place in a text file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TextPlace {
    /// The file.
    pub file: String,
    /// The line, counted from 1.
    pub line: usize,
    /// The character in the line, counted from 1.
    pub column: usize,
}

impl TextPlace {
    /// The place of a byte of `text`.
    pub(crate) fn of_byte(file: &str, text: &str, byte: usize) -> Self {
        let before = text.get(..byte).unwrap_or(text);
        let line_start = before.rfind('\n').map_or(0, |end| end + 1);
        Self {
            file: file.to_owned(),
            line: before.bytes().filter(|byte| *byte == b'\n').count() + 1,
            column: before[line_start..].chars().count() + 1,
        }
    }
}

impl fmt::Display for TextPlace {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}, line {}, column {}", self.file, self.line, self.column)
    }
}

/// What is wrong with the text of a layout.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LayoutProblem {
    /// It is no TOML, or its keys are not those of a layout.
    #[error("{0}")]
    Toml(String),
    /// A format from the future.
    #[error("format {found} is not known to this version of Footplate, which reads format {known}")]
    Format {
        /// What the file says.
        found: i64,
        /// What would be right.
        known: i64,
    },
    /// More than a name and a leg at the end of an edge.
    #[error(
        "`{found}` is not an end of an edge: write a name like `C13`, or `BR6 straight` or `BR6 \
             curved`"
    )]
    RailEnd {
        /// What the file says.
        found: String,
    },
    /// A sensor without a number whose name does not tell it.
    #[error("`{name}` does not tell the sensor's number: add `numbers = [.., ..]`, or call it A1 to E16")]
    SensorNumber {
        /// The name.
        name: String,
    },
    /// The uncertainty of a length that is not written.
    #[error("an uncertainty is given of a length that is not: add `mm`, or leave out `uncertainty_mm`")]
    UncertaintyOfNothing,
    /// An edge in a zone that is nowhere described.
    #[error("no zone is called `{found}`: add `{{ name = \"{found}\", max_mm_s = .. }}` to `zones`")]
    UnknownZone {
        /// What the file says.
        found: String,
    },
    /// A point that cannot be drawn.
    #[error("[{x}, {y}] is out of range: coordinates are between -{limit} and {limit}")]
    Point {
        /// Its first coordinate.
        x: f64,
        /// Its second coordinate.
        y: f64,
        /// The largest that is drawn.
        limit: f64,
    },
    /// It is no layout.
    #[error(transparent)]
    Layout(#[from] LayoutError),
}
