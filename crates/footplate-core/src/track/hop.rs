//! Hops: the paths from a node to the sensors that may report next, in a table made once for each layout.

use alloc::vec;
use alloc::vec::Vec;
use core::ops::Range;

use crate::ids::{EdgeId, NodeId, SensorId};
use crate::track::{Layout, Leg, NodeKind, StretchLength, TurnoutNeed, TurnoutStates};
use crate::units::Length;

/// Most work to make the table, counted in edges visited and edges stored. The built-in layouts take less than a
/// thousand; a plan that needs this much has hundreds of turnouts without a sensor between them.
const MAX_TABLE_WORK: usize = 1 << 20;

/// A hop, as an index into the layout's table.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct HopId(pub(crate) u32);

impl HopId {
    /// The index as a number.
    #[inline]
    #[must_use]
    pub const fn index(self) -> usize {
        self.0 as usize
    }
}

/// A path from a node to the next sensor, or to the end of the track if there is none before it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hop<'l> {
    /// Its index in the table.
    pub id: HopId,
    /// Where it begins.
    pub from: NodeId,
    /// The node of the sensor or track end it reaches.
    pub to: NodeId,
    /// The sensor there; `None` at the end of a track.
    pub sensor: Option<SensorId>,
    /// The sum of its edges.
    pub length: Length,
    /// Its edges in the order of travel.
    pub edges: &'l [EdgeId],
    /// The turnouts on it in the order of travel, facing and trailing.
    pub needs: &'l [TurnoutNeed],
}

impl Hop<'_> {
    /// Whether no turnout on it is known to be in the other position.
    #[inline]
    pub fn is_open(&self, turnouts: &TurnoutStates) -> bool {
        self.needs.iter().all(|need| turnouts.allow(*need))
    }
}

impl Layout {
    /// All hops from a node, whatever the turnout positions. The straight leg comes before the curved one. No hop
    /// passes a node twice.
    #[inline]
    pub fn hops_from(&self, node: NodeId) -> impl Iterator<Item = Hop<'_>> {
        let (first, end) = self.hops.range_from(node);
        (first..end).filter_map(|id| self.hop(HopId(id)))
    }

    /// The hops that known turnout positions leave open: one if all are known, both legs of a turnout that is not.
    #[inline]
    pub fn open_hops_from<'l>(
        &'l self,
        node: NodeId,
        turnouts: &'l TurnoutStates,
    ) -> impl Iterator<Item = Hop<'l>> {
        self.hops_from(node).filter(move |hop| hop.is_open(turnouts))
    }

    /// A hop by its id; `None` if the id is from another layout.
    #[inline]
    pub fn hop(&self, id: HopId) -> Option<Hop<'_>> {
        self.hops.get(id)
    }

    /// A lower bound of the length of a hop (about two standard deviations). The end of an unmeasured track may be
    /// directly beyond the last sensor before it.
    pub fn least_length(&self, hop: &Hop<'_>) -> Length {
        if let Some(uncertainty) = self.surveyed_distance(hop.id) {
            return (hop.length + -2.0 * uncertainty).max(Length::ZERO);
        }
        let edges = || hop.edges.iter().filter_map(|edge| self.edge(*edge)).map(|edge| edge.known);
        if hop.sensor.is_none() && edges().any(|known| known == StretchLength::Unknown) {
            return Length::ZERO;
        }
        edges().map(StretchLength::shortest).sum()
    }

    /// All hops of the table, by the node they begin at.
    pub fn hops(&self) -> impl Iterator<Item = Hop<'_>> {
        self.nodes().flat_map(|(node, _)| self.hops_from(node))
    }
}

/// All hops of a layout, flat.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Hops {
    /// For each node the index of its first hop, and one more for the end.
    first: Vec<u32>,
    rows: Vec<Row>,
    edges: Vec<EdgeId>,
    needs: Vec<TurnoutNeed>,
}

#[derive(Debug, Clone, PartialEq)]
struct Row {
    from: NodeId,
    to: NodeId,
    sensor: Option<SensorId>,
    length: Length,
    edges: Range<u32>,
    needs: Range<u32>,
}

impl Hops {
    /// Makes the table, or returns the node at which it exceeded [`MAX_TABLE_WORK`].
    pub(crate) fn of(layout: &Layout) -> Result<Self, NodeId> {
        let mut hops = Self { first: vec![0], ..Self::default() };
        let mut work = 0;
        let mut walk = Walk { path: Vec::new(), on_path: vec![false; layout.nodes().len()] };
        for (node, _) in layout.nodes() {
            walk.mark(node, true);
            let mut open: Vec<(usize, EdgeId)> = vec![];
            open.extend(layout.outgoing(node).edges().rev().map(|edge| (0, edge)));
            while let Some((depth, id)) = open.pop() {
                let Some(edge) = layout.edge(id) else { continue };
                work += 1;
                walk.back_to(depth);
                let ends = layout.node(edge.to).map(|node| node.kind);
                if matches!(ends, Some(NodeKind::Sensor(_) | NodeKind::Exit)) {
                    walk.path.push((id, None));
                    work += hops.push(layout, node, &walk.path);
                } else if walk.enter(id, edge.to) {
                    open.extend(layout.outgoing(edge.to).edges().rev().map(|edge| (depth + 1, edge)));
                }
                if work > MAX_TABLE_WORK {
                    return Err(node);
                }
            }
            walk.back_to(0);
            walk.mark(node, false);
            hops.first.push(hops.rows.len() as u32);
        }
        Ok(hops)
    }

