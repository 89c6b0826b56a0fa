//! Occupancy detectors of blocks: what they add to the time at which a train comes into their block and leaves it.

use std::collections::BTreeMap;

use footplate_core::track::Layout;
use footplate_core::{SensorId, TimeSpan};

use crate::draws::Draws;

/// From current in a block to the report (chosen: detectors filter a few periods of the digital signal).
const PICKUP_S: core::ops::Range<f64> = 0.005..0.025;
/// How long the detectors of one layout go on reporting a train that has left (makers state 0.3 to 2 s, against flicker).
const RELEASE_S: core::ops::Range<f64> = 0.3..2.0;
/// Detectors of one make differ in that by their capacitors (chosen; one standard deviation).
const RELEASE_DEVIATION: f64 = 0.02;
/// And each from release to release (chosen).
const RELEASE_SCATTER_S: f64 = 0.015;
/// A wheel on dirt interrupts the current so long after a train came in, and for so long (chosen).
const DARK_AFTER_S: core::ops::Range<f64> = 0.1..1.5;
const DARK_S: core::ops::Range<f64> = 0.05..0.8;

/// The times of one detector, in s.
#[derive(Debug, Clone, Copy)]
struct Delays {
    pickup: f64,
    release: f64,
}

/// The detectors of a layout.
#[derive(Debug, Clone)]
pub(crate) struct Detectors {
    /// The detector of each entry of a block.
    entries: BTreeMap<SensorId, SensorId>,
    delays: BTreeMap<SensorId, Delays>,
    draws: Draws,
}

impl Detectors {
    /// Those of a layout; nothing is drawn for a layout without blocks.
    pub(crate) fn draw(layout: &Layout, faults: &mut Draws) -> Self {
        let mut draws = if layout.blocks().is_empty() { faults.clone() } else { faults.split() };
        let entries = layout.blocks().iter().flat_map(|block| {
            let detector = block.detector;
            block.entries.iter().map(move |entry| (*entry, detector))
        });
        let entries = entries.collect();
        let mut delays = BTreeMap::new();
        if !layout.blocks().is_empty() {
            let usual = draws.uniform(RELEASE_S);
            for block in layout.blocks() {
                let release = draws.normal_within(usual, RELEASE_DEVIATION * usual, 2.5);
                delays.insert(block.detector, Delays { pickup: draws.uniform(PICKUP_S), release });
            }
        }
        Self { entries, delays, draws }
    }

    /// The detector that a train trips at a sensor; `None` where a shoe closes the sensor.
    pub(crate) fn at(&self, sensor: SensorId) -> Option<SensorId> {
        self.entries.get(&sensor).copied()
    }

    /// The sensors of a layout as the station knows them: those that shoes close, and detectors.
    pub(crate) fn inputs(&self, layout: &Layout) -> Vec<SensorId> {
        let closed = layout.sensors().map(|(sensor, _)| sensor).filter(|sensor| self.at(*sensor).is_none());
        closed.chain(self.delays.keys().copied()).collect()
    }

    /// How long after a train came in its detector reports it.
    pub(crate) fn pickup(&self, detector: SensorId) -> TimeSpan {
        TimeSpan::from_s(self.delays.get(&detector).map_or(0.0, |delays| delays.pickup))
    }

    /// How long after a train left its detector reports that, this time.
    pub(crate) fn release(&mut self, detector: SensorId) -> TimeSpan {
        let usual = self.delays.get(&detector).map_or(0.0, |delays| delays.release);
        TimeSpan::from_s(self.draws.normal_within(usual, RELEASE_SCATTER_S, 2.5).max(0.0))
    }

    /// The usual release delay of a detector.
    pub(crate) fn usual_release(&self, detector: SensorId) -> Option<TimeSpan> {
        self.delays.get(&detector).map(|delays| TimeSpan::from_s(delays.release))
    }

    /// When after a train came in its detector reports the block free, and when occupied again, if dirty wheels make it flicker
    /// this time. A short interruption ends before the release delay does.
    pub(crate) fn flicker(&mut self, detector: SensorId, chance: f64) -> Option<[TimeSpan; 2]> {
        if !self.draws.chance(chance) {
            return None;
        }
        let began = self.draws.uniform(DARK_AFTER_S);
        let ended = began + self.draws.uniform(DARK_S);
        let reported = began + self.release(detector).as_s();
        (reported < ended).then(|| [reported, ended].map(TimeSpan::from_s))
    }
}
