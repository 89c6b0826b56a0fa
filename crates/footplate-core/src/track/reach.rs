//! Reaches: the sensors that may report next if some before them stay silent.
//!
//! Detections are missed now and then: E11 reports after C15, and D12 between them was silent. A reach is one to
//! [`MAX_MISSED`] + 1 hops in a row; all but its last sensor were missed.

use alloc::collections::BTreeMap;
use alloc::vec::Vec;

use crate::ids::{EdgeId, NodeId, SensorId};
use crate::track::{HopId, Layout, TurnoutStates};
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
    pub fn hops(&self) -> &[HopId] {
        self.hops.get(..usize::from(self.count)).unwrap_or_default()
    }

    /// The number of silent sensors that it passes.
    #[inline]
    pub const fn missed(&self) -> usize {
        (self.count as usize).saturating_sub(1)
    }
}

impl Layout {
    /// Every sensor and track end ahead of a node that a train may reach next, with up to `missed` silent sensors in
    /// between (at most [`MAX_MISSED`]). Depth first: a sensor comes before those beyond it. A turnout that a path
    /// passes twice may be thrown in between, so each passage counts by itself. Allocates nothing.
    #[inline]
    pub fn reaches<'l>(&'l self, from: NodeId, turnouts: &'l TurnoutStates, missed: usize) -> Reaches<'l> {
        Reaches::new(self, from, turnouts, missed)
    }

    /// The edges that begin within distances from the starts of some edges, over both legs of every turnout, each with the longest
    /// distance that is left where it begins.
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
}

/// The iterator of [`Layout::reaches`].
#[derive(Debug, Clone)]
pub struct Reaches<'l> {
    layout: &'l Layout,
    turnouts: &'l TurnoutStates,
    /// The level of the last hop that may be added.
    deepest: usize,
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
    fn new(layout: &'l Layout, from: NodeId, turnouts: &'l TurnoutStates, missed: usize) -> Self {
        let open = layout.hops.range_from(from);
        Self {
            layout,
            turnouts,
            deepest: missed.min(MAX_MISSED),
            levels: [Level { open, length: Length::ZERO, last: HopId::default() }; MAX_HOPS],
            level: 0,
        }
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
            if !hop.is_open(self.turnouts) {
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
            let length: Length = reach.hops().iter().map(|hop| layout.hop(*hop).unwrap().length).sum();
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
    fn no_more_sensors_are_looked_past_than_the_most() {
        let straight: TurnoutStates = [(TurnoutId(1), Leg::Straight)].into_iter().collect();
        let deep = reaches("A1", &straight, usize::MAX);
        assert_eq!(deep.len(), MAX_MISSED + 1);
        assert_eq!(deep.last().unwrap(), "A1 3300 past 8");
    }
}
