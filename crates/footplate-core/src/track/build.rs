//! Builds a layout from a plan: checks every entry, and names the first invalid one.

use alloc::borrow::ToOwned;
use alloc::collections::BTreeMap;
use alloc::string::String;
use alloc::vec;
use alloc::vec::Vec;

use crate::ids::{EdgeId, NodeId, SensorId, TurnoutId};
use crate::track::hop::Hops;
use crate::track::survey::surveyed_distances;
use crate::track::{
    Edge, Layout, LayoutError, LayoutPlan, Leg, MAX_EDGE_LENGTH, MAX_NAME_CHARACTERS, Node, NodeKind,
    OutgoingEdges, Place, PlannedZone, StretchLength, Survey,
};
use crate::units::Length;

/// Largest uncertainty of the common scale: beyond 100 % a survey has no meaning.
const LARGEST_SCALE: f64 = 1.0;

/// Nodes and edges are numbered by `u16`, two to a place and two to a stretch.
const MAX_PAIRS: usize = 1 << (u16::BITS - 1);

/// Sensors are numbered by `u16`; the last number is no sensor of a boundary.
const MAX_SENSORS: usize = u16::MAX as usize;

impl Layout {
    /// Checks a plan and makes the tables.
    ///
    /// # Errors
    /// The first invalid entry, in the order survey, places, stretches, rail ends without a stretch,
    /// pairs, blocks, loops, zones.
    pub fn build(plan: &LayoutPlan) -> Result<Self, LayoutError> {
        let uncertainty = plan.survey.uncertainty;
        if !is_plausible(uncertainty) {
            return Err(LayoutError::IllegalUncertainty { found: uncertainty });
        }
        if !(0.0..=LARGEST_SCALE).contains(&plan.survey.scale) {
            return Err(LayoutError::IllegalScale { found: plan.survey.scale });
        }
        let places = place_nodes(plan)?;
        let (nodes, edges) = join(plan, &places)?;
        let partners = pair_turnouts(&plan.never_both_curved, &places)?;
        let layout = Self {
            name: plan.name.clone(),
            survey: plan.survey.clone(),
            nodes,
            edges,
            names: places.names,
            sensors: places.sensors,
            turnouts: places.turnouts,
            never_both_curved: plan.never_both_curved.clone(),
            partners,
            hops: Hops::default(),
            distances: BTreeMap::new(),
            zones: Vec::new(),
            restricted: BTreeMap::new(),
            blocks: Vec::new(),
            entered: BTreeMap::new(),
            undirected: places.undirected,
            crossings: Vec::new(),
        };
        let layout = layout.with_blocks(&plan.blocks, &plan.places)?.with_hops()?;
        let zones = plan.zones.iter();
        zones
            .cloned()
            .try_fold(layout, |layout, PlannedZone { zone, stretches }| layout.with_zone(zone, stretches))
    }

    /// Makes the tables that follow from the lengths.
    pub(super) fn with_hops(mut self) -> Result<Self, LayoutError> {
        let place_and_name = |layout: &Self, node: NodeId| (node.pair(), layout.node_name(node).to_owned());
        if let Some((place, node)) = self.loop_without_length().map(|node| place_and_name(&self, node)) {
            return Err(LayoutError::LoopWithoutLength { place, node });
        }
        self.hops = Hops::of(&self).map_err(|node| {
            let (place, node) = place_and_name(&self, node);
            LayoutError::TooManyHops { place, node }
        })?;
        self.distances = surveyed_distances(&self)?;
        Ok(self)
    }

    /// A node on a loop of edges of 0 mm.
    fn loop_without_length(&self) -> Option<NodeId> {
        // Repeatedly remove nodes that no remaining edge of 0 mm reaches (Kahn, 1962): the rest are on a loop or
        // behind one.
        let spot = |id: EdgeId| self.edge(id).filter(|edge| edge.length == Length::ZERO);
        let mut reached_by = vec![0_usize; self.nodes.len()];
        for edge in self.edges.iter().filter(|edge| edge.length == Length::ZERO) {
            if let Some(count) = reached_by.get_mut(usize::from(edge.to.0)) {
                *count += 1;
            }
        }
        let counted = self.nodes().zip(&reached_by).map(|((node, _), count)| (node, *count));
        let mut free: Vec<NodeId> = counted.filter(|(_, count)| *count == 0).map(|(node, _)| node).collect();
        while let Some(node) = free.pop() {
            for edge in self.outgoing(node).edges().filter_map(spot) {
                if let Some(count) = reached_by.get_mut(usize::from(edge.to.0)) {
                    *count -= 1;
                    if *count == 0 {
                        free.push(edge.to);
                    }
                }
            }
        }
        let stays = |node: NodeId| reached_by.get(usize::from(node.0)).is_some_and(|count| *count > 0);
        let mut node = self.nodes().map(|(node, _)| node).find(|node| stays(*node))?;
        // Every remaining node is reached from another one: as many steps back as there are nodes end on a loop.
        for _ in &self.nodes {
            let mut before =
                self.outgoing(node.reverse()).edges().filter_map(spot).map(|edge| edge.to.reverse());
            node = before.find(|node| stays(*node))?;
        }
        Some(node)
    }
}

