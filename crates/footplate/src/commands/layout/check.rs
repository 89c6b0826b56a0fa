//! `footplate layout check`: checks a layout file and locates its first error.

use std::io::Write;

use clap::Args;
use footplate_store::layout_named;

use crate::commands::Outcome;

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
        match layout.zones().len() {
            0 => writeln!(output)?,
            1 => writeln!(output, ", with one speed restriction")?,
            zones => writeln!(output, ", with {zones} speed restrictions")?,
        }
        Ok(Outcome::Done)
    }
}
