//! Draws a layout as SVG: edges as lines; sensors, turnouts and track ends as marks with their names.

use std::fmt;

use footplate_core::NodeId;
use footplate_core::track::{Layout, NodeKind, StretchLength};

use super::drawing::LayoutFile;

/// The layout has no drawing coordinates.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("no place of the layout has a point to draw at: add `at = [x, y]` to its sensors, turnouts and ends")]
pub struct NothingToDraw;

/// Sizes as parts of the drawing's longer side, chosen by eye with the built-in layouts.
const MARGIN: f64 = 0.03;
const RAIL: f64 = 0.002;
const SENSOR: f64 = 0.004;
const TURNOUT: f64 = 0.003;
const LETTER: f64 = 0.011;
/// The colour of edges with a speed restriction: that of a caution signal.
const RESTRICTED: &str = "#d80";

/// The text of an SVG file. Places without a point are left out, with their edges.
///
/// # Errors
/// [`NothingToDraw`] if no place has a point.
pub fn draw_layout(file: &LayoutFile) -> Result<String, NothingToDraw> {
    let LayoutFile { layout, drawing, .. } = file;
    let places =
        || layout.nodes().step_by(2).filter_map(|(id, node)| Some((id, node.kind, drawing.point(id)?)));
    let ([left, top], [right, bottom]) = places()
        .map(|(_, _, point)| (point, point))
        .reduce(|(least, most), (point, _)| (join(least, point, f64::min), join(most, point, f64::max)))
        .ok_or(NothingToDraw)?;
    // A single place still needs a canvas around it.
    let side = (right - left).max(bottom - top).max(1.0);
    let margin = side * MARGIN;
    let (x, y) = (left - margin, top - margin);
    let (width, height) = (right - left + 2.0 * margin, bottom - top + 2.0 * margin);
    let (rail, letter) = (side * RAIL, side * LETTER);
    let mut svg = String::new();
    let mut line = |text: fmt::Arguments<'_>| svg.push_str(&format!("{text}\n"));
    line(format_args!("<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"{x} {y} {width} {height}\">"));
    line(format_args!("<title>{}</title>", escaped(layout.name())));
    line(format_args!("<rect x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\" fill=\"#fff\"/>"));
    line(format_args!("<g stroke=\"#555\" stroke-width=\"{rail}\" stroke-linecap=\"round\">"));
    for (id, edge) in layout.edges().step_by(2) {
        if let (Some([x1, y1]), Some([x2, y2])) = (drawing.point(edge.from), drawing.point(edge.to)) {
            let (from, to) = (layout.node_name(edge.from), layout.node_name(edge.to));
            let length = if edge.known == StretchLength::Unknown {
                "length not measured".to_owned()
            } else {
                format!("{:.0} mm", edge.length.as_mm())
            };
            let (colour, zone) = layout.zone(id).map_or_else(Default::default, |zone| {
                let (name, limit) = (escaped(&zone.name), zone.limit.as_mm_per_s());
                (format!(" stroke=\"{RESTRICTED}\""), format!(", zone {name}: at most {limit} mm/s"))
            });
            line(format_args!(
                "<line x1=\"{x1}\" y1=\"{y1}\" x2=\"{x2}\" y2=\"{y2}\"{colour}><title>{from} to {to}: \
                 {length}{zone}</title></line>"
            ));
        }
    }
    line(format_args!("</g>"));
    // A white outline keeps names readable over edges.
    line(format_args!(
        "<g font-family=\"sans-serif\" font-size=\"{letter}\" text-anchor=\"middle\" paint-order=\"stroke\" \
         stroke-width=\"{}\">",
        2.0 * rail
    ));
    let mut drawn: Vec<[f64; 2]> = Vec::new();
    for (id, kind, point) in places() {
        let (radius, colour) = match kind {
            NodeKind::Sensor(_) | NodeKind::Boundary => (SENSOR, "#c33"),
            NodeKind::Branch(_) | NodeKind::Merge(_) => (TURNOUT, "#36c"),
            NodeKind::Enter | NodeKind::Exit => (TURNOUT, "#555"),
        };
        let radius = side * radius;
        // Names of places at the same point are stacked.
        let below = drawn.iter().filter(|other| **other == point).count() as f64;
        drawn.push(point);
        let ([x, y], name) = (point, label(layout, id, kind));
        let above = y - 2.0 * radius - below * letter;
        line(format_args!("<circle cx=\"{x}\" cy=\"{y}\" r=\"{radius}\" fill=\"{colour}\"/>"));
        line(format_args!("<text x=\"{x}\" y=\"{above}\" fill=\"{colour}\" stroke=\"#fff\">{name}</text>"));
    }
    line(format_args!("</g>\n</svg>"));
    Ok(svg)
}