/// The length of a stretch and one standard deviation of it.
pub(super) fn checked(stretch: usize, known: StretchLength, survey: &Survey) -> Result<Length, LayoutError> {
    let (length, uncertainty) = known.estimate(survey);
    if !is_plausible(length) {
        return Err(LayoutError::IllegalLength { stretch, found: length });
    }
    if !is_plausible(uncertainty) {
        return Err(LayoutError::IllegalLengthUncertainty { stretch, found: uncertainty });
    }
    Ok(length)
}

/// Whether a length is finite, not negative and not absurdly large.
pub(super) fn is_plausible(length: Length) -> bool {
    length >= Length::ZERO && length <= MAX_EDGE_LENGTH
}

/// The nodes of all places, and the node of each name, sensor and turnout.
#[derive(Default)]
struct Places {
    nodes: Vec<(String, NodeKind)>,
    names: BTreeMap<String, NodeId>,
    sensors: Vec<Option<NodeId>>,
    turnouts: BTreeMap<TurnoutId, NodeId>,
    undirected: BTreeMap<SensorId, [SensorId; 2]>,
}

fn place_nodes(plan: &LayoutPlan) -> Result<Places, LayoutError> {
    let found = plan.places.len();
    if found > MAX_PAIRS {
        return Err(LayoutError::TooMany { what: "places", found, limit: MAX_PAIRS });
    }
    let mut places = Places::default();
    let mut entries = first_entry(plan)..u16::MAX;
    for (place, entry) in plan.places.iter().enumerate() {
        let mut unused = || {
            let too_many =
                LayoutError::TooMany { what: "sensors", found: MAX_SENSORS + 1, limit: MAX_SENSORS };
            entries.next().map(SensorId).ok_or(too_many)
        };
        let mut entry_of = |enters: &Option<String>| match enters {
            None => Ok(NodeKind::Boundary),
            Some(_) => unused().map(NodeKind::Sensor),
        };
        let kinds = match entry {
            Place::Sensor { sensors: [one, other], .. } => [NodeKind::Sensor(*one), NodeKind::Sensor(*other)],
            Place::UndirectedSensor { sensor, .. } => {
                let both = [*sensor, unused()?];
                places.undirected.extend(both.map(|direction| (direction, both)));
                both.map(NodeKind::Sensor)
            }
            Place::Boundary { enters: [one, other], .. } => [entry_of(one)?, entry_of(other)?],
            Place::Turnout { turnout, .. } => [NodeKind::Branch(*turnout), NodeKind::Merge(*turnout)],
            Place::End { .. } => [NodeKind::Enter, NodeKind::Exit],
        };
        let first = NodeId::first_of(place);
        for ((name, kind), node) in entry.names().iter().zip(kinds).zip([first, first.reverse()]) {
            if !is_legal_name(name) {
                return Err(LayoutError::IllegalName { place, name: name.clone() });
            }
            if places.names.insert(name.clone(), node).is_some() {
                return Err(LayoutError::DuplicateName { place, name: name.clone() });
            }
            places.nodes.push((name.clone(), kind));
            places.take(place, node, kind)?;
        }
    }
    Ok(places)
}

/// The first number for the entries of blocks and the second directions of sensors: above all sensors and detectors.
fn first_entry(plan: &LayoutPlan) -> u16 {
    let of_places = plan.places.iter().filter_map(|place| match place {
        Place::Sensor { sensors: [one, other], .. } => Some(one.0.max(other.0)),
        Place::UndirectedSensor { sensor, .. } => Some(sensor.0),
        _ => None,
    });
    let used = of_places.chain(plan.blocks.iter().map(|block| block.detector.0));
    used.max().map_or(0, |highest| highest.saturating_add(1))
}

