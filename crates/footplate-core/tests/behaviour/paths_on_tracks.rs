//! On any track, hops, routes and positions are those of a plain search over its rails.
#![expect(clippy::indexing_slicing, clippy::unwrap_used, reason = "a test may stop at the first surprise")]

use std::collections::{BTreeMap, BTreeSet};

use footplate_core::track::{
    Layout, LayoutPlan, Leg, NodeKind, Place, Position, RailEnd, Stretch, Survey, TurnoutStates,
};
use footplate_core::{EdgeId, Length, NodeId, SensorId, TurnoutId};
use proptest::collection::vec;
use proptest::prelude::{Just, Strategy, any, prop_assert, prop_assert_eq, proptest};
use proptest::sample::{Index, select};

/// Lengths that add up without rounding, zero among them.
const LENGTHS_MM: [f64; 6] = [0.0, 0.0, 64.0, 128.0, 512.0, 1024.0];

/// A track with these many places, whose rail ends are joined in an arbitrary order.
fn any_plan() -> impl Strategy<Value = LayoutPlan> {
    // Sensors have two rail ends, turnouts three, track ends one: an even number in all can be joined.
    (1_u16..7, 0_u16..6, 0_u16..5)
        .prop_map(|(sensors, turnouts, ends)| (sensors, turnouts, ends + (turnouts + ends) % 2))
        .prop_flat_map(|(sensors, turnouts, ends)| {
            let places = places(sensors, turnouts, ends);
            let rail_ends: Vec<RailEnd> = places.iter().flat_map(rail_ends_of).collect();
            let lengths = vec(select(LENGTHS_MM.to_vec()), rail_ends.len() / 2);
            (Just(places), Just(rail_ends).prop_shuffle(), lengths)
        })
        .prop_map(|(places, rail_ends, lengths)| {
            let join = |(pair, mm): (&[RailEnd], &f64)| Stretch {
                from: pair[0].clone(),
                to: RailEnd { node: reverse_name(&pair[1].node), leg: pair[1].leg },
                length: Length::from_mm(*mm).into(),
            };
            LayoutPlan {
                name: "any".into(),
                survey: Survey::taped(Length::ZERO, "made up".into()),
                stretches: rail_ends.chunks(2).zip(&lengths).map(join).collect(),
                places,
                never_both_curved: vec![],
                zones: vec![],
                blocks: vec![],
            }
        })
}

fn any_layout() -> impl Strategy<Value = (LayoutPlan, Layout)> {
    any_plan().prop_filter_map("a loop without length", |plan| {
        let layout = Layout::build(&plan).ok()?;
        Some((plan, layout))
    })
}

/// The names of a place differ in their first letter.
fn places(sensors: u16, turnouts: u16, ends: u16) -> Vec<Place> {
    let sensor = |n: u16| Place::Sensor {
        names: [format!("S{n}"), format!("s{n}")],
        sensors: [SensorId(2 * n), SensorId(2 * n + 1)],
    };
    let turnout =
        |n: u16| Place::Turnout { names: [format!("T{n}"), format!("t{n}")], turnout: TurnoutId(n) };
    let end = |n: u16| Place::End { names: [format!("E{n}"), format!("e{n}")] };
    (0..sensors).map(sensor).chain((0..turnouts).map(turnout)).chain((0..ends).map(end)).collect()
}

fn reverse_name(name: &str) -> String {
    let (kind, number) = name.split_at(1);
    let other = if kind == kind.to_uppercase() { kind.to_lowercase() } else { kind.to_uppercase() };
    other + number
}

/// The nodes by which a train leaves a place, with the leg.
fn rail_ends_of(place: &Place) -> Vec<RailEnd> {
    let [one, other] = place.names().clone();
    let end = |node: &String, leg| RailEnd { node: node.clone(), leg };
    match place {
        Place::Sensor { .. } | Place::UndirectedSensor { .. } | Place::Boundary { .. } => {
            vec![end(&one, None), end(&other, None)]
        }
        Place::Turnout { .. } => {
            vec![end(&one, Some(Leg::Straight)), end(&one, Some(Leg::Curved)), end(&other, None)]
        }
        Place::End { .. } => vec![end(&one, None)],
    }
}

/// The connections of the plan alone: by node, the leg by which it is left, the next node and the distance in mm.
type Leads = BTreeMap<String, Vec<(Option<Leg>, String, f64)>>;

fn leads(plan: &LayoutPlan) -> Leads {
    let mut leads = Leads::new();
    for Stretch { from, to, length } in &plan.stretches {
        let mut lead = |from: &str, leg, to: &str| {
            leads.entry(from.to_owned()).or_default().push((
                leg,
                to.to_owned(),
                length.estimate(&plan.survey).0.as_mm().round(),
            ));
        };
        lead(&from.node, from.leg, &to.node);
        lead(&reverse_name(&to.node), to.leg, &reverse_name(&from.node));
    }
    leads
}

