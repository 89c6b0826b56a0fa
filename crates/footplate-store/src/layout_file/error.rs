//! Errors in layout files: where, what is wrong, and what would be right.

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
        /// The error of the system.
        source: io::Error,
    },
    /// The file is larger than any layout.
    #[error("{file}: the file is longer than {limit} bytes; is it a layout?")]
    TooLarge {
        /// The file.
        file: String,
        /// The limit.
        limit: usize,
    },
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
    /// Where XML is wrong; at the end of what breaks off, for which its parser names no place.
    pub(crate) fn of_xml(file: &str, text: &str, error: &roxmltree::Error) -> Self {
        use roxmltree::Error;
        if matches!(error, Error::UnclosedRootNode | Error::UnexpectedEndOfStream | Error::NoRootNode) {
            return Self::of_byte(file, text, text.len());
        }
        let at = error.pos();
        Self { file: file.to_owned(), line: at.row as usize, column: at.col as usize }
    }

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
        "`{found}` is not an end of an edge: write a name like `C13`, or `BR6 straight` or `BR6 \
             curved`"
    )]
    RailEnd {
        /// The text in the file.
        found: String,
    },
    /// A sensor without a number whose name does not imply one.
    #[error("`{name}` does not imply the sensor's number: add `numbers = [.., ..]`, or call it A1 to E16")]
    SensorNumber {
        /// The name.
        name: String,
    },
    /// An uncertainty without a length.
    #[error("an uncertainty without a length: add `mm`, or leave out `uncertainty_mm`")]
    UncertaintyOfNothing,
    /// An edge in a zone that is not defined.
    #[error("no zone is called `{found}`: add `{{ name = \"{found}\", max_mm_s = .. }}` to `zones`")]
    UnknownZone {
        /// The name in the file.
        found: String,
    },
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
