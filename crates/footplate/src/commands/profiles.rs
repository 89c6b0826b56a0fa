//! `footplate profiles`: speed profiles of other programs, in and out.

mod check;
mod export;
mod import;
mod preview;

use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::Context;
use clap::{Args, Subcommand};
use footplate_core::track::Layout;
use footplate_core::{DecoderSteps, SpeedStep, TrainId};
use footplate_store::{MotionFile, ProfileContext, Store, layout_named};

use super::Outcome;
use crate::clock::{LATEST, now};

/// Import and export speed profiles: JMRI roster entries, Rocrail's mvtrack.csv, CSV.
#[derive(Args)]
#[command(after_help = "\
Examples:
  footplate profiles import roster/Santa_Fe_5253.xml
  footplate profiles import roster/Santa_Fe_5253.xml --train 24 --store railway.db
  footplate profiles export --train 24 --store railway.db --format jmri --into roster/Santa_Fe_5253.xml")]
pub(crate) struct Arguments {
    #[command(subcommand)]
    task: Task,
}

#[derive(Subcommand)]
enum Task {
    Import(import::Arguments),
    Export(export::Arguments),
    /// Withdraw the imported profile of a train: its motion model begins without it.
    #[command(after_help = "Example: footplate profiles withdraw --train 24 --store railway.db")]
    Withdraw(Withdrawal),
    Check(check::Arguments),
}

#[derive(Args)]
struct Withdrawal {
    /// The train.
    #[arg(long, value_name = "N")]
    train: u16,
    /// The store.
    #[arg(long, value_name = "FILE")]
    store: PathBuf,
}

impl Arguments {
    pub(crate) fn run(self, output: &mut dyn Write) -> anyhow::Result<Outcome> {
        match self.task {
            Task::Import(arguments) => arguments.run(output),
            Task::Export(arguments) => arguments.run(output),
            Task::Withdraw(arguments) => arguments.run(output),
            Task::Check(arguments) => arguments.run(output),
        }
    }
}

impl Withdrawal {
    fn run(self, output: &mut dyn Write) -> anyhow::Result<Outcome> {
        let train = TrainId(self.train);
        let mut store = Store::open(&self.store)?;
        let Some(profile) = store.profile(train, LATEST)? else {
            writeln!(output, "train {train} has no imported profile; nothing to withdraw")?;
            return Ok(Outcome::Done);
        };
        store.keep_profile(train, None, now())?;
        writeln!(
            output,
            "train {train}: the profile of {} is withdrawn; it stays in the store's history",
            profile.source
        )?;
        Ok(Outcome::Done)
    }
}

/// What a profile does not say itself.
#[derive(Args)]
struct Reading {
    /// The highest step of the decoder, as the trains are driven [default: 14].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(1..=126))]
    steps: Option<u8>,
    /// The scale, such as 87 for H0: needed where speeds are those of the full-size train.
    #[arg(long, value_name = "N", value_parser = positive)]
    scale: Option<f64>,
    /// The locomotive (column `LocoID`), if mvtrack.csv has several.
    #[arg(long, value_name = "NAME")]
    loco: Option<String>,
    /// The value of the column `Velocity` of mvtrack.csv at full speed [default: 100].
    #[arg(long, value_name = "N", value_parser = positive)]
    full_velocity: Option<f64>,
}

impl Reading {
    /// The highest step as stated.
    fn stated(&self) -> Option<SpeedStep> {
        self.steps.and_then(SpeedStep::new)
    }

    fn highest(&self) -> SpeedStep {
        self.stated().unwrap_or(DecoderSteps::Fourteen.highest())
    }

    fn context(&self) -> ProfileContext {
        let Self { scale, loco, full_velocity, .. } = self;
        ProfileContext {
            highest: self.highest(),
            scale: *scale,
            loco: loco.clone(),
            full_velocity: *full_velocity,
        }
    }
}

fn positive(text: &str) -> Result<f64, String> {
    let number = text.parse::<f64>().ok().filter(|number| *number > 0.0 && number.is_finite());
    number.ok_or_else(|| "write a number above 0".to_owned())
}

/// The stored model of a train with its layout, which is the named one or that of the model.
fn stored_model(
    store: &Store,
    train: TrainId,
    layout: Option<&str>,
) -> anyhow::Result<Option<(MotionFile, Layout)>> {
    // A layout that is named asks for the model made there, even if the train ran on another one since.
    if let Some(Ok(named)) = layout.map(layout_named)
        && let Some(file) = MotionFile::of_store_on(store, train, named.layout.name(), LATEST)?
    {
        return Ok(Some((file, named.layout)));
    }
    let Some(file) = MotionFile::of_store(store, train, LATEST)? else { return Ok(None) };
    let name = layout.unwrap_or(&file.layout);
    let layout = layout_named(name)
        .with_context(|| {
            format!(
                "the model of train {train} is of the layout {}: give its file with --layout",
                file.layout
            )
        })?
        .layout;
    anyhow::ensure!(
        file.layout == layout.name(),
        "the model of train {train} is of the layout {}, not of {}: give its file with --layout",
        file.layout,
        layout.name()
    );
    Ok(Some((file, layout)))
}

/// The name of a file, without its folders.
fn short(path: &Path) -> String {
    path.file_name().map_or_else(|| path.display().to_string(), |name| name.display().to_string())
}
