//! Where a train really went, counted on the map that everybody has.
//!
//! Rails are not as long as they were surveyed, and nobody can keep a train to a millimetre of a map that is centimetres
//! off. What counts is where the train is between its contacts: a contact is where the map has it, and between two of them
//! the train is as far along the surveyed way as it is along the true one.

use footplate_core::track::{Layout, TurnoutStates};
use footplate_core::{NodeId, TimeSpan, Timestamp, TrainId};
use footplate_sim::living::Truth;

use crate::testbed::VirtualLine;

/// How often it is looked where a train is: a straight line between two looks is off by a tenth of a millimetre.
pub(super) const LOOK: TimeSpan = TimeSpan::from_ms(50);

/// What one train's odometer showed, look by look.
#[derive(Debug, Clone, Default)]
pub(super) struct Odometer(Vec<(Timestamp, f64)>);

impl Odometer {
    /// Looks once.
    pub(super) fn look(&mut self, line: &VirtualLine<'_>, train: TrainId) {
        let truth = line.station.world().truth().train(train);
        self.0.extend(truth.map(|truth| (line.now(), truth.odometer.as_mm())));
    }

    /// Looks since a time: when, and what it showed (mm).
    pub(super) fn since(&self, since: Timestamp) -> impl Iterator<Item = (Timestamp, f64)> {
        self.0.iter().copied().filter(move |(at, _)| *at >= since)
    }
}

/// A train came to a contact.
#[derive(Debug, Clone, Copy)]
pub(super) struct Mark {
    pub(super) node: NodeId,
    pub(super) at: Timestamp,
    odometer: f64,
    /// Surveyed way since the first of them (mm).
    pub(super) surveyed: f64,
}

/// A train's way from contact to contact.
#[derive(Debug, Clone, Default)]
pub(super) struct TrueWay {
    pub(super) marks: Vec<Mark>,
}

impl TrueWay {
    /// The way of a train since a time, as far as it went from contact to contact of the map.
    pub(super) fn since(
        layout: &Layout,
        turnouts: &TurnoutStates,
        truth: Truth<'_, '_>,
        train: TrainId,
        since: Timestamp,
    ) -> Self {
        let mut marks: Vec<Mark> = Vec::new();
        let passes = truth.passes().iter().filter(|pass| pass.train == Some(train) && pass.at >= since);
        for pass in passes {
            let Some(node) = layout.sensor_node(pass.sensor) else { continue };
            let before = marks.last().copied();
            let hop = before.map(|before| {
                let hop = layout.open_hops_from(before.node, turnouts).find(|hop| hop.to == node);
                hop.map(|hop| before.surveyed + hop.length.as_mm())
            });
            let surveyed = match hop {
                None => 0.0,
                Some(Some(surveyed)) => surveyed,
                Some(None) => break,
            };
            marks.push(Mark { node, at: pass.at, odometer: pass.odometer_mm, surveyed });
        }
        Self { marks }
    }

    /// The surveyed way (mm) where the odometer shows something; `None` before the first contact and behind the last.
    pub(super) fn surveyed(&self, odometer: f64) -> Option<f64> {
        let next = self.marks.partition_point(|mark| mark.odometer <= odometer);
        let [from, to] = [self.marks.get(next.checked_sub(1)?)?, self.marks.get(next)?];
        let part = (odometer - from.odometer) / (to.odometer - from.odometer);
        Some(from.surveyed + part * (to.surveyed - from.surveyed))
    }

    /// The last contact before a time.
    pub(super) fn before(&self, at: Timestamp) -> Option<&Mark> {
        self.marks.iter().rev().find(|mark| mark.at <= at)
    }
}