impl Places {
    /// Records the node of a sensor or turnout, unless it has one already.
    fn take(&mut self, place: usize, node: NodeId, kind: NodeKind) -> Result<(), LayoutError> {
        let name = |node: NodeId| {
            self.nodes.get(usize::from(node.0)).map_or_else(String::new, |(name, _)| name.clone())
        };
        match kind {
            NodeKind::Sensor(sensor) => {
                let slot = usize::from(sensor.0);
                if let Some(Some(first)) = self.sensors.get(slot) {
                    let (first, second) = (name(*first), name(node));
                    return Err(LayoutError::SensorPlacedTwice { place, sensor, first, second });
                }
                if self.sensors.len() <= slot {
                    self.sensors.resize(slot + 1, None);
                }
                if let Some(known) = self.sensors.get_mut(slot) {
                    *known = Some(node);
                }
            }
            NodeKind::Branch(turnout) => {
                if let Some(first) = self.turnouts.get(&turnout) {
                    let (first, second) = (name(*first), name(node));
                    return Err(LayoutError::TurnoutPlacedTwice { place, turnout, first, second });
                }
                self.turnouts.insert(turnout, node);
            }
            NodeKind::Boundary | NodeKind::Merge(_) | NodeKind::Enter | NodeKind::Exit => {}
        }
        Ok(())
    }
}

/// The partner of each turnout that is in a pair.
fn pair_turnouts(
    pairs: &[[TurnoutId; 2]],
    places: &Places,
) -> Result<BTreeMap<TurnoutId, TurnoutId>, LayoutError> {
    let mut partners = BTreeMap::new();
    for (pair, [one, other]) in pairs.iter().enumerate() {
        for (turnout, partner) in [(*one, *other), (*other, *one)] {
            let is_new = partners.insert(turnout, partner).is_none();
            if !is_new || !places.turnouts.contains_key(&turnout) {
                return Err(LayoutError::IllegalPair { pair, turnout });
            }
        }
    }
    Ok(partners)
}

/// Letters, digits, `_` and `.`: no sign, so `C13-20mm` can only be a landmark, and no space, so `BR6 curved` can only
/// be a leg.
fn is_legal_name(name: &str) -> bool {
    (1..=MAX_NAME_CHARACTERS).contains(&name.chars().count())
        && name.chars().all(|c| c.is_alphanumeric() || matches!(c, '_' | '.'))
}