/// A hop in words: the nodes it passes with the legs it leaves them by, and its length in mm.
type FoundReach = (Vec<(String, Option<Leg>)>, i64);

/// All paths from a node to the next sensor or track end that pass no node twice.
fn search(
    leads: &Leads,
    path: &mut Vec<(String, Option<Leg>)>,
    at: &str,
    mm: f64,
    found: &mut BTreeSet<FoundReach>,
) {
    let mut leads_on = leads.get(at).cloned().unwrap_or_default();
    leads_on.sort_by_key(|(leg, ..)| *leg);
    for (leg, to, length) in leads_on {
        path.push((at.to_owned(), leg));
        if to.starts_with(['S', 's', 'e']) {
            let mut commanded = path.clone();
            commanded.push((to, None));
            found.insert((commanded, (mm + length) as i64));
        } else if path.iter().all(|(passed, _)| *passed != to) {
            search(leads, path, &to, mm + length, found);
        }
        path.pop();
    }
}

/// States of turnouts 0 to 5, of which some are unknown.
fn any_states() -> impl Strategy<Value = TurnoutStates> {
    vec(select(vec![None, Some(Leg::Straight), Some(Leg::Curved)]), 6).prop_map(|legs| {
        (0..).map(TurnoutId).zip(legs).filter_map(|(turnout, leg)| Some((turnout, leg?))).collect()
    })
}

fn position(layout: &Layout, edge: Index, part: f64) -> Position {
    let edge = EdgeId(edge.index(layout.edges().len()) as u16);
    Position { edge, offset: layout.edge(edge).unwrap().length * part }
}

/// Whether two positions are the same point, up to the rounding of sums.
fn is_same(layout: &Layout, one: Position, other: Position) -> bool {
    let free = TurnoutStates::unknown();
    let near = |from, to| {
        layout.distance_ahead(from, to, &free).is_some_and(|distance| distance < Length::from_mm(1e-6))
    };
    near(one, other) || near(other, one)
}

