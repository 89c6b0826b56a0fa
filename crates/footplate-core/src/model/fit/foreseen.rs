//! How well the first sensor behind a stop and a start is foreseen before it is passed.

use alloc::vec::Vec;

use super::rows::{Linear, Point, Source, TripAt, add_term};
use crate::model::MotionModel;
use crate::model::priors::TRIP_DEVIATION;

/// Where a train was at the last sensor before a stop is known from the whole run, which leaves this part of the variance of that
/// sensor by itself (two or three sensors within the time in which a run's speed wanders).
const LAST_SENSOR: f64 = 0.5;

/// The first sensor behind a stop, before and after it was passed.
#[derive(Debug, Clone, Copy)]
pub(super) struct Foreseen {
    /// How much earlier or later along the path it was passed than foreseen (m).
    pub(super) residual: f64,
    /// What was known to be unknown of that (m²): the train's numbers, the lengths of sections, this start, this run, and
    /// when the two sensors were passed. The scatter of the stop itself is not in it.
    pub(super) variance: f64,
}

impl Point<'_> {
    /// What was foreseen of the first sensor of a trip that continues another, and what came.
    ///
    /// A stop that may be longer and a start that may be later are known as a sum far better than each of them: the sensor
    /// is foreseen as well as that sum is, from the last sensor before the stop on.
    pub(super) fn foreseen(
        &self,
        model: &MotionModel,
        before: TripAt<'_>,
        after: TripAt<'_>,
    ) -> Option<Foreseen> {
        let stopping = self.rows(before, true);
        let stop = stopping.iter().position(|row| row.source == Source::Stop)?;
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
        for (hop, column) in &self.columns.stop_offsets {
            let slope = of_local.iter().find(|(of, _)| of == column).map_or(0.0, |(_, slope)| *slope);
            variance += slope * slope * model.stop_offsets.of(Some(*hop)).variance;
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
