//! `footplate profiles export`: our speeds and stops for other programs.

use std::io::Write;
use std::path::PathBuf;

use anyhow::{Context, bail, ensure};
use clap::{Args, ValueEnum};
use footplate_core::TrainId;
use footplate_store::{
    LARGEST_PROFILE, ModelRow, Store, read_at_most, write_profile_table, write_roster_entry, write_whole,
};

use super::stored_model;
use crate::commands::Outcome;
use crate::commands::output_files::check_outputs;
use crate::counted::counted;

/// Export the speeds and stops of a train that was calibrated.
///
/// A roster entry of JMRI gets our speeds as its speed profile, and what it has no place for (uncertainty, stopping distances) as
/// attributes that begin with `Footplate.`. Everything else in the file stays as it is, byte for byte.
#[derive(Args)]
#[command(after_help = "\
Examples:
  footplate profiles export --train 24 --store railway.db --format csv
  footplate profiles export --train 24 --store railway.db --format jmri --into roster/Santa_Fe_5253.xml")]
pub(super) struct Arguments {
    /// The train.
    #[arg(long, value_name = "N")]
    train: u16,
    /// The store.
    #[arg(long, value_name = "FILE")]
    store: PathBuf,
    /// The form.
    #[arg(long)]
    format: Format,
    /// The roster entry to write into. Close JMRI first: it writes its roster when it ends.
    #[arg(long, value_name = "ROSTER.xml")]
    into: Option<PathBuf>,
    /// The file to write; standard output for CSV and the roster entry itself for JMRI if not given.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// The layout of the model, if it is not a built-in one.
    #[arg(long, value_name = "LAYOUT")]
    layout: Option<String>,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Format {
    /// A roster entry of JMRI.
    Jmri,
    /// CSV with speeds, stops and their uncertainties by step.
    Csv,
}

impl Arguments {
    pub(super) fn run(self, output: &mut dyn Write) -> anyhow::Result<Outcome> {
        check_outputs(
            [self.store.as_path()],
            &[("--out", self.out.as_deref()), ("--into", self.into.as_deref())],
        )?;
        let train = TrainId(self.train);
        let rows = self.rows(train)?;
        let steps = counted(rows.len(), "step");
        match (self.format, &self.into) {
            (Format::Csv, None) => {
                let table = write_profile_table(&rows);
                match &self.out {
                    Some(path) => {
                        write_whole(path, table.as_bytes()).with_context(|| path.display().to_string())?;
                        writeln!(output, "{}: {steps} of train {train}", path.display())?;
                    }
                    None => output.write_all(table.as_bytes())?,
                }
            }
            (Format::Csv, Some(_)) => bail!("--into is for --format jmri; --out names the file of a CSV"),
            (Format::Jmri, None) => bail!(
                "--format jmri writes into a roster entry: name it with --into, such as --into \
                 ~/.jmri/roster/LOCOMOTIVE.xml; JMRI makes one when you add the locomotive to its roster"
            ),
            (Format::Jmri, Some(entry)) => {
                let name = entry.display().to_string();
                let bytes = read_at_most(entry, LARGEST_PROFILE)
                    .with_context(|| format!("{name}: cannot be read"))?;
                let written = write_roster_entry(&name, &bytes, &rows)?;
                let out = self.out.as_ref().unwrap_or(entry);
                write_whole(out, &written).with_context(|| out.display().to_string())?;
                writeln!(
                    output,
                    "{}: speed profile of train {train} with {steps}; uncertainties and stops as attributes Footplate.*",
                    out.display()
                )?;
            }
        }
        Ok(Outcome::Done)
    }

    fn rows(&self, train: TrainId) -> anyhow::Result<Vec<ModelRow>> {
        let store = Store::open_to_read(&self.store)?;
        let Some((file, layout)) = stored_model(&store, train, self.layout.as_deref())? else {
            bail!(
                "train {train} has no motion model in {}; calibrate or drive it first",
                self.store.display()
            );
        };
        let model = file.model(&layout).with_context(|| format!("the model of train {train}"))?;
        let rows = ModelRow::of_model(&model);
        ensure!(!rows.is_empty(), "no step of train {train} was measured; calibrate or drive it first");
        Ok(rows)
    }
}
