//! No text, however it came about, makes the readers of layouts panic; and what they read, they write and read again.

use std::fmt::Write;

use footplate_core::track::{
    Layout, LayoutPlan, Leg, NodeKind, Place, PlannedZone, RailEnd, Stretch, Survey, Zone,
};
use footplate_core::{Length, NodeId, SensorId, Speed, StretchId, TurnoutId};
use footplate_store::{
    Drawing, ImportContext, LayoutFile, LayoutTables, import_layout, parse_layout, write_layout,
};
use proptest::collection::vec;
use proptest::prelude::{Strategy, any, prop_assert_eq, prop_oneof, proptest};
use proptest::sample::{Index, select};

const TRACK_A: &str = include_str!("../../layouts/track-a.toml");

/// Pieces that mean something in a layout file, and some that mean nothing anywhere.
const PIECES: [&str; 26] = [
    "zones = [",
    "zone = \"neck\"",
    "\"A1\"",
    "\"BR6 curved\"",
    "mm = ",
    "from = ",
    "to = ",
    "names = [",
    "]",
    "}",
    "{",
    ",",
    "\n",
    "0",
    "-1",
    "nan",
    "1e308",
    "edges = [",
    "[[edges]]",
    "never_both_curved = [[153, 153]]",
    "at = [1, 2]",
    "\"\"\"",
    "\\u0000",
    "ß",
    "\u{feff}",
    "99999999999999999999",
];

