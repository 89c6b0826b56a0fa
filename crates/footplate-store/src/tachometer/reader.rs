//! A recording that is being read, whatever its form.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

use super::block::TachometerBlock;
use super::columns::TachometerColumns;
use super::csv::CsvReader;
use super::error::TachometerError;
use crate::table::TableError;

/// A tachometer recording that is being read.
pub struct TachometerReader {
    csv: CsvReader<Box<dyn Read + Send>>,
    extent: Option<u64>,
}

impl TachometerReader {
    /// Opens the file at `path`.
    ///
    /// # Errors
    /// That it cannot be read or is no recording, and what would be right.
    pub fn open(path: &Path) -> Result<Self, TachometerError> {
        let file = path.display().to_string();
        let opened = File::open(path).and_then(|input| {
            // A folder opens like a file on some systems, and then fails with a number.
            let about = input.metadata()?;
            if about.is_dir() { Err(io::Error::other("it is a folder")) } else { Ok((input, about.len())) }
        });
        match opened {
            Ok((input, bytes)) => {
                Ok(Self { extent: Some(bytes), ..Self::of_stream(&file, Box::new(input))? })
            }
            Err(source) => Err(TableError::Read { file, source }.into()),
        }
    }

    /// Reads from an input that comes as it likes. `name` is what messages call it.
    ///
    /// # Errors
    /// As [`open`](Self::open).
    pub fn of_stream(name: &str, input: Box<dyn Read + Send>) -> Result<Self, TachometerError> {
        Ok(Self { csv: CsvReader::open(name, input)?, extent: None })
    }

    /// The columns it has.
    #[must_use]
    pub fn columns(&self) -> &TachometerColumns {
        self.csv.columns()
    }

    /// How much there is to read, in bytes of a text and in rows of a table; unknown of a stream.
    #[must_use]
    pub fn extent(&self) -> Option<u64> {
        self.extent
    }

    /// The next rows, at most a few thousand, and from a live input those that are there; `false` at the end. A block
    /// without rows brings notes. What
    /// was in the block is gone, but its memory is used again.
    ///
    /// # Errors
    /// What is wrong with a row, and where.
    pub fn read_block(&mut self, block: &mut TachometerBlock) -> Result<bool, TachometerError> {
        self.csv.read_block(block)
    }
}
