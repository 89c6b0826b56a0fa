//! Writes a table as CSV.

use std::borrow::Cow;
use std::io::{self, Write};

use super::cell::Cell;
use crate::decimal::push_unscaled;

/// The size of the write buffer (bytes).
const GATHERED: usize = 64 * 1024;

/// A table as CSV. Numbers have the fewest digits that read back as the same number; times have all digits, to the
/// nanosecond.
#[derive(Debug)]
pub(crate) struct CsvTable<W> {
    output: W,
    text: Vec<u8>,
}

impl<W: Write> CsvTable<W> {
    pub(crate) fn new<'n>(output: W, names: impl Iterator<Item = &'n str>) -> Self {
        let mut text = Vec::with_capacity(2 * GATHERED);
        for (at, name) in names.enumerate() {
            if at > 0 {
                text.push(b',');
            }
            text.extend(name.as_bytes());
        }
        text.push(b'\n');
        Self { output, text }
    }

    pub(crate) fn push<'c>(&mut self, row: impl Iterator<Item = Cell<'c>>) -> io::Result<()> {
        let text = &mut self.text;
        for (at, cell) in row.enumerate() {
            if at > 0 {
                text.push(b',');
            }
            match cell {
                Cell::Missing => {}
                Cell::Time(time) => push_unscaled(text, time.as_ns(), 9),
                Cell::Whole(number) => push_unscaled(text, number, 0),
                Cell::Number(number) => text.extend(zmij::Buffer::new().format(number).as_bytes()),
                Cell::Text(word) => text.extend(quoted(word).as_bytes()),
            }
        }
        text.push(b'\n');
        if text.len() >= GATHERED { self.write() } else { Ok(()) }
    }

    /// Writes all complete rows.
    ///
    /// # Errors
    /// The error of the system.
    pub(crate) fn flush(&mut self) -> io::Result<()> {
        self.write()?;
        self.output.flush()
    }

    /// Ends the table and returns its writer.
    ///
    /// # Errors
    /// The error of the system.
    pub(crate) fn finish(mut self) -> io::Result<W> {
        self.flush()?;
        Ok(self.output)
    }

    fn write(&mut self) -> io::Result<()> {
        self.output.write_all(&self.text)?;
        self.text.clear();
        Ok(())
    }
}

/// A text as a CSV field.
fn quoted(text: &str) -> Cow<'_, str> {
    if text.contains([',', '"', '\n', '\r']) || text.trim() != text {
        format!("\"{}\"", text.replace('"', "\"\"")).into()
    } else {
        text.into()
    }
}
