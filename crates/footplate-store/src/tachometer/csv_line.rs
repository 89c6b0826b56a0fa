//! A row that is not written plainly, or that is wrong: read field by field, with an error that says what
//! would be right.

use footplate_core::Timestamp;
use footplate_core::odometry::wheels::Direction;

use super::block::{MISSING, TachometerBlock};
use super::columns::{Quantity, Slot, TachometerColumns};
use super::run_names::{MOST_RUNS, RunNames};
use crate::decimal::scaled;
use crate::table::{Fields, SplitError, TableError, shown};

/// Whole numbers beyond this are no longer exact when they are written with a point.
const LARGEST_EXACT: f64 = (1_u64 << 53) as f64;

/// Splits lines and reads what is in them.
#[derive(Default)]
pub(super) struct LineReader {
    pub(super) fields: Fields,
}

/// The line that is being read.
#[derive(Clone, Copy)]
pub(super) struct Line<'l> {
    pub(super) file: &'l str,
    pub(super) number: u64,
    /// Its bytes, the line feed included.
    pub(super) bytes: &'l [u8],
}

impl LineReader {
    /// Reads lines with this ASCII character between fields.
    pub(super) fn separated_by(separator: u8) -> Self {
        Self { fields: Fields::separated_by(separator) }
    }

    /// The fields of a header; none if the line is empty.
    pub(super) fn header(&mut self, line: Line<'_>) -> Result<Vec<String>, TableError> {
        self.split(line)?;
        let mut names: Vec<String> = Vec::with_capacity(self.fields.len());
        for name in self.fields.iter() {
            if !name.is_empty() && names.iter().any(|earlier| earlier == name) {
                let (file, name) = (line.file.to_owned(), shown(name));
                return Err(TableError::ColumnTwice { file, line: line.number, name });
            }
            names.push(name.to_owned());
        }
        Ok(names)
    }

    /// Adds a row to the block, or leaves the block as it was; `false` if the line is empty.
    pub(super) fn read(
        &mut self,
        line: Line<'_>,
        columns: &TachometerColumns,
        runs: &mut RunNames,
        block: &mut TachometerBlock,
    ) -> Result<bool, TableError> {
        self.split(line)?;
        let (found, expected) = (self.fields.len(), columns.slots.len());
        if found == 0 {
            return Ok(false);
        }
        if found != expected {
            let file = line.file.to_owned();
            return Err(TableError::FieldCount { file, line: line.number, found, expected });
        }
        let rows = block.len();
        for (at, slot) in columns.slots.iter().enumerate() {
            if let Err(expected) = read_field(*slot, self.fields.get(at), runs, block) {
                block.truncate(rows);
                return Err(TableError::Field {
                    file: line.file.to_owned(),
                    line: line.number,
                    number: at + 1,
                    column: columns.names.get(at).map_or_else(String::new, |name| shown(name)),
                    value: shown(self.fields.get(at)),
                    expected,
                });
            }
        }
        Ok(true)
    }

    /// Splits a line into `fields`; none if it is empty.
    pub(super) fn split(&mut self, line: Line<'_>) -> Result<(), TableError> {
        let (file, number) = (line.file.to_owned(), line.number);
        self.fields.split(line.bytes).map_err(|error| match error {
            SplitError::NotText { byte } => TableError::NotText { file, line: number, byte },
            SplitError::QuoteNotClosed => TableError::QuoteNotClosed { file, line: number },
        })
    }
}

/// Adds one field to the block, or says what would be right.
pub(super) fn read_field(
    slot: Slot,
    text: &str,
    runs: &mut RunNames,
    block: &mut TachometerBlock,
) -> Result<(), String> {
    match slot {
        Slot::Time => {
            let ns = scaled(text, 9).ok_or("a time in seconds, such as 12.05")?;
            block.times.push(Timestamp::from_ns(ns));
        }
        Slot::Pulses(wheel) | Slot::Counter(wheel) => {
            let count = if is_missing(text) { Some(MISSING) } else { whole(text) };
            block.counts[wheel].push(count.ok_or("a whole number, or nothing where it is missing")?);
        }
        Slot::Direction(wheel) => block.directions[wheel].push(match text {
            "1" | "+1" => Direction::Forward,
            "-1" => Direction::Backward,
            _ if text == "0" || is_missing(text) => Direction::Unknown,
            _ => return Err("1 (forward), -1 (backward) or 0 (unknown)".to_owned()),
        }),
        Slot::Edge(wheel) => {
            let ns = if is_missing(text) { Some(MISSING) } else { scaled(text, 9) };
            let expected = "a time in seconds, or nothing where there is none";
            block.edges[wheel].push(ns.ok_or(expected)?);
        }
        Slot::Number(quantity) => block.numbers[quantity.slot()].push(number(text, quantity)?),
        Slot::Run => {
            let known = runs.known(text.as_bytes());
            if known.is_none() && text.is_empty() {
                return Err("the name of the run that the row belongs to".to_owned());
            }
            let run = known.or_else(|| {
                block.new_runs.push(text.to_owned());
                runs.add(text)
            });
            let too_many = || format!("one of at most {MOST_RUNS} runs; is it a name a row?");
            block.runs.push(run.ok_or_else(too_many)?);
        }
        Slot::Unused => {}
    }
    Ok(())
}

pub(super) fn is_missing(text: &str) -> bool {
    text.is_empty() || text.eq_ignore_ascii_case("nan")
}

/// A whole number, also as `12.0` or `1.2e1`.
fn whole(text: &str) -> Option<i64> {
    if let Ok(number) = text.parse::<i64>() {
        return (number != MISSING).then_some(number);
    }
    let number: f64 = text.parse().ok()?;
    (number.fract() == 0.0 && number.abs() <= LARGEST_EXACT).then_some(number as i64)
}

fn number(text: &str, quantity: Quantity) -> Result<f64, String> {
    if is_missing(text) {
        return Ok(f64::NAN);
    }
    text.parse().ok().filter(|value| quantity.fits(*value)).ok_or_else(|| quantity.expected().to_owned())
}