/// Makes two edges of every stretch, and checks that each rail end has exactly one.
fn join(plan: &LayoutPlan, places: &Places) -> Result<(Vec<Node>, Vec<Edge>), LayoutError> {
    if plan.stretches.len() > MAX_PAIRS {
        let found = plan.stretches.len();
        return Err(LayoutError::TooMany { what: "stretches", found, limit: MAX_PAIRS });
    }
    let mut edges = Vec::with_capacity(2 * plan.stretches.len());
    // The edges that leave each node: the only or straight one, and the curved one.
    let mut leaving: Vec<[Option<EdgeId>; 2]> = vec![[None; 2]; places.nodes.len()];
    for (stretch, entry) in plan.stretches.iter().enumerate() {
        let find = |name: &String| {
            let unknown = || LayoutError::UnknownNode { stretch, node: name.clone() };
            places.names.get(name).copied().ok_or_else(unknown)
        };
        let (from, to) = (find(&entry.from.node)?, find(&entry.to.node)?);
        let known = entry.length;
        let length = checked(stretch, known, &plan.survey)?;
        let there = Edge { from, leg: entry.from.leg, to, length, known };
        let back = Edge { from: to.reverse(), leg: entry.to.leg, to: from.reverse(), length, known };
        let first = EdgeId(NodeId::first_of(stretch).0);
        for (id, edge, named) in [(first, there, &entry.from), (first.twin(), back, &entry.to)] {
            let node = usize::from(edge.from.0);
            let Some((name, kind)) = places.nodes.get(node) else { continue };
            let slot = match (kind, edge.leg) {
                (NodeKind::Exit, _) => {
                    return Err(LayoutError::BeyondTrackEnd { stretch, node: named.node.clone() });
                }
                (NodeKind::Branch(_), None) => {
                    return Err(LayoutError::LegMissing { stretch, node: named.node.clone() });
                }
                (NodeKind::Branch(_), Some(leg)) => usize::from(leg.is_curved()),
                (_, Some(leg)) => {
                    let node = named.node.clone();
                    return Err(LayoutError::LegWithoutTurnout { stretch, node, leg });
                }
                (_, None) => 0,
            };
            let Some(taken) = leaving.get_mut(node).and_then(|edges| edges.get_mut(slot)) else { continue };
            if let Some(first) = taken {
                let first = usize::from(first.stretch().0);
                return Err(LayoutError::RailEndTaken { stretch, first, node: name.clone(), leg: edge.leg });
            }
            *taken = Some(id);
            edges.push(edge);
        }
    }
    let nodes = places.nodes.iter().zip(&leaving).zip(0_u16..).map(|(((name, kind), edges), number)| {
        let open = |leg| LayoutError::RailEndOpen { place: NodeId(number).pair(), node: name.clone(), leg };
        let outgoing = match (kind, *edges) {
            (NodeKind::Exit, _) => OutgoingEdges::Ended,
            (NodeKind::Branch(_), [Some(straight), Some(curved)]) => OutgoingEdges::Legs { straight, curved },
            (NodeKind::Branch(_), [None, _]) => return Err(open(Some(Leg::Straight))),
            (NodeKind::Branch(_), [_, None]) => return Err(open(Some(Leg::Curved))),
            (_, [Some(edge), _]) => OutgoingEdges::Ahead(edge),
            (_, [None, _]) => return Err(open(None)),
        };
        Ok(Node { name: name.clone(), kind: *kind, outgoing })
    });
    Ok((nodes.collect::<Result<_, _>>()?, edges))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::track::example::{end, oval_plan, stretch, turnout};
    use crate::track::{PlanEntry, RailEnd, Stretch};
    use std::format;
    use std::string::ToString;

    fn refusal(change: impl FnOnce(&mut LayoutPlan)) -> (PlanEntry, String) {
        let mut plan = oval_plan();
        change(&mut plan);
        let error = Layout::build(&plan).unwrap_err();
        (error.entry(), error.to_string())
    }

    #[test]
    fn a_plan_is_refused_with_the_entry_and_the_value_at_fault() {
        assert_eq!(
            refusal(|plan| plan.survey.uncertainty = Length::from_mm(-1.0)),
            (PlanEntry::Survey, "an uncertainty of -1 mm is not between 0 and 100000 mm".into())
        );
        for name in ["", "A+1", "two words", "a-name-with-signs", &"x".repeat(MAX_NAME_CHARACTERS + 1)] {
            let (entry, text) =
                refusal(|plan| plan.places[1] = Place::End { names: ["X".into(), name.into()] });
            assert_eq!(entry, PlanEntry::Place(1));
            assert_eq!(text, format!("the name `{name}` is not 1 to 32 letters, digits, `_` or `.`"));
        }
        assert_eq!(
            refusal(|plan| plan.places.push(Place::End { names: ["X".into(), "A1".into()] })),
            (PlanEntry::Place(9), "the name `A1` is taken; every node needs its own".into())
        );
        assert_eq!(
            refusal(|plan| plan.places.push(Place::Sensor {
                names: ["X1".into(), "X2".into()],
                sensors: [SensorId(40), SensorId(2)]
            })),
            (PlanEntry::Place(9), "sensor 2 is placed at `B1` and again at `X2`".into())
        );
        assert_eq!(
            refusal(|plan| plan
                .places
                .push(Place::Turnout { names: ["X".into(), "Y".into()], turnout: TurnoutId(1) })),
            (PlanEntry::Place(9), "turnout 1 is placed at `BR1` and again at `X`".into())
        );
    }

    #[test]
    fn a_stretch_is_refused_with_its_number_and_the_node_at_fault() {
        let last = PlanEntry::Stretch(9);
        assert_eq!(
            refusal(|plan| plan.stretches.push(stretch("A1", "Z9", 1.0))),
            (last, "no sensor, turnout or end is called `Z9`".into())
        );
        for (length, text) in [(f64::NAN, "NaN"), (-1.0, "-1"), (185_000.0, "185000"), (f64::INFINITY, "inf")]
        {
            assert_eq!(
                refusal(|plan| plan.stretches[3].length = Length::from_mm(length).into()),
                (
                    PlanEntry::Stretch(3),
                    format!("a length of {text} mm is not between 0 and 100000 mm (is it in millimetres?)")
                )
            );
        }
        assert_eq!(
            refusal(|plan| plan.stretches.push(stretch("BR1", "A1", 1.0))),
            (last, "`BR1` has two legs: write `BR1 straight` or `BR1 curved`".into())
        );
        assert_eq!(
            refusal(|plan| plan.stretches.push(stretch("MR1 curved", "A1", 1.0))),
            (last, "`MR1 curved` names a leg, but this node has only one exit: write `MR1`".into())
        );
        assert_eq!(
            refusal(|plan| plan.stretches.push(stretch("EX1", "A1", 1.0))),
            (last, "the track ends at `EX1`: edges leave an entry and reach an exit".into())
        );
        assert_eq!(
            refusal(|plan| plan.stretches.push(stretch("A2", "EN1", 1.0))),
            (
                last,
                "there is an edge from `A2` already; each stretch is written once, in either direction"
                    .into()
            )
        );
        assert_eq!(
            refusal(|plan| plan.stretches.push(stretch("D2", "MR2 straight", 100.0))),
            (
                last,
                "there is an edge from `D2` already; each stretch is written once, in either direction"
                    .into()
            )
        );
        assert_eq!(
            refusal(|plan| plan.stretches[0] = stretch("A1", "A2", 100.0)),
            (PlanEntry::Stretch(0), "an edge that leaves `A1` comes back to the same rail end".into())
        );
    }

    #[test]
    fn an_open_rail_end_is_named() {
        let open = |removed: usize| refusal(|plan| drop(plan.stretches.remove(removed)));
        assert_eq!(
            open(1),
            (
                PlanEntry::Place(1),
                "no edge leads on from `B2`: join it to another node, or to an end if the track ends there"
                    .into()
            )
        );
        let (entry, text) = refusal(|plan| {
            plan.stretches.truncate(2);
            plan.places = vec![plan.places[0].clone(), plan.places[1].clone(), plan.places[4].clone()];
            plan.stretches.push(stretch("B1", "A1", 10.0));
        });
        assert_eq!(entry, PlanEntry::Place(2));
        assert!(text.starts_with("no edge leads on from `BR1 curved`"), "{text}");
    }

    #[test]
    fn a_pair_takes_two_turnouts_of_the_layout() {
        for (pair, turnout) in [([1, 3], 3), ([7, 1], 7), ([2, 2], 2)] {
            assert_eq!(
                refusal(|plan| plan.never_both_curved.push(pair.map(TurnoutId))),
                (
                    PlanEntry::Pair(0),
                    format!(
                        "turnout {turnout} makes no pair: it takes two different turnouts of this layout, each \
                         in one pair"
                    )
                )
            );
        }
    }

    #[test]
    fn a_turnout_is_in_one_pair_at_most() {
        let (entry, text) = refusal(|plan| {
            plan.places.extend([turnout(3), end(3), end(4), end(5)]);
            plan.stretches.extend([
                stretch("EN3", "BR3", 1.0),
                stretch("BR3 straight", "EX4", 1.0),
                stretch("BR3 curved", "EX5", 1.0),
            ]);
            plan.never_both_curved = vec![[TurnoutId(1), TurnoutId(2)], [TurnoutId(3), TurnoutId(2)]];
        });
        assert_eq!(entry, PlanEntry::Pair(1));
        assert!(text.starts_with("turnout 2 makes no pair"), "{text}");
    }

    #[test]
    fn a_loop_of_no_length_is_refused_and_a_stretch_of_no_length_is_not() {
        let mut plan = oval_plan();
        plan.stretches[0].length = Length::ZERO.into();
        assert!(Layout::build(&plan).is_ok());
        for stretch in &mut plan.stretches {
            stretch.length = Length::ZERO.into();
        }
        let error = Layout::build(&plan).unwrap_err();
        assert!(matches!(error, LayoutError::LoopWithoutLength { .. }), "{error}");
    }

    #[test]
    fn more_places_than_numbers_are_refused() {
        let (entry, text) = refusal(|plan| {
            plan.places = vec![Place::End { names: ["a".into(), "b".into()] }; MAX_PAIRS + 1];
        });
        assert_eq!(entry, PlanEntry::Plan);
        assert_eq!(text, "32769 places are more than the 32768 that a layout can number");
        let (entry, text) = refusal(|plan| {
            let any = Stretch {
                from: RailEnd { node: "A1".into(), leg: None },
                to: RailEnd { node: "A1".into(), leg: None },
                length: Length::ZERO.into(),
            };
            plan.stretches = vec![any; MAX_PAIRS + 1];
        });
        assert_eq!(entry, PlanEntry::Plan);
        assert_eq!(text, "32769 stretches are more than the 32768 that a layout can number");
    }
}
