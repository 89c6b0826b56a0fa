//! The columns of the equations: lasting numbers first, then those of one trip.

use alloc::collections::BTreeMap;

use super::trip::{Own, Trip};

/// The columns of the lasting numbers, and of those of the current trip.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Columns {
    /// Sections that were run over, with their columns after the numbers of the train.
    pub(super) sections: BTreeMap<usize, usize>,
    /// Edges that a stop ran over, with the columns of their stop offsets.
    pub(super) stop_offsets: BTreeMap<usize, usize>,
    /// The count of lasting numbers.
    pub(super) lasting: usize,
}

/// Columns of a trip before its own numbers: where it begins, and where the next one does.
const PLACES: usize = 2;

impl Columns {
    /// Of the place at which the trip began.
    pub(super) const fn place(&self) -> usize {
        self.lasting
    }

    /// Of the place at which the next trip begins.
    pub(super) const fn next_place(&self) -> usize {
        self.lasting + 1
    }

    /// Of how much later than usual it started.
    pub(super) const fn late_start(&self) -> usize {
        self.lasting + PLACES
    }

    /// Of the deviation of speed over a piece.
    pub(super) const fn deviation(&self, piece: usize) -> usize {
        self.late_start() + 1 + piece
    }

    /// Of the additional distance of a change.
    pub(super) fn change(&self, of: &Trip, commanded: usize) -> usize {
        self.deviation(of.pieces.len() + commanded)
    }

    /// A trip's own numbers, from the values of all columns; the place is the first of them.
    pub(super) fn own(&self, of: &Trip, values: &[f64]) -> Own {
        let at = |column: usize| values.get(column).copied().unwrap_or(0.0);
        Own {
            place: at(self.place()),
            late_start: at(self.late_start()),
            deviations: (0..of.pieces.len()).map(|piece| at(self.deviation(piece))).collect(),
            changes: (0..of.commanded.len()).map(|commanded| at(self.change(of, commanded))).collect(),
        }
    }
}
