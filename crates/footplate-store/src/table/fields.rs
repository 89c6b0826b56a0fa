//! The fields of one line of CSV.

use csv_core::{ReadRecordResult, ReaderBuilder, Terminator};

/// The fields of one line, unquoted.
pub(crate) struct Fields {
    /// Built once: that takes as long as parsing a hundred lines.
    parser: csv_core::Reader,
    text: String,
    /// Where each field ends in `text`.
    ends: Vec<usize>,
    /// Where the parser writes, kept for the next line.
    parsed: Vec<u8>,
    separator: u8,
}

impl Default for Fields {
    fn default() -> Self {
        Self::separated_by(b',')
    }
}

/// Why a line has no fields.
pub(crate) enum SplitError {
    NotText { byte: usize },
    QuoteNotClosed,
}

impl Fields {
    /// Fields with this ASCII character between them.
    pub(crate) fn separated_by(separator: u8) -> Self {
        let parser = ReaderBuilder::new().delimiter(separator).terminator(Terminator::Any(b'\n')).build();
        Self { parser, text: String::new(), ends: Vec::new(), parsed: Vec::new(), separator }
    }

    /// Splits a line that ends with a line feed.
    pub(crate) fn split(&mut self, line: &[u8]) -> Result<(), SplitError> {
        self.text.clear();
        self.ends.clear();
        let text = std::str::from_utf8(line)
            .map_err(|error| SplitError::NotText { byte: error.valid_up_to() + 1 })?;
        if text.trim().is_empty() {
            return Ok(());
        }
        // Unquoting only removes bytes, and a line of n separators has at most n + 1 fields.
        self.parsed.resize(line.len(), 0);
        self.ends.resize(line.iter().filter(|byte| **byte == self.separator).count() + 1, 0);
        self.parser.reset();
        let (result, _, written, fields) = self.parser.read_record(line, &mut self.parsed, &mut self.ends);
        self.ends.truncate(fields);
        if !matches!(result, ReadRecordResult::Record) {
            return Err(SplitError::QuoteNotClosed);
        }
        // Quotes are ASCII: without them the text is still text.
        self.text.push_str(std::str::from_utf8(&self.parsed[..written]).unwrap_or_default());
        Ok(())
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.ends.is_empty()
    }

    pub(crate) fn len(&self) -> usize {
        self.ends.len()
    }

    pub(crate) fn get(&self, index: usize) -> &str {
        let begin = index.checked_sub(1).map_or(0, |before| self.ends.get(before).copied().unwrap_or(0));
        let end = self.ends.get(index).copied().unwrap_or(begin);
        self.text.get(begin..end).unwrap_or_default().trim()
    }

    pub(crate) fn iter(&self) -> impl Iterator<Item = &str> {
        (0..self.len()).map(|index| self.get(index))
    }
}
