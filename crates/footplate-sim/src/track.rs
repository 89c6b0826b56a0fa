//! The true rails: not as long as surveyed, curved here, dirty there.

use std::collections::BTreeMap;

use footplate_core::track::Layout;
use footplate_core::{EdgeId, Length, Ratio, SensorId};

use crate::draws::{Draws, Purpose};

/// Standard deviation of a sensor's true place about its node (chosen: half of a survey's 10 mm).
const SENSOR_SD_MM: f64 = 5.0;
/// Share of stretches that are curves (chosen: a loop's ends and the legs of its turnouts).
const CURVED: f64 = 0.4;
/// Mean speed on a curve over that on a straight (measured: section means of trains 54 and 55 spread by 1 to 2 %).
const CURVE_FACTOR: f64 = 0.97;
/// Standard deviation of the factor of a curve (chosen).
const CURVE_FACTOR_SD: f64 = 0.012;
/// Standard deviation of the factor of a straight (chosen: joints, slope, cleanness).
const STRAIGHT_FACTOR_SD: f64 = 0.006;
/// Dirty spots per metre of rail (chosen: two or three on a loop of 5 m).
const DIRTY_PER_M: f64 = 0.5;
/// Largest relative error of a short stretch, so that no length becomes negative.
const MAX_RELATIVE_SD: f64 = 0.2;
/// Deviations beyond this many standard deviations are drawn again.
const MAX_SDS: f64 = 2.5;

/// The true properties of a stretch of rail in both directions.
#[derive(Debug, Clone, PartialEq)]
struct Rail {
    length_mm: f64,
    factor: f64,
    /// Dirty spots as parts of the length, in the direction of the stretch's first edge.
    dirty: Vec<f64>,
}

/// True lengths, sensor places, and the speed factors of the rails.
#[derive(Debug, Clone, PartialEq)]
pub struct TrueTrack {
    /// By stretch number.
    rails: Vec<Rail>,
    sensor_offsets_mm: BTreeMap<SensorId, f64>,
}

impl TrueTrack {
    /// Rails that differ from a layout as real ones do: lengths by the layout's survey uncertainty.
    pub fn draw(layout: &Layout, seed: u64) -> Self {
        let mut draws = Draws::new(seed, Purpose::Track);
        let survey_mm = layout.survey().uncertainty.as_mm();
        let mut rails: Vec<Rail> = Vec::with_capacity(layout.stretch_count());
        for (_, edge) in layout.edges().step_by(2) {
            let nominal_mm = edge.length.as_mm();
            let sd = survey_mm.min(MAX_RELATIVE_SD * nominal_mm);
            let length_mm = draws.normal_within(nominal_mm, sd, MAX_SDS);
            let (mean, factor_sd) = if draws.chance(CURVED) {
                (CURVE_FACTOR, CURVE_FACTOR_SD)
            } else {
                (1.0, STRAIGHT_FACTOR_SD)
            };
            let factor = draws.normal_within(mean, factor_sd, MAX_SDS);
            let mut dirty = Vec::new();
            let mut at = draws.waiting(DIRTY_PER_M * 1e-3);
            while at < length_mm {
                dirty.push(at / length_mm);
                at += draws.waiting(DIRTY_PER_M * 1e-3);
            }
            rails.push(Rail { length_mm, factor, dirty });
        }
        let mut track = Self { rails, sensor_offsets_mm: BTreeMap::new() };
        for (sensor, _) in layout.sensors() {
            track.sensor_offsets_mm.insert(sensor, draws.normal_within(0.0, SENSOR_SD_MM, MAX_SDS));
        }
        track
    }

    /// Rails exactly as surveyed, level, straight and clean.
    pub fn as_surveyed(layout: &Layout) -> Self {
        let rail = |length: Length| Rail { length_mm: length.as_mm(), factor: 1.0, dirty: Vec::new() };
        Self {
            rails: layout.edges().step_by(2).map(|(_, edge)| rail(edge.length)).collect(),
            sensor_offsets_mm: BTreeMap::new(),
        }
    }

    /// The true length of an edge, and of its twin; zero for an edge of another layout.
    pub fn length(&self, edge: EdgeId) -> Length {
        Length::from_mm(self.rail(edge).map_or(0.0, |rail| rail.length_mm))
    }

    /// How far past its node, in its own direction of travel, a sensor really closes.
    pub fn sensor_offset(&self, sensor: SensorId) -> Length {
        Length::from_mm(self.sensor_offsets_mm.get(&sensor).copied().unwrap_or(0.0))
    }

    /// Moves the place where a sensor closes further along, in mm.
    pub(crate) fn move_sensor(&mut self, sensor: SensorId, by_mm: f64) {
        *self.sensor_offsets_mm.entry(sensor).or_insert(0.0) += by_mm;
    }

    /// The speed factor of an edge relative to level straight track, for a train with full curve sensitivity.
    pub fn speed_factor(&self, edge: EdgeId) -> Ratio {
        Ratio::from_parts(self.rail(edge).map_or(1.0, |rail| rail.factor))
    }

    /// Dirty spots from the start of an edge, in the direction of travel, in mm.
    pub(crate) fn dirty_mm(&self, edge: EdgeId) -> Vec<f64> {
        let Some(rail) = self.rail(edge) else { return Vec::new() };
        let along = |part: &f64| if edge < edge.twin() { *part } else { 1.0 - *part };
        let mut spots: Vec<f64> = rail.dirty.iter().map(|part| along(part) * rail.length_mm).collect();
        spots.sort_by(f64::total_cmp);
        spots
    }

    fn rail(&self, edge: EdgeId) -> Option<&Rail> {
        self.rails.get(usize::from(edge.stretch().0))
    }
}
