//! Short moves measured with a tape: laws of starting and stopping that fit them, and a table that passes through them.
//!
//! A short move is "go, wait `T`, stop" from standstill. Its distance alone is measured, so that the laws are the simplest that
//! have its shape: even acceleration and even braking ([`ShortMove`]). Of the two delays only the difference counts.
//! Letters: `d` measured distance, `x` unknowns.
//!
//! ```text
//! x = start delay − stop delay, ln speed, ln duration of the start, ln deceleration
//! ```
#![expect(clippy::indexing_slicing, reason = "every index is below the number of unknowns")]

use alloc::vec::Vec;

use crate::estimate::Estimate;
use crate::kinematics::{Braking, ShortMove, ShortMoveError, SpeedLaw, StoppingLaw};
use crate::linalg::{CurveFit, FittedCurve, Unknown};
use crate::time::{TimeSpan, Timestamp};
use crate::units::{Acceleration, Length, Speed};

const DELAY: usize = 0;
const LN_SPEED: usize = 1;
const LN_RISE: usize = 2;
const LN_BRAKE: usize = 3;
const N: usize = 4;

/// What all model trains have in common: a delay of 0.1 s, 0.3 m/s reached in 1 s, braking with 0.3 m/s², each within a factor
/// of 2.7 (kinematics of the course's trains).
const UNKNOWNS: [Unknown; N] = [
    Unknown { prior: 0.1, spread: 0.3, step: 1e-4, is_free: true },
    Unknown { prior: -1.2, spread: 1.0, step: 1e-3, is_free: true },
    Unknown { prior: 0.0, spread: 1.0, step: 1e-3, is_free: true },
    Unknown { prior: -1.2, spread: 1.0, step: 1e-3, is_free: true },
];
/// No tape is read better than this (m).
const LEAST_NOISE: f64 = 1e-3;
/// Moves below which four unknowns and what is left over are not found.
const FEWEST_MOVES: usize = 6;

/// What a table and laws make of measured short moves. All uncertainties are standard deviations.
#[derive(Debug, Clone)]
pub struct ShortMoveFit {
    /// The laws alone.
    pub law: ShortMove<'static>,
    /// The laws, corrected so that they pass through every measured move; why not, where moves contradict each other.
    pub table: Result<ShortMove<'static>, ShortMoveError>,
    /// By how much longer the command to start takes to have an effect than the command to stop.
    pub start_delay: Estimate<TimeSpan>,
    /// The steady speed.
    pub speed: Estimate<Speed>,
    /// Acceleration from standstill.
    pub acceleration: Estimate<Acceleration>,
    /// Deceleration to standstill, as a positive number.
    pub deceleration: Estimate<Acceleration>,
    /// Every move, and what the others say of it.
    pub moves: Vec<PredictedMove>,
}

/// A measured move and what laws and table without it predict.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PredictedMove {
    /// Time between the two commands.
    pub time: TimeSpan,
    /// Distance by the tape; the mean, where a time was measured several times.
    pub measured: Length,
    /// By laws that were fitted to the other moves.
    pub by_law: Length,
    /// By those laws, corrected by the other moves.
    pub by_table: Option<Length>,
}

/// Why measured moves make no model of short moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum ShortMoveFitError {
    /// There are too few different times.
    TooFew {
        /// How many there are.
        found: usize,
    },
    /// The moves leave the laws open.
    NotDetermined,
}

impl core::fmt::Display for ShortMoveFitError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::TooFew { found } => write!(
                f,
                "short moves of {found} different times are too few: measure {FEWEST_MOVES} or more, from a quarter of a second up"
            ),
            Self::NotDetermined => write!(
                f,
                "the moves leave the laws open: measure moves that reach steady speed and some that do not"
            ),
        }
    }
}

impl core::error::Error for ShortMoveFitError {}

