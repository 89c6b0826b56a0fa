//! What an accelerometer in a train read.

use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::Path;

use footplate_core::Timestamp;

use crate::decimal::scaled;
use crate::table::{Column, Table, TableError, shown};

/// Three axes, as phones and as inertial boxes call them, or one along the track.
const AXES: [[&str; 3]; 2] = [["ax_m_s2", "ay_m_s2", "az_m_s2"], ["acc_x_m_s2", "acc_y_m_s2", "acc_z_m_s2"]];
const ALONG: &str = "accel_m_s2";
const WANTED: &str =
    "t_s with ax_m_s2, ay_m_s2, az_m_s2 (or acc_x_m_s2, acc_y_m_s2, acc_z_m_s2, or accel_m_s2)";
/// Three hours at 1660 readings a second.
const MOST_ROWS: usize = 18_000_000;
/// Gravity is in readings whose mean is longer than half of it (m/s²).
const HALF_OF_GRAVITY: f64 = 4.9;
/// A larger reading is none of a train, a derailed one included (m/s²).
const LARGEST_READING: f64 = 1000.0;

/// What a sensor does with gravity.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SensorForm {
    /// Gravity is in the readings, and steady accelerations are, too.
    WithGravity,
    /// A phone's high pass has taken gravity out, and slow changes with it.
    WithoutGravity,
    /// One axis along the track, taken as it is.
    Along,
}

/// What an accelerometer in a train read.
#[derive(Debug, Clone)]
pub struct AccelerometerRecording {
    /// What messages call the file.
    pub file: String,
    /// Times in order, and readings of the three axes (m/s²); of one axis, the others are 0.
    pub(super) readings: Vec<(Timestamp, [f64; 3])>,
    pub(super) form: SensorForm,
    /// Rows that are left out: their time does not go on.
    pub(super) out_of_order: usize,
}

impl AccelerometerRecording {
    /// Reads a CSV file.
    ///
    /// # Errors
    /// What is wrong with it, with file, line and column.
    pub fn read(path: &Path) -> Result<Self, AccelerometerError> {
        let file = path.display().to_string();
        let input = File::open(path).map_err(|source| TableError::Read { file: file.clone(), source })?;
        Self::parse(&file, BufReader::new(input))
    }

    /// The same from text that is called `file` in messages.
    ///
    /// # Errors
    /// As [`read`](Self::read).
    pub fn parse(file: &str, input: impl BufRead) -> Result<Self, AccelerometerError> {
        let mut table = Table::open(file, input)?;
        let missing = |found: String| AccelerometerError::MissingColumns {
            file: file.to_owned(),
            wanted: WANTED,
            found,
        };
        let time = table.column("t_s");
        let three = AXES.iter().find_map(|names| table.columns_named(*names));
        let axes: Vec<Column> = three.map_or_else(|| table.column(ALONG).into_iter().collect(), Vec::from);
        let (Some(time), false) = (time, axes.is_empty()) else {
            return Err(missing(shown(&table.columns().join(", "))));
        };
        let mut readings: Vec<(Timestamp, [f64; 3])> = Vec::new();
        let mut out_of_order = 0;
        while let Some(row) = table.next_row()? {
            if readings.len() == MOST_ROWS {
                let (file, line) = (file.to_owned(), row.line());
                return Err(AccelerometerError::TooManyRows { file, line, most: MOST_ROWS });
            }
            let ns = row.read(time, "a time in seconds, such as 12.35", |text| scaled(text, 9))?;
            let mut read = [0.0; 3];
            for (value, column) in read.iter_mut().zip(&axes) {
                *value = row.read(*column, "an acceleration in m/s², within 1000 of zero", |text| {
                    text.parse().ok().filter(|value: &f64| value.abs() <= LARGEST_READING)
                })?;
            }
            let now = Timestamp::from_ns(ns);
            if readings.last().is_some_and(|(before, _)| now <= *before) {
                out_of_order += 1;
            } else {
                readings.push((now, read));
            }
        }
        table.check_end()?;
        if readings.is_empty() {
            return Err(AccelerometerError::NoRows(file.to_owned()));
        }
        let form = if three.is_none() {
            SensorForm::Along
        } else if length(mean(&readings)) > HALF_OF_GRAVITY {
            SensorForm::WithGravity
        } else {
            SensorForm::WithoutGravity
        };
        Ok(Self { file: file.to_owned(), readings, form, out_of_order })
    }

    /// What its sensor does with gravity.
    pub fn form(&self) -> SensorForm {
        self.form
    }

    /// How many readings it has, and how many more were left out because their time did not go on.
    pub fn rows(&self) -> [usize; 2] {
        [self.readings.len(), self.out_of_order]
    }

    /// How long it lasts (s).
    pub fn duration_s(&self) -> f64 {
        match (self.readings.first(), self.readings.last()) {
            (Some((first, _)), Some((last, _))) => (*last - *first).as_s(),
            _ => 0.0,
        }
    }
}

/// The mean reading of each axis (m/s²).
pub(super) fn mean(readings: &[(Timestamp, [f64; 3])]) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for (_, axes) in readings {
        for (sum, axis) in sum.iter_mut().zip(axes) {
            *sum += axis;
        }
    }
    sum.map(|sum| sum / readings.len().max(1) as f64)
}

fn length(axes: [f64; 3]) -> f64 {
    axes.iter().map(|axis| axis * axis).sum::<f64>().sqrt()
}

/// A recording of an accelerometer, or marks of stops, that could not be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum AccelerometerError {
    /// A line or a field is wrong.
    #[error(transparent)]
    Table(#[from] TableError),
    /// Columns that no recording can do without.
    #[error(
        "{file}: missing columns: {wanted}; the header names {found} (docs/formats/accelerometer-recording.md)"
    )]
    MissingColumns {
        /// The file.
        file: String,
        /// What is missing.
        wanted: &'static str,
        /// What the header names, shortened if long.
        found: String,
    },
    /// There is a header and nothing below it.
    #[error("{0}: no rows below the header; there should be at least one")]
    NoRows(String),
    /// More rows than are read.
    #[error("{file}, line {line}: more than {most} rows; cut the recording into trips")]
    TooManyRows {
        /// The file.
        file: String,
        /// The line of the first row too many.
        line: u64,
        /// The most that are read.
        most: usize,
    },
}
