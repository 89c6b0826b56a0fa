//! Estimates as rows of a table.

use std::io::{self, Write};

use footplate_core::odometry::{Mode, MotionEstimate, WheelState};

use crate::written_table::{Cell, CsvTable, Kind, TableForm, TableWriter};

/// The columns of a result, in order; `run_id` follows where there are many runs.
const COLUMNS: [(&str, Kind); 20] = [
    ("t_s", Kind::Time),
    ("speed_m_s", Kind::Number),
    ("confidence_speed_low_m_s", Kind::Number),
    ("confidence_speed_high_m_s", Kind::Number),
    ("guaranteed_speed_low_m_s", Kind::Number),
    ("guaranteed_speed_high_m_s", Kind::Number),
    ("accel_m_s2", Kind::Number),
    ("distance_m", Kind::Number),
    ("confidence_distance_low_m", Kind::Number),
    ("confidence_distance_high_m", Kind::Number),
    ("guaranteed_distance_low_m", Kind::Number),
    ("guaranteed_distance_high_m", Kind::Number),
    ("over_m", Kind::Number),
    ("under_m", Kind::Number),
    ("wheel_1", Kind::Text),
    ("wheel_2", Kind::Text),
    ("mode", Kind::Text),
    ("share_1", Kind::Number),
    ("share_2", Kind::Number),
    ("share_3", Kind::Number),
];
const RUN_COLUMN: (&str, Kind) = ("run_id", Kind::Text);

fn columns(with_runs: bool) -> impl Iterator<Item = (&'static str, Kind)> + Clone {
    COLUMNS.into_iter().chain(with_runs.then_some(RUN_COLUMN))
}

/// Writes estimates as CSV to somebody who reads along.
#[derive(Debug)]
pub struct LiveResult<W> {
    table: CsvTable<W>,
    with_runs: bool,
}

impl<W: Write> LiveResult<W> {
    /// Begins with the header; `with_runs` says that every row names its run.
    pub fn new(output: W, with_runs: bool) -> Self {
        Self { table: CsvTable::new(output, columns(with_runs).map(|(name, _)| name)), with_runs }
    }

    /// Adds an estimate of a run.
    ///
    /// # Errors
    /// What the system said.
    pub fn push(&mut self, run: &str, estimate: &MotionEstimate) -> io::Result<()> {
        self.table.push(row(run, estimate, self.with_runs))
    }

    /// Hands on everything up to the last estimate.
    ///
    /// # Errors
    /// What the system said.
    pub fn flush(&mut self) -> io::Result<()> {
        self.table.flush()
    }
}

/// Writes estimates to a file, as CSV or Parquet.
#[derive(Debug)]
pub struct ResultWriter<W: Write + Send> {
    table: TableWriter<W>,
    with_runs: bool,
}

impl<W: Write + Send> ResultWriter<W> {
    /// Begins the file; `with_runs` says that every row names its run. A `warning` that holds for every row becomes metadata of a
    /// Parquet file (key `warning`); CSV has no place for it.
    ///
    /// # Errors
    /// What the system said.
    pub fn new(output: W, form: TableForm, with_runs: bool, warning: Option<&str>) -> io::Result<Self> {
        Ok(Self { table: TableWriter::new(output, form, columns(with_runs), warning)?, with_runs })
    }

    /// Adds an estimate of a run.
    ///
    /// # Errors
    /// What the system said.
    pub fn push(&mut self, run: &str, estimate: &MotionEstimate) -> io::Result<()> {
        self.table.push(row(run, estimate, self.with_runs))
    }

    /// Ends the file and gives it back.
    ///
    /// # Errors
    /// What the system said.
    pub fn finish(self) -> io::Result<W> {
        self.table.finish()
    }
}

