//! The lines of a CSV file or stream, read into a large buffer.

use std::io::{ErrorKind, Read};

use super::csv_line::Line;
use crate::table::{LONGEST_LINE, TableError};

/// How much is asked of the input at once, and four times the longest line.
const BUFFER: usize = 256 * 1024;
const BYTE_ORDER_MARK: &[u8] = b"\xEF\xBB\xBF";

/// The lines of an input, as many at hand as one read brought.
pub(super) struct Lines<R> {
    pub(super) file: String,
    input: R,
    buffer: Vec<u8>,
    /// Where in the buffer the lines that are not taken begin, where the last complete one ends, and where what
    /// was read ends.
    begin: usize,
    complete: usize,
    end: usize,
    /// The line that was taken last, counted from 1, and how many bytes have been taken with it.
    pub(super) line: u64,
    pub(super) taken: u64,
    /// The input has ended, and its last line had no end of its own.
    end_was_added: bool,
    ended: bool,
}

impl<R: Read> Lines<R> {
    pub(super) fn new(file: &str, input: R) -> Self {
        Self {
            file: file.to_owned(),
            input,
            // One more for the line feed that may have to be added.
            buffer: vec![0; BUFFER + 1],
            begin: 0,
            complete: 0,
            end: 0,
            line: 0,
            taken: 0,
            end_was_added: false,
            ended: false,
        }
    }

    pub(super) fn has_line(&self) -> bool {
        self.begin < self.complete
    }

    /// The complete lines that are not taken yet.
    pub(super) fn at_hand(&self) -> &[u8] {
        self.buffer.get(self.begin..self.complete).unwrap_or_default()
    }

    /// Takes a line of so many bytes.
    pub(super) fn take(&mut self, bytes: usize) {
        self.begin += bytes;
        self.taken += bytes as u64;
        self.line += 1;
    }

    /// Whether the line at hand is the last one and the file breaks off in it.
    pub(super) fn is_last_without_end(&self) -> bool {
        self.end_was_added && {
            let rest = self.at_hand();
            rest.iter().position(|byte| *byte == b'\n').is_some_and(|end| end + 1 == rest.len())
        }
    }

    /// Takes the next line, reading on if none is at hand.
    pub(super) fn next_line(&mut self) -> Result<Option<Line<'_>>, TableError> {
        while !self.has_line() {
            if !self.fill()? {
                return Ok(None);
            }
        }
        let length = self.at_hand().iter().position(|byte| *byte == b'\n').map_or(0, |end| end + 1);
        let begin = self.begin;
        self.take(length);
        if length > LONGEST_LINE {
            return Err(TableError::LineTooLong { file: self.file.clone(), line: self.line });
        }
        let bytes = self.buffer.get(begin..begin + length).unwrap_or_default();
        let bytes = if self.line == 1 { bytes.strip_prefix(BYTE_ORDER_MARK).unwrap_or(bytes) } else { bytes };
        Ok(Some(Line { file: &self.file, number: self.line, bytes }))
    }

    /// Reads on, once; `false` at the end of the input.
    pub(super) fn fill(&mut self) -> Result<bool, TableError> {
        if self.ended {
            return Ok(false);
        }
        self.buffer.copy_within(self.begin..self.end, 0);
        self.end -= self.begin;
        self.complete -= self.begin;
        self.begin = 0;
        if self.end - self.complete > LONGEST_LINE {
            return Err(TableError::LineTooLong { file: self.file.clone(), line: self.line + 1 });
        }
        let free = self.buffer.get_mut(self.end..BUFFER).unwrap_or_default();
        let count = loop {
            match self.input.read(free) {
                Ok(count) => break count,
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(source) => return Err(TableError::Read { file: self.file.clone(), source }),
            }
        };
        let new = self.end..self.end + count;
        self.end = new.end;
        if count > 0 {
            let new_line = self.buffer.get(new.clone()).and_then(|new| new.iter().rposition(|b| *b == b'\n'));
            if let Some(at) = new_line {
                self.complete = new.start + at + 1;
            }
            return Ok(true);
        }
        self.ended = true;
        if self.complete < self.end {
            if let Some(byte) = self.buffer.get_mut(self.end) {
                *byte = b'\n';
            }
            self.end += 1;
            self.complete = self.end;
            self.end_was_added = true;
        }
        Ok(self.has_line())
    }
}
