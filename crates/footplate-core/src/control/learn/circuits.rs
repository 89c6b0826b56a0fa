//! Circuits: which one to run on, its turnouts, and the turnouts and track ends around the train.
//!
//! If lengths are unknown or wrong, the train changes circuits until every section was passed a few times.

use alloc::collections::{BTreeMap, BTreeSet};
use alloc::vec;
use alloc::vec::Vec;

use super::activity::Activity;
use super::calibrator::Calibrator;
use super::notice::CalibrationNotice;
use crate::ids::{NodeId, TurnoutId};
use crate::time::Timestamp;
use crate::track::{Circuit, Hop, HopId, Layout, Leg, NodeKind, TurnoutStates};
use crate::units::Length;

/// A section is known well after this many passages: one measures its length within 10 to 15 mm (a poll at both
/// ends), and no number of passages reduces the effect of curves on the path length, 8 mm of a usual section.
const ENOUGH: u32 = 4;

/// A change of circuit is worth its time if the other one needs this many passages more.
const WORTH_CHANGING: usize = 4;

/// A measured section needs this many times as many passages if others were not measured: it is their scale.
const MEASURED: u32 = 3;

/// Nodes that a search around the train may pass: far more than lie within a few metres of any train.
const MAX_PASSED: usize = 256;

/// The number of passages of each section, and the last sensor passed.
#[derive(Debug, Clone, Default)]
pub(super) struct Passes {
    of: BTreeMap<usize, u32>,
    at: Option<NodeId>,
}

impl<'l> Calibrator<'l> {
    /// Whether lengths have to be measured.
    fn surveys(&self) -> bool {
        self.survey_test.factor > 1.0 || !self.survey_test.odd.is_empty() || !self.layout.is_measured()
    }

    /// Counts a passage, after the train passed a sensor.
    pub(super) fn count_passage(&mut self, node: NodeId) {
        let hop = self.passes.at.replace(node).and_then(|from| self.only_hop(from, node));
        if let Some(section) = hop.and_then(|hop| self.sections.section(hop.id)) {
            *self.passes.of.entry(section).or_default() += 1;
        }
    }

    /// The hop between two nodes; `None` if unknown turnouts leave several.
    pub(super) fn only_hop(&self, from: NodeId, to: NodeId) -> Option<Hop<'l>> {
        let mut hops = self.layout.hops_from(from).filter(|hop| hop.to == to && hop.is_open(&self.turnouts));
        hops.next().filter(|_| hops.next().is_none())
    }

    /// The number of passages that a hop still needs.
    fn wanted(&self, hop: HopId) -> usize {
        let section = self.sections.section(hop);
        let passed = section.and_then(|section| self.passes.of.get(&section)).copied().unwrap_or(0);
        let is_the_measure = self.sections.is_measured(hop) && !self.layout.is_measured();
        let enough = if is_the_measure { MEASURED * ENOUGH } else { ENOUGH };
        enough.saturating_sub(passed) as usize
    }

    fn wanted_on(&self, circuit: &Circuit) -> usize {
        circuit.lap.iter().map(|hop| self.wanted(*hop)).sum()
    }

    /// The circuit to run on from a node: the one with the most sensors or, if lengths are unknown, the one that
    /// needs the most passages.
    pub(super) fn best_circuit(
        &self,
        node: NodeId,
        locked: &BTreeMap<TurnoutId, Option<Leg>>,
    ) -> Option<Circuit> {
        let avoid = &self.settings.avoid;
        let unknown = self.surveys().then(|| {
            let circuit = self.layout.circuit_over(node, locked, avoid, &|hop| self.wanted(hop));
            circuit.filter(|circuit| self.wanted_on(circuit) > 0)
        });
        unknown.flatten().or_else(|| self.layout.circuit_from(node, locked, avoid))
    }

    /// Changes to a circuit that needs more passages; `false` if there is none.
    pub(super) fn change_circuit(&mut self, now: Timestamp) -> bool {
        if !self.surveys() {
            return false;
        }
        let (Some(here), Some(node)) = (&self.circuit, self.tracker.last()) else { return false };
        let wanted = self.wanted_on(here);
        let locked = self.locked(node);
        let other = self.best_circuit(node, &locked);
        let Some(other) = other.filter(|other| self.wanted_on(other) >= wanted + WORTH_CHANGING) else {
            return false;
        };
        self.notify(CalibrationNotice::Circuit(other.clone()));
        self.circuit = Some(other);
        self.activity = Activity::Joining;
        self.throw_turnouts(now, node);
        self.expect_detection(now);
        self.go_on_if_set(now, node);
        true
    }

    /// The same for a train at rest within an experiment. Turnouts that a moving train is always too near to, because the
    /// lengths before them are unknown, can be thrown then. Returns how many were commanded; `None` if nothing changes.
    pub(super) fn change_circuit_at_rest(&mut self, now: Timestamp) -> Option<usize> {
        if self.layout.is_measured() {
            return None;
        }
        let node = self.tracker.last()?;
        let locked = self.locked_at_rest(now, node)?;
        let wanted = self.wanted_on(self.circuit.as_ref()?);
        let other = self.best_circuit(node, &locked)?;
        if self.wanted_on(&other) < wanted + WORTH_CHANGING {
            return None;
        }
        self.notify(CalibrationNotice::Circuit(other.clone()));
        self.circuit = Some(other);
        Some(self.throw_unlocked(now, node, &locked, false))
    }
}

