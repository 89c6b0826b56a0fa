//! `footplate profiles check`: how far the speeds of a profile predict each other.

use std::io::Write;
use std::path::PathBuf;

use clap::Args;
use footplate_store::{HoldOut, read_profile};
use serde_json::json;

use super::{Reading, short};
use crate::commands::Outcome;

/// Check profiles: predict each half of the speeds from the other half.
///
/// Of speeds as certain as an import assumes, 95 % are inside their intervals. Gross errors are more than five standard deviations
/// from the prediction; an import ignores them.
#[derive(Args)]
#[command(after_help = "Example: footplate profiles check roster/*.xml")]
pub(super) struct Arguments {
    /// The profiles.
    #[arg(required = true, value_name = "PROFILE")]
    files: Vec<PathBuf>,
    #[command(flatten)]
    reading: Reading,
    /// Write JSON, one line for each profile.
    #[arg(long)]
    json: bool,
}

impl Arguments {
    pub(super) fn run(self, output: &mut dyn Write) -> anyhow::Result<Outcome> {
        let context = self.reading.context();
        let mut total = HoldOut::default();
        if !self.json {
            writeln!(output, "predicted  inside 95 %  gross errors  half width  profile")?;
        }
        for path in &self.files {
            let score = HoldOut::of(&read_profile(path, &context)?, self.reading.highest());
            if self.json {
                let report = json!({
                    "file": short(path),
                    "predicted": score.predicted,
                    "inside": score.inside,
                    "gross": score.gross,
                    "half_width": score.half_width,
                });
                writeln!(output, "{report}")?;
            } else {
                write_row(output, &score, &short(path))?;
            }
            total.add(&score);
        }
        if !self.json && self.files.len() > 1 {
            write_row(output, &total, "all")?;
        }
        Ok(Outcome::Done)
    }
}

fn write_row(output: &mut dyn Write, score: &HoldOut, name: &str) -> std::io::Result<()> {
    let HoldOut { predicted, inside, gross, half_width } = score;
    writeln!(output, "{predicted:>9} {inside:>12} {gross:>13} {:>9.0} %  {name}", 100.0 * half_width)
}
