//! A CSV file that is being read, row by row.

use std::fmt;
use std::io::{BufRead, ErrorKind};

use super::error::{TableError, shown};
use super::fields::{Fields, SplitError};

/// The longest line that is read. A row of any recording has some hundred bytes; the limit keeps a file that
/// is no table at all from filling the memory.
pub const LONGEST_LINE: usize = 64 * 1024;
const BYTE_ORDER_MARK: &[u8] = b"\xEF\xBB\xBF";

/// A column of a table that is known to be there.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Column(usize);

/// How the last line of a file ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum LastLine {
    /// With an end of line, as it should, or it has not been reached yet.
    Ended,
    /// Without one, but with all fields.
    NotEnded,
    /// In the middle of its fields.
    CutOff,
}

/// A CSV file that is being read.
pub(crate) struct Table<R> {
    file: String,
    input: R,
    /// The line that was read last, counted from 1.
    line: u64,
    columns: Vec<String>,
    last_line: LastLine,
    bytes: Vec<u8>,
    fields: Fields,
}

impl<R: BufRead> Table<R> {
    /// Reads the header. `file` is what messages call the file.
    pub(crate) fn open(file: &str, input: R) -> Result<Self, TableError> {
        let mut table = Self {
            file: file.to_owned(),
            input,
            line: 0,
            columns: Vec::new(),
            last_line: LastLine::Ended,
            bytes: Vec::new(),
            fields: Fields::default(),
        };
        while table.fields.is_empty() {
            if matches!(table.read_line()?, Line::None) {
                return Err(TableError::Empty(table.file));
            }
            table.split()?;
        }
        let mut names: Vec<String> = Vec::with_capacity(table.fields.len());
        for name in table.fields.iter() {
            if !name.is_empty() && names.iter().any(|earlier| earlier == name) {
                return Err(TableError::ColumnTwice {
                    file: table.file,
                    line: table.line,
                    name: shown(name),
                });
            }
            names.push(name.to_owned());
        }
        table.columns = names;
        Ok(table)
    }

    /// What the columns are called, in order.
    pub(crate) fn columns(&self) -> &[String] {
        &self.columns
    }

    /// The column of that name.
    pub(crate) fn column(&self, name: &str) -> Option<Column> {
        self.columns.iter().position(|column| column == name).map(Column)
    }

    /// The columns of these names, if all are there.
    pub(crate) fn columns_named<const N: usize>(&self, names: [&str; N]) -> Option<[Column; N]> {
        let columns = names.map(|name| self.column(name));
        columns.iter().all(Option::is_some).then(|| columns.map(Option::unwrap_or_default))
    }

    /// The line that was read last, counted from 1.
    pub(crate) fn line(&self) -> u64 {
        self.line
    }

    /// How the file ended, once [`next_row`](Self::next_row) has found its end.
    pub(crate) fn last_line(&self) -> LastLine {
        self.last_line
    }

    /// Refuses a last line that breaks off, once [`next_row`](Self::next_row) has found the end.
    pub(crate) fn check_end(&self) -> Result<(), TableError> {
        match self.last_line {
            LastLine::CutOff => Err(TableError::CutOff { file: self.file.clone(), line: self.line }),
            _ => Ok(()),
        }
    }

    /// Says that the last line broke off, after one of its fields turned out to be wrong.
    pub(crate) fn last_line_is_cut_off(&mut self) {
        self.last_line = LastLine::CutOff;
    }

