//! A recording that is being read, whatever its form.

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use footplate_core::odometry::wheels::Vehicle;

use super::block::TachometerBlock;
use super::columns::TachometerColumns;
use super::csv::CsvReader;
use super::error::TachometerError;
use super::mapping::{ColumnMapping, MappedReader};
use super::parquet::{PARQUET_MAGIC, ParquetReader};
use crate::table::TableError;
use crate::whole_file::open_file;

/// A tachometer recording that is being read.
pub struct TachometerReader {
    form: Form,
    extent: Option<u64>,
}

enum Form {
    Csv(Box<CsvReader<Box<dyn Read + Send>>>),
    Parquet(Box<ParquetReader>),
    Mapped(Box<MappedReader>),
}

impl TachometerReader {
    /// Opens the file at `path`.
    ///
    /// # Errors
    /// That it cannot be read or is no recording, and what would be right.
    pub fn open(path: &Path) -> Result<Self, TachometerError> {
        let name = path.display().to_string();
        let opened = open_file(path).and_then(|(mut input, about)| {
            if !about.is_file() {
                // A pipe cannot be read twice.
                return Ok((input, None, false));
            }
            let is_parquet = beginning(&mut input)? == PARQUET_MAGIC;
            input.seek(SeekFrom::Start(0))?;
            Ok((input, Some(about.len()), is_parquet))
        });
        match opened {
            Ok((input, _, true)) => Self::parquet(&name, input),
            Ok((input, None, false)) => Self::of_stream(&name, Box::new(input)),
            Ok((input, extent, false)) => Self::csv(&name, Box::new(input), extent),
            Err(source) => Err(TableError::Read { file: name, source }.into()),
        }
    }

    /// Reads from an input that comes as it likes. `name` is what messages call it. Of Parquet, whose beginning stands
    /// at its end, a temporary copy is made.
    ///
    /// # Errors
    /// As [`open`](Self::open).
    pub fn of_stream(name: &str, mut input: Box<dyn Read + Send>) -> Result<Self, TachometerError> {
        let unreadable = |source| TableError::Read { file: name.to_owned(), source };
        let begin = beginning(&mut input).map_err(unreadable)?;
        let is_parquet = begin == PARQUET_MAGIC;
        let mut whole = io::Cursor::new(begin).chain(input);
        if is_parquet {
            let mut copy = tempfile::tempfile().map_err(unreadable)?;
            io::copy(&mut whole, &mut copy).map_err(unreadable)?;
            return Self::parquet(name, copy);
        }
        Self::csv(name, Box::new(whole), None)
    }

    /// Opens a CSV file at `path` whose columns a mapping names; wheel speeds become pulses of this vehicle.
    ///
    /// # Errors
    /// As [`open`](Self::open), and where the mapping does not fit the file.
    pub fn open_mapped(
        path: &Path,
        mapping: &ColumnMapping,
        vehicle: &Vehicle,
    ) -> Result<Self, TachometerError> {
        let file = path.display().to_string();
        let (input, about) =
            open_file(path).map_err(|source| TableError::Read { file: file.clone(), source })?;
        let reader = Self::mapped_stream(&file, Box::new(input), mapping, vehicle)?;
        Ok(Self { extent: about.is_file().then_some(about.len()), ..reader })
    }

    /// Reads such a file from an input that comes as it likes. `name` is what messages call it.
    ///
    /// # Errors
    /// As [`open_mapped`](Self::open_mapped).
    pub fn mapped_stream(
        name: &str,
        mut input: Box<dyn Read + Send>,
        mapping: &ColumnMapping,
        vehicle: &Vehicle,
    ) -> Result<Self, TachometerError> {
        let unreadable = |source| TableError::Read { file: name.to_owned(), source };
        let begin = beginning(&mut input).map_err(unreadable)?;
        if begin == PARQUET_MAGIC {
            return Err(TachometerError::MappedParquet(name.to_owned()));
        }
        let whole = Box::new(io::Cursor::new(begin).chain(input));
        let reader = MappedReader::open(name, whole, mapping, vehicle)?;
        Ok(Self { form: Form::Mapped(Box::new(reader)), extent: None })
    }

    fn csv(name: &str, input: Box<dyn Read + Send>, extent: Option<u64>) -> Result<Self, TachometerError> {
        Ok(Self { form: Form::Csv(Box::new(CsvReader::open(name, input)?)), extent })
    }

    fn parquet(name: &str, input: File) -> Result<Self, TachometerError> {
        let reader = guarded(name, || ParquetReader::open(name, input))?;
        Ok(Self { extent: Some(reader.rows()), form: Form::Parquet(Box::new(reader)) })
    }

    /// The columns it has.
    pub fn columns(&self) -> &TachometerColumns {
        match &self.form {
            Form::Csv(reader) => reader.columns(),
            Form::Parquet(reader) => reader.columns(),
            Form::Mapped(reader) => reader.columns(),
        }
    }

    /// How much there is to read, in bytes of a text and in rows of a table; unknown of a stream.
    pub fn extent(&self) -> Option<u64> {
        self.extent
    }

    /// The next rows, at most a few thousand, and from a live input those that are there; `false` at the end. A block
    /// without rows brings notes. What was in the block is gone, but its memory is used again.
    ///
    /// # Errors
    /// What is wrong with a row, and where.
    pub fn read_block(&mut self, block: &mut TachometerBlock) -> Result<bool, TachometerError> {
        match &mut self.form {
            Form::Csv(reader) => reader.read_block(block),
            Form::Mapped(reader) => reader.read_block(block),
            Form::Parquet(reader) => {
                let name = reader.file().to_owned();
                guarded(&name, || reader.read_block(block))
            }
        }
    }
}

/// Does what the decoder of Parquet may not survive: it panics at some damages, which here are errors like any other.
fn guarded<T>(name: &str, work: impl FnOnce() -> Result<T, TachometerError>) -> Result<T, TachometerError> {
    catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|_| {
        let problem = "the decoder gave up".to_owned();
        Err(TachometerError::Parquet { file: name.to_owned(), problem })
    })
}

/// The first bytes, by which a form is recognised; fewer only of a shorter input.
fn beginning(input: &mut impl Read) -> io::Result<Vec<u8>> {
    let mut begin = Vec::with_capacity(PARQUET_MAGIC.len());
    input.take(PARQUET_MAGIC.len() as u64).read_to_end(&mut begin)?;
    Ok(begin)
}
