//! Everything a train did so far, and the model that explains it best.
//!
//! One chain of trips: a trip begins where the one before came to rest. With `p` the place where a trip began, counted
//! from the contact passed last before it, `F(t)` the way run by the laws and `W` the way to a contact as the train
//! feels it, every contact passed at `t` says `p + F(t) − W = 0`, and every stop that the next trip's `p′` is where this
//! one ended, give or take the scatter of stops. All numbers are found together (Gauss and Newton), with what is known
//! of model trains beforehand as measurements of their own; the derivatives are numerical. A stop that is followed by a
//! slow run to the next contact is so measured as well as that run is.
#![expect(clippy::indexing_slicing, reason = "columns are counted before the vectors are made by that count")]

use alloc::vec;
use alloc::vec::Vec;

use super::chain::Chain;
use super::model::{MotionModel, StepUse};
use super::parameters::SPEEDS;
use super::priors::priors;
use super::rows::{Linear, Point};
use super::unknowns::Columns;
use crate::calibration::SectionIndex;
use crate::event::{Event, EventKind};
use crate::ids::{SpeedStep, TrainId};
use crate::linalg::NormalEquations;
use crate::time::Timestamp;
use crate::track::{Layout, TurnoutStates};

/// Steps after which an iteration that has not settled is taken as it is.
const MOST_ITERATIONS: usize = 15;
/// A step is shortened by half so often before the point counts as the best.
const MOST_HALVINGS: usize = 6;
/// A step of ln speed no longer than this is believed at once: beyond it the laws bend too much.
const LONGEST_STEP: f64 = 0.6;
/// A step that changes no number by more than this (in its unit) was the last.
const SETTLED: f64 = 2e-4;
/// In so many iterations all rows count in full: the places at which trips began are not yet known then.
const ALL_BELIEVED: usize = 3;
/// Collects what one train does and fits its [`MotionModel`] to all of it.
#[derive(Debug, Clone)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct MotionFit {
    model: MotionModel,
    chain: Chain,
    /// Follows from the layout, and is made when it is first needed.
    #[cfg_attr(feature = "serde", serde(skip))]
    sections: Option<SectionIndex>,
    date: Timestamp,
}

impl MotionFit {
    /// Nothing seen yet.
    #[must_use]
    pub fn new(train: TrainId, highest: SpeedStep) -> Self {
        Self {
            model: MotionModel::unknown(train, highest),
            chain: Chain::default(),
            sections: None,
            date: Timestamp::ZERO,
        }
    }

    /// The next entry that is about this train: a command to it that has been sent, or a report that was judged to be
    /// of it. The turnouts as they lay at that time.
    pub fn take(&mut self, layout: &Layout, turnouts: &TurnoutStates, event: &Event) {
        match event.kind {
            EventKind::Sensor(_) => {
                let sections = self.sections.get_or_insert_with(|| SectionIndex::of(layout));
                self.chain.pass(layout, sections, turnouts, event);
            }
            EventKind::Speed { train, step } if train == self.model.train() => {
                self.chain.tell(event.time, step, &self.model.answers());
            }
            EventKind::Reverse { train } if train == self.model.train() => self.chain.interrupt(),
            _ => return,
        }
        self.date = event.time;
    }

    /// The chain is broken: the train was lifted, pushed, stalled or lost. What it did before still counts.
    pub fn interrupt(&mut self) {
        self.chain.interrupt();
    }

    /// A step moved the train, or did not.
    pub fn note_use(&mut self, step: SpeedStep, found: StepUse) {
        self.model.note_use(step, found);
    }

    /// Fits anew to all that was seen. Takes milliseconds; not for between two reports.
    pub fn refit(&mut self, sections: &SectionIndex) {
        let highest = usize::from(self.model.highest().get());
        let trips = &self.chain.trips;
        let columns = Columns::of(trips, highest);
        let mut x = self.start(&columns);
        let known = priors(&columns, trips, sections, &x, highest);
        let stop_shape_error = self.model.stop_shape_error();
        let rows_at = |x: &[f64], scale: f64, with_slopes: bool| {
            Point { trips, columns: &columns, x, highest, scale, stop_shape_error }.rows(with_slopes)
        };
        let mut scale = 1.0;
        let mut rows = rows_at(&x, scale, true);
        let mut equations = NormalEquations::new(columns.all);
        for iteration in 0..MOST_ITERATIONS {
            let believes_all = iteration < ALL_BELIEVED;
            equations = NormalEquations::new(columns.all);
            known.add_to(&mut equations);
            for row in &rows {
                // The row is about the step from here; its terms are about the numbers themselves.
                let here: f64 = row.terms.iter().map(|(column, slope)| slope * x[*column]).sum();
                equations.add(&row.terms, here - row.residual, row.variance / row.weight(believes_all));
            }
            let Some(next) = equations.values() else { return };
            let cost = |x: &[f64], rows: &[Linear]| {
                known.cost(x) + rows.iter().map(|row| row.cost(believes_all)).sum::<f64>()
            };
            let before = cost(&x, &rows);
            let logarithms = SPEEDS..SPEEDS + highest;
            let longest = logarithms.map(|i| (next[i] - x[i]).abs()).fold(0.0, f64::max);
            let mut part = if longest > LONGEST_STEP { LONGEST_STEP / longest } else { 1.0 };
            let mut moved = 0.0_f64;
            for _ in 0..MOST_HALVINGS {
                let tried: Vec<f64> =
                    x.iter().zip(&next).map(|(from, to)| from + part * (to - from)).collect();
                if cost(&tried, &rows_at(&tried, scale, false)) < before {
                    let lasting = x.iter().zip(&tried).take(columns.lasting);
                    moved = lasting.map(|(from, to)| (to - from).abs()).fold(0.0, f64::max);
                    x = tried;
                    break;
                }
                part *= 0.5;
            }
            rows = rows_at(&x, scale, true);
            if !believes_all {
                let mut squares = Squares::default();
                for row in rows.iter().filter(|row| row.is_stop) {
                    squares.take(row.residual * row.residual / row.variance * scale * scale);
                }
                scale = squares.scale();
                if moved < SETTLED {
                    break;
                }
            }
        }
        // Nobody asks how the numbers of single trips are known.
        let solution = equations.solve_for_first(columns.lasting);
        let Some(solution) = solution else { return };
        self.model.learn(&columns, &x, &solution, scale, trips, self.date);
    }

    /// Where the search begins: what the last fit found, and the prior for all else.
    fn start(&self, columns: &Columns) -> Vec<f64> {
        let mut x = vec![0.0; columns.all];
        for (slot, value) in x.iter_mut().zip(&self.model.values) {
            *slot = *value;
        }
        for (section, column) in &columns.sections {
            x[*column] = self.model.section(*section).map_or(0.0, |(by, _)| by);
        }
        x
    }

    /// The model as of the last fit.
    #[must_use]
    pub const fn model(&self) -> &MotionModel {
        &self.model
    }
}

/// How much stops scatter against what trains usually do.
#[derive(Debug, Default)]
struct Squares {
    sum: f64,
    count: f64,
}

impl Squares {
    /// What the usual scatter is worth against stops seen.
    const USUAL: f64 = 10.0;

    /// A stop that is further off than this (squared) was none by the train's own law.
    const WILD: f64 = 9.0;

    fn take(&mut self, square: f64) {
        self.sum += square.min(Self::WILD);
        self.count += 1.0;
    }

    fn scale(&self) -> f64 {
        libm::sqrt((self.sum + Self::USUAL) / (self.count + Self::USUAL))
    }
}