    /// The next row that is not empty. A last line that breaks off before its last field is no row.
    pub(crate) fn next_row(&mut self) -> Result<Option<Row<'_>>, TableError> {
        loop {
            let ended = match self.read_line()? {
                Line::None => return Ok(None),
                Line::Ended => true,
                Line::NotEnded => false,
            };
            match self.split().and_then(|()| self.check_count()) {
                Err(_) if !ended => {
                    self.last_line = LastLine::CutOff;
                    return Ok(None);
                }
                Err(error) => return Err(error),
                Ok(()) if self.fields.is_empty() => {}
                Ok(()) => {
                    if !ended {
                        self.last_line = LastLine::NotEnded;
                    }
                    break;
                }
            }
        }
        Ok(Some(Row { file: &self.file, line: self.line, columns: &self.columns, fields: &self.fields }))
    }

    fn check_count(&self) -> Result<(), TableError> {
        let (found, expected) = (self.fields.len(), self.columns.len());
        if found == expected || found == 0 {
            return Ok(());
        }
        Err(TableError::FieldCount { file: self.file.clone(), line: self.line, found, expected })
    }

    /// Reads one line into `bytes`, its line feed included or added, and never more than [`LONGEST_LINE`] of it.
    fn read_line(&mut self) -> Result<Line, TableError> {
        self.bytes.clear();
        self.line += 1;
        loop {
            let available = match self.input.fill_buf() {
                Ok(available) => available,
                Err(error) if error.kind() == ErrorKind::Interrupted => continue,
                Err(source) => return Err(TableError::Read { file: self.file.clone(), source }),
            };
            if available.is_empty() {
                if self.bytes.is_empty() {
                    self.line -= 1;
                    return Ok(Line::None);
                }
                self.bytes.push(b'\n');
                return Ok(Line::NotEnded);
            }
            let end = available.iter().position(|byte| *byte == b'\n');
            let part = end.map_or(available.len(), |end| end + 1);
            if self.bytes.len() + part > LONGEST_LINE {
                return Err(TableError::LineTooLong { file: self.file.clone(), line: self.line });
            }
            self.bytes.extend_from_slice(&available[..part]);
            self.input.consume(part);
            if end.is_some() {
                return Ok(Line::Ended);
            }
        }
    }

    /// Splits the line that was read last into `fields`; none if it is empty.
    fn split(&mut self) -> Result<(), TableError> {
        let mut line = self.bytes.as_slice();
        if self.line == 1 {
            line = line.strip_prefix(BYTE_ORDER_MARK).unwrap_or(line);
        }
        match self.fields.split(line) {
            Ok(()) => Ok(()),
            Err(SplitError::NotText { byte }) => {
                Err(TableError::NotText { file: self.file.clone(), line: self.line, byte })
            }
            Err(SplitError::QuoteNotClosed) => {
                Err(TableError::QuoteNotClosed { file: self.file.clone(), line: self.line })
            }
        }
    }
}

enum Line {
    None,
    Ended,
    NotEnded,
}

/// One row of a table.
#[derive(Clone, Copy)]
pub(crate) struct Row<'t> {
    file: &'t str,
    line: u64,
    columns: &'t [String],
    fields: &'t Fields,
}

impl<'t> Row<'t> {
    /// The line of the file, counted from 1.
    pub(crate) fn line(&self) -> u64 {
        self.line
    }

    /// The text of a field, without the spaces around it.
    pub(crate) fn text(&self, column: Column) -> &'t str {
        self.fields.get(column.0)
    }

    /// What `read` makes of a field, or an error that says what it should be.
    pub(crate) fn read<T>(
        &self,
        column: Column,
        expected: &str,
        read: impl FnOnce(&str) -> Option<T>,
    ) -> Result<T, TableError> {
        read(self.text(column)).ok_or_else(|| self.wrong(column, expected))
    }

    /// The error of a field that should be something else.
    pub(crate) fn wrong(&self, column: Column, expected: impl Into<String>) -> TableError {
        TableError::Field {
            file: self.file.to_owned(),
            line: self.line,
            number: column.0 + 1,
            column: self.columns.get(column.0).map_or_else(String::new, |name| shown(name)),
            value: shown(self.text(column)),
            expected: expected.into(),
        }
    }

    /// A column that rows of this kind cannot do without.
    pub(crate) fn needs(
        &self,
        column: Option<Column>,
        name: &'static str,
        row: &'static str,
    ) -> Result<Column, TableError> {
        column.ok_or_else(|| self.lacks(name, row))
    }

    /// The error of a row whose kind needs a column that the file does not have.
    pub(crate) fn lacks(&self, column: &'static str, row: &'static str) -> TableError {
        TableError::RowNeedsColumn { file: self.file.to_owned(), line: self.line, row, column }
    }
}

impl<R> fmt::Debug for Table<R> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Table").field("file", &self.file).field("line", &self.line).finish_non_exhaustive()
    }
}