impl ShortMoveFit {
    /// Fits laws to measured moves in any order: time between the commands, and the distance from rest to rest.
    ///
    /// # Errors
    ///
    /// If there are too few, or they say nothing of a start and a stop.
    pub fn of(moves: &[(TimeSpan, Length)]) -> Result<Self, ShortMoveFitError> {
        let moves = merged(moves);
        if moves.len() < FEWEST_MOVES {
            return Err(ShortMoveFitError::TooFew { found: moves.len() });
        }
        let fit = fitted(&moves).ok_or(ShortMoveFitError::NotDetermined)?;
        let law = law(&fit.x).ok_or(ShortMoveFitError::NotDetermined)?;
        let table = law.corrected_by(&moves);
        let others = |without: usize| -> Vec<(TimeSpan, Length)> {
            moves.iter().enumerate().filter(|(at, _)| *at != without).map(|(_, one)| *one).collect()
        };
        let predicted = |(at, &(time, measured)): (usize, &(TimeSpan, Length))| {
            let others = others(at);
            let law = self::law(&fitted(&others)?.x)?;
            let by_table = law.corrected_by(&others).ok().map(|table| table.distance(time));
            Some(PredictedMove { time, measured, by_law: law.distance(time), by_table })
        };
        let predictions: Option<Vec<PredictedMove>> = moves.iter().enumerate().map(predicted).collect();
        let count = u32::try_from(moves.len()).unwrap_or(u32::MAX);
        let derived = |of: &dyn Fn(&[f64]) -> f64| {
            let (value, uncertainty) = fit.derived(&UNKNOWNS, of);
            Estimate { value, uncertainty, count, date: Timestamp::ZERO }
        };
        Ok(Self {
            law,
            table,
            start_delay: derived(&|x| x[DELAY]).scaled(TimeSpan::from_s),
            speed: derived(&|x| libm::exp(x[LN_SPEED])).scaled(Speed::from_m_per_s),
            acceleration: derived(&|x| libm::exp(x[LN_SPEED] - x[LN_RISE]))
                .scaled(Acceleration::from_m_per_s2),
            deceleration: derived(&|x| libm::exp(x[LN_BRAKE])).scaled(Acceleration::from_m_per_s2),
            moves: predictions.ok_or(ShortMoveFitError::NotDetermined)?,
        })
    }

    /// Root mean square error of the laws for moves that they were not fitted to.
    pub fn law_error(&self) -> Length {
        rms(self.moves.iter().map(|one| one.by_law - one.measured))
    }

    /// The same for the table; `None` if there is none.
    pub fn table_error(&self) -> Option<Length> {
        let errors: Option<Vec<Length>> =
            self.moves.iter().map(|one| Some(one.by_table? - one.measured)).collect();
        self.table.as_ref().ok()?;
        Some(rms(errors?.into_iter()))
    }

    /// The better of both for a move that was not measured.
    pub fn better(&self) -> &ShortMove<'static> {
        match (&self.table, self.table_error()) {
            (Ok(table), Some(error)) if error < self.law_error() => table,
            _ => &self.law,
        }
    }
}

/// By time, with the mean distance of each time; moves of no time and no distance say nothing.
fn merged(moves: &[(TimeSpan, Length)]) -> Vec<(TimeSpan, Length)> {
    let mut sorted: Vec<_> = moves.iter().copied().filter(|(time, _)| *time > TimeSpan::ZERO).collect();
    sorted.sort_by_key(|(time, _)| *time);
    sorted
        .chunk_by(|one, next| one.0 == next.0)
        .filter_map(|same| {
            let sum: f64 = same.iter().map(|(_, distance)| distance.as_m()).sum();
            Some((same.first()?.0, Length::from_m(sum / same.len() as f64)))
        })
        .collect()
}

/// Laws with these unknowns; `None` beyond all numbers.
fn law(x: &[f64]) -> Option<ShortMove<'static>> {
    let [start_delay, stop_delay] = [x[DELAY], -x[DELAY]].map(|delay| TimeSpan::from_s(delay.max(0.0)));
    let rise = TimeSpan::from_s(libm::exp(x[LN_RISE]));
    let speed = Speed::from_m_per_s(libm::exp(x[LN_SPEED]));
    let start = SpeedLaw::ConstantAcceleration.between(Speed::ZERO, speed, rise);
    let braking = Braking::Constant(Acceleration::from_m_per_s2(libm::exp(x[LN_BRAKE])));
    ShortMove::new(start_delay, start, StoppingLaw::new(stop_delay, braking).ok()?).ok()
}

fn fitted(moves: &[(TimeSpan, Length)]) -> Option<FittedCurve> {
    let residuals = |x: &[f64]| -> Vec<f64> {
        let law = law(x);
        let predicted = |time| law.as_ref().map_or(f64::INFINITY, |law| law.distance(time).as_m());
        moves.iter().map(|(time, distance)| distance.as_m() - predicted(*time)).collect()
    };
    let variance = |residuals: &[f64]| {
        let squares: f64 = residuals.iter().map(|r| r * r).sum();
        (squares / residuals.len().saturating_sub(N).max(1) as f64).max(LEAST_NOISE * LEAST_NOISE)
    };
    let fit = CurveFit { unknowns: &UNKNOWNS, residuals, variance };
    fit.fitted(&UNKNOWNS.map(|unknown| unknown.prior))
}

fn rms(errors: impl ExactSizeIterator<Item = Length>) -> Length {
    let count = errors.len().max(1) as f64;
    let squares: f64 = errors.map(|error| error.as_m() * error.as_m()).sum();
    Length::from_m(libm::sqrt(squares / count))
}
