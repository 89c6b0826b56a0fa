//! Some rows of a recording, column by column.

use footplate_core::odometry::wheels::{Count, Direction, Period, WheelReading};
use footplate_core::{Acceleration, Length, Speed, TimeSpan, Timestamp};

use super::columns::{Quantity, TachometerColumns};
use super::note::TachometerNote;
use super::time_watch::TimeFaults;

/// Most rows of a block: with all columns it fits the second cache of a core, and a block takes some 100 µs.
pub(super) const BLOCK_ROWS: usize = 4096;

/// Of so many rows the usual time step is taken: hours of rows would show no more.
const JUDGED_ROWS: usize = 201;
/// The median of fewer steps may be that of a disturbance.
const FEWEST_STEPS: usize = 20;

/// What stands for a count or a time that is missing. No counter has it: it cannot be written without its sign.
pub(super) const MISSING: i64 = i64::MIN;

/// Some rows of a recording, column by column; columns that the file does not have are empty.
#[derive(Debug, Clone, Default)]
pub struct TachometerBlock {
    pub(super) times: Vec<Timestamp>,
    pub(super) counts: [Vec<i64>; 2],
    pub(super) directions: [Vec<Direction>; 2],
    /// Nanoseconds, or [`MISSING`].
    pub(super) edges: [Vec<i64>; 2],
    /// NaN where a number is missing.
    pub(super) numbers: [Vec<f64>; Quantity::COUNT],
    pub(super) runs: Vec<u32>,
    is_counter: [bool; 2],
    /// Names of runs that appear for the first time in this block; their numbers go on from those before.
    pub new_runs: Vec<String>,
    /// What is odd in this block for the first time.
    pub notes: Vec<TachometerNote>,
    /// How many rows had a time that makes no period, from the beginning of the file to the end of this block.
    pub time_faults: TimeFaults,
    /// How much of the input has been read with it, in the unit of [`extent`](super::TachometerReader::extent).
    pub read_up_to: u64,
}

/// What really happened, where a recording says it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Truth {
    /// How fast the train ran.
    pub speed: Option<Speed>,
    /// How far it had gone.
    pub distance: Option<Length>,
    /// How fast the circumference of each wheel turned.
    pub wheels: [Option<Speed>; 2],
}

impl TachometerBlock {
    /// How many rows it has.
    pub fn len(&self) -> usize {
        self.times.len()
    }

    /// Whether it has no row.
    pub fn is_empty(&self) -> bool {
        self.times.is_empty()
    }

    /// The number of the run that a row belongs to, counted from 0 in the order of first appearance.
    #[inline]
    pub fn run(&self, row: usize) -> usize {
        self.runs.get(row).map_or(0, |run| *run as usize)
    }

    /// What was read in the period of a row; one of which nothing is known if there is no such row.
    #[inline]
    pub fn period(&self, row: usize) -> Period {
        Period {
            time: self.times.get(row).copied().unwrap_or_default(),
            wheels: [self.wheel(row, 0), self.wheel(row, 1)],
            effort: self.number(row, Quantity::Effort),
            acceleration: self.number(row, Quantity::Acceleration).map(Acceleration::from_m_per_s2),
            balise: self.number(row, Quantity::Balise).map(Length::from_m),
            balise_deviation: self.number(row, Quantity::BaliseDeviation).map(Length::from_m),
        }
    }

    /// What really happened in the period of a row.
    #[inline]
    pub fn truth(&self, row: usize) -> Truth {
        let speed = |quantity| self.number(row, quantity).map(Speed::from_m_per_s);
        Truth {
            speed: speed(Quantity::TrueSpeed),
            distance: self.number(row, Quantity::TrueDistance).map(Length::from_m),
            wheels: [speed(Quantity::TrueWheel1), speed(Quantity::TrueWheel2)],
        }
    }

    /// The median time between the first rows of a run in this block; `None` where they are too few.
    pub fn usual_step(&self, run: usize) -> Option<TimeSpan> {
        let rows = (0..self.len()).filter(|row| self.run(*row) == run).take(JUDGED_ROWS);
        let times: Vec<Timestamp> = rows.filter_map(|row| self.times.get(row).copied()).collect();
        let mut steps: Vec<TimeSpan> =
            times.iter().zip(times.iter().skip(1)).map(|(from, to)| *to - *from).collect();
        steps.sort_unstable();
        steps.get(steps.len() / 2).copied().filter(|_| steps.len() >= FEWEST_STEPS)
    }

    #[inline]
    fn wheel(&self, row: usize, wheel: usize) -> WheelReading {
        let count = match self.counts[wheel].get(row) {
            None | Some(&MISSING) => Count::Missing,
            Some(&counter) if self.is_counter[wheel] => Count::Counter(counter),
            Some(&pulses) => Count::Pulses(pulses),
        };
        WheelReading {
            count,
            direction: self.directions[wheel].get(row).copied().unwrap_or_default(),
            last_edge: self.edges[wheel]
                .get(row)
                .filter(|edge| **edge != MISSING)
                .map(|edge| Timestamp::from_ns(*edge)),
        }
    }

    #[inline]
    fn number(&self, row: usize, quantity: Quantity) -> Option<f64> {
        self.numbers[quantity.slot()].get(row).copied().filter(|value| !value.is_nan())
    }

    /// Empties it for the next rows of a recording with these columns.
    pub(super) fn begin(&mut self, columns: &TachometerColumns) {
        self.truncate(0);
        self.is_counter = [0, 1].map(|wheel| columns.is_counter(wheel));
        self.new_runs.clear();
        self.notes.clear();
    }

    /// Takes back what has been read of rows behind the first `rows`.
    pub(super) fn truncate(&mut self, rows: usize) {
        self.times.truncate(rows);
        self.runs.truncate(rows);
        self.counts.iter_mut().for_each(|counts| counts.truncate(rows));
        self.directions.iter_mut().for_each(|directions| directions.truncate(rows));
        self.edges.iter_mut().for_each(|edges| edges.truncate(rows));
        self.numbers.iter_mut().for_each(|numbers| numbers.truncate(rows));
    }
}
