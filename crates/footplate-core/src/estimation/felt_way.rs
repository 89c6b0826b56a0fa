//! Ways in a train's own measure: from contact to contact, to a place on the layout, and back.

use super::ground::Ground;
use super::locator::WayPoint;
use crate::calibration::motion::{Guess, MotionModel};
use crate::ids::{NodeId, SensorId};
use crate::track::{Hop, Layout, Position, Reach};
use crate::units::Length;

/// Contacts that may stay silent in a row before the way is no longer believed.
const BELIEVED_MISSED: usize = 2;
/// One contact in so many stays silent, as ln: dirty track, a light pickup (chosen; the trains of the course miss fewer).
const LOG_MISSED: f64 = -3.9;
/// The same where trains are told apart, as ln: 0.3 % on a layout that is looked after (chosen from what course reports
/// complain about). What a single train is followed past may be more, because nothing else is there to explain it.
pub(super) const LOG_CHANCE_OF_SILENCE: f64 = -5.809;
/// Hops that a way to a place may take: more than a lap of any layout in use.
const MOST_HOPS: usize = 200;

/// A way to a contact, past contacts that stayed silent, as a train feels it.
#[derive(Debug, Clone, Copy)]
pub(super) struct FeltReach {
    /// Its length (m).
    pub(super) length: Guess,
    /// Contacts on the way that did not report.
    pub(super) missed: usize,
}

impl FeltReach {
    /// ln of the chance that those contacts stay silent.
    pub(super) fn log_chance(&self) -> f64 {
        LOG_MISSED * self.missed as f64
    }
}

/// A hop as a train feels it (m).
pub(super) fn felt_reach(ground: Ground<'_>, model: &MotionModel, hop: &Hop<'_>) -> Guess {
    let [length, uncertainty] = model.length(ground.sections, hop).map(Length::as_m);
    Guess { mean: length, variance: uncertainty * uncertainty }
}

fn felt(ground: Ground<'_>, model: &MotionModel, layout: &Layout, reach: &Reach) -> FeltReach {
    let hops = reach.hops().iter().filter_map(|hop| layout.hop(*hop));
    let length = hops.map(|hop| felt_reach(ground, model, &hop)).fold(
        Guess { mean: 0.0, variance: 0.0 },
        |sum, hop| Guess { mean: sum.mean + hop.mean, variance: sum.variance + hop.variance },
    );
    FeltReach { length, missed: reach.missed() }
}

/// Every way from a node to a sensor that is open as far as the turnouts are known.
pub(super) fn felt_reaches<'g>(
    ground: Ground<'g>,
    model: &'g MotionModel,
    from: NodeId,
    sensor: SensorId,
) -> impl Iterator<Item = FeltReach> + 'g {
    ground
        .layout
        .reaches(from, ground.turnouts, BELIEVED_MISSED)
        .filter(move |reach| reach.sensor == Some(sensor))
        .map(move |reach| felt(ground, model, ground.layout, &reach))
}

/// The way from a waypoint's node to a place on the layout, as the train feels it and as the turnouts lie; `None` if
/// none leads there within one lap.
#[must_use]
pub fn way_to(ground: Ground<'_>, model: &MotionModel, from: NodeId, to: Position) -> Option<Length> {
    let mut way = Length::ZERO;
    for (count, hop) in ground.hops_ahead(from).take(MOST_HOPS).enumerate() {
        if count > 0 && hop.from == from {
            return None;
        }
        let [felt, _] = model.length(ground.sections, &hop);
        let mut along = Length::ZERO;
        for id in hop.edges {
            if *id == to.edge {
                return Some(way + felt * part(along + to.offset, hop.length));
            }
            along += ground.layout.edge(*id)?.length;
        }
        way += felt;
    }
    None
}

fn part(of: Length, whole: Length) -> f64 {
    if whole > Length::ZERO { of / whole } else { 0.0 }
}

/// The place on the layout of a point on the way, as the turnouts lie; for a point behind its node, the node.
#[must_use]
pub fn place_of(ground: Ground<'_>, model: &MotionModel, at: WayPoint) -> Option<Position> {
    let mut left = at.way.max(Length::ZERO);
    for hop in ground.hops_ahead(at.node).take(MOST_HOPS) {
        let [felt, _] = model.length(ground.sections, &hop);
        if left > felt && hop.sensor.is_some() {
            left -= felt;
            continue;
        }
        let mut along = (hop.length * part(left, felt)).min(hop.length);
        let mut last = None;
        for id in hop.edges {
            let length = ground.layout.edge(*id)?.length;
            if along <= length {
                return Some(Position { edge: *id, offset: along });
            }
            along -= length;
            last = Some(Position { edge: *id, offset: length });
        }
        return last;
    }
    None
}
