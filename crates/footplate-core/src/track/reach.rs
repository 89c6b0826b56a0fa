//! Reaches: the sensors that may report next if some before them stay silent.
//!
//! Detections are missed now and then: E11 reports after C15, and D12 between them was silent. A reach is one to
//! [`MAX_MISSED`] + 1 hops in a row; all but its last sensor were missed.

use alloc::collections::BTreeMap;
use alloc::vec::Vec;

use crate::ids::{EdgeId, NodeId, SensorId};
use crate::track::{Hop, HopId, Layout, Position, TurnoutStates};
use crate::units::Length;

/// Most missed sensors in a row. Where sensors do not latch, two of five passages at a high speed are missed, and eight in a row
/// are one in a thousand: beyond that a train is lost and must be located again, not predicted.
pub const MAX_MISSED: usize = 8;

const MAX_HOPS: usize = MAX_MISSED + 1;

/// A path to a sensor that may report next, past sensors that stayed silent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reach {
    /// The node of the sensor or track end it reaches.
    pub to: NodeId,
    /// The sensor there; `None` at the end of a track.
    pub sensor: Option<SensorId>,
    /// The distance to it.
    pub length: Length,
    hops: [HopId; MAX_HOPS],
    count: u8,
}

impl Reach {
    /// Its hops in the order of travel, at least one.
    #[inline]
    #[must_use]
    pub fn hops(&self) -> &[HopId] {
        self.hops.get(..usize::from(self.count)).unwrap_or_default()
    }

    /// The number of silent sensors that it passes.
    #[inline]
    #[must_use]
    pub const fn missed(&self) -> usize {
        (self.count as usize).saturating_sub(1)
    }
}

impl Layout {
    /// Every sensor and track end ahead of a node that a train may reach next, with up to `missed` silent sensors in
    /// between (at most [`MAX_MISSED`]). Depth first: a sensor comes before those beyond it. A turnout that a path
    /// passes twice may be thrown in between, so each passage counts by itself. Allocates nothing.
    #[inline]
    #[must_use]
    pub fn reaches<'l>(&'l self, from: NodeId, turnouts: &'l TurnoutStates, missed: usize) -> Reaches<'l> {
        Reaches::new(self, from, None, turnouts, missed)
    }

    /// The same for a train at a position, with distances from there. The edge of its position shows how the turnout
    /// at the start of that edge was set. A position of another layout gives no reaches.
    #[inline]
    #[must_use]
    pub fn reaches_ahead<'l>(
        &'l self,
        position: Position,
        turnouts: &'l TurnoutStates,
        missed: usize,
    ) -> Reaches<'l> {
        // No hop begins on an unknown edge.
        let from = self.edge(position.edge).map_or(NodeId(0), |edge| edge.from);
        Reaches::new(self, from, Some(position), turnouts, missed)
    }

    /// The edges that begin within distances from the starts of some edges, over both legs of every turnout, each with the longest
    /// distance that is left where it begins.
    #[must_use]
    pub(crate) fn edges_within(
        &self,
        from: impl IntoIterator<Item = (EdgeId, Length)>,
    ) -> BTreeMap<EdgeId, Length> {
        let mut found: BTreeMap<EdgeId, Length> = BTreeMap::new();
        let mut open = Vec::from_iter(from);
        while let Some((id, left)) = open.pop() {
            let Some(edge) = self.edge(id).filter(|_| left > Length::ZERO) else { continue };
            if found.get(&id).is_none_or(|known| *known < left) {
                found.insert(id, left);
                open.extend(self.outgoing(edge.to).edges().map(|next| (next, left - edge.length)));
            }
        }
        found
    }

    /// The edges of a reach in the order of travel.
    pub fn edges_of(&self, reach: Reach) -> impl Iterator<Item = EdgeId> {
        (0..usize::from(reach.count))
            .filter_map(move |place| self.hop(*reach.hops.get(place)?))
            .flat_map(|hop| hop.edges.iter().copied())
    }
}

/// The iterator of [`Layout::reaches`].
#[derive(Debug, Clone)]
pub struct Reaches<'l> {
    layout: &'l Layout,
    turnouts: &'l TurnoutStates,
    /// The level of the last hop that may be added.
    deepest: usize,
    /// The edge on which every reach begins, if it is given.
    first_edge: Option<EdgeId>,
    levels: [Level; MAX_HOPS],
    level: usize,
}

/// State of the search after a number of hops.
#[derive(Debug, Clone, Copy)]
struct Level {
    /// The range of hops still to be tried; the end is exclusive.
    open: (u32, u32),
    /// The distance to their start.
    length: Length,
    /// The hop tried last.
    last: HopId,
}

impl<'l> Reaches<'l> {
    #[inline]
    fn new(
        layout: &'l Layout,
        from: NodeId,
        position: Option<Position>,
        turnouts: &'l TurnoutStates,
        missed: usize,
    ) -> Self {
        let open = layout.hops.range_from(from);
        let length = position.map_or(Length::ZERO, |position| -position.offset);
        Self {
            layout,
            turnouts,
            deepest: missed.min(MAX_MISSED),
            first_edge: position.map(|position| position.edge),
            levels: [Level { open, length, last: HopId::default() }; MAX_HOPS],
            level: 0,
        }
    }

