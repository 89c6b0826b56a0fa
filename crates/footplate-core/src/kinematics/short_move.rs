//! Short moves: "go, wait, stop", with the stop commanded before the speed is reached.
//!
//! If the stop is commanded after a time T, the starting law gives distance and speed at that time, and the stopping
//! law adds the rest: the distance grows with T, first quadratically and then linearly. Laws fitted to longer runs
//! are off by a few per cent here, so measured moves correct them: a piecewise linear map of T makes the laws pass
//! through every measured move and keeps their shape in between.

#![expect(clippy::indexing_slicing, reason = "every index is below the number of measured moves")]

use super::bracket::crossing;
use super::motion::Motion;
use super::speed_change::SpeedChange;
use super::stopping_distance::FromCommand;
use super::stopping_law::StoppingLaw;
use crate::time::TimeSpan;
use crate::units::{Length, Speed};

/// The distance of a move as a function of the time between its two commands, and the inverse.
#[derive(Debug, Clone, PartialEq)]
pub struct ShortMove<'t> {
    start_delay: TimeSpan,
    start: SpeedChange<'t>,
    stop: StoppingLaw<FromCommand>,
    /// Command times in s: measured, and by the laws for the same distance.
    measured: [f64; ShortMove::MOST_POINTS],
    by_law: [f64; ShortMove::MOST_POINTS],
    points: usize,
}

/// Why laws or measurements give no model of short moves.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum ShortMoveError {
    /// A short move starts from standstill and reaches a speed.
    NoStart {
        /// Speed before the start.
        from: Speed,
        /// Speed that it leads to.
        to: Speed,
    },
    /// There are more measured moves than the model can store.
    TooMany {
        /// How many there were.
        found: usize,
    },
    /// Measured moves are sorted by time, and each goes farther than the previous one; the first goes farther than
    /// zero.
    NotIncreasing {
        /// Time between the commands of the move in question.
        time: TimeSpan,
        /// How far it got.
        distance: Length,
    },
    /// A measured move went farther than its laws ever go.
    OutOfReach {
        /// Time between the commands of the move in question.
        time: TimeSpan,
        /// How far it got.
        distance: Length,
    },
}

impl core::fmt::Display for ShortMoveError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::NoStart { from, to } => {
                let (from, to) = (from.as_mm_per_s(), to.as_mm_per_s());
                write!(
                    f,
                    "a short move should start from 0 mm/s and lead ahead, not go from {from} to {to} mm/s"
                )
            }
            Self::TooMany { found } => {
                write!(
                    f,
                    "{found} measured moves are more than the {} there is room for",
                    ShortMove::MOST_POINTS
                )
            }
            Self::NotIncreasing { time, distance } => {
                let (time, distance) = (time.as_ms(), distance.as_mm());
                write!(
                    f,
                    "the move of {time} ms got {distance} mm, which should be more than the move before it got in less time"
                )
            }
            Self::OutOfReach { time, distance } => {
                let (time, distance) = (time.as_ms(), distance.as_mm());
                write!(f, "the move of {time} ms got {distance} mm, where the law of starting never gets")
            }
        }
    }
}

impl core::error::Error for ShortMoveError {}

impl ShortMove<'_> {
    /// Most measured moves that can correct the laws: one every quarter of a second up to six seconds.
    pub const MOST_POINTS: usize = 24;
}

impl<'t> ShortMove<'t> {
    /// From the laws alone. The start begins `start_delay` after its command; the delay of the stop is in its law.
    ///
    /// # Errors
    ///
    /// If the start does not lead ahead from standstill.
    pub fn new(
        start_delay: TimeSpan,
        start: SpeedChange<'t>,
        stop: StoppingLaw<FromCommand>,
    ) -> Result<Self, ShortMoveError> {
        // A step at the middle of an interval stays at the start until then.
        let from = start.state_at(TimeSpan::from_ns(-1)).speed;
        let to = start.state_at(start.duration() + TimeSpan::from_ns(1)).speed;
        let leads_ahead = to.is_finite() && to > Speed::ZERO;
        if from != Speed::ZERO || !leads_ahead {
            return Err(ShortMoveError::NoStart { from, to });
        }
        let nothing = [0.0; ShortMove::MOST_POINTS];
        Ok(Self { start_delay, start, stop, measured: nothing, by_law: nothing, points: 0 })
    }

