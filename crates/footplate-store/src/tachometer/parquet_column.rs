//! One column of a Parquet file, whatever the type it was written with.

use std::fmt::Display;

use footplate_core::odometry::wheels::Direction;
use footplate_core::{TimeSpan, Timestamp};
use parquet::basic::{LogicalType, TimeUnit, Type};
use parquet::column::reader::{ColumnReader, ColumnReaderImpl};
use parquet::data_type::{ByteArray, DataType};
use parquet::errors::ParquetError;
use parquet::schema::types::ColumnDescriptor;

use super::block::{MISSING, TachometerBlock};
use super::columns::{Quantity, Slot};
use super::run_names::{MOST_RUNS, RunNames};
use crate::table::shown;

/// Whole numbers beyond this are not exact in a double.
const LARGEST_EXACT: f64 = (1_u64 << 53) as f64;
const NS_PER_S: f64 = 1e9;

/// Why a column could not be read on.
pub(super) enum ColumnFault {
    Unreadable(ParquetError),
    /// A value that is not what it should be, in a row of the block counted from 0.
    Value {
        row: usize,
        value: String,
        expected: String,
    },
}

impl From<ParquetError> for ColumnFault {
    fn from(error: ParquetError) -> Self {
        Self::Unreadable(error)
    }
}

/// One column that is used.
pub(super) struct ParquetColumn {
    leaf: usize,
    slot: Slot,
    /// Nanoseconds of one unit, of a time that is written as a whole number.
    unit_ns: i64,
    is_unsigned: bool,
    reader: Option<ColumnReader>,
    levels: Vec<i16>,
    values: Values,
}

/// Where the decoder writes; only the one of the column's type is used.
#[derive(Default)]
struct Values {
    ints: Vec<i32>,
    longs: Vec<i64>,
    floats: Vec<f32>,
    doubles: Vec<f64>,
    texts: Vec<ByteArray>,
}

impl ParquetColumn {
    /// A column that can hold what it should; otherwise what it is, and what would be right.
    pub(super) fn new(
        leaf: usize,
        slot: Slot,
        about: &ColumnDescriptor,
    ) -> Result<Self, (String, &'static str)> {
        let physical = about.physical_type();
        let logical = about.logical_type_ref();
        let unit_ns = match logical {
            Some(LogicalType::Timestamp(time)) => match time.unit {
                TimeUnit::MILLIS => 1_000_000,
                TimeUnit::MICROS => 1_000,
                TimeUnit::NANOS => 1,
            },
            _ => 0,
        };
        let is_integer = match logical {
            None | Some(LogicalType::Integer(_)) => matches!(physical, Type::INT32 | Type::INT64),
            _ => false,
        };
        let is_float = matches!(physical, Type::FLOAT | Type::DOUBLE) && logical.is_none();
        let (fits, expected) = match slot {
            Slot::Time | Slot::Edge(_) => (
                physical == Type::DOUBLE || (physical == Type::INT64 && unit_ns > 0),
                "DOUBLE in seconds, or INT64 as a timestamp",
            ),
            Slot::Pulses(_) | Slot::Counter(_) | Slot::Direction(_) => {
                (is_integer || is_float, "INT32 or INT64")
            }
            Slot::Number(_) => (is_integer || is_float, "DOUBLE or FLOAT"),
            Slot::Run => (
                is_integer
                    || (physical == Type::BYTE_ARRAY && matches!(logical, None | Some(LogicalType::String))),
                "a text or a whole number",
            ),
            Slot::Unused => (true, ""),
        };
        if !fits || about.max_rep_level() > 0 {
            let logical = logical.map_or_else(String::new, |logical| format!(" ({logical:?})"));
            return Err((format!("{physical}{logical}"), expected));
        }
        let is_unsigned = matches!(logical, Some(LogicalType::Integer(int)) if !int.is_signed);
        Ok(Self {
            leaf,
            slot,
            unit_ns,
            is_unsigned,
            reader: None,
            levels: Vec::new(),
            values: Values::default(),
        })
    }

    /// Which column of the file it is.
    pub(super) fn leaf(&self) -> usize {
        self.leaf
    }

    /// Goes on with the next group of rows.
    pub(super) fn begin(&mut self, reader: ColumnReader) {
        self.reader = Some(reader);
    }