    /// Stores a hop unless it needs both turnouts of a pair curved; returns the number of edges stored.
    fn push(&mut self, layout: &Layout, from: NodeId, path: &[(EdgeId, Option<NodeId>)]) -> usize {
        let (first_edge, first_need) = (self.edges.len() as u32, self.needs.len());
        let Some(to) = path.last().and_then(|(id, _)| layout.edge(*id)).map(|edge| edge.to) else { return 0 };
        self.edges.extend(path.iter().map(|(id, _)| *id));
        let needs = path.iter().flat_map(|(id, _)| layout.needs_of(*id));
        self.needs.extend(needs);
        let needs = self.needs.get(first_need..).unwrap_or_default();
        if layout.needs_both_curved(needs) {
            self.edges.truncate(first_edge as usize);
            self.needs.truncate(first_need);
            return 0;
        }
        self.rows.push(Row {
            from,
            to,
            sensor: layout.sensor_at(to),
            length: path.iter().filter_map(|(id, _)| layout.edge(*id)).map(|edge| edge.length).sum(),
            edges: first_edge..self.edges.len() as u32,
            needs: first_need as u32..self.needs.len() as u32,
        });
        path.len()
    }

    /// The range of indices of the hops from a node; the end is exclusive.
    #[inline]
    pub(crate) fn range_from(&self, node: NodeId) -> (u32, u32) {
        let node = usize::from(node.0);
        let bound = |place: usize| self.first.get(place).copied();
        bound(node).zip(bound(node + 1)).unwrap_or_default()
    }

    #[inline]
    fn get(&self, id: HopId) -> Option<Hop<'_>> {
        let row = self.rows.get(id.0 as usize)?;
        Some(Hop {
            id,
            from: row.from,
            to: row.to,
            sensor: row.sensor,
            length: row.length,
            edges: self.edges.get(row.edges.start as usize..row.edges.end as usize)?,
            needs: self.needs.get(row.needs.start as usize..row.needs.end as usize)?,
        })
    }
}

/// The current path of the search from a node.
struct Walk {
    /// Edges, and the node that each of them entered.
    path: Vec<(EdgeId, Option<NodeId>)>,
    /// The nodes entered, by number.
    on_path: Vec<bool>,
}

impl Walk {
    fn mark(&mut self, node: NodeId, on_path: bool) {
        if let Some(mark) = self.on_path.get_mut(usize::from(node.0)) {
            *mark = on_path;
        }
    }

    /// Extends the path over `edge` to `node`, unless it passed that node before.
    fn enter(&mut self, edge: EdgeId, node: NodeId) -> bool {
        let is_new = self.on_path.get(usize::from(node.0)).is_some_and(|on_path| !*on_path);
        if is_new {
            self.mark(node, true);
            self.path.push((edge, Some(node)));
        }
        is_new
    }

    /// Removes all but the first `depth` edges.
    fn back_to(&mut self, depth: usize) {
        while self.path.len() > depth {
            if let Some((_, Some(node))) = self.path.pop() {
                self.mark(node, false);
            }
        }
    }
}

impl Layout {
    /// What an edge asks of the turnouts at its ends: the branch it leaves by a leg, the merge it enters by one.
    pub(crate) fn needs_of(&self, id: EdgeId) -> impl Iterator<Item = TurnoutNeed> {
        let facing = self.edge(id).map(|edge| (edge, true));
        let trailing = self.edge(id.twin()).map(|edge| (edge, false));
        facing.into_iter().chain(trailing).filter_map(|(edge, facing)| {
            let NodeKind::Branch(turnout) = self.node(edge.from)?.kind else { return None };
            Some(TurnoutNeed { turnout, leg: edge.leg?, facing })
        })
    }