/// The turnouts within a distance ahead of a node, on any branch.
pub(super) fn turnouts_within(layout: &Layout, from: NodeId, distance: Length) -> BTreeSet<TurnoutId> {
    let mut found = BTreeSet::new();
    let mut open = vec![(from, distance)];
    let mut passed = 0;
    while let Some((node, left)) = open.pop() {
        passed += 1;
        if passed > MAX_PASSED {
            break;
        }
        if let Some(NodeKind::Branch(turnout) | NodeKind::Merge(turnout)) =
            layout.node(node).map(|node| node.kind)
        {
            found.insert(turnout);
        }
        for edge in layout.outgoing(node).edges().filter_map(|id| layout.edge(id)) {
            let length = edge.known.shortest();
            if length <= left {
                open.push((edge.to, left - length));
            }
        }
    }
    found
}

/// The turnouts that a train may occupy, or reach before they are thrown, with their known positions.
pub(super) fn locked_turnouts(
    layout: &Layout,
    turnouts: &TurnoutStates,
    node: NodeId,
    ahead: Length,
    behind: Length,
) -> BTreeMap<TurnoutId, Option<Leg>> {
    let mut near = turnouts_within(layout, node, ahead);
    near.extend(turnouts_within(layout, node.reverse(), behind));
    near.into_iter().map(|turnout| (turnout, turnouts.get(turnout))).collect()
}

/// The shortest distance to the end of the track, over both legs of unknown turnouts; `None` if it is beyond
/// `distance`.
pub(super) fn end_within(
    layout: &Layout,
    turnouts: &TurnoutStates,
    node: NodeId,
    distance: Length,
) -> Option<Length> {
    let mut nearest: Option<Length> = None;
    let mut open = vec![(node, Length::ZERO)];
    let mut passed = 0;
    while let Some((node, gone)) = open.pop() {
        passed += 1;
        if passed > MAX_PASSED {
            break;
        }
        for hop in layout.open_hops_from(node, turnouts) {
            let length = gone + layout.least_length(&hop);
            if length > distance {
                continue;
            }
            if hop.sensor.is_some() {
                open.push((hop.to, length));
            } else {
                nearest = Some(nearest.map_or(length, |other| other.min(length)));
            }
        }
    }
    nearest
}

/// The path on a circuit from a node: the lead first, then the lap repeatedly; empty if the node is not on it.
pub(super) fn path_from(layout: &Layout, circuit: &Circuit, node: NodeId) -> impl Iterator<Item = HopId> {
    let all = circuit.lead.len() + circuit.lap.len();
    let starts = |id: &HopId| layout.hop(*id).is_some_and(|hop| hop.from == node);
    let at = circuit.hops().take(all).position(|id| starts(&id));
    let steps = at.map_or(0, |_| all);
    circuit.hops().skip(at.unwrap_or(0)).take(steps)
}

/// The turnout positions that a circuit needs ahead of a node, nearest first, each for its next passage, with the least distance
/// after which it is needed.
pub(super) fn wanted_legs(layout: &Layout, circuit: &Circuit, node: NodeId) -> Vec<(TurnoutId, Leg, Length)> {
    let mut wanted: Vec<(TurnoutId, Leg, Length)> = Vec::new();
    let mut gone = Length::ZERO;
    for hop in path_from(layout, circuit, node).filter_map(|id| layout.hop(id)) {
        for need in hop.needs {
            if wanted.iter().all(|(turnout, ..)| *turnout != need.turnout) {
                wanted.push((need.turnout, need.leg, gone));
            }
        }
        gone += layout.least_length(&hop);
    }
    wanted
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::track::example::oval;

    fn node(layout: &Layout, name: &str) -> NodeId {
        layout.node_named(name).unwrap()
    }

    #[test]
    fn turnouts_ahead_of_and_under_the_train_are_locked() {
        let layout = oval();
        let mm = Length::from_mm;
        let locked = |name, ahead, behind| {
            let locked = locked_turnouts(
                &layout,
                &TurnoutStates::unknown(),
                node(&layout, name),
                mm(ahead),
                mm(behind),
            );
            locked.into_keys().map(|turnout| turnout.0).collect::<Vec<_>>()
        };
        assert_eq!(locked("A1", 99.0, 0.0), [0_u16; 0]);
        assert_eq!(locked("A1", 100.0, 0.0), [1]);
        assert_eq!(locked("B1", 200.0, 199.0), [2]);
        assert_eq!(locked("B1", 199.0, 220.0), [1]);
    }

    #[test]
    fn a_track_end_is_found_beyond_a_sensor_and_none_on_a_circuit() {
        let layout = oval();
        let end = |name, mm| {
            end_within(&layout, &TurnoutStates::unknown(), node(&layout, name), Length::from_mm(mm))
        };
        assert_eq!(end("EN1", 100.0).map(|end| libm::round(end.as_mm())), Some(70.0));
        assert_eq!(end("EN1", 69.0), None);
        assert_eq!(end("A1", 3_000.0), None);
    }

    #[test]
    fn the_path_of_a_circuit_continues_from_any_of_its_nodes() {
        let layout = oval();
        let circuit = layout.circuit_from(node(&layout, "A1"), &BTreeMap::new(), &[]).unwrap();
        let names = |from| {
            let hops = path_from(&layout, &circuit, node(&layout, from)).filter_map(|id| layout.hop(id));
            hops.map(|hop| layout.node_name(hop.to)).collect::<Vec<_>>()
        };
        assert_eq!(names("B1"), ["D1", "A1", "B1"]);
        assert!(names("C1").is_empty());
        let wanted = wanted_legs(&layout, &circuit, node(&layout, "B1"));
        let mm = Length::from_mm;
        assert_eq!(
            wanted,
            [(TurnoutId(2), Leg::Straight, mm(0.0)), (TurnoutId(1), Leg::Straight, mm(800.0))]
        );
    }
}
