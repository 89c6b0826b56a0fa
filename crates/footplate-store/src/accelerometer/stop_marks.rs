//! Stops that a person marked: when the train came to rest and when it left.

use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};

use footplate_core::Timestamp;

use super::recording::AccelerometerError;
use crate::decimal::scaled;
use crate::table::{Table, TableError, shown};

/// The end of the name of a recording, and of that of the marks that belong to it.
const OF_RECORDING: &str = "_accel";
const OF_MARKS: &str = "_stops";

/// The stops of one recording.
#[derive(Debug, Clone, PartialEq)]
pub struct StopMarks {
    /// When the train came to rest and when it left, stop by stop.
    pub(super) stops: Vec<[Timestamp; 2]>,
}

impl StopMarks {
    /// Where the marks of a recording lie: `x_stops.csv` beside `x_accel.csv` or `x.csv`.
    pub fn beside(recording: &Path) -> PathBuf {
        let stem = recording.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
        let stem = stem.strip_suffix(OF_RECORDING).unwrap_or(&stem);
        recording.with_file_name(format!("{stem}{OF_MARKS}.csv"))
    }

    /// Reads a CSV file with the columns `t_s` and `event`.
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
        let Some([time, event]) = table.columns_named(["t_s", "event"]) else {
            let found = shown(&table.columns().join(", "));
            return Err(AccelerometerError::MissingColumns {
                file: file.to_owned(),
                wanted: "t_s, event",
                found,
            });
        };
        let mut stops = Vec::new();
        let mut stopped = None;
        let mut latest = None;
        while let Some(row) = table.next_row()? {
            let ns = row.read(time, "a time in seconds, such as 12.35", |text| scaled(text, 9))?;
            let now = Timestamp::from_ns(ns);
            if latest.replace(now).is_some_and(|latest| now <= latest) {
                return Err(row.wrong(time, "later than the mark before it").into());
            }
            match (row.text(event), stopped) {
                ("stop", None) => stopped = Some(now),
                ("start", Some(from)) => {
                    stops.push([from, now]);
                    stopped = None;
                }
                ("start", None) if stops.is_empty() => {}
                _ => {
                    return Err(row
                        .wrong(event, "`stop` (came to rest) and `start` (moved off) in turn")
                        .into());
                }
            }
        }
        table.check_end()?;
        if stops.is_empty() {
            return Err(AccelerometerError::NoRows(file.to_owned()));
        }
        Ok(Self { stops })
    }

    /// When the first marked stop began and the last ended; what is before and after is not marked.
    pub fn marked(&self) -> Option<[Timestamp; 2]> {
        let ([first, _], [_, last]) = (self.stops.first()?, self.stops.last()?);
        Some([*first, *last])
    }
}
