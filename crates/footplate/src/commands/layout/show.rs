//! `footplate layout show`: what a layout consists of, in words, as JSON or as a drawing.

use std::io::Write;
use std::path::PathBuf;

use anyhow::Context;
use clap::Args;
use footplate_core::track::{Hop, Layout, NodeKind, TurnoutNeed, Zone};
use footplate_store::{LayoutFile, draw_layout, layout_named, write_whole};
use serde_json::{Value, json};

use crate::commands::Outcome;

/// Show what a layout consists of.
#[derive(Args)]
#[command(after_help = "Example: footplate layout show track-a --svg track-a.svg")]
pub(super) struct Arguments {
    /// The layout: the name of a built-in layout (track-a, track-b), or a file.
    layout: String,
    /// List the hops from sensor to sensor as well.
    #[arg(long)]
    hops: bool,
    /// Draw it to this file.
    #[arg(long, value_name = "FILE")]
    svg: Option<PathBuf>,
    /// Write JSON, always with the hops.
    #[arg(long)]
    json: bool,
}

impl Arguments {
    pub(super) fn run(self, output: &mut dyn Write) -> anyhow::Result<Outcome> {
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
    writeln!(output, "nodes   {nodes}: {sensors} sensors, {turnouts} turnouts, {ends} track ends")?;
    let (shortest, longest) = range_mm(layout.edges().map(|(_, edge)| edge.length.as_mm()));
    writeln!(output, "edges   {} of {shortest:.0} to {longest:.0} mm", layout.edges().len())?;
    writeln!(output, "rails   {:.0} mm", layout.total_length().as_mm())?;
    let survey = layout.survey();
    writeln!(output, "        an edge is known to {} mm: {}", survey.uncertainty.as_mm(), survey.origin)?;
    let (shortest, longest) = range_mm(sensor_hops(layout).map(|hop| hop.length.as_mm()));
    let count = sensor_hops(layout).count();
    writeln!(output, "hops    {count} from sensor to sensor, of {shortest:.0} to {longest:.0} mm")?;
    for [one, other] in layout.never_both_curved() {
        writeln!(output, "pair    turnouts {one} and {other} are never both curved")?;
    }
    for zone in layout.zones() {
        let (limit, rails) = (zone.limit.as_mm_per_s(), restricted_mm(layout, zone));
        writeln!(output, "zone    {}: at most {limit} mm/s on {rails:.0} mm of rails", zone.name)?;
    }
    Ok(())
}

/// How long the rails of a zone are.
fn restricted_mm(layout: &Layout, zone: &Zone) -> f64 {
    let stretches = layout.edges().step_by(2).filter(|(edge, _)| layout.zone(*edge) == Some(zone));
    stretches.map(|(_, edge)| edge.length.as_mm()).sum()
}

/// Every way from a sensor to the next, one a line.
fn write_hops(layout: &Layout, output: &mut dyn Write) -> anyhow::Result<()> {
    for hop in sensor_hops(layout) {
        let (from, to) = (layout.node_name(hop.from), layout.node_name(hop.to));
        let needs = facing(&hop).map(|need| format!(" {} {}", need.turnout, need.leg)).collect::<String>();
        writeln!(output, "{from:>8} {to:<8} {:>5.0} mm {needs}", hop.length.as_mm())?;
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
            "length_mm": rounded_mm(hop.length.as_mm()),
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
    json!({
        "name": layout.name(),
        "nodes": layout.nodes().len(),
        "edges": layout.edges().len(),
        "sensors": sensors,
        "turnouts": turnouts,
        "track_ends": ends,
        "total_length_mm": rounded_mm(layout.total_length().as_mm()),
        "length_uncertainty_mm": rounded_mm(layout.survey().uncertainty.as_mm()),
        "length_origin": layout.survey().origin,
        "never_both_curved": layout.never_both_curved(),
        "zones": zones.collect::<Value>(),
        "hops": hops.collect::<Value>(),
    })
}

/// Sensors, turnouts and track ends.
fn counts(layout: &Layout) -> [usize; 3] {
    let count =
        |is_counted: fn(&NodeKind) -> bool| layout.nodes().filter(|(_, node)| is_counted(&node.kind)).count();
    [
        count(|kind| matches!(kind, NodeKind::Sensor(_))),
        count(|kind| matches!(kind, NodeKind::Branch(_))),
        count(|kind| matches!(kind, NodeKind::Exit)),
    ]
}

fn sensor_hops(layout: &Layout) -> impl Iterator<Item = Hop<'_>> {
    layout.hops().filter(|hop| layout.sensor_at(hop.from).is_some() && hop.sensor.is_some())
}

/// The turnouts that decide whether a train takes a hop.
fn facing<'l>(hop: &Hop<'l>) -> impl Iterator<Item = &'l TurnoutNeed> {
    hop.needs.iter().filter(|need| need.facing)
}

fn range_mm(lengths: impl Iterator<Item = f64>) -> (f64, f64) {
    lengths.fold((f64::INFINITY, 0.0), |(least, most), mm| (mm.min(least), mm.max(most)))
}

/// To the nanometre, so that the rounding of sums does not show.
fn rounded_mm(mm: f64) -> f64 {
    (mm * 1e6).round() / 1e6
}
