//! Short moves measured with a tape: "go, wait, stop", and how far the train got (docs/formats/short-moves.md).

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::Path;

use footplate_core::{Length, TimeSpan, TrainId};

use crate::decimal::scaled;
use crate::table::{Table, TableError};

const TIME: &str = "command_time_s";
const DISTANCE: &str = "distance_mm";
const TRAIN: &str = "train";
/// Six decimals of a millimetre, nine of a second.
const DISTANCE_DECIMALS: u32 = 6;
const TIME_DECIMALS: u32 = 9;
/// A minute of running is no short move (s); a longer time is in another unit.
const LONGEST_S: f64 = 60.0;
/// Farther than any layout is long (mm); a longer distance is in another unit.
const FARTHEST_MM: f64 = 100_000.0;
/// More rows than anybody measures with a tape.
const MOST_ROWS: usize = 10_000;

/// A file of short moves: time between the two commands, and distance from rest to rest, by train where the file names them.
#[derive(Debug, Clone)]
pub struct TapedMoves {
    /// What messages call the file.
    pub file: String,
    /// Its rows.
    pub trains: BTreeMap<Option<TrainId>, Vec<(TimeSpan, Length)>>,
}

/// Why a file of short moves could not be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TapedMovesError {
    /// A line or a field is wrong.
    #[error(transparent)]
    Table(#[from] TableError),
    /// There are more rows than are read.
    #[error("{file}, line {line}: more than {MOST_ROWS} short moves; split the file by train")]
    TooManyRows {
        /// The file.
        file: String,
        /// The line of the first row too many.
        line: u64,
    },
}

impl TapedMoves {
    /// Reads a file if its header names `command_time_s` and `distance_mm`; `None` if it is something else.
    ///
    /// # Errors
    ///
    /// If the file cannot be read, or a line of moves is wrong.
    pub fn read(path: &Path) -> Result<Option<Self>, TapedMovesError> {
        let file = path.display().to_string();
        let input = File::open(path).map_err(|source| TableError::Read { file: file.clone(), source })?;
        Self::parse(&file, BufReader::new(input))
    }

    /// The same from text that is called `file` in messages.
    ///
    /// # Errors
    ///
    /// As those of [`read`](Self::read).
    pub fn parse(file: &str, input: impl BufRead) -> Result<Option<Self>, TapedMovesError> {
        let mut table = Table::open(file, input)?;
        let Some([time, distance]) = table.columns_named([TIME, DISTANCE]) else { return Ok(None) };
        let train = table.column(TRAIN);
        let mut moves = Self { file: file.to_owned(), trains: BTreeMap::new() };
        let mut rows = 0;
        while let Some(row) = table.next_row()? {
            rows += 1;
            if rows > MOST_ROWS {
                return Err(TapedMovesError::TooManyRows { file: file.to_owned(), line: row.line() });
            }
            let time = row.read(time, "seconds between the two commands, 0 to 60", |text| {
                let span = TimeSpan::from_ns(scaled(text, TIME_DECIMALS)?);
                (0.0..=LONGEST_S).contains(&span.as_s()).then_some(span)
            })?;
            let distance = row.read(distance, "a distance in millimetres, 0 to 100000", |text| {
                let mm = scaled(text, DISTANCE_DECIMALS)? as f64 / 1e6;
                (0.0..=FARTHEST_MM).contains(&mm).then(|| Length::from_mm(mm))
            })?;
            let train = train
                .map(|train| row.read(train, "the number of a train", |text| text.parse().ok().map(TrainId)))
                .transpose()?;
            moves.trains.entry(train).or_default().push((time, distance));
        }
        table.check_end()?;
        Ok(Some(moves))
    }
}
