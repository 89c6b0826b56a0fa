//! `footplate layout show`: describes a layout as text, JSON or a drawing.

use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::Context;
use clap::Args;
use footplate_core::track::{
    Block, Crossing, Hop, Layout, NodeKind, Position, StretchLength, TurnoutNeed, Zone,
};
use footplate_core::{EdgeId, NodeId};
use footplate_store::{LayoutFile, draw_layout, layout_named, write_whole};
use serde_json::{Value, json};

use crate::commands::Outcome;
use crate::commands::output_files::check_outputs;

/// Show what a layout consists of.
#[derive(Args)]
#[command(after_help = "Example: footplate layout show track-a --svg track-a.svg")]
pub(super) struct Arguments {
    /// The layout: the name of a built-in layout (track-a, track-b, oval-blocks), or a file.
    layout: String,
    /// Also list the hops from sensor to sensor.
    #[arg(long)]
    hops: bool,
    /// Draw the layout to this file.
    #[arg(long, value_name = "FILE")]
    svg: Option<PathBuf>,
    /// Write JSON, always with the hops.
    #[arg(long)]
    json: bool,
}

impl Arguments {
    pub(super) fn run(self, output: &mut dyn Write) -> anyhow::Result<Outcome> {
        check_outputs([Path::new(&self.layout)], &[("--svg", self.svg.as_deref())])?;
        let file = layout_named(&self.layout)?;
        if let Some(path) = &self.svg {
            let drawing = draw_layout(&file).with_context(|| format!("drawing {}", self.layout))?;
            write_whole(path, drawing.as_bytes()).with_context(|| format!("writing {}", path.display()))?;
        }
        if self.json {
            serde_json::to_writer_pretty(&mut *output, &summary(&file.layout))?;
            writeln!(output)?;
        } else {
            write_words(&file, output)?;
            if self.hops {
                write_hops(&file.layout, output)?;
            }
        }
        Ok(Outcome::Done)
    }
}

fn write_words(file: &LayoutFile, output: &mut dyn Write) -> anyhow::Result<()> {
    let layout = &file.layout;
    writeln!(output, "{}", layout.name())?;
    for line in file.about.lines() {
        writeln!(output, "  {line}")?;
    }
    let [sensors, turnouts, ends] = counts(layout);
    let nodes = layout.nodes().len();
    write!(output, "nodes   {nodes}: {sensors} sensors, {turnouts} turnouts, {ends} track ends")?;
    match boundaries(layout).count() {
        0 => writeln!(output)?,
        boundaries => writeln!(output, ", {boundaries} boundaries")?,
    }
    let undirected = layout.sensors().filter(|(sensor, _)| layout.both_directions(*sensor).is_some()).count();
    match undirected / 2 {
        0 => {}
        1 => writeln!(output, "        1 place reports both directions under one number")?,
        places => writeln!(output, "        {places} places report both directions under one number")?,
    }
    let known = || layout.edges().filter(|(_, edge)| edge.known != StretchLength::Unknown);
    let (shortest, longest) = range_mm(known().map(|(_, edge)| edge.length.as_mm()));
    let unknown = layout.edges().len() - known().count();
    write!(output, "edges   {} of {shortest:.0} to {longest:.0} mm", known().count())?;
    if unknown > 0 {
        write!(output, ", and {unknown} that were not measured")?;
    }
    writeln!(output)?;
    if unknown == 0 {
        writeln!(output, "rails   {:.0} mm", layout.total_length().as_mm())?;
    }
    let survey = layout.survey();
    writeln!(
        output,
        "        edge lengths are known to {} mm: {}",
        survey.uncertainty.as_mm(),
        survey.origin
    )?;
    if survey.scale > 0.0 {
        writeln!(output, "        their common scale is known to {:.1} %", 100.0 * survey.scale)?;
    }
    let measured = sensor_hops(layout).filter(|hop| is_measured(layout, hop));
    let (shortest, longest) = range_mm(measured.map(|hop| hop.length.as_mm()));
    let count = sensor_hops(layout).count();
    write!(output, "hops    {count} from sensor to sensor")?;
    if shortest <= longest {
        write!(output, ", of {shortest:.0} to {longest:.0} mm")?;
    }
    writeln!(output)?;
    for [one, other] in layout.never_both_curved() {
        writeln!(output, "pair    turnouts {one} and {other} are never both curved")?;
    }
    for block in layout.blocks() {
        let Block { name, detector, entries, .. } = block;
        let entries: Vec<&str> = entries.iter().map(|entry| layout.sensor_name(*entry)).collect();
        let rails = block_mm(layout, block);
        writeln!(
            output,
            "block   {name}: detector {detector}, entered at {}, {rails:.0} mm of rails",
            entries.join(", ")
        )?;
    }
    for Crossing { tracks: [one, other] } in layout.crossings() {
        writeln!(output, "cross   {} crosses {}", spot(layout, *one), spot(layout, *other))?;
    }
    for zone in layout.zones() {
        let (limit, rails) = (zone.limit.as_mm_per_s(), restricted_mm(layout, zone));
        writeln!(output, "zone    {}: at most {limit} mm/s on {rails:.0} mm of rails", zone.name)?;
    }
    Ok(())
}