/// The names of a node: both names of a sensor, the number of a turnout, the inbound name of an end.
fn label(layout: &Layout, first: NodeId, kind: NodeKind) -> String {
    match kind {
        NodeKind::Sensor(_) | NodeKind::Boundary => {
            format!("{} {}", layout.node_name(first), layout.node_name(first.reverse()))
        }
        NodeKind::Branch(turnout) | NodeKind::Merge(turnout) => turnout.to_string(),
        NodeKind::Enter | NodeKind::Exit => layout.node_name(first).to_owned(),
    }
}

fn join(one: [f64; 2], other: [f64; 2], pick: fn(f64, f64) -> f64) -> [f64; 2] {
    [pick(one[0], other[0]), pick(one[1], other[1])]
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::layout_file::{Drawing, built_in, parse_layout, write_layout};
    use footplate_core::Speed;
    use footplate_core::track::Zone;

    #[test]
    fn every_place_and_stretch_of_track_a_is_drawn_once() {
        let file = built_in("track-a").unwrap();
        let svg = draw_layout(&file).unwrap();
        assert_eq!(svg.matches("<circle").count(), 72);
        assert_eq!(svg.matches("<line").count(), 78);
        assert!(svg.contains("<title>C13 to E7: 875 mm</title>"), "{svg}");
        assert!(svg.contains(">C13 C14</text>"), "{svg}");
        assert!(svg.starts_with("<svg ") && svg.ends_with("</svg>\n"));
        // The four turnouts at one point have four names above each other.
        let heights = ["153", "154", "155", "156"].map(|turnout| {
            let line = svg.lines().find(|line| line.ends_with(&format!(">{turnout}</text>"))).unwrap();
            line.split('"').nth(3).unwrap().parse::<f64>().unwrap()
        });
        assert!(heights.windows(2).all(|pair| pair[1] < pair[0] - 10.0), "{heights:?}");
    }

    #[test]
    fn edges_with_a_speed_restriction_are_coloured_and_labelled() {
        let file = built_in("track-a").unwrap();
        let zone = Zone { name: "C & E".into(), limit: Speed::from_mm_per_s(180.0) };
        let [from, to] = ["C13", "E7"].map(|name| file.layout.node_named(name).unwrap());
        let edge = file.layout.edge_between(from, to).unwrap();
        let layout = file.layout.with_zone(zone, [edge.stretch()]).unwrap();
        let svg = draw_layout(&LayoutFile { layout, ..file }).unwrap();
        assert_eq!(svg.matches(RESTRICTED).count(), 1);
        assert!(svg.contains("<title>C13 to E7: 875 mm, zone C &amp; E: at most 180 mm/s</title>"), "{svg}");
    }

    #[test]
    fn a_layout_without_points_cannot_be_drawn() {
        let file = LayoutFile { drawing: Drawing::default(), ..built_in("track-b").unwrap() };
        assert_eq!(draw_layout(&file), Err(NothingToDraw));
    }

    #[test]
    fn a_name_is_no_markup() {
        let text =
            write_layout(&built_in("track-b").unwrap()).replace("name = \"track-b\"", "name = \"<b>&\"");
        let svg = draw_layout(&parse_layout("b.toml", text.as_bytes()).unwrap()).unwrap();
        assert!(svg.contains("<title>&lt;b>&amp;</title>"));
    }
}
