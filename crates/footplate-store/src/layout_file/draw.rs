//! Draws a layout as SVG: rails as lines, sensors, turnouts and track ends as marks with their names.

use std::fmt::Write;

use footplate_core::NodeId;
use footplate_core::track::{Layout, NodeKind};

use super::drawing::LayoutFile;

/// A layout without points to draw at.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("no place of the layout has a point to draw at: add `at = [x, y]` to its sensors, turnouts and ends")]
pub struct NothingToDraw;

/// Sizes as parts of the drawing's longer side, found by looking at the built-in layouts.
const MARGIN: f64 = 0.03;
const RAIL: f64 = 0.002;
const SENSOR: f64 = 0.004;
const TURNOUT: f64 = 0.003;
const LETTER: f64 = 0.011;

/// The text of an SVG file. Places without a point, and the rails to them, are left out.
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
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"{} {} {} {}\" font-family=\"sans-serif\" \
         font-size=\"{}\" text-anchor=\"middle\">\n<title>{}</title>\n",
        left - margin,
        top - margin,
        right - left + 2.0 * margin,
        bottom - top + 2.0 * margin,
        side * LETTER,
        escaped(layout.name()),
    );
    let rail =
        format_args!("stroke=\"#555\" stroke-width=\"{}\" stroke-linecap=\"round\"", side * RAIL).to_string();
    for (_, edge) in layout.edges().step_by(2) {
        if let (Some([x1, y1]), Some([x2, y2])) = (drawing.point(edge.from), drawing.point(edge.to)) {
            let (from, to) = (layout.node_name(edge.from), layout.node_name(edge.to));
            let title = format!("{from} to {to}: {:.0} mm", edge.length.as_mm());
            line(
                &mut svg,
                format_args!(
                    "<line x1=\"{x1}\" y1=\"{y1}\" x2=\"{x2}\" y2=\"{y2}\" {rail}><title>{title}</title></line>"
                ),
            );
        }
    }
    for (id, kind, [x, y]) in places() {
        let (radius, colour) = match kind {
            NodeKind::Sensor(_) => (SENSOR, "#c33"),
            NodeKind::Branch(_) | NodeKind::Merge(_) => (TURNOUT, "#36c"),
            NodeKind::Enter | NodeKind::Exit => (TURNOUT, "#555"),
        };
        let radius = side * radius;
        line(&mut svg, format_args!("<circle cx=\"{x}\" cy=\"{y}\" r=\"{radius}\" fill=\"{colour}\"/>"));
        let above = y - 2.0 * radius;
        line(
            &mut svg,
            format_args!(
                "<text x=\"{x}\" y=\"{above}\" fill=\"{colour}\">{}</text>",
                label(layout, id, kind)
            ),
        );
    }
    svg += "</svg>\n";
    Ok(svg)
}

/// Both names of a contact, the number of a turnout, the way in at an end.
fn label(layout: &Layout, first: NodeId, kind: NodeKind) -> String {
    match kind {
        NodeKind::Sensor(_) => format!("{} {}", layout.node_name(first), layout.node_name(first.reverse())),
        NodeKind::Branch(turnout) | NodeKind::Merge(turnout) => turnout.to_string(),
        NodeKind::Enter | NodeKind::Exit => layout.node_name(first).to_owned(),
    }
}

fn join(one: [f64; 2], other: [f64; 2], pick: fn(f64, f64) -> f64) -> [f64; 2] {
    [pick(one[0], other[0]), pick(one[1], other[1])]
}

fn line(svg: &mut String, text: std::fmt::Arguments<'_>) {
    // Writing to a string cannot fail.
    let _ = writeln!(svg, "{text}");
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;")
}