/// What a person, an editor or a broken disk does to a text.
#[derive(Debug, Clone)]
enum Damage {
    Remove { from: Index, bytes: usize },
    Insert { at: Index, piece: &'static str },
    SwapLines { one: Index, other: Index },
    Set { at: Index, byte: u8 },
}

fn damage() -> impl Strategy<Value = Damage> {
    prop_oneof![
        (any::<Index>(), 1_usize..80).prop_map(|(from, bytes)| Damage::Remove { from, bytes }),
        (any::<Index>(), select(PIECES.to_vec())).prop_map(|(at, piece)| Damage::Insert { at, piece }),
        (any::<Index>(), any::<Index>()).prop_map(|(one, other)| Damage::SwapLines { one, other }),
        (any::<Index>(), any::<u8>()).prop_map(|(at, byte)| Damage::Set { at, byte }),
    ]
}

fn damaged(text: &str, damages: &[Damage]) -> Vec<u8> {
    let mut bytes = text.as_bytes().to_vec();
    for damage in damages.iter().cloned() {
        if bytes.is_empty() {
            break;
        }
        match damage {
            Damage::Remove { from, bytes: count } => {
                let from = from.index(bytes.len());
                bytes.drain(from..(from + count).min(bytes.len()));
            }
            Damage::Insert { at, piece } => {
                let at = at.index(bytes.len());
                bytes.splice(at..at, piece.bytes());
            }
            Damage::SwapLines { one, other } => {
                let mut lines: Vec<&[u8]> = bytes.split(|byte| *byte == b'\n').collect();
                let (one, other) = (one.index(lines.len()), other.index(lines.len()));
                lines.swap(one, other);
                bytes = lines.join(&b'\n');
            }
            Damage::Set { at, byte } => {
                let at = at.index(bytes.len());
                bytes[at] = byte;
            }
        }
    }
    bytes
}

/// The nodes and edges of a layout as the tables say them.
fn tables(layout: &Layout) -> (String, String) {
    let (mut nodes, mut edges) =
        ("name,type,number,reverse\n".to_owned(), "src,dst,direction,dist_mm\n".to_owned());
    let name = |node: NodeId| layout.node_name(node);
    for (id, node) in layout.nodes() {
        let (kind, number) = match node.kind {
            NodeKind::Sensor(sensor) => ("sensor", layout.input(sensor).0),
            NodeKind::Branch(turnout) => ("branch", turnout.0),
            NodeKind::Merge(turnout) => ("merge", turnout.0),
            NodeKind::Boundary => unreachable!("these layouts have no blocks"),
            NodeKind::Enter => ("enter", 1),
            NodeKind::Exit => ("exit", 1),
        };
        writeln!(nodes, "{},{kind},{number},{}", node.name, name(id.reverse())).unwrap();
    }
    for (_, edge) in layout.edges() {
        let direction = edge.leg.map_or_else(|| "ahead".to_owned(), |leg| leg.to_string());
        let mm = (edge.length.as_mm() * 1e6).round() / 1e6;
        writeln!(edges, "{},{},{direction},{mm}", name(edge.from), name(edge.to)).unwrap();
    }
    (nodes, edges)
}

fn import(nodes: &[u8], edges: &[u8], layout: &Layout) -> Option<LayoutFile> {
    let tables = LayoutTables {
        nodes: ("nodes.csv".to_owned(), nodes),
        edges: ("edges.csv".to_owned(), edges),
        schematic: None,
    };
    let context = ImportContext {
        name: layout.name().to_owned(),
        about: String::new(),
        survey: layout.survey().clone(),
        never_both_curved: layout.never_both_curved().to_vec(),
    };
    import_layout(tables, &context).ok()
}

/// Any number of loops, each with a passing siding, strung on one line between two ends.
fn any_layout() -> impl Strategy<Value = LayoutFile> {
    let siding = (0.0..2_000.0_f64, 0.0..2_000.0_f64, any::<bool>(), any::<bool>());
    let point = (any::<Index>(), -1e6..1e6_f64, -1e6..1e6_f64);
    let limit = (1_000..5_000_000_u32, any::<Index>());
    (vec(siding, 1..8), "\\PC{0,20}", "[a-z\n\"\\\\ ]{0,40}", vec(point, 0..5), vec(limit, 0..3)).prop_map(
        |(sidings, name, about, points, limits)| {
            let end = |leg| move |node: String| RailEnd { node, leg };
            let plain = end(None);
            let mm = |length: f64| Length::from_mm((length * 1e3).round() / 1e3);
            let (mut places, mut stretches) = (vec![], vec![]);
            let mut ahead = "in".to_owned();
            for (number, (long, short, swap_first, swap_last)) in (0_u16..).zip(&sidings) {
                let names = |name: &str| [format!("{name}{number}"), format!("{name}{number}_back")];
                let sensors = [SensorId(4 * number), SensorId(4 * number + 1)];
                places.push(Place::Sensor { names: names("P"), sensors });
                places.push(Place::UndirectedSensor { names: names("Q"), sensor: SensorId(4 * number + 2) });
                for (turnout, which) in [("S", 0), ("T", 1)] {
                    places.push(Place::Turnout {
                        names: names(turnout),
                        turnout: TurnoutId(2 * number + which),
                    });
                }
                let legs =
                    |swap| if swap { [Leg::Curved, Leg::Straight] } else { [Leg::Straight, Leg::Curved] };
                let ([first, second], [third, fourth]) = (legs(*swap_first), legs(*swap_last));
                let mut join = |from: RailEnd, to: RailEnd, length| {
                    stretches.push(Stretch { from, to, length: Length::into(length) });
                };
                join(plain(ahead), plain(format!("S{number}")), mm(*long));
                join(end(Some(first))(format!("S{number}")), plain(format!("P{number}")), mm(*short));
                join(plain(format!("P{number}")), end(Some(third))(format!("T{number}_back")), mm(*long));
                join(end(Some(second))(format!("S{number}")), plain(format!("Q{number}_back")), mm(*long));
                join(
                    plain(format!("Q{number}_back")),
                    end(Some(fourth))(format!("T{number}_back")),
                    mm(*short),
                );
                ahead = format!("T{number}_back");
            }
            places.push(Place::End { names: ["in".to_owned(), "in_out".to_owned()] });
            places.push(Place::End { names: ["out_in".to_owned(), "out".to_owned()] });
            stretches.push(Stretch {
                from: plain(ahead),
                to: plain("out".to_owned()),
                length: mm(1.0).into(),
            });
            // Files list sensors, boundaries, turnouts, ends.
            places.sort_by_key(|place| match place {
                Place::Sensor { .. } | Place::UndirectedSensor { .. } => 0,
                Place::Boundary { .. } => 1,
                Place::Turnout { .. } => 2,
                Place::End { .. } => 3,
            });
            // A zone on every third stretch from some place on.
            let zones = (0_u16..).zip(&limits).map(|(number, (um_s, from))| PlannedZone {
                zone: Zone {
                    name: format!("zone {number}"),
                    limit: Speed::from_mm_per_s(f64::from(*um_s) / 1e3),
                },
                stretches: (from.index(stretches.len() / 3)..)
                    .map(|third| StretchId(3 * third as u16 + number))
                    .take_while(|stretch| usize::from(stretch.0) < stretches.len())
                    .collect(),
            });
            let zones = zones.collect();
            let survey = Survey::taped(Length::from_mm(2.5), "made up".to_owned());
            let plan = LayoutPlan {
                name,
                survey,
                places,
                stretches,
                never_both_curved: vec![],
                zones,
                blocks: vec![],
            };
            let layout = Layout::build(&plan).unwrap();
            let mut drawing = Drawing::default();
            for (node, x, y) in points {
                drawing.set(NodeId(node.index(layout.nodes().len()) as u16), [x, y]);
            }
            LayoutFile { layout, about: about.trim().to_owned(), drawing }
        },
    )
}

#[test]
fn brackets_without_end_are_no_panic() {
    for bracket in ["[", "{a=", "[[", "\"\"\"", "a."] {
        let text = format!("edges = {}", bracket.repeat(100_000));
        assert!(parse_layout("deep.toml", text.as_bytes()).is_err());
    }
}

proptest! {
    #[test]
    fn damage_to_a_layout_file_is_never_a_panic(damages in vec(damage(), 1..6)) {
        let bytes = damaged(TRACK_A, &damages);
        if let Ok(file) = parse_layout("damaged.toml", &bytes) {
            let again = parse_layout("written.toml", write_layout(&file).as_bytes()).unwrap();
            prop_assert_eq!(write_layout(&again), write_layout(&file));
        }
    }

    #[test]
    fn any_bytes_are_no_panic(bytes in vec(any::<u8>(), 0..200)) {
        let _ = parse_layout("bytes.toml", &bytes);
    }

    #[test]
    fn pieces_of_a_layout_file_in_any_order_are_no_panic(pieces in vec(select(PIECES.to_vec()), 0..60)) {
        let _ = parse_layout("pieces.toml", pieces.concat().as_bytes());
    }

    #[test]
    fn damage_to_tables_is_never_a_panic(
        of_nodes in vec(damage(), 0..4),
        of_edges in vec(damage(), 0..4),
        file in any_layout(),
    ) {
        let (nodes, edges) = tables(&file.layout);
        let _ = import(&damaged(&nodes, &of_nodes), &damaged(&edges, &of_edges), &file.layout);
    }

    #[test]
    fn a_layout_that_is_written_reads_back_as_itself(file in any_layout()) {
        prop_assert_eq!(parse_layout("written.toml", write_layout(&file).as_bytes()).unwrap(), file);
    }

    #[test]
    fn a_layout_said_by_tables_is_the_same_layout(file in any_layout()) {
        let (nodes, edges) = tables(&file.layout);
        let imported = import(nodes.as_bytes(), edges.as_bytes(), &file.layout).unwrap();
        let sorted = |layout: &Layout| {
            let (_, edges) = tables(layout);
            let mut rows: Vec<String> = edges.lines().map(str::to_owned).collect();
            rows.sort();
            rows
        };
        prop_assert_eq!(sorted(&imported.layout), sorted(&file.layout));
    }
}
