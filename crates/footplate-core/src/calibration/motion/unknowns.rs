//! Which column of the fit belongs to which number: those of the train first, those of single trips behind them.

use alloc::collections::BTreeMap;
use alloc::vec::Vec;

use super::parameters::count;
use super::trip::{Own, Trip};

/// The columns of a fit.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Columns {
    /// Sections that were run over, with their columns.
    pub(super) sections: BTreeMap<usize, usize>,
    /// Columns of what stays true after a trip.
    pub(super) lasting: usize,
    /// Where those of each trip begin: place, late start, deviations, changes.
    trips: Vec<usize>,
    pub(super) all: usize,
}

impl Columns {
    pub(super) fn of(trips: &[Trip], highest: usize) -> Self {
        let mut columns = Self { lasting: count(highest), ..Self::default() };
        for section in trips.iter().flat_map(|trip| &trip.contacts).flat_map(|contact| &contact.sections) {
            let next = columns.lasting;
            if *columns.sections.entry(*section).or_insert(next) == next {
                columns.lasting += 1;
            }
        }
        columns.all = columns.lasting;
        for trip in trips {
            columns.trips.push(columns.all);
            columns.all += 2 + trip.pieces.len() + trip.told.len();
        }
        columns
    }

    /// Column of the place at which a trip began.
    pub(super) fn place(&self, trip: usize) -> usize {
        self.trips.get(trip).copied().unwrap_or(0)
    }

    /// Column of how much later than usual it started.
    pub(super) fn late_start(&self, trip: usize) -> usize {
        self.place(trip) + 1
    }

    /// Column of the deviation of speed over a piece.
    pub(super) fn deviation(&self, trip: usize, piece: usize) -> usize {
        self.place(trip) + 2 + piece
    }

    /// Column of the additional way of a change.
    pub(super) fn change(&self, trip: usize, of: &Trip, told: usize) -> usize {
        self.place(trip) + 2 + of.pieces.len() + told
    }

    /// A trip's own numbers out of a vector of all.
    pub(super) fn own(&self, trip: usize, of: &Trip, values: &[f64]) -> Own {
        let from = |first: usize, count: usize| {
            values.get(first..first + count).map(<[f64]>::to_vec).unwrap_or_default()
        };
        Own {
            late_start: values.get(self.late_start(trip)).copied().unwrap_or(0.0),
            deviations: from(self.deviation(trip, 0), of.pieces.len()),
            changes: from(self.change(trip, of, 0), of.told.len()),
        }
    }
}