proptest! {
    #[test]
    fn hops_are_what_a_plain_search_finds((plan, layout) in any_layout()) {
        let leads = leads(&plan);
        for (id, node) in layout.nodes() {
            let mut expected = BTreeSet::new();
            search(&leads, &mut Vec::new(), &node.name, 0.0, &mut expected);
            let commanded = layout.hops_from(id).map(|hop| {
                let edge = |id: &EdgeId| *layout.edge(*id).unwrap();
                let left = hop.edges.iter().map(edge).map(|edge| (layout.node_name(edge.from).to_owned(), edge.leg));
                let arrived = (layout.node_name(hop.to).to_owned(), None);
                (left.chain([arrived]).collect(), hop.length.as_mm().round() as i64)
            });
            prop_assert_eq!(commanded.collect::<BTreeSet<FoundReach>>(), expected, "from {}", node.name);
        }
    }

    #[test]
    fn open_hops_are_those_that_facing_turnouts_allow((_, layout) in any_layout(), states in any_states()) {
        for (id, _) in layout.nodes() {
            let allowed = layout.hops_from(id).filter(|hop| {
                let edges = hop.edges.iter().filter_map(|edge| layout.edge(*edge));
                edges.filter_map(|edge| Some((layout.node(edge.from)?.kind, edge.leg?))).all(|(kind, leg)| {
                    let NodeKind::Branch(turnout) = kind else { return false };
                    states.get(turnout).is_none_or(|known| known == leg)
                })
            });
            prop_assert_eq!(
                layout.open_hops_from(id, &states).map(|hop| hop.id).collect::<Vec<_>>(),
                allowed.map(|hop| hop.id).collect::<Vec<_>>()
            );
        }
    }

    #[test]
    fn reaches_are_hops_in_a_row((_, layout) in any_layout(), states in any_states(), missed in 0_usize..4) {
        for (id, _) in layout.nodes() {
            let mut expected = Vec::new();
            in_a_row(&layout, &states, id, Length::ZERO, missed, 0, &mut expected);
            let reaches = layout.reaches(id, &states, missed);
            prop_assert_eq!(reaches.map(|reach| (reach.to, reach.length, reach.missed())).collect::<Vec<_>>(), expected);
        }
    }

    #[test]
    fn distances_are_the_shortest((plan, layout) in any_layout()) {
        let (leads, free) = (leads(&plan), TurnoutStates::unknown());
        for (from, node) in layout.nodes() {
            let shortest = distances(&leads, &node.name);
            for (to, other) in layout.nodes() {
                let (Some(start), Some(end)) = (arrival(&layout, from), departure(&layout, to)) else { continue };
                let mm = layout.distance_ahead(start, end, &free).map(|ahead| ahead.as_mm().round());
                prop_assert_eq!(mm, shortest.get(&other.name).copied(), "{} to {}", node.name, other.name);
            }
        }
    }

    #[test]
    fn positions_have_a_normal_form(
        (_, layout) in any_layout(), states in any_states(), edge in any::<Index>(), part in 0.0..=1.0_f64,
    ) {
        let position = position(&layout, edge, part);
        let normal = layout.advance(position, Length::ZERO, &states).unwrap();
        prop_assert_eq!(layout.advance(normal, Length::ZERO, &states).unwrap(), normal);
        prop_assert!(is_same(&layout, position, normal));
        let edge = layout.edge(normal.edge).unwrap();
        let leads_on = match layout.node(edge.to).unwrap().kind {
            NodeKind::Exit => false,
            NodeKind::Branch(turnout) => states.get(turnout).is_some(),
            _ => true,
        };
        prop_assert!(normal.offset < edge.length || (normal.offset == edge.length && !leads_on));
        let around = layout.reversed(layout.reversed(normal).unwrap()).unwrap();
        prop_assert!(is_same(&layout, around, normal));
    }

    #[test]
    fn consecutive_paths_join(
        (_, layout) in any_layout(), states in any_states(), edge in any::<Index>(), part in 0.0..=1.0_f64,
        one in 0.0..4_000.0_f64, other in 0.0..4_000.0_f64,
    ) {
        let start = position(&layout, edge, part);
        let (one, other) = (Length::from_mm(one), Length::from_mm(other));
        let both = layout.advance(start, one + other, &states);
        let in_a_row = layout.advance(start, one, &states).and_then(|half| layout.advance(half, other, &states));
        match (both, in_a_row) {
            (Ok(both), Ok(in_a_row)) => prop_assert!(is_same(&layout, both, in_a_row)),
            (both, in_a_row) => prop_assert_eq!(both.is_ok(), in_a_row.is_ok()),
        }
    }

    #[test]
    fn no_numbers_panic(
        (_, layout) in any_layout(), states in any_states(), ids in any::<[u16; 4]>(), mm in any::<[f64; 3]>(), text in "\\PC{0,12}",
    ) {
        let [one, two, three] = mm.map(Length::from_mm);
        let from = NodeId(ids[0]);
        let _ = layout.landmark(&text);
        prop_assert_eq!(layout.reaches(from, &states, usize::from(ids[2])).next().is_some(), layout.open_hops_from(from, &states).next().is_some());
        let ids = [ids[2], ids[3] % 64];
        let [position, target] = ids.map(|edge| Position { edge: EdgeId(edge), offset: two });
        let _ = layout.advance(position, one, &states);
        let _ = layout.advance(target, three, &states);
        let _ = layout.distance_ahead(target, position, &states);
        let _ = layout.reversed(target);
    }
}

/// Reaches by definition: hops, and behind each sensor hops again.
fn in_a_row(
    layout: &Layout,
    states: &TurnoutStates,
    from: NodeId,
    begins_at: Length,
    missed: usize,
    depth: usize,
    found: &mut Vec<(NodeId, Length, usize)>,
) {
    for hop in layout.open_hops_from(from, states) {
        let length = begins_at + hop.length;
        found.push((hop.to, length, depth));
        if depth < missed && hop.sensor.is_some() {
            in_a_row(layout, states, hop.to, length, missed, depth + 1, found);
        }
    }
}

/// A train that has just arrived at a node, if any track leads there. The ends of an edge of 0 mm are one point in both directions.
fn arrival(layout: &Layout, node: NodeId) -> Option<Position> {
    let (edge, found) = layout.edges().find(|(_, edge)| edge.to == node && edge.length > Length::ZERO)?;
    Some(Position { edge, offset: found.length })
}

/// A train that is about to leave a node, if any track begins there.
fn departure(layout: &Layout, node: NodeId) -> Option<Position> {
    let (edge, _) = layout.edges().find(|(_, edge)| edge.from == node && edge.length > Length::ZERO)?;
    Some(Position { edge, offset: Length::ZERO })
}

/// The shortest distances from a node in mm: relaxed until nothing changes (Bellman and Ford, 1956).
fn distances(leads: &Leads, from: &str) -> BTreeMap<String, f64> {
    let mut shortest = BTreeMap::from([(from.to_owned(), 0.0)]);
    loop {
        let mut is_shorter = false;
        for (node, leads_on) in leads {
            let Some(mm) = shortest.get(node).copied() else { continue };
            for (_, to, length) in leads_on {
                if shortest.get(to).is_none_or(|known| mm + length < *known) {
                    shortest.insert(to.clone(), mm + length);
                    is_shorter = true;
                }
            }
        }
        if !is_shorter {
            return shortest;
        }
    }
}
