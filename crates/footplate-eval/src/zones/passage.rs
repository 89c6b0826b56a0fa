//! The true passages of trains through zones: speed, time and distance.

use std::collections::BTreeMap;

use footplate_core::track::{Layout, Zone};
use footplate_core::{Timestamp, TrainId};
use footplate_sim::living::Truth;

/// The passage of one train through one zone, from the entry of its front end until its rear end has left.
#[derive(Debug, Clone)]
pub(super) struct Passage {
    /// The zone's limit (mm/s).
    pub(super) limit: f64,
    /// Its highest speed (mm/s).
    pub(super) fastest: f64,
    /// Its time (s), and the distance that the train ran meanwhile (mm).
    pub(super) seconds: f64,
    pub(super) distance: f64,
    /// The distance that the train ran within the limit before the zone (mm).
    pub(super) early: f64,
}

/// A train whose true position and speed are sampled.
pub(super) struct Watched<'l> {
    layout: &'l Layout,
    train: TrainId,
    /// Unfinished passages by the name of the zone, each with the time and the odometer (mm) at its start.
    open: BTreeMap<String, (Passage, Timestamp, f64)>,
    /// The odometer when the train was last faster than each limit (mm).
    faster: BTreeMap<String, f64>,
    pub(super) passages: Vec<Passage>,
}

impl<'l> Watched<'l> {
    pub(super) const fn new(layout: &'l Layout, train: TrainId) -> Self {
        Self { layout, train, open: BTreeMap::new(), faster: BTreeMap::new(), passages: Vec::new() }
    }

    /// Takes a sample.
    pub(super) fn look(&mut self, truth: Truth<'_, '_>, now: Timestamp) {
        let Some(train) = truth.train(self.train) else { return };
        let (speed, odometer) = (train.speed.as_mm_per_s(), train.odometer.as_mm());
        let under: Vec<&Zone> =
            truth.under(self.train).filter_map(|(edge, _)| self.layout.zone(edge)).collect();
        for zone in &under {
            let limit = zone.limit.as_mm_per_s();
            let early = self.faster.get(&zone.name).map_or(f64::INFINITY, |faster| odometer - faster);
            let (passage, ..) = self.open.entry(zone.name.clone()).or_insert_with(|| {
                (Passage { limit, fastest: 0.0, seconds: 0.0, distance: 0.0, early }, now, odometer)
            });
            passage.fastest = passage.fastest.max(speed);
        }
        for zone in self.layout.zones().iter().filter(|zone| speed > zone.limit.as_mm_per_s()) {
            self.faster.insert(zone.name.clone(), odometer);
        }
        let passages = &mut self.passages;
        self.open.retain(|name, (passage, since, from)| {
            let is_under = under.iter().any(|zone| zone.name == *name);
            if !is_under {
                let (seconds, distance) = ((now - *since).as_s(), odometer - *from);
                passages.push(Passage { seconds, distance, ..passage.clone() });
            }
            is_under
        });
    }
}