    /// Whether a hop at the present level can be taken.
    #[inline]
    fn is_open(&self, hop: &Hop<'_>) -> bool {
        let Some(first) = self.first_edge.filter(|_| self.level == 0) else {
            return hop.is_open(self.turnouts);
        };
        let is_decided = self.layout.edge(first).is_some_and(|edge| edge.leg.is_some());
        let mut needs = hop.needs.iter().skip(usize::from(is_decided));
        hop.edges.first() == Some(&first) && needs.all(|need| self.turnouts.allow(*need))
    }
}

impl Iterator for Reaches<'_> {
    type Item = Reach;

    #[inline]
    fn next(&mut self) -> Option<Reach> {
        loop {
            let level = self.levels.get_mut(self.level)?;
            if level.open.0 >= level.open.1 {
                self.level = self.level.checked_sub(1)?;
                continue;
            }
            level.last = HopId(level.open.0);
            level.open.0 += 1;
            let begins_at = level.length;
            let hop = self.layout.hop(level.last)?;
            if !self.is_open(&hop) {
                continue;
            }
            let length = begins_at + hop.length;
            let reach = Reach {
                to: hop.to,
                sensor: hop.sensor,
                length,
                hops: self.levels.map(|level| level.last),
                count: self.level as u8 + 1,
            };
            if self.level < self.deepest && hop.sensor.is_some() {
                self.level += 1;
                let next = self.levels.get_mut(self.level)?;
                *next = Level { open: self.layout.hops.range_from(hop.to), length, last: hop.id };
            }
            return Some(reach);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ids::TurnoutId;
    use crate::track::Leg;
    use crate::track::example::oval;
    use std::format;
    use std::string::String;
    use std::vec::Vec;

    fn reaches(from: &str, turnouts: &TurnoutStates, missed: usize) -> Vec<String> {
        let layout = oval();
        let from = layout.node_named(from).unwrap();
        let text = |reach: Reach| {
            let length: Length =
                layout.edges_of(reach).filter_map(|edge| layout.edge(edge)).map(|edge| edge.length).sum();
            assert!((length - reach.length).abs() < Length::from_mm(1e-9));
            assert_eq!(reach.sensor, layout.sensor_at(reach.to));
            format!("{} {:.0} past {}", layout.node_name(reach.to), reach.length.as_mm(), reach.missed())
        };
        layout.reaches(from, turnouts, missed).map(text).collect()
    }

    #[test]
    fn without_missed_sensors_reaches_are_hops() {
        assert_eq!(reaches("A1", &TurnoutStates::unknown(), 0), ["B1 300 past 0", "C1 320 past 0"]);
    }

    #[test]
    fn a_missed_sensor_is_followed_by_those_behind_it() {
        let curved: TurnoutStates = [(TurnoutId(1), Leg::Curved)].into_iter().collect();
        assert_eq!(reaches("A1", &curved, 2), ["C1 320 past 0", "D1 570 past 1", "A1 1070 past 2"]);
        assert_eq!(
            reaches("A1", &TurnoutStates::unknown(), 1),
            ["B1 300 past 0", "D1 600 past 1", "C1 320 past 0", "D1 570 past 1"]
        );
    }

    #[test]
    fn the_end_of_the_track_ends_a_reach() {
        assert_eq!(reaches("EN1", &TurnoutStates::unknown(), 3), ["E1 30 past 0", "EX2 70 past 1"]);
        assert!(reaches("EX2", &TurnoutStates::unknown(), 3).is_empty());
    }

    #[test]
    fn a_moving_train_reaches_what_is_ahead_of_it() {
        let layout = oval();
        let node = |name| layout.node_named(name).unwrap();
        let edge = layout.edge_between(node("BR1"), node("C1")).unwrap();
        let position = Position { edge, offset: Length::from_mm(50.0) };
        // It is on the curved leg, whatever the turnout position since.
        let straight: TurnoutStates = [(TurnoutId(1), Leg::Straight)].into_iter().collect();
        let reached: Vec<_> = layout
            .reaches_ahead(position, &straight, 1)
            .map(|reach| format!("{} {:.0}", layout.node_name(reach.to), reach.length.as_mm()))
            .collect();
        assert_eq!(reached, ["C1 170", "D1 420"]);

        let edge = layout.edge_between(node("A1"), node("BR1")).unwrap();
        let position = Position { edge, offset: Length::from_mm(90.0) };
        let sensors: Vec<_> =
            layout.reaches_ahead(position, &straight, 0).map(|reach| layout.node_name(reach.to)).collect();
        assert_eq!(sensors, ["B1"], "the turnout still decides");
        let elsewhere = Position { edge: EdgeId(999), offset: Length::ZERO };
        assert_eq!(layout.reaches_ahead(elsewhere, &straight, 3).count(), 0);
    }

    #[test]
    fn no_more_sensors_are_looked_past_than_the_most() {
        let straight: TurnoutStates = [(TurnoutId(1), Leg::Straight)].into_iter().collect();
        let deep = reaches("A1", &straight, usize::MAX);
        assert_eq!(deep.len(), MAX_MISSED + 1);
        assert_eq!(deep.last().unwrap(), "A1 3300 past 8");
    }
}