    /// The same laws, corrected so that they pass through measured moves: time between the commands, and how far
    /// the train got. Beyond the last the laws go on from it.
    ///
    /// # Errors
    ///
    /// If there are too many moves, or one is not farther and later than the one before, or out of reach.
    pub fn corrected_by(&self, moves: &[(TimeSpan, Length)]) -> Result<Self, ShortMoveError> {
        if moves.len() > Self::MOST_POINTS {
            return Err(ShortMoveError::TooMany { found: moves.len() });
        }
        let mut corrected = Self { points: 0, ..self.clone() };
        let mut before = (TimeSpan::ZERO, Length::ZERO);
        for (index, &(time, distance)) in moves.iter().enumerate() {
            let increasing = distance.is_finite() && time > before.0 && distance > before.1;
            if !increasing {
                return Err(ShortMoveError::NotIncreasing { time, distance });
            }
            corrected.measured[index] = time.as_s();
            corrected.by_law[index] =
                self.law_time(distance).ok_or(ShortMoveError::OutOfReach { time, distance })?;
            before = (time, distance);
        }
        corrected.points = moves.len();
        Ok(corrected)
    }

    /// The distance of a move whose stop is commanded this long after its start.
    pub fn distance(&self, command_time: TimeSpan) -> Length {
        let (measured, by_law) = self.corrections();
        self.law_distance(stretched(command_time.as_s().max(0.0), measured, by_law))
    }

    /// The time after which to command the stop for a distance; `None` if the distance is impossible or not ahead.
    pub fn command_time(&self, distance: Length) -> Option<TimeSpan> {
        let (measured, by_law) = self.corrections();
        let time = stretched(self.law_time(distance)?, by_law, measured);
        time.is_finite().then(|| TimeSpan::from_s(time))
    }

    fn corrections(&self) -> (&[f64], &[f64]) {
        (&self.measured[..self.points], &self.by_law[..self.points])
    }

    /// By the laws alone, for a stop commanded after a time in s.
    fn law_distance(&self, command_time: f64) -> Length {
        let state = self.start.state_at(TimeSpan::from_s(command_time) - self.start_delay);
        state.distance + self.stop.distance(state.speed).length()
    }

    /// Inverse of [`law_distance`](Self::law_distance).
    fn law_time(&self, distance: Length) -> Option<f64> {
        if !(distance.is_finite() && distance > Length::ZERO) {
            return None;
        }
        let begins = self.start_delay.as_s();
        let settled = (self.start_delay + self.start.duration()).as_s();
        let beyond = distance - self.law_distance(settled);
        let (low, high) = if beyond > Length::ZERO {
            // At the end of the start, or so near to it that the speed hardly changes any more.
            let speed = self.start.state_at(self.start.duration() + TimeSpan::from_ns(1)).speed;
            (settled, settled + beyond.as_m() / speed.as_m_per_s())
        } else {
            (begins, settled)
        };
        let time = crossing(low, high, |time| (self.law_distance(time) - distance).as_m());
        time.is_finite().then_some(time)
    }
}

/// Piecewise linear map of a time from (0, 0) through points; beyond the last its slope is 1.
fn stretched(time: f64, from: &[f64], to: &[f64]) -> f64 {
    let passed = from.partition_point(|&point| point < time);
    let (low, low_to) = if passed > 0 { (from[passed - 1], to[passed - 1]) } else { (0.0, 0.0) };
    if passed == from.len() {
        return low_to + (time - low);
    }
    low_to + (time - low) * ((to[passed] - low_to) / (from[passed] - low))
}
