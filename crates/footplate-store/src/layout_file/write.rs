//! Writes a layout as readable TOML that reads back as the same layout.

use footplate_core::track::{
    Block, Crossing, Edge, Layout, Leg, Node, NodeKind, StretchLength, SurveyedDistance, Zone,
};
use footplate_core::{EdgeId, Length, NodeId};

use super::drawing::{Drawing, LayoutFile};
use super::read::FORMAT;
use crate::decimal::unscaled;
use crate::sensor_names::{ModuleLetters, SensorNames};

/// The text of a layout file. Lengths are rounded to a nanometre.
pub fn write_layout(file: &LayoutFile) -> String {
    let LayoutFile { layout, about, drawing } = file;
    let survey = layout.survey();
    let mut text = format!("format = {FORMAT}\nname = {}\n", quoted(layout.name()));
    if !about.is_empty() {
        text += &format!("about = {}\n", quoted_lines(about));
    }
    text += &format!(
        "# One standard deviation of the length of an edge, and how it is known.\n\
         length_uncertainty_mm = {}\n\
         length_origin = {}\n",
        millimetres(survey.uncertainty),
        quoted(&survey.origin),
    );
    if survey.scale > 0.0 {
        let percent = unscaled((survey.scale * 1e8).round() as i64, 6);
        text += &format!(
            "# One standard deviation of the factor that all lengths have in common.\n\
             length_scale_uncertainty_percent = {percent}\n"
        );
    }
    let places = Places { layout, drawing };
    text += "\n# A sensor has one name for each direction of travel.\n";
    text += &list(
        "sensors",
        places.lines(|layout, id, node| matches!(node.kind, NodeKind::Sensor(_)) && !layout.is_boundary(id)),
    );
    text += "\n# A turnout has one name for trains from its toe, and one for trains from its legs.\n";
    text += &list("turnouts", places.lines(|_, _, node| matches!(node.kind, NodeKind::Branch(_))));
    if !layout.never_both_curved().is_empty() {
        let pairs = layout.never_both_curved().iter().map(|[one, other]| format!("[{one}, {other}]"));
        text += "\n# Turnouts in one place, of which at most one may lie curved.\n";
        text += &format!("never_both_curved = [{}]\n", pairs.collect::<Vec<_>>().join(", "));
    }
    text += "\n# Track ends: first the name of the inbound direction, then of the outbound one.\n";
    text += &list("ends", places.lines(|_, _, node| matches!(node.kind, NodeKind::Enter)));
    if !layout.blocks().is_empty() {
        text += "\n# Blocks have an occupancy detector, which reports this number.\n";
        text += &list("blocks", layout.blocks().iter().map(block));
        text += "\n# Their boundaries: one name for each direction of travel, and the block that a train enters there.\n";
        text += &list("boundaries", places.lines(|layout, id, _| layout.is_boundary(id)));
    }
    if !layout.zones().is_empty() {
        text += "\n# Speed restrictions: edges name the zone that they are in.\n";
        text += &list("zones", layout.zones().iter().map(zone));
    }
    text += "\n# Each stretch once, in one direction; the other direction is the same track.\n";
    if !layout.is_measured() {
        text += "# Edges without mm were not measured.\n";
    }
    text += &list("edges", stretches(layout));
    if !layout.crossings().is_empty() {
        text += "\n# Level crossings: two edges, and how far from their starts they cross.\n";
        text +=
            &list("crossings", layout.crossings().iter().map(|crossing| self::crossing(layout, crossing)));
    }
    if !survey.distances.is_empty() {
        text += "\n# Distances between sensors, known better than the sum of their edges.\n";
        text += &list("distances", survey.distances.iter().map(distance));
    }
    text
}

/// `key = [` and one entry a line.
fn list(key: &str, entries: impl Iterator<Item = String>) -> String {
    let mut text = format!("{key} = [");
    let mut end = "]\n";
    for entry in entries {
        text += &format!("\n  {{ {entry} }},");
        end = "\n]\n";
    }
    text + end
}

struct Places<'f> {
    layout: &'f Layout,
    drawing: &'f Drawing,
}

impl<'f> Places<'f> {
    fn lines(&self, is_wanted: impl Fn(&Layout, NodeId, &Node) -> bool) -> impl Iterator<Item = String> {
        let firsts = self.layout.nodes().step_by(2);
        firsts
            .filter(move |(id, node)| is_wanted(self.layout, *id, node))
            .map(|(id, node)| self.line(id, node))
    }

