//! Positions of one train over time, from video, a tape or light gates (docs/formats/position-series.md).

use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::Path;

use footplate_core::model::report::{PositionPoint, SeriesError, SeriesFit};
use footplate_core::{Length, TimeSpan};

use crate::decimal::scaled;
use crate::table::{Row, Table, TableError};

const TIME: &str = "t_s";
const POSITION: &str = "position_mm";
/// Six decimals of a millimetre, nine of a second.
const POSITION_DECIMALS: u32 = 6;
const TIME_DECIMALS: u32 = 9;
/// More rows than an hour of video of 60 pictures a second has say nothing more of one start or stop.
const MOST_ROWS: usize = 216_000;
/// A kilometre (mm): beyond that the column holds something else than a model railway's millimetres.
const FARTHEST_MM: f64 = 1e6;
/// Twice the scale speed of the fastest model trains (mm/s): beyond that time or place is in another unit.
const FASTEST_MM_PER_S: f64 = 5_000.0;
/// Pictures that a speed is taken over (s): neighbouring ones differ by noise alone.
const SPEED_OVER_S: f64 = 0.25;

/// A file of positions over time.
#[derive(Debug, Clone)]
pub struct PositionSeries {
    /// What messages call the file.
    pub file: String,
    /// Its rows.
    pub points: Vec<PositionPoint>,
}

/// Why a series could not be read or says nothing.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PositionSeriesError {
    /// A line or a field is wrong.
    #[error(transparent)]
    Table(#[from] TableError),
    /// A column is missing.
    #[error(
        "{file}, line {line}: missing column `{column}`; a series of positions has the columns `t_s` and `position_mm` \
         (docs/formats/position-series.md)"
    )]
    MissingColumn {
        /// The file.
        file: String,
        /// The line of the header.
        line: u64,
        /// The column.
        column: &'static str,
    },
    /// There are more rows than are read.
    #[error("{file}, line {line}: more than {MOST_ROWS} rows; cut the series to one start or one stop")]
    TooManyRows {
        /// The file.
        file: String,
        /// The line of the first row too many.
        line: u64,
    },
    /// The rows are in order, and say nothing of a change of speed.
    #[error("{file}: {why}")]
    NoChange {
        /// The file.
        file: String,
        /// Why not.
        why: SeriesError,
    },
}

impl PositionSeries {
    /// Reads a file if its header names `position_mm`; `None` if it is something else.
    ///
    /// # Errors
    ///
    /// If the file cannot be read, or a line of a series is wrong.
    pub fn read(path: &Path) -> Result<Option<Self>, PositionSeriesError> {
        let file = path.display().to_string();
        let input = File::open(path).map_err(|source| TableError::Read { file: file.clone(), source })?;
        Self::parse(&file, BufReader::new(input))
    }

    /// The same from text that is called `file` in messages.
    ///
    /// # Errors
    ///
    /// As those of [`read`](Self::read).
    pub fn parse(file: &str, input: impl BufRead) -> Result<Option<Self>, PositionSeriesError> {
        let mut table = Table::open(file, input)?;
        let (time, position) = match (table.column(TIME), table.column(POSITION)) {
            (Some(time), Some(position)) => (time, position),
            (_, None) if table.columns() != [TIME] => return Ok(None),
            (time, _) => {
                let column = if time.is_none() { TIME } else { POSITION };
                return Err(PositionSeriesError::MissingColumn {
                    file: file.to_owned(),
                    line: table.line(),
                    column,
                });
            }
        };
        let mut points: Vec<PositionPoint> = Vec::new();
        let mut earlier = 0;
        while let Some(row) = table.next_row()? {
            if points.len() == MOST_ROWS {
                return Err(PositionSeriesError::TooManyRows { file: file.to_owned(), line: row.line() });
            }
            let ns =
                row.read(time, "a time in seconds, such as `12.35`", |text| scaled(text, TIME_DECIMALS))?;
            let point = PositionPoint { time: TimeSpan::from_ns(ns), position: place(row, position)? };
            if let Some(before) = points.last().filter(|before| point.time <= before.time) {
                return Err(row
                    .wrong(time, format!("later than {}, the time of the row before", before.time.as_s()))
                    .into());
            }
            while points.get(earlier + 1).is_some_and(|next| (point.time - next.time).as_s() >= SPEED_OVER_S)
            {
                earlier += 1;
            }
            if let Some(before) = points.get(earlier) {
                let over = (point.time - before.time).as_s();
                let speed = (point.position - before.position).as_mm() / over.max(SPEED_OVER_S);
                if speed.abs() > FASTEST_MM_PER_S {
                    return Err(row
                        .wrong(
                            position,
                            format!(
                                "a place in millimetres: at {:.0} mm/s since {} s no model train gets there, which runs \
                                 at {FASTEST_MM_PER_S} mm/s at most",
                                speed.abs(),
                                before.time.as_s()
                            ),
                        )
                        .into());
                }
            }
            points.push(point);
        }
        table.check_end()?;
        Ok(Some(Self { file: file.to_owned(), points }))
    }

    /// The law of the motion model that the positions follow.
    ///
    /// # Errors
    ///
    /// If they show no single start or stop.
    pub fn fit(&self) -> Result<SeriesFit, PositionSeriesError> {
        SeriesFit::of(&self.points)
            .map_err(|why| PositionSeriesError::NoChange { file: self.file.clone(), why })
    }
}

fn place(row: Row<'_>, column: crate::table::Column) -> Result<Length, TableError> {
    let micro = |text: &str| scaled(text, POSITION_DECIMALS).map(|number| number as f64 / 1e6);
    let mm = row.read(column, "a place in millimetres, within 1000000 of zero", |text| {
        micro(text).filter(|mm| mm.abs() <= FARTHEST_MM)
    })?;
    Ok(Length::from_mm(mm))
}