/// The length of rail in a zone, in mm.
fn restricted_mm(layout: &Layout, zone: &Zone) -> f64 {
    let stretches = layout.edges().step_by(2).filter(|(edge, _)| layout.zone(*edge) == Some(zone));
    stretches.map(|(_, edge)| edge.length.as_mm()).sum()
}

/// The places of the boundaries of blocks, each by its first node.
pub(super) fn boundaries(layout: &Layout) -> impl Iterator<Item = NodeId> {
    layout.nodes().step_by(2).map(|(node, _)| node).filter(|node| layout.is_boundary(*node))
}

/// The length of rail in a block, in mm.
fn block_mm(layout: &Layout, block: &Block) -> f64 {
    let edges = block.stretches.iter().filter_map(|stretch| layout.edge(EdgeId(2 * stretch.0)));
    edges.map(|edge| edge.length.as_mm()).sum()
}

/// A place on an edge: `A1 to B3 after 120 mm`.
fn spot(layout: &Layout, at: Position) -> String {
    let name = |node| layout.node_name(node);
    let ends = layout.edge(at.edge).map_or(["?", "?"], |edge| [name(edge.from), name(edge.to)]);
    format!("{} after {:.0} mm", ends.join(" to "), at.offset.as_mm())
}

/// Writes each hop from a sensor to the next, one a line.
fn write_hops(layout: &Layout, output: &mut dyn Write) -> anyhow::Result<()> {
    for hop in sensor_hops(layout) {
        let (from, to) = (layout.node_name(hop.from), layout.node_name(hop.to));
        let needs = facing(&hop).map(|need| format!(" {} {}", need.turnout, need.leg)).collect::<String>();
        if is_measured(layout, &hop) {
            writeln!(output, "{from:>8} {to:<8} {:>5.0} mm {needs}", hop.length.as_mm())?;
        } else {
            writeln!(output, "{from:>8} {to:<8}     ? mm {needs}")?;
        }
    }
    Ok(())
}

fn summary(layout: &Layout) -> Value {
    let [sensors, turnouts, ends] = counts(layout);
    let hops = sensor_hops(layout).map(|hop| {
        let turnouts = facing(&hop).map(|need| json!({ "turnout": need.turnout, "leg": need.leg }));
        json!({
            "from": layout.node_name(hop.from),
            "to": layout.node_name(hop.to),
            "length_mm": is_measured(layout, &hop).then(|| rounded_mm(hop.length.as_mm())),
            "turnouts": turnouts.collect::<Value>(),
        })
    });
    let zones = layout.zones().iter().map(|zone| {
        json!({
            "name": zone.name,
            "max_mm_s": rounded_mm(zone.limit.as_mm_per_s()),
            "length_mm": rounded_mm(restricted_mm(layout, zone)),
        })
    });
    let blocks = layout.blocks().iter().map(|block| {
        json!({
            "name": block.name,
            "detector": block.detector,
            "entries": block.entries.iter().map(|entry| layout.sensor_name(*entry)).collect::<Value>(),
            "length_mm": rounded_mm(block_mm(layout, block)),
        })
    });
    json!({
        "name": layout.name(),
        "nodes": layout.nodes().len(),
        "edges": layout.edges().len(),
        "sensors": sensors,
        "turnouts": turnouts,
        "track_ends": ends,
        "total_length_mm": layout.is_measured().then(|| rounded_mm(layout.total_length().as_mm())),
        "length_uncertainty_mm": rounded_mm(layout.survey().uncertainty.as_mm()),
        "length_origin": layout.survey().origin,
        "never_both_curved": layout.never_both_curved(),
        "boundaries": boundaries(layout).count(),
        "blocks": blocks.collect::<Value>(),
        "crossings": layout.crossings().len(),
        "zones": zones.collect::<Value>(),
        "hops": hops.collect::<Value>(),
    })
}

/// The numbers of sensors, turnouts and track ends.
fn counts(layout: &Layout) -> [usize; 3] {
    let count =
        |is_counted: fn(&NodeKind) -> bool| layout.nodes().filter(|(_, node)| is_counted(&node.kind)).count();
    [
        layout
            .nodes()
            .filter(|(node, _)| layout.sensor_at(*node).is_some() && !layout.is_boundary(*node))
            .count(),
        count(|kind| matches!(kind, NodeKind::Branch(_))),
        count(|kind| matches!(kind, NodeKind::Exit)),
    ]
}

fn sensor_hops(layout: &Layout) -> impl Iterator<Item = Hop<'_>> {
    layout.hops().filter(|hop| layout.sensor_at(hop.from).is_some() && hop.sensor.is_some())
}

/// Whether the lengths of all edges of a hop are known.
fn is_measured(layout: &Layout, hop: &Hop<'_>) -> bool {
    let mut edges = hop.edges.iter().filter_map(|edge| layout.edge(*edge));
    edges.all(|edge| edge.known != StretchLength::Unknown)
}

/// The facing turnouts of a hop.
fn facing<'l>(hop: &Hop<'l>) -> impl Iterator<Item = &'l TurnoutNeed> {
    hop.needs.iter().filter(|need| need.facing)
}

fn range_mm(lengths: impl Iterator<Item = f64>) -> (f64, f64) {
    lengths.fold((f64::INFINITY, 0.0), |(least, most), mm| (mm.min(least), mm.max(most)))
}

/// Rounds to a nanometre, which hides the rounding errors of sums.
fn rounded_mm(mm: f64) -> f64 {
    (mm * 1e6).round() / 1e6
}
