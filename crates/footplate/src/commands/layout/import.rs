//! `footplate layout import`: converts tables of nodes and edges, or a panel of JMRI, to a layout file.

use std::ffi::OsStr;
use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::Context;
use clap::Args;
use footplate_core::track::Survey;
use footplate_core::{Length, TurnoutId};
use footplate_store::{
    ImportContext, LayoutFile, LayoutTables, import_layout, import_panel, write_layout, write_whole,
};

use crate::commands::Outcome;
use crate::commands::output_files::check_outputs;

/// The default standard deviation of lengths in mm: two hand surveys of one course track differ from a third by 9 and
/// 11 mm (standard deviation).
const ASSUMED_UNCERTAINTY_MM: &str = "10";
const ASSUMED_ORIGIN: &str = "assumed: surveys of one track differ by 9 to 11 mm (standard deviation)";

/// Import a layout from a panel of JMRI's Layout Editor, or from CSV tables of nodes and directed edges.
///
/// A panel is the file that JMRI saves; what it does not say, such as most lengths, is listed.
///
/// Nodes: name, type (sensor, branch, merge, enter or exit), number, reverse. Edges, with their twins: src, dst,
/// direction (ahead, straight or curved), dist_mm. Points to draw at: name, x_px, y_px.
#[derive(Args)]
#[command(
    after_help = "Examples: footplate layout import panel.xml --out attic.toml\n          footplate layout import --nodes nodes.csv --edges edges.csv --out loop.toml"
)]
pub(super) struct Arguments {
    /// The panel.
    #[arg(value_name = "XML", conflicts_with_all = ["nodes", "edges", "schematic", "never_both_curved"])]
    panel: Option<PathBuf>,
    /// The table of nodes.
    #[arg(long, value_name = "CSV", required_unless_present = "panel")]
    nodes: Option<PathBuf>,
    /// The table of edges.
    #[arg(long, value_name = "CSV", required_unless_present = "panel")]
    edges: Option<PathBuf>,
    /// The table of points to draw at.
    #[arg(long, value_name = "CSV")]
    schematic: Option<PathBuf>,
    /// The layout file to write.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// The name of the layout [default: the file's name].
    #[arg(long)]
    name: Option<String>,
    /// A description of the layout: its place, the surveyor.
    #[arg(long, value_name = "TEXT", default_value = "", hide_default_value = true)]
    about: String,
    /// The standard deviation of the length of an edge.
    #[arg(long, value_name = "MM", default_value = ASSUMED_UNCERTAINTY_MM)]
    length_uncertainty: f64,
    /// The origin of that figure.
    #[arg(long, value_name = "TEXT", default_value = ASSUMED_ORIGIN)]
    length_origin: String,
    /// Two turnouts in one place of which at most one may lie curved, such as 153+154.
    #[arg(long, value_name = "PAIR", value_parser = pair)]
    never_both_curved: Vec<[TurnoutId; 2]>,
}

impl Arguments {
    pub(super) fn run(self, output: &mut dyn Write) -> anyhow::Result<Outcome> {
        let inputs = [&self.panel, &self.nodes, &self.edges, &self.schematic];
        check_outputs(inputs.into_iter().flatten().map(PathBuf::as_path), &[("--out", Some(&self.out))])?;
        let stem = || self.out.file_stem().map(OsStr::to_string_lossy).unwrap_or_default().into_owned();
        let context = ImportContext {
            name: self.name.clone().unwrap_or_else(stem),
            about: self.about.trim().to_owned(),
            survey: Survey::taped(Length::from_mm(self.length_uncertainty), self.length_origin.clone()),
            never_both_curved: self.never_both_curved.clone(),
        };
        let (file, left_out) = self.imported(&context)?;
        let text = write_layout(&file);
        write_whole(&self.out, text.as_bytes()).with_context(|| format!("writing {}", self.out.display()))?;
        let (nodes, edges) = (file.layout.nodes().len(), file.layout.edges().len());
        writeln!(output, "{}: {nodes} nodes and {edges} edges", self.out.display())?;
        for line in left_out {
            writeln!(output, "not imported: {line}")?;
        }
        Ok(Outcome::Done)
    }

    /// The layout, and what it does not have of a panel.
    fn imported(&self, context: &ImportContext) -> anyhow::Result<(LayoutFile, Vec<String>)> {
        let (Some(nodes), Some(edges)) = (&self.nodes, &self.edges) else {
            let path = self.panel.as_deref().unwrap_or(Path::new(""));
            let file = path.display().to_string();
            let text = std::fs::read_to_string(path).with_context(|| format!("reading {file}"))?;
            let panel = import_panel(&file, &text, context)?;
            return Ok((panel.file, panel.left_out));
        };
        let tables = LayoutTables::open(nodes, edges, self.schematic.as_deref())?;
        Ok((import_layout(tables, context)?, Vec::new()))
    }
}

fn pair(text: &str) -> Result<[TurnoutId; 2], String> {
    let numbers =
        text.split_once('+').and_then(|(one, other)| Some([one.parse().ok()?, other.parse().ok()?]));
    numbers
        .map(|pair| pair.map(TurnoutId))
        .ok_or_else(|| "write two turnout numbers as in 153+154".to_owned())
}
