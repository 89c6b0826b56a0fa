//! From the solution of a fit to a model.

use alloc::collections::BTreeMap;

use super::model::{Counts, MotionModel};
use super::spread::Spread;
use super::trip::Trip;
use super::unknowns::Columns;
use crate::linalg::Solution;
use crate::time::Timestamp;

impl MotionModel {
    /// Takes over what a fit found.
    pub(super) fn learn(
        &mut self,
        columns: &Columns,
        x: &[f64],
        solution: &Solution,
        scatter_scale: f64,
        trips: &[Trip],
        date: Timestamp,
    ) {
        let steps = self.steps();
        let numbers = super::parameters::count(steps);
        self.values = x.get(..numbers).unwrap_or_default().to_vec();
        self.spread = Spread::of(solution, steps);
        self.sections = columns
            .sections
            .iter()
            .map(|(section, column)| {
                (*section, (x.get(*column).copied().unwrap_or(0.0), solution.variance(*column)))
            })
            .collect::<BTreeMap<_, _>>();
        self.scatter_scale = scatter_scale;
        self.date = date;
        for counts in &mut self.counts {
            *counts = [Counts::default(); 2];
        }
        for trip in trips {
            self.count(trip);
        }
    }

    fn count(&mut self, trip: &Trip) {
        let mut told = trip.told.iter().peekable();
        let mut now = trip.running.unwrap_or((0, false));
        for contact in &trip.contacts {
            while let Some(next) = told.next_if(|next| next.sent <= contact.time) {
                now = (next.to, next.above());
            }
            if let Some(counts) = self.counts_mut(now) {
                counts.contacts += 1;
            }
        }
        if let ([.., before, last], true) = (trip.told.as_slice(), trip.came_to_rest)
            && last.to == 0
            && let Some(counts) = self.counts_mut((before.to, before.above()))
        {
            counts.stops += 1;
        }
    }

    fn counts_mut(&mut self, (step, above): (u8, bool)) -> Option<&mut Counts> {
        self.counts.get_mut(usize::from(step))?.get_mut(usize::from(above))
    }
}
