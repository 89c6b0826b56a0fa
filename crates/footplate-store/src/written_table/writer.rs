//! Writes a table in the format of its file name.

use std::fmt;
use std::io::{self, Write};
use std::path::Path;

use super::cell::{Cell, Kind};
use super::csv::CsvTable;
use super::parquet::ParquetTable;

/// A format of tables.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TableForm {
    /// CSV text.
    Csv,
    /// Compressed columns.
    Parquet,
}

/// The extension of the file does not name a format.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{file}: the name should end in .csv or .parquet")]
pub struct UnknownForm {
    file: String,
}

impl TableForm {
    /// The format of a file name.
    ///
    /// # Errors
    /// The extension is neither .csv nor .parquet.
    pub fn of_path(path: &Path) -> Result<Self, UnknownForm> {
        let ending = path.extension().unwrap_or_default();
        if ending.eq_ignore_ascii_case("csv") {
            Ok(Self::Csv)
        } else if ending.eq_ignore_ascii_case("parquet") {
            Ok(Self::Parquet)
        } else {
            Err(UnknownForm { file: path.display().to_string() })
        }
    }
}

/// Writes a table row by row.
pub(crate) struct TableWriter<W: Write + Send> {
    output: Output<W>,
}

enum Output<W: Write + Send> {
    Csv(CsvTable<W>),
    Parquet(Box<ParquetTable<W>>),
}

impl<W: Write + Send> TableWriter<W> {
    /// Begins a table; a `warning` about all of it is metadata of Parquet, and CSV has no place for it.
    pub(crate) fn new<'n>(
        output: W,
        form: TableForm,
        columns: impl Iterator<Item = (&'n str, Kind)> + Clone,
        warning: Option<&str>,
    ) -> io::Result<Self> {
        let output = match form {
            TableForm::Csv => Output::Csv(CsvTable::new(output, columns.map(|(name, _)| name))),
            TableForm::Parquet => Output::Parquet(Box::new(ParquetTable::new(output, columns, warning)?)),
        };
        Ok(Self { output })
    }

    pub(crate) fn push<'c>(&mut self, row: impl Iterator<Item = Cell<'c>>) -> io::Result<()> {
        match &mut self.output {
            Output::Csv(table) => table.push(row),
            Output::Parquet(table) => table.push(row),
        }
    }

    /// Ends the table and returns its writer.
    ///
    /// # Errors
    /// The error of the system.
    pub(crate) fn finish(self) -> io::Result<W> {
        match self.output {
            Output::Csv(table) => table.finish(),
            Output::Parquet(table) => table.finish(),
        }
    }
}

impl<W: Write + Send> fmt::Debug for TableWriter<W> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("TableWriter").finish_non_exhaustive()
    }
}
