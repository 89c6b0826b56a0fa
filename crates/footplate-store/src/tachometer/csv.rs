//! A recording in CSV, read in one pass over a large buffer.
//!
//! Nearly every row is plain digits and commas, and [`csv_bytes`](super::csv_bytes) reads it as it comes. A row that
//! is not goes through [`csv_line`](super::csv_line). A block is handed over as soon as the input has no further
//! complete line at hand, so that a live recording is never held back.

use std::io::Read;

use footplate_core::Timestamp;

use super::block::{BLOCK_ROWS, TachometerBlock};
use super::columns::{Slot, TachometerColumns};
use super::csv_bytes;
use super::csv_line::LineReader;
use super::csv_lines::Lines;
use super::error::TachometerError;
use super::note::{RowPlace, TachometerNote, TachometerOddity};
use super::row_watch::RowWatch;
use super::run_names::RunNames;
use crate::table::{LONGEST_LINE, TableError};

/// A CSV file that is being read.
pub(super) struct CsvReader<R> {
    lines: Lines<R>,
    columns: TachometerColumns,
    line_reader: LineReader,
    runs: RunNames,
    watch: RowWatch,
    /// What the header had that is odd, until the first block takes it along.
    notes: Vec<TachometerNote>,
    has_rows: bool,
}

impl<R: Read> CsvReader<R> {
    /// Reads the header. `file` is what messages call the file.
    pub(super) fn open(file: &str, input: R) -> Result<Self, TachometerError> {
        let mut lines = Lines::new(file, input);
        let mut line_reader = LineReader::default();
        let names = loop {
            let Some(line) = lines.next_line()? else {
                return Err(TableError::Empty(file.to_owned()).into());
            };
            let names = line_reader.header(line)?;
            if !names.is_empty() {
                break names;
            }
        };
        let place = Some(RowPlace::Line(lines.line));
        let (columns, oddities) = TachometerColumns::of_header(file, names)?;
        let notes = oddities.into_iter().map(|oddity| TachometerNote { place, oddity }).collect();
        Ok(Self {
            lines,
            columns,
            line_reader,
            runs: RunNames::default(),
            watch: RowWatch::default(),
            notes,
            has_rows: false,
        })
    }

    pub(super) fn columns(&self) -> &TachometerColumns {
        &self.columns
    }

    /// The next rows or notes, as many as are at hand; `false` at the end.
    pub(super) fn read_block(&mut self, block: &mut TachometerBlock) -> Result<bool, TachometerError> {
        block.begin(&self.columns);
        block.notes.append(&mut self.notes);
        loop {
            while block.len() < BLOCK_ROWS && self.lines.has_line() {
                self.read_row(block)?;
            }
            block.time_faults = self.watch.faults();
            block.read_up_to = self.lines.taken;
            self.has_rows |= !block.is_empty();
            // What is odd about the header or the end is worth a block without rows.
            if !block.is_empty() || !block.notes.is_empty() {
                return Ok(true);
            }
            if !self.lines.fill()? {
                self.watch.end(&self.lines.file, &self.columns)?;
                let file = self.lines.file.clone();
                return if self.has_rows { Ok(false) } else { Err(TachometerError::NoRows(file)) };
            }
        }
    }

    /// Reads the line at hand with the quick reader, or if that does not know it, with the slow one.
    fn read_row(&mut self, block: &mut TachometerBlock) -> Result<(), TachometerError> {
        let row = block.len();
        let is_last = self.lines.is_last_without_end();
        let plain = plain_row(self.lines.at_hand(), &self.columns.slots, &mut self.runs, block);
        if let Some(end) = plain.filter(|end| *end <= LONGEST_LINE) {
            self.lines.take(end);
        } else {
            block.truncate(row);
            let Some(line) = self.lines.next_line()? else { return Ok(()) };
            let note = |oddity| TachometerNote { place: Some(RowPlace::Line(line.number)), oddity };
            match self.line_reader.read(line, &self.columns, &mut self.runs, block) {
                Ok(true) => {}
                Ok(false) => return Ok(()),
                Err(_) if is_last => {
                    block.notes.push(note(TachometerOddity::LineCutOff));
                    return Ok(());
                }
                Err(error) => return Err(error.into()),
            }
        }
        let place = RowPlace::Line(self.lines.line);
        self.watch.see(&self.lines.file, &self.columns, block, row, place)?;
        if is_last {
            block.notes.push(TachometerNote { place: Some(place), oddity: TachometerOddity::LineNotEnded });
        }
        Ok(())
    }
}

/// Adds the row that `text` begins with and says where it ends; `None` if it is not written plainly.
#[inline]
fn plain_row(text: &[u8], slots: &[Slot], runs: &mut RunNames, block: &mut TachometerBlock) -> Option<usize> {
    let mut at = 0;
    let last = slots.len() - 1;
    for (column, slot) in slots.iter().enumerate() {
        at = match *slot {
            Slot::Time => {
                let (ns, end) = csv_bytes::time_ns(text, at)?;
                block.times.push(Timestamp::from_ns(ns));
                end
            }
            Slot::Pulses(wheel) | Slot::Counter(wheel) => {
                let (count, end) = csv_bytes::count(text, at)?;
                block.counts[wheel].push(count);
                end
            }
            Slot::Direction(wheel) => {
                let (direction, end) = csv_bytes::direction(text, at)?;
                block.directions[wheel].push(direction);
                end
            }
            Slot::Edge(wheel) => {
                let (ns, end) = csv_bytes::time_or_nothing(text, at)?;
                block.edges[wheel].push(ns);
                end
            }
            Slot::Number(quantity) => {
                let (value, end) = csv_bytes::number(text, at)?;
                if !(value.is_nan() || quantity.fits(value)) {
                    return None;
                }
                block.numbers[quantity.slot()].push(value);
                end
            }
            Slot::Run => {
                let (run, end) = csv_bytes::run(text, at, runs)?;
                block.runs.push(run);
                end
            }
            Slot::Unused => csv_bytes::skip(text, at)?,
        };
        let separator = *text.get(at)?;
        at += 1;
        if column < last {
            if separator != b',' {
                return None;
            }
        } else if separator == b'\r' {
            if *text.get(at)? != b'\n' {
                return None;
            }
            at += 1;
        } else if separator != b'\n' {
            return None;
        }
    }
    Some(at)
}