    /// Adds so many rows to the block.
    pub(super) fn read(
        &mut self,
        rows: usize,
        block: &mut TachometerBlock,
        runs: &mut RunNames,
    ) -> Result<(), ColumnFault> {
        let Self { values, levels, slot, unit_ns, is_unsigned, .. } = self;
        let target = Target { slot: *slot, unit_ns: *unit_ns, block, runs };
        match &mut self.reader {
            Some(ColumnReader::Int32ColumnReader(reader)) => {
                fetch(reader, rows, levels, &mut values.ints)?;
                let unsigned = *is_unsigned;
                let long = |value: &i32| if unsigned { i64::from(*value as u32) } else { i64::from(*value) };
                target.wholes(&values.ints, levels, long)
            }
            Some(ColumnReader::Int64ColumnReader(reader)) => {
                fetch(reader, rows, levels, &mut values.longs)?;
                target.wholes(&values.longs, levels, |value| *value)
            }
            Some(ColumnReader::FloatColumnReader(reader)) => {
                fetch(reader, rows, levels, &mut values.floats)?;
                target.numbers(&values.floats, levels, |value| f64::from(*value))
            }
            Some(ColumnReader::DoubleColumnReader(reader)) => {
                fetch(reader, rows, levels, &mut values.doubles)?;
                target.numbers(&values.doubles, levels, |value| *value)
            }
            Some(ColumnReader::ByteArrayColumnReader(reader)) => {
                fetch(reader, rows, levels, &mut values.texts)?;
                target.texts(&values.texts, levels)
            }
            _ => Err(ParquetError::General("a column of another type than the file says".to_owned()).into()),
        }
    }
}

/// Decodes so many rows; afterwards `levels` is empty if all of them have a value.
fn fetch<T: DataType>(
    reader: &mut ColumnReaderImpl<T>,
    rows: usize,
    levels: &mut Vec<i16>,
    values: &mut Vec<T::T>,
) -> Result<(), ParquetError> {
    levels.clear();
    values.clear();
    let (read, present, _) = reader.read_records(rows, Some(levels), None, values)?;
    if read != rows {
        return Err(ParquetError::EOF(format!("a column ends {} rows before its group does", rows - read)));
    }
    if present == rows {
        levels.clear();
    }
    Ok(())
}

/// Where the values of one column go.
struct Target<'t> {
    slot: Slot,
    unit_ns: i64,
    block: &'t mut TachometerBlock,
    runs: &'t mut RunNames,
}

impl Target<'_> {
    fn wholes<T: Display>(
        self,
        values: &[T],
        levels: &[i16],
        long: impl Fn(&T) -> i64,
    ) -> Result<(), ColumnFault> {
        let Self { slot, unit_ns, block, runs } = self;
        match slot {
            Slot::Time => {
                let time = |value: &T| long(value).checked_mul(unit_ns).map(Timestamp::from_ns);
                fill(&mut block.times, values, levels, None, time, TIME)
            }
            Slot::Edge(wheel) => {
                let time = |value: &T| long(value).checked_mul(unit_ns);
                fill(&mut block.edges[wheel], values, levels, Some(MISSING), time, TIME)
            }
            Slot::Pulses(wheel) | Slot::Counter(wheel) => {
                let count = |value: &T| Some(long(value)).filter(|count| *count != MISSING);
                fill(&mut block.counts[wheel], values, levels, Some(MISSING), count, WHOLE)
            }
            Slot::Direction(wheel) => {
                let sign = |value: &T| direction(long(value) as f64);
                fill(&mut block.directions[wheel], values, levels, Some(Direction::Unknown), sign, SIGN)
            }
            Slot::Number(quantity) => {
                let number = |value: &T| Some(long(value) as f64).filter(|value| quantity.fits(*value));
                fill_numbers(block, quantity, values, levels, number)
            }
            Slot::Run => {
                let names = |value: &T, new: &mut Vec<String>| run(&long(value).to_string(), runs, new);
                fill_runs(block, values, levels, names, ToString::to_string)
            }
            Slot::Unused => Ok(()),
        }
    }

    fn numbers<T: Display>(
        self,
        values: &[T],
        levels: &[i16],
        double: impl Fn(&T) -> f64,
    ) -> Result<(), ColumnFault> {
        let Self { slot, block, .. } = self;
        match slot {
            Slot::Time => fill(&mut block.times, values, levels, None, |value| seconds(double(value)), TIME),
            Slot::Edge(wheel) => {
                let time = |value: &T| {
                    let value = double(value);
                    if value.is_nan() { Some(MISSING) } else { seconds(value).map(Timestamp::as_ns) }
                };
                fill(&mut block.edges[wheel], values, levels, Some(MISSING), time, TIME)
            }
            Slot::Pulses(wheel) | Slot::Counter(wheel) => {
                let count = |value: &T| {
                    let value = double(value);
                    let is_whole = value.fract() == 0.0 && value.abs() <= LARGEST_EXACT;
                    if value.is_nan() { Some(MISSING) } else { is_whole.then_some(value as i64) }
                };
                fill(&mut block.counts[wheel], values, levels, Some(MISSING), count, WHOLE)
            }
            Slot::Direction(wheel) => {
                let sign = |value: &T| direction(double(value));
                fill(&mut block.directions[wheel], values, levels, Some(Direction::Unknown), sign, SIGN)
            }
            Slot::Number(quantity) => {
                let number =
                    |value: &T| Some(double(value)).filter(|value| value.is_nan() || quantity.fits(*value));
                fill_numbers(block, quantity, values, levels, number)
            }
            Slot::Run | Slot::Unused => Ok(()),
        }
    }

    fn texts(self, values: &[ByteArray], levels: &[i16]) -> Result<(), ColumnFault> {
        let runs = self.runs;
        let names = |value: &ByteArray, new: &mut Vec<String>| {
            runs.known(value.data()).or_else(|| run(std::str::from_utf8(value.data()).ok()?, runs, new))
        };
        fill_runs(self.block, values, levels, names, |value| {
            String::from_utf8_lossy(value.data()).into_owned()
        })
    }
}

