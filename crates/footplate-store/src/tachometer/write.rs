//! Writes a tachometer recording, as CSV or Parquet.

use std::io::{self, Write};

use footplate_core::odometry::wheels::{Count, Direction, Period, WheelReading};
use footplate_core::{Acceleration, Length, Speed};

use super::block::Truth;
use crate::written_table::{Cell, Kind, TableForm, TableWriter};

/// Which columns a recording gets besides `t_s` and the counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct WrittenColumns {
    /// Running counters instead of pulses, for each wheelset.
    pub counters: [bool; 2],
    /// `direction_1`, `direction_2`.
    pub directions: bool,
    /// `edge_1_s`, `edge_2_s`.
    pub edges: bool,
    /// `effort`.
    pub effort: bool,
    /// `accel_m_s2`.
    pub acceleration: bool,
    /// `balise_m`.
    pub balise: bool,
    /// `balise_sd_m`.
    pub balise_deviation: bool,
    /// `run_id`.
    pub run_id: bool,
    /// `true_speed_m_s`, `true_distance_m`.
    pub truth: bool,
    /// `true_wheel_1_m_s`, `true_wheel_2_m_s`.
    pub true_wheels: bool,
}

impl WrittenColumns {
    /// All columns that there can be and whether each is written.
    fn all(&self) -> [(&'static str, Kind, bool); 16] {
        let [first, second] = self.counters.map(|counter| if counter { 1 } else { 0 });
        [
            ("t_s", Kind::Time, true),
            (["pulses_1", "counter_1"][first], Kind::Whole, true),
            (["pulses_2", "counter_2"][second], Kind::Whole, true),
            ("direction_1", Kind::Whole, self.directions),
            ("direction_2", Kind::Whole, self.directions),
            ("edge_1_s", Kind::OptionalTime, self.edges),
            ("edge_2_s", Kind::OptionalTime, self.edges),
            ("effort", Kind::OptionalNumber, self.effort),
            ("accel_m_s2", Kind::OptionalNumber, self.acceleration),
            ("balise_m", Kind::OptionalNumber, self.balise),
            ("balise_sd_m", Kind::OptionalNumber, self.balise_deviation),
            ("run_id", Kind::Text, self.run_id),
            ("true_speed_m_s", Kind::OptionalNumber, self.truth),
            ("true_distance_m", Kind::OptionalNumber, self.truth),
            ("true_wheel_1_m_s", Kind::OptionalNumber, self.true_wheels),
            ("true_wheel_2_m_s", Kind::OptionalNumber, self.true_wheels),
        ]
    }
}

/// Writes a tachometer recording, row by row.
#[derive(Debug)]
pub struct TachometerWriter<W: Write + Send> {
    table: TableWriter<W>,
    is_written: [bool; 16],
}

impl<W: Write + Send> TachometerWriter<W> {
    /// Begins a recording with these columns.
    ///
    /// # Errors
    /// What the system said.
    pub fn new(output: W, form: TableForm, columns: WrittenColumns) -> io::Result<Self> {
        let all = columns.all();
        let written = all.into_iter().filter(|(.., written)| *written).map(|(name, kind, _)| (name, kind));
        let table = TableWriter::new(output, form, written, None)?;
        Ok(Self { table, is_written: all.map(|(.., written)| written) })
    }

    /// Adds a period of a run. What there is no column for is left out.
    ///
    /// # Errors
    /// What the system said.
    pub fn push(&mut self, run: &str, period: &Period, truth: &Truth) -> io::Result<()> {
        let [first, second] = period.wheels;
        let speed = |value: Option<Speed>| Cell::optional_number(value.map(Speed::as_m_per_s));
        let length = |value: Option<Length>| Cell::optional_number(value.map(Length::as_m));
        let cells = [
            Cell::Time(period.time),
            count(first),
            count(second),
            direction(first),
            direction(second),
            first.last_edge.map_or(Cell::Missing, Cell::Time),
            second.last_edge.map_or(Cell::Missing, Cell::Time),
            Cell::optional_number(period.effort),
            Cell::optional_number(period.acceleration.map(Acceleration::as_m_per_s2)),
            length(period.balise),
            length(period.balise_deviation),
            Cell::Text(run),
            speed(truth.speed),
            length(truth.distance),
            speed(truth.wheels[0]),
            speed(truth.wheels[1]),
        ];
        let written = cells.into_iter().zip(self.is_written).filter(|(_, written)| *written);
        self.table.push(written.map(|(cell, _)| cell))
    }

    /// Ends the recording and gives back where it was written to.
    ///
    /// # Errors
    /// What the system said.
    pub fn finish(self) -> io::Result<W> {
        self.table.finish()
    }
}

fn count(wheel: WheelReading) -> Cell<'static> {
    match wheel.count {
        Count::Missing => Cell::Missing,
        Count::Pulses(count) | Count::Counter(count) => Cell::Whole(count),
    }
}

fn direction(wheel: WheelReading) -> Cell<'static> {
    Cell::Whole(match wheel.direction {
        Direction::Forward => 1,
        Direction::Unknown => 0,
        Direction::Backward => -1,
    })
}
