//! Prediction of the first sensor after a stop and a start, compared with its detection.

use alloc::vec::Vec;

use super::rows::{Linear, Point, Source, TripAt, add_term};
use crate::model::MotionModel;
use crate::model::priors::TRIP_DEVIATION;

/// The whole run determines the train's position at the last sensor before a stop. That leaves this part of the variance of the
/// sensor alone (two or three sensors lie within the correlation time of a run's speed).
const LAST_SENSOR: f64 = 0.5;

/// The first sensor after a stop: detection against prediction.
#[derive(Debug, Clone, Copy)]
pub(super) struct Foreseen {
    /// By how much the train was behind its prediction (m).
    pub(super) residual: f64,
    /// The variance of that prediction (m²): numbers of the train, section lengths, this start, this run, and the times of both
    /// detections. The scatter of the stop itself is not in it.
    pub(super) variance: f64,
}

impl Point<'_> {
    /// Compares the first sensor of a trip that continues another with its prediction.
    ///
    /// The sum of a stop and the following start is known far better than either part: the prediction counts from the last
    /// sensor before the stop and is as precise as that sum.
    pub(super) fn foreseen(
        &self,
        model: &MotionModel,
        before: TripAt<'_>,
        after: TripAt<'_>,
    ) -> Option<Foreseen> {
        let stopping = self.rows(before, true);
        let stop = stopping.iter().position(|row| row.source == Source::Rest)?;
        let last = stop.checked_sub(1).and_then(|place| stopping.get(place));
        let last = last.filter(|row| row.source == Source::Sensor);
        let starting = self.rows(after, true);
        let first = starting.iter().find(|row| row.source == Source::Sensor)?;
        let mut terms: Vec<(usize, f64)> = Vec::new();
        let mut add = |row: &Linear, sign: f64| {
            for (column, slope) in row.terms.iter().filter(|(column, _)| *column < self.columns.lasting) {
                add_term(&mut terms, *column, sign * slope);
            }
        };
        let stop = stopping.get(stop)?;
        add(stop, 1.0);
        add(first, 1.0);
        if let Some(last) = last {
            add(last, -1.0);
        }
        let numbers = crate::model::parameters::count(self.highest);
        let (of_train, of_local): (Vec<_>, Vec<_>) =
            terms.iter().copied().partition(|(column, _)| *column < numbers);
        let mut variance = model.spread.variance_along(&of_train);
        for (section, column) in &self.columns.sections {
            let slope = of_local.iter().find(|(of, _)| of == column).map_or(0.0, |(_, slope)| *slope);
            variance += slope * slope * model.section(*section).map_or(0.0, |(_, variance)| variance);
        }
        for (edge, column) in &self.columns.stop_offsets {
            let slope = of_local.iter().find(|(of, _)| of == column).map_or(0.0, |(_, slope)| *slope);
            variance += slope * slope * model.stop_offsets.of(*edge).variance;
        }
        let slope_at =
            |column: usize| first.terms.iter().find(|(of, _)| *of == column).map_or(0.0, |(_, slope)| *slope);
        let late = slope_at(self.columns.late_start()) * model.start_scatter();
        let pieces = (0..after.own.deviations.len()).map(|piece| slope_at(self.columns.deviation(piece)));
        let run = pieces.sum::<f64>() * TRIP_DEVIATION;
        let begin = last.map_or(0.0, |row| LAST_SENSOR * row.once);
        variance += late * late + run * run + first.once + begin;
        let residual = stop.residual + first.residual;
        Some(Foreseen { residual, variance })
    }
}
