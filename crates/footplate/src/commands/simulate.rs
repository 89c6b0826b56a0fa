//! `footplate simulate`: worlds whose truth is known.

mod again;
mod chaos;
mod driving;
mod layout;
mod line;
mod long;
mod recording;
mod seed_scores;
mod series;
mod station;
mod survey;
mod traffic;
mod truth;
mod worlds;

use std::io::Write;

use clap::{Args, Subcommand};

use self::seed_scores::SeedScores;
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
    /// Exchange engines, dirty wheels, restart the station, lift trains, and score how a supervised driver copes.
    ///
    /// Each seed is a layout with its trains. Each disturbance happens as if no other had happened before, and one run has none.
    #[command(after_help = "Example: footplate simulate disasters --seeds 1..5 --markdown")]
    Disasters(SeedScores<240>),
    Driving(driving::Arguments),
    Layout(layout::Arguments),
    Line(line::Arguments),
    Long(long::Arguments),
    /// Let calibrated trains hold speeds between those of steps, arrive in time and follow each other, and score them by the truth.
    ///
    /// Each seed is a layout with three trains. Simpler drivers carry out the same orders in the same world.
    #[command(after_help = "Example: footplate simulate pacing --seeds 1..4 --markdown")]
    Pacing(SeedScores),
    Survey(survey::Arguments),
    Traffic(traffic::Arguments),
    Worlds(worlds::Arguments),
    /// Let calibrated trains run, stop, hold speeds, arrive in time and follow each other over speed restrictions, and score
    /// their true speeds there.
    ///
    /// Each seed is a layout with three trains and other restrictions for each of them; zones of its own are not used.
    #[command(after_help = "Example: footplate simulate zones --seeds 1..4 --markdown")]
    Zones(SeedScores),
}

impl Arguments {
    pub(crate) fn run(self, output: &mut dyn Write) -> anyhow::Result<Outcome> {
        match self.world {
            Some(World::Chaos(arguments)) => arguments.run(output),
            Some(World::Disasters(scores)) => scores.disasters(output),
            Some(World::Driving(arguments)) => arguments.run(output),
            Some(World::Layout(arguments)) => arguments.run(output),
            Some(World::Line(arguments)) => arguments.run(output),
            Some(World::Long(arguments)) => arguments.run(output),
            Some(World::Pacing(scores)) => scores.pacing(output),
            Some(World::Survey(arguments)) => arguments.run(output),
            Some(World::Traffic(arguments)) => arguments.run(output),
            Some(World::Worlds(arguments)) => arguments.run(output),
            Some(World::Zones(scores)) => scores.zones(output),
            None => {
                if self.list {
                    layout::list(output)?;
                }
                Ok(Outcome::Done)
            }
        }
    }
}
