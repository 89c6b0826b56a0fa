//! Imports a layout from tables of nodes and directed edges, in the format of the courses on real-time trains.
//!
//! The tables contain everything twice, once for each direction of travel. The import pairs the entries and reports
//! rows whose twins disagree.

use std::collections::BTreeMap;
use std::io::BufRead;

use footplate_core::track::{Layout, LayoutPlan, Leg, Place, PlanEntry, RailEnd, Stretch, Survey};
use footplate_core::{Length, SensorId, TurnoutId};

use super::drawing::{Drawing, LayoutFile};
use super::import_error::{ImportError, RowProblem};
use super::tables::{
    EdgeRow, LayoutTables, NodeRow, NodeType, PointRow, read_edges, read_nodes, read_points,
};

/// Properties that the tables do not contain.
#[derive(Debug, Clone, PartialEq)]
pub struct ImportContext {
    /// The name of the layout.
    pub name: String,
    /// Its description.
    pub about: String,
    /// The uncertainty of the lengths.
    pub survey: Survey,
    /// Pairs of turnouts in one place of which at most one may lie curved.
    pub never_both_curved: Vec<[TurnoutId; 2]>,
}

/// Imports a layout.
///
/// # Errors
/// The first error in the nodes, then in the edges, then in the points.
pub fn import_layout<R: BufRead>(
    tables: LayoutTables<R>,
    context: &ImportContext,
) -> Result<LayoutFile, ImportError> {
    let (nodes_file, input) = tables.nodes;
    let nodes = read_nodes(&nodes_file, input)?;
    let (edges_file, input) = tables.edges;
    let edges = read_edges(&edges_file, input)?;
    let (places, reverses) = pair_nodes(&nodes).map_err(in_file(&nodes_file))?;
    let stretches = pair_edges(&edges, &reverses).map_err(in_file(&edges_file))?;

    let plan = LayoutPlan {
        name: context.name.clone(),
        survey: context.survey.clone(),
        places: places.iter().map(|(_, place)| place.clone()).collect(),
        stretches: stretches.iter().map(|(_, stretch)| stretch.clone()).collect(),
        never_both_curved: context.never_both_curved.clone(),
        zones: Vec::new(),
        blocks: Vec::new(),
    };
    let layout = Layout::build(&plan).map_err(|error| {
        let (file, line) = match error.entry() {
            PlanEntry::Place(place) => (&nodes_file, places.get(place).map(|(line, _)| *line)),
            PlanEntry::Stretch(stretch) => (&edges_file, stretches.get(stretch).map(|(line, _)| *line)),
            PlanEntry::Plan
            | PlanEntry::Survey
            | PlanEntry::Distance(_)
            | PlanEntry::Pair(_)
            | PlanEntry::Zone(_)
            | PlanEntry::Block(_) => {
                return ImportError::Context(error);
            }
        };
        in_file(file)((line.unwrap_or_default(), RowProblem::Layout(error)))
    })?;
    let drawing = match tables.schematic {
        Some((file, input)) => draw(&layout, &read_points(&file, input)?).map_err(in_file(&file))?,
        None => Drawing::default(),
    };
    Ok(LayoutFile { layout, about: context.about.clone(), drawing })
}

/// The line of an error, and the error.
type Fault = (u64, RowProblem);

fn in_file(file: &str) -> impl Fn(Fault) -> ImportError {
    move |(line, problem)| ImportError::Row { file: file.to_owned(), line, problem: Box::new(problem) }
}

/// The reverse of each node by name.
type Reverses<'n> = BTreeMap<&'n str, &'n str>;

/// The places with the line of their first node, in the order of layout files: sensors, turnouts, ends.
fn pair_nodes(nodes: &[NodeRow]) -> Result<(Vec<(u64, Place)>, Reverses<'_>), Fault> {
    let mut rows: BTreeMap<&str, &NodeRow> = BTreeMap::new();
    for row in nodes {
        if let Some(first) = rows.insert(&row.name, row) {
            let problem = RowProblem::DuplicateNode { name: row.name.clone(), first: first.line };
            return Err((row.line, problem));
        }
    }
    let [mut sensors, mut turnouts, mut ends] = [const { Vec::new() }; 3];
    let mut reverses = Reverses::new();
    for row in nodes {
        let other = check_reverse(row, &rows).map_err(|problem| (row.line, problem))?;
        let is_known = reverses.contains_key(row.reverse.as_str());
        reverses.insert(row.name.as_str(), other.name.as_str());
        let names = [row.name.clone(), other.name.clone()];
        match row.kind {
            NodeType::Sensor if !is_known => {
                let numbers = [row, other].map(|row| SensorId(row.number));
                let place = match numbers {
                    [one, two] if one == two => Place::UndirectedSensor { names, sensor: one },
                    sensors => Place::Sensor { names, sensors },
                };
                sensors.push((row.line, place));
            }
            NodeType::Branch => {
                turnouts.push((row.line, Place::Turnout { names, turnout: TurnoutId(row.number) }));
            }
            NodeType::Enter => ends.push((row.line, Place::End { names })),
            NodeType::Sensor | NodeType::Merge | NodeType::Exit => {}
        }
    }
    sensors.append(&mut turnouts);
    sensors.append(&mut ends);
    Ok((sensors, reverses))
}

