//! `footplate simulate`: worlds whose truth is known.

mod again;
mod chaos;
mod disasters;
mod driving;
mod layout;
mod line;
mod pacing;
mod recording;
mod score_form;
mod series;
mod station;
mod survey;
mod traffic;
mod truth;
mod worlds;
mod zones;

use std::io::Write;

use clap::{Args, Subcommand};

use super::Outcome;

/// Write recordings of simulated trains, with the truth beside them.
#[derive(Args)]
#[command(
    args_conflicts_with_subcommands = true,
    arg_required_else_help = true,
    after_help = "Example: footplate simulate layout --layout track-a --scenario stops --seed 7 --out runs"
)]
pub(crate) struct Arguments {
    /// List the scenarios and laws of speed change of layouts; `line --list` lists those of lines.
    #[arg(long)]
    list: bool,
    #[command(subcommand)]
    world: Option<World>,
}

#[derive(Subcommand)]
enum World {
    Chaos(chaos::Arguments),
    Disasters(disasters::Arguments),
    Driving(driving::Arguments),
    Layout(layout::Arguments),
    Line(line::Arguments),
    Pacing(pacing::Arguments),
    Survey(survey::Arguments),
    Traffic(traffic::Arguments),
    Worlds(worlds::Arguments),
    Zones(zones::Arguments),
}

impl Arguments {
    pub(crate) fn run(self, output: &mut dyn Write) -> anyhow::Result<Outcome> {
        match self.world {
            Some(World::Chaos(arguments)) => arguments.run(output),
            Some(World::Disasters(arguments)) => arguments.run(output),
            Some(World::Driving(arguments)) => arguments.run(output),
            Some(World::Layout(arguments)) => arguments.run(output),
            Some(World::Line(arguments)) => arguments.run(output),
            Some(World::Pacing(arguments)) => arguments.run(output),
            Some(World::Survey(arguments)) => arguments.run(output),
            Some(World::Traffic(arguments)) => arguments.run(output),
            Some(World::Worlds(arguments)) => arguments.run(output),
            Some(World::Zones(arguments)) => arguments.run(output),
            None => {
                if self.list {
                    layout::list(output)?;
                }
                Ok(Outcome::Done)
            }
        }
    }
}
