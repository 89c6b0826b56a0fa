//! The true motion of a train in surveyed lengths.
//!
//! True lengths differ from surveyed ones by centimetres, which no driver can know. So positions are relative to sensors: a
//! sensor is at its surveyed place, and between two sensors the train has run the same share of the surveyed distance as of
//! the true one.

use footplate_core::track::{Layout, TurnoutStates};
use footplate_core::{NodeId, TimeSpan, Timestamp, TrainId};
use footplate_sim::living::Truth;

use crate::testbed::VirtualLine;

/// The interval of samples: between two of them, linear interpolation is accurate to a tenth of a millimetre.
pub(super) const LOOK: TimeSpan = TimeSpan::from_ms(50);

/// The samples of the odometer of one train.
#[derive(Debug, Clone, Default)]
pub(super) struct Odometer(Vec<(Timestamp, f64)>);

impl Odometer {
    /// Takes a sample.
    pub(super) fn look(&mut self, line: &VirtualLine<'_>, train: TrainId) {
        let truth = line.station.world.truth().train(train);
        self.0.extend(truth.map(|truth| (line.now(), truth.odometer.as_mm())));
    }

    /// The samples since a time: when, and the distance (mm).
    pub(super) fn since(&self, since: Timestamp) -> impl Iterator<Item = (Timestamp, f64)> {
        self.0.iter().copied().filter(move |(at, _)| *at >= since)
    }
}

/// A passage of a sensor.
#[derive(Debug, Clone, Copy)]
pub(super) struct Mark {
    pub(super) node: NodeId,
    pub(super) at: Timestamp,
    odometer: f64,
    /// The surveyed distance from the first sensor (mm).
    pub(super) surveyed: f64,
}

/// The path of a train from sensor to sensor.
#[derive(Debug, Clone, Default)]
pub(super) struct TruePath {
    pub(super) marks: Vec<Mark>,
}

impl TruePath {
    /// The path of a train since a time, up to the first passage that the layout does not explain.
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

    /// The surveyed distance (mm) at a reading of the odometer; `None` before the first sensor and after the last.
    pub(super) fn surveyed(&self, odometer: f64) -> Option<f64> {
        let next = self.marks.partition_point(|mark| mark.odometer <= odometer);
        let [from, to] = [self.marks.get(next.checked_sub(1)?)?, self.marks.get(next)?];
        let part = (odometer - from.odometer) / (to.odometer - from.odometer);
        Some(from.surveyed + part * (to.surveyed - from.surveyed))
    }

    /// The last passage before a time.
    pub(super) fn before(&self, at: Timestamp) -> Option<&Mark> {
        self.marks.iter().rev().find(|mark| mark.at <= at)
    }
}
