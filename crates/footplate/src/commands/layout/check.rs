//! `footplate layout check`: checks a layout file and locates its first error.

use std::io::Write;

use clap::Args;
use footplate_store::layout_named;

use super::show::boundaries;
use crate::commands::Outcome;
use crate::counted::counted;

/// Check a layout.
///
/// Reports the first error with file, line and column, and says what would be right.
#[derive(Args)]
#[command(after_help = "Example: footplate layout check loop.toml")]
pub(super) struct Arguments {
    /// The layout: a file, or the name of a built-in layout.
    layout: String,
}

impl Arguments {
    pub(super) fn run(self, output: &mut dyn Write) -> anyhow::Result<Outcome> {
        let file = layout_named(&self.layout)?;
        let layout = &file.layout;
        let (nodes, edges) = (layout.nodes().len(), layout.edges().len());
        write!(output, "{}: a sound layout of {nodes} nodes and {edges} edges", self.layout)?;
        let [blocks, zones] = [layout.blocks().len(), layout.zones().len()];
        if blocks > 0 {
            let boundaries = boundaries(layout).count();
            write!(output, ", with {} between {boundaries} boundaries", counted(blocks, "block"))?;
        }
        if !layout.crossings().is_empty() {
            write!(output, ", with {}", counted(layout.crossings().len(), "crossing"))?;
        }
        if zones > 0 {
            write!(output, ", with {}", counted(zones, "speed restriction"))?;
        }
        writeln!(output)?;
        Ok(Outcome::Done)
    }
}