const TIME: &str = "a time in seconds";
const WHOLE: &str = "a whole number, or null where it is missing";
const SIGN: &str = "1 (forward), -1 (backward) or 0 (unknown)";

/// Converts values into a column; `missing` stands for a null, if there may be one.
fn fill<T: Display, V: Copy>(
    target: &mut Vec<V>,
    values: &[T],
    levels: &[i16],
    missing: Option<V>,
    convert: impl FnMut(&T) -> Option<V>,
    expected: &str,
) -> Result<(), ColumnFault> {
    convert_all(target, values, levels, missing, convert, ToString::to_string, expected)
}

fn fill_numbers<T: Display>(
    block: &mut TachometerBlock,
    quantity: Quantity,
    values: &[T],
    levels: &[i16],
    number: impl FnMut(&T) -> Option<f64>,
) -> Result<(), ColumnFault> {
    let target = &mut block.numbers[quantity.slot()];
    fill(target, values, levels, Some(f64::NAN), number, quantity.expected())
}

fn fill_runs<T>(
    block: &mut TachometerBlock,
    values: &[T],
    levels: &[i16],
    mut number: impl FnMut(&T, &mut Vec<String>) -> Option<u32>,
    show: impl Fn(&T) -> String,
) -> Result<(), ColumnFault> {
    let TachometerBlock { runs, new_runs, .. } = block;
    let expected = format!("the name of one of at most {MOST_RUNS} runs");
    convert_all(runs, values, levels, None, |value| number(value, new_runs), show, &expected)
}

fn convert_all<T, V: Copy>(
    target: &mut Vec<V>,
    values: &[T],
    levels: &[i16],
    missing: Option<V>,
    mut convert: impl FnMut(&T) -> Option<V>,
    show: impl Fn(&T) -> String,
    expected: &str,
) -> Result<(), ColumnFault> {
    let before = target.len();
    let wrong = |row: usize, value: Option<&T>| ColumnFault::Value {
        row: row - before,
        value: value.map_or_else(|| "null".to_owned(), |value| shown(&show(value))),
        expected: expected.to_owned(),
    };
    let mut values = values.iter();
    if levels.is_empty() {
        for value in values {
            target.push(convert(value).ok_or_else(|| wrong(target.len(), Some(value)))?);
        }
        return Ok(());
    }
    // Without repetition a level is 0 for a null, and as deep as the column for a value.
    for level in levels {
        let value = if *level > 0 { values.next() } else { None };
        let converted = value.map_or(missing, &mut convert);
        target.push(converted.ok_or_else(|| wrong(target.len(), value))?);
    }
    Ok(())
}

fn run(name: &str, runs: &mut RunNames, new: &mut Vec<String>) -> Option<u32> {
    if let Some(run) = runs.known(name.as_bytes()) {
        return Some(run);
    }
    let run = if name.is_empty() { None } else { runs.add(name) }?;
    new.push(name.to_owned());
    Some(run)
}

fn seconds(value: f64) -> Option<Timestamp> {
    let fits = (value * NS_PER_S).abs() < i64::MAX as f64;
    fits.then(|| Timestamp::ZERO + TimeSpan::from_s(value))
}

fn direction(sign: f64) -> Option<Direction> {
    if sign == 1.0 {
        Some(Direction::Forward)
    } else if sign == -1.0 {
        Some(Direction::Backward)
    } else {
        (sign == 0.0 || sign.is_nan()).then_some(Direction::Unknown)
    }
}