    fn line(&self, id: NodeId, node: &Node) -> String {
        let other = id.reverse();
        let mut line = String::new();
        if let NodeKind::Branch(turnout) = node.kind {
            line += &format!("number = {turnout}, ");
        }
        line += &format!("names = [{}, {}]", quoted(&node.name), quoted(self.layout.node_name(other)));
        if self.layout.is_boundary(id) {
            let enters = [id, other].map(|node| {
                let entry = self.layout.sensor_at(node);
                let block = entry.and_then(|entry| self.layout.block_of_entry(entry));
                quoted(block.map_or("", |block| block.name.as_str()))
            });
            line += &format!(", enters = [{}]", enters.join(", "));
        } else if let Some([number, _]) =
            self.layout.sensor_at(id).and_then(|sensor| self.layout.both_directions(sensor))
        {
            line += &format!(", number = {number}");
        } else if let (Some(one), Some(two)) = (self.layout.sensor_at(id), self.layout.sensor_at(other)) {
            let stated =
                [&node.name, self.layout.node_name(other)].map(|name| ModuleLetters.sensor_named(name));
            if stated != [Some(one), Some(two)] {
                line += &format!(", numbers = [{one}, {two}]");
            }
        }
        if let Some([x, y]) = self.drawing.point(id) {
            line += &format!(", at = [{x}, {y}]");
        }
        line
    }
}

/// Each stretch once.
fn stretches(layout: &Layout) -> impl Iterator<Item = String> {
    layout.edges().step_by(2).map(|(id, edge)| {
        let zone =
            layout.zone(id).map_or_else(String::new, |zone| format!(", zone = {}", quoted(&zone.name)));
        format!("{}{}{zone}", ends(layout, id), length(edge.known))
    })
}

/// The ends of an edge: it names its start, and its twin the leg by which that leaves the end.
fn ends(layout: &Layout, id: EdgeId) -> String {
    let edges = [layout.edge(id), layout.edge(id.twin())];
    let [Some(there), Some(back)] = edges else { return String::new() };
    format!("from = {}, to = {}", rail_end(layout, there.from, there), rail_end(layout, there.to, back))
}

fn crossing(layout: &Layout, crossing: &Crossing) -> String {
    let spots =
        crossing.tracks.map(|at| format!("{{ {}, mm = {} }}", ends(layout, at.edge), millimetres(at.offset)));
    format!("tracks = [{}]", spots.join(", "))
}

/// The keys of an edge's length.
fn length(known: StretchLength) -> String {
    match known {
        StretchLength::Measured(length) => format!(", mm = {}", millimetres(length)),
        StretchLength::Estimated { length, uncertainty } => {
            format!(", mm = {}, uncertainty_mm = {}", millimetres(length), millimetres(uncertainty))
        }
        StretchLength::Unknown => String::new(),
    }
}

fn distance(distance: &SurveyedDistance) -> String {
    let SurveyedDistance { from, to, length, uncertainty } = distance;
    let (mm, uncertainty) = (millimetres(*length), millimetres(*uncertainty));
    format!("from = {}, to = {}, mm = {mm}, uncertainty_mm = {uncertainty}", quoted(from), quoted(to))
}

fn block(block: &Block) -> String {
    format!("name = {}, number = {}", quoted(&block.name), block.detector)
}

fn zone(zone: &Zone) -> String {
    // Rounded to a nanometre a second, as lengths are to a nanometre.
    let limit = unscaled((zone.limit.as_mm_per_s() * 1e6).round() as i64, 6);
    format!("name = {}, max_mm_s = {limit}", quoted(&zone.name))
}

/// A node, with the leg by which `leaving` leaves its place.
fn rail_end(layout: &Layout, node: NodeId, leaving: &Edge) -> String {
    let name = layout.node_name(node);
    match leaving.leg {
        None => quoted(name),
        Some(Leg::Straight) => quoted(&format!("{name} straight")),
        Some(Leg::Curved) => quoted(&format!("{name} curved")),
    }
}

fn millimetres(length: Length) -> String {
    unscaled((length.as_mm() * 1e6).round() as i64, 6)
}

/// A TOML string on one line.
fn quoted(text: &str) -> String {
    toml::Value::String(text.to_owned()).to_string()
}

/// A TOML string with its line breaks.
fn quoted_lines(text: &str) -> String {
    let is_plain = text.chars().all(|c| c == '\n' || !(c.is_control() || matches!(c, '"' | '\\')));
    if text.contains('\n') && is_plain { format!("\"\"\"\n{text}\n\"\"\"") } else { quoted(text) }
}