    /// Whether facing turnouts would need both turnouts of a pair curved.
    pub(crate) fn needs_both_curved(&self, needs: &[TurnoutNeed]) -> bool {
        let curved = || needs.iter().filter(|need| need.facing && need.leg == Leg::Curved);
        curved().any(|need| {
            let partner = self.never_curved_with(need.turnout);
            partner.is_some_and(|partner| curved().any(|other| other.turnout == partner))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ids::TurnoutId;
    use crate::track::Place;
    use crate::track::example::{end, oval, oval_plan, stretch, turnout};
    use std::string::{String, ToString};
    use std::{format, vec::Vec};

    fn hops(layout: &Layout, from: &str, turnouts: &TurnoutStates) -> Vec<String> {
        let from = layout.node_named(from).unwrap();
        layout
            .open_hops_from(from, turnouts)
            .map(|hop| format!("{} {:.0}", layout.node_name(hop.to), hop.length.as_mm()))
            .collect()
    }

    #[test]
    fn an_unknown_turnout_opens_both_legs_and_a_known_one_closes_one() {
        let layout = oval();
        let mut turnouts = TurnoutStates::unknown();
        assert_eq!(hops(&layout, "A1", &turnouts), ["B1 300", "C1 320"]);
        turnouts.set(TurnoutId(1), Leg::Curved);
        assert_eq!(hops(&layout, "A1", &turnouts), ["C1 320"]);
        // A trailed turnout may be in either position.
        turnouts.set(TurnoutId(2), Leg::Curved);
        assert_eq!(hops(&layout, "B1", &turnouts), ["D1 300"]);
    }

    #[test]
    fn a_hop_names_its_edges_and_turnouts() {
        let layout = oval();
        let from = layout.node_named("B1").unwrap();
        let hop = layout.hops_from(from).next().unwrap();
        let names: Vec<_> =
            hop.edges.iter().map(|id| layout.node_name(layout.edge(*id).unwrap().to)).collect();
        assert_eq!(names, ["MR2", "D1"]);
        assert_eq!(hop.needs, [TurnoutNeed { turnout: TurnoutId(2), leg: Leg::Straight, facing: false }]);
        assert_eq!((hop.from, hop.sensor), (from, layout.sensor_named("D1")));
        assert_eq!(layout.hop(hop.id), Some(hop));
        assert_eq!(layout.hop(HopId(u32::MAX)), None);
    }

    #[test]
    fn hops_begin_at_any_node_and_end_at_track_ends() {
        let layout = oval();
        let unknown = TurnoutStates::unknown();
        assert_eq!(hops(&layout, "BR1", &unknown), ["B1 200", "C1 220"]);
        assert_eq!(hops(&layout, "EN1", &unknown), ["E1 30"]);
        assert_eq!(hops(&layout, "E2", &unknown), ["EX1 30"]);
        let exit = layout.node_named("EX1").unwrap();
        assert_eq!(layout.hops_from(exit).count(), 0);
        assert_eq!(layout.hops_from(NodeId(u16::MAX)).count(), 0);
    }

    #[test]
    fn a_path_over_two_turnouts_that_are_never_both_curved_is_no_hop() {
        // A chain of two turnouts: the only path to `C1` needs both curved.
        let mut plan = oval_plan();
        plan.places = ["A", "B", "C"]
            .iter()
            .zip([0, 2, 4])
            .map(|(name, number)| Place::Sensor {
                names: [format!("{name}1"), format!("{name}2")],
                sensors: [SensorId(number), SensorId(number + 1)],
            })
            .chain((1..=2).map(turnout))
            .chain((1..=4).map(end))
            .collect();
        plan.stretches = vec![
            stretch("EN1", "A1", 1.0),
            stretch("A1", "BR1", 1.0),
            stretch("BR1 straight", "EX2", 1.0),
            stretch("BR1 curved", "BR2", 0.0),
            stretch("BR2 straight", "B1", 1.0),
            stretch("BR2 curved", "C1", 1.0),
            stretch("B1", "EX3", 1.0),
            stretch("C1", "EX4", 1.0),
        ];
        let unknown = TurnoutStates::unknown();
        assert_eq!(hops(&Layout::build(&plan).unwrap(), "A1", &unknown), ["EX2 2", "B1 2", "C1 2"]);
        plan.never_both_curved = vec![[TurnoutId(2), TurnoutId(1)]];
        assert_eq!(hops(&Layout::build(&plan).unwrap(), "A1", &unknown), ["EX2 2", "B1 2"]);
    }

    #[test]
    fn a_ladder_of_turnouts_without_sensors_is_refused_instead_of_filling_the_memory() {
        // The legs of every odd turnout meet again at the next one: 2^30 paths from end to end.
        let mut plan = oval_plan();
        plan.places = (1..=60).map(turnout).chain((1..=2).map(end)).collect();
        plan.stretches = vec![stretch("EN1", "BR1", 1.0), stretch("MR60", "EX2", 1.0)];
        for number in (1..60).step_by(2) {
            for leg in ["straight", "curved"] {
                let (from, to) = (format!("BR{number} {leg}"), format!("MR{} {leg}", number + 1));
                plan.stretches.push(stretch(&from, &to, 1.0));
            }
            if number > 1 {
                plan.stretches.push(stretch(&format!("MR{}", number - 1), &format!("BR{number}"), 1.0));
            }
        }
        let error = Layout::build(&plan).unwrap_err();
        assert_eq!(
            error.to_string(),
            "there are too many paths from `BR1` to the next sensors: put sensors between the turnouts"
        );
    }
}
