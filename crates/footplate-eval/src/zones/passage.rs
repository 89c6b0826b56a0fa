//! Trains in zones as they really were: how fast, and how long.

use std::collections::BTreeMap;

use footplate_core::track::{Layout, Zone};
use footplate_core::{Timestamp, TrainId};
use footplate_sim::living::Truth;

/// One train's way through one zone, from its front end's coming there until its rear end has left.
#[derive(Debug, Clone)]
pub(super) struct Passage {
    /// The zone's limit (mm/s).
    pub(super) limit: f64,
    /// The fastest that it was (mm/s).
    pub(super) fastest: f64,
    /// How long it took (s), and how far the train ran meanwhile (mm).
    pub(super) seconds: f64,
    pub(super) way: f64,
    /// How far it ran within the limit before it came there (mm).
    pub(super) early: f64,
}

/// A train that is looked at again and again.
pub(super) struct Watched<'l> {
    layout: &'l Layout,
    train: TrainId,
    /// What is under way, by the zone's name: the passage, when it began and what the odometer showed.
    open: BTreeMap<String, (Passage, Timestamp, f64)>,
    /// What the odometer showed when the train was faster than each limit for the last time.
    faster: BTreeMap<String, f64>,
    pub(super) passages: Vec<Passage>,
}

impl<'l> Watched<'l> {
    pub(super) const fn new(layout: &'l Layout, train: TrainId) -> Self {
        Self { layout, train, open: BTreeMap::new(), faster: BTreeMap::new(), passages: Vec::new() }
    }

    /// Looks once.
    pub(super) fn look(&mut self, truth: Truth<'_, '_>, now: Timestamp) {
        let Some(train) = truth.train(self.train) else { return };
        let (speed, odometer) = (train.speed.as_mm_per_s(), train.odometer.as_mm());
        let under: Vec<&Zone> =
            truth.under(self.train).filter_map(|(edge, _)| self.layout.zone(edge)).collect();
        for zone in &under {
            let limit = zone.limit.as_mm_per_s();
            let early = self.faster.get(&zone.name).map_or(f64::INFINITY, |faster| odometer - faster);
            let (passage, ..) = self.open.entry(zone.name.clone()).or_insert_with(|| {
                (Passage { limit, fastest: 0.0, seconds: 0.0, way: 0.0, early }, now, odometer)
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
                let (seconds, way) = ((now - *since).as_s(), odometer - *from);
                passages.push(Passage { seconds, way, ..passage.clone() });
            }
            is_under
        });
    }
}