/// The cells of an estimate, in the order of [`COLUMNS`].
fn row<'r>(run: &'r str, estimate: &MotionEstimate, with_runs: bool) -> impl Iterator<Item = Cell<'r>> {
    let (confidence, guaranteed) = (&estimate.confidence, &estimate.guaranteed);
    let numbers = [
        estimate.speed.as_m_per_s(),
        confidence.speed_low.as_m_per_s(),
        confidence.speed_high.as_m_per_s(),
        guaranteed.speed_low.as_m_per_s(),
        guaranteed.speed_high.as_m_per_s(),
        estimate.acceleration.as_m_per_s2(),
        estimate.distance.as_m(),
        confidence.distance_low.as_m(),
        confidence.distance_high.as_m(),
        guaranteed.distance_low.as_m(),
        guaranteed.distance_high.as_m(),
        estimate.over.as_m(),
        estimate.under.as_m(),
    ];
    let [first, second] = estimate.wheels.map(wheel_word);
    let words = [first, second, mode_word(estimate.mode)];
    [Cell::Time(estimate.time)]
        .into_iter()
        .chain(numbers.map(Cell::Number))
        .chain(words.map(Cell::Text))
        .chain(estimate.shares.map(Cell::Number))
        .chain(with_runs.then_some(Cell::Text(run)))
}

const fn wheel_word(state: WheelState) -> &'static str {
    match state {
        WheelState::Rolling => "rolling",
        WheelState::Spin => "spin",
        WheelState::Slide => "slide",
        WheelState::Excluded => "excluded",
    }
}

const fn mode_word(mode: Mode) -> &'static str {
    match mode {
        Mode::Normal => "normal",
        Mode::OneSlip => "one_slip",
        Mode::Correction => "correction",
        Mode::Ambiguous => "ambiguous",
        Mode::Degraded => "degraded",
    }
}

#[cfg(test)]
mod tests {
    use footplate_core::odometry::MotionBounds;
    use footplate_core::{Acceleration, Length, Speed, Timestamp};

    use super::*;

    fn bounds([speed_low, speed_high]: [f64; 2], [distance_low, distance_high]: [f64; 2]) -> MotionBounds {
        MotionBounds {
            speed_low: Speed::from_m_per_s(speed_low),
            speed_high: Speed::from_m_per_s(speed_high),
            distance_low: Length::from_m(distance_low),
            distance_high: Length::from_m(distance_high),
        }
    }

    fn estimate() -> MotionEstimate {
        MotionEstimate {
            time: Timestamp::from_ns(1_250_000_000),
            speed: Speed::from_m_per_s(10.0),
            speed_deviation: Speed::ZERO,
            confidence: bounds([9.75, 10.25], [33.0, 34.0]),
            guaranteed: bounds([9.5, 10.5], [32.0, 35.0]),
            acceleration: Acceleration::from_m_per_s2(-0.1),
            distance: Length::from_m(100.0 / 3.0),
            over: Length::from_m(0.5),
            under: Length::from_m(1e-9),
            wheels: [WheelState::Rolling, WheelState::Slide],
            mode: Mode::OneSlip,
            shares: [1.0, 0.0, 0.0],
        }
    }

    #[test]
    fn a_row_says_everything_in_the_order_of_the_header() {
        let mut result = ResultWriter::new(Vec::new(), TableForm::Csv, true, Some("no vehicle")).unwrap();
        result.push("a, b", &estimate()).unwrap();
        let text = String::from_utf8(result.finish().unwrap()).unwrap();
        assert_eq!(
            text,
            "t_s,speed_m_s,confidence_speed_low_m_s,confidence_speed_high_m_s,guaranteed_speed_low_m_s,\
             guaranteed_speed_high_m_s,accel_m_s2,distance_m,confidence_distance_low_m,confidence_distance_high_m,\
             guaranteed_distance_low_m,guaranteed_distance_high_m,over_m,under_m,wheel_1,wheel_2,mode,share_1,share_2,\
             share_3,run_id\n\
             1.25,10.0,9.75,10.25,9.5,10.5,-0.1,33.333333333333336,33.0,34.0,32.0,35.0,0.5,1e-9,rolling,slide,one_slip,\
             1.0,0.0,0.0,\"a, b\"\n"
        );
        let mut live = Vec::new();
        let mut result = LiveResult::new(&mut live, true);
        result.push("a, b", &estimate()).unwrap();
        result.flush().unwrap();
        assert_eq!(live, text.into_bytes());
    }
}