/// The row of the reverse node, if the two rows agree.
fn check_reverse<'n>(row: &NodeRow, rows: &BTreeMap<&str, &'n NodeRow>) -> Result<&'n NodeRow, RowProblem> {
    let (name, reverse) = (row.name.clone(), row.reverse.clone());
    let Some(other) = rows.get(row.reverse.as_str()) else {
        return Err(RowProblem::UnknownReverse { name, reverse });
    };
    if other.reverse != row.name {
        return Err(RowProblem::OneWayReverse { name, reverse, back: other.reverse.clone() });
    }
    if name == reverse {
        return Err(RowProblem::OwnReverse(name));
    }
    let expected = row.kind.reverse();
    if other.kind != expected {
        let (kind, found) = (row.kind.name(), other.kind.name());
        return Err(RowProblem::ReverseType { name, kind, reverse, found, expected: expected.name() });
    }
    if matches!(row.kind, NodeType::Branch | NodeType::Merge) && other.number != row.number {
        let (number, found) = (row.number, other.number);
        return Err(RowProblem::ReverseNumber { name, number, reverse, found });
    }
    Ok(other)
}

/// The stretches with the line of their first edge, in the order of the table.
fn pair_edges(edges: &[EdgeRow], reverses: &Reverses<'_>) -> Result<Vec<(u64, Stretch)>, Fault> {
    let mut leaving: BTreeMap<(&str, Option<Leg>), u64> = BTreeMap::new();
    // Edges without a twin so far, by their ends.
    let mut alone: BTreeMap<(&str, &str), Vec<usize>> = BTreeMap::new();
    for (number, edge) in edges.iter().enumerate() {
        if let Some(first) = leaving.insert((&edge.from, edge.leg), edge.line) {
            return Err((edge.line, RowProblem::DuplicateEdge { from: edge.from.clone(), first }));
        }
        alone.entry((&edge.from, &edge.to)).or_default().push(number);
    }
    let reverse = |line: u64, name: &str| {
        let unknown = || (line, RowProblem::UnknownNode(name.to_owned()));
        reverses.get(name).copied().ok_or_else(unknown)
    };
    let mut stretches = Vec::with_capacity(edges.len() / 2);
    for (number, edge) in edges.iter().enumerate() {
        let (back_to, back_from) = (reverse(edge.line, &edge.from)?, reverse(edge.line, &edge.to)?);
        // Skip edges that are twins of earlier ones.
        let Some(own) = alone.get_mut(&(edge.from.as_str(), edge.to.as_str())) else { continue };
        let Some(place) = own.iter().position(|other| *other == number) else { continue };
        own.remove(place);

        let twins = alone.get_mut(&(back_from, back_to)).filter(|twins| !twins.is_empty());
        let Some(twins) = twins else {
            let (from, to) = (edge.from.clone(), edge.to.clone());
            let (twin_from, twin_to) = (back_from.to_owned(), back_to.to_owned());
            return Err((edge.line, RowProblem::NoTwin { from, to, twin_from, twin_to }));
        };
        // Two tracks may connect the same turnouts: the twin has the same length.
        let is_equal =
            |other: &usize| edges.get(*other).is_some_and(|twin| twin.mm.total_cmp(&edge.mm).is_eq());
        let twin = &edges[twins.remove(twins.iter().position(is_equal).unwrap_or(0))];
        if twin.mm.total_cmp(&edge.mm).is_ne() {
            let (from, to, mm) = (edge.from.clone(), edge.to.clone(), edge.mm);
            let (twin_line, twin_mm) = (twin.line, twin.mm);
            return Err((edge.line, RowProblem::UnequalTwin { from, to, mm, twin_line, twin_mm }));
        }
        let stretch = Stretch {
            from: RailEnd { node: edge.from.clone(), leg: edge.leg },
            to: RailEnd { node: edge.to.clone(), leg: twin.leg },
            length: Length::from_mm(edge.mm).into(),
        };
        stretches.push((edge.line, stretch));
    }
    Ok(stretches)
}

fn draw(layout: &Layout, points: &[PointRow]) -> Result<Drawing, Fault> {
    let mut drawing = Drawing::default();
    for row in points {
        let Some(node) = layout.node_named(&row.name) else {
            return Err((row.line, RowProblem::UnknownNode(row.name.clone())));
        };
        if drawing.point(node).is_some_and(|point| point != row.point) {
            let reverse = layout.node_name(node.reverse()).to_owned();
            return Err((row.line, RowProblem::TwoPoints { name: row.name.clone(), reverse }));
        }
        drawing.set(node, row.point);
    }
    Ok(drawing)
}
