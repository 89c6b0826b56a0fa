//! Text files that people write: read whole up to a limit, as UTF-8, and the place of what is wrong in them.

use std::fmt;
use std::io;
use std::path::Path;

use crate::whole_file::read_at_most;

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

    /// Where bytes end to be UTF-8.
    pub(crate) fn of_error(file: &str, bytes: &[u8], error: &std::str::Utf8Error) -> Self {
        let before = String::from_utf8_lossy(bytes.get(..error.valid_up_to()).unwrap_or_default());
        Self::of_byte(file, &before, before.len())
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

/// A file that is not the text of what it should describe.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TextFileError {
    /// The file could not be opened or read.
    #[error("{file}: cannot be read: {source}")]
    Read {
        /// The file.
        file: String,
        /// The error of the system.
        source: io::Error,
    },
    /// More bytes than any such file has.
    #[error("{file}: the file is longer than {limit} bytes; is it {kind}?")]
    TooLarge {
        /// The file.
        file: String,
        /// The limit.
        limit: usize,
        /// What it should describe.
        kind: &'static str,
    },
    /// Bytes that are not UTF-8.
    #[error("{0}: no UTF-8 text; save the file as UTF-8")]
    NotText(TextPlace),
}

/// What a file describes.
pub(crate) struct TextFile {
    /// As people call it.
    pub(crate) kind: &'static str,
    /// The most bytes that are read.
    pub(crate) largest: usize,
}

impl TextFile {
    /// The bytes of the file at `path`, one more than are read at most.
    pub(crate) fn read(&self, path: &Path) -> Result<Vec<u8>, TextFileError> {
        read_at_most(path, self.largest)
            .map_err(|source| TextFileError::Read { file: path.display().to_string(), source })
    }

    /// Refuses more bytes than any such file has.
    pub(crate) fn check_size(&self, file: &str, bytes: &[u8]) -> Result<(), TextFileError> {
        if bytes.len() > self.largest {
            return Err(TextFileError::TooLarge {
                file: file.to_owned(),
                limit: self.largest,
                kind: self.kind,
            });
        }
        Ok(())
    }

    /// The text of the bytes of a file.
    pub(crate) fn text<'b>(&self, file: &str, bytes: &'b [u8]) -> Result<&'b str, TextFileError> {
        self.check_size(file, bytes)?;
        std::str::from_utf8(bytes)
            .map_err(|error| TextFileError::NotText(TextPlace::of_error(file, bytes, &error)))
    }
}
