//! From the solution of a fit to a model.

use alloc::vec::Vec;

use super::trip::Trip;
use super::unknowns::Columns;
use crate::linalg::Solution;
use crate::model::motion_model::{Counts, MotionModel};
use crate::model::parameters::{
    DOWN, NODES, SPEEDS, START_DELAY, START_NODES, STOP_NODES, UP, knots, shape_at,
};
use crate::model::priors::independent_nodes;
use crate::model::scatter::ScatterSums;
use crate::model::spread::Spread;
use crate::time::Timestamp;

impl MotionModel {
    /// Takes over the solution of a fit; `scale` is the relative uncertainty of the survey's scale, if the fit used it.
    pub(super) fn learn(
        &mut self,
        columns: &Columns,
        lasting: &[f64],
        solution: &Solution,
        scale: Option<f64>,
        scatter: ScatterSums,
        date: Timestamp,
    ) {
        let steps = self.steps();
        let numbers = crate::model::parameters::count(steps);
        self.values = lasting.get(..numbers).unwrap_or_default().to_vec();
        let sections: Vec<usize> = columns.sections.values().copied().collect();
        (self.spread, self.scale) = Spread::of(solution, steps, &sections);
        if let Some(deviation) = scale {
            self.scale = by_scale(&self.values, steps).map(|slope| slope * deviation).collect();
        }
        let with_total = |column: usize| solution.covariance_with_sum(column, &sections);
        let total: f64 = sections.iter().map(|column| with_total(*column)).sum();
        let known = |column: usize| {
            let with_total = with_total(column);
            let by_total = if total > 0.0 { with_total * with_total / total } else { 0.0 };
            let longer = lasting.get(column).copied().unwrap_or(0.0);
            (longer, (solution.variance(column) - by_total).max(0.0))
        };
        self.sections = columns.sections.iter().map(|(section, column)| (*section, known(*column))).collect();
        self.scatter = scatter.scatter();
        let offset =
            |column: usize| (lasting.get(column).copied().unwrap_or(0.0), solution.variance(column).max(0.0));
        let offsets = columns.stop_offsets.iter().map(|(edge, column)| (*edge, offset(*column)));
        self.stop_offsets.learn(offsets.collect());
        for (scale, first) in self.residual_scales.iter_mut().zip([STOP_NODES, START_NODES]) {
            *scale = residual_scale(first, lasting, solution);
        }
        self.date = date;
    }

    /// Counts the measurements again: those before the kept trips, and those in them.
    pub(super) fn recount(&mut self, before: &[[Counts; 2]], trips: &[Trip]) {
        self.counts.clear();
        self.counts.extend_from_slice(before);
        for trip in trips {
            count(&mut self.counts, trip);
        }
    }
}

/// The usual size of what laws leave over weighs as much as this many nodes.
const USUAL_NODES: f64 = 4.0;

/// By how much more than usual a law leaves over, as its nodes show: one step of expectation and maximisation (Dempster, Laird and
/// Rubin, 1977). Less than usual is no evidence that the next speed is like those seen.
fn residual_scale(first: usize, lasting: &[f64], solution: &Solution) -> f64 {
    let squares = independent_nodes(first).map(|(sum, usual)| {
        let found: f64 = sum.iter().filter_map(|(place, slope)| Some(slope * lasting.get(*place)?)).sum();
        let mean = found - usual;
        let with = |(one, by): &(usize, f64)| -> f64 {
            sum.iter().map(|(other, slope)| by * slope * solution.covariance(*one, *other)).sum()
        };
        mean * mean + sum.iter().map(with).sum::<f64>().max(0.0)
    });
    libm::sqrt((squares.sum::<f64>() + USUAL_NODES) / (NODES as f64 + USUAL_NODES)).max(1.0)
}

/// How each number changes with ln of the scale by which lengths are measured.
fn by_scale(values: &[f64], steps: usize) -> impl Iterator<Item = f64> + '_ {
    let speeds = SPEEDS..SPEEDS + knots(steps);
    values.iter().enumerate().map(move |(place, value)| {
        // Of delay, lag, κ and ρ all are times but κ, which is a time by speed.
        let of_change =
            [UP, DOWN].into_iter().find_map(|first| place.checked_sub(first).filter(|of| *of < 4));
        match of_change {
            Some(KAPPA) => -value,
            Some(_) => 0.0,
            None if place == START_DELAY || place >= shape_at(false, steps) => 0.0,
            None if speeds.contains(&place) => 1.0,
            None => *value,
        }
    })
}

/// Place of `κ` among the numbers of a direction.
const KAPPA: usize = 2;

/// Counts the measurements of one trip, by step and approach.
pub(super) fn count(counts: &mut [[Counts; 2]], trip: &Trip) {
    let mut at = |(step, above): (u8, bool), add: &dyn Fn(&mut Counts)| {
        if let Some(slot) =
            counts.get_mut(usize::from(step)).and_then(|both| both.get_mut(usize::from(above)))
        {
            add(slot);
        }
    };
    let mut commanded = trip.commanded.iter().peekable();
    let mut now = trip.running.unwrap_or((0, false));
    for detection in &trip.detections {
        while let Some(next) = commanded.next_if(|next| next.sent <= detection.time) {
            now = (next.to, next.above());
        }
        at(now, &|counts| counts.contacts += 1);
    }
    if let ([.., last], true) = (trip.commanded.as_slice(), trip.came_to_rest)
        && last.to == 0
    {
        let before = trip
            .commanded
            .iter()
            .rev()
            .nth(1)
            .map(|commanded| (commanded.to, commanded.above()))
            .or(trip.running);
        if let Some(before) = before {
            at(before, &|counts| counts.stops += 1);
        }
    }
}
