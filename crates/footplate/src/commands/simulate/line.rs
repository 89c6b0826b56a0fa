//! `footplate simulate line`: full-size trains on wheels with tachometers, as recordings or straight through the odometer.

mod files;
mod world;

use std::io::Write;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use clap::{Args, ValueEnum};
use footplate_core::TimeSpan;
use footplate_eval::line::{FamiliesPage, ScoredRun, ScoredWorld, WorldsPage};
use footplate_eval::seeds::Seeds;
use footplate_sim::line::{LineConditions, LineLevel, LineScenario};
use footplate_store::TableForm;

use self::files::WrittenRun;
use self::world::{LevelName, Scenarios, World};
use super::super::Outcome;
use super::super::odometry::SPEED_INSIDE_PCT;
use crate::spread::each;

/// Periods that an odometer takes (s).
const PERIODS_S: (f64, f64) = (0.001, 1.0);

/// Let full-size trains slip and slide, and write what two tachometers say of it, with the truth.
///
/// For every run two files are written to the folder: NAME-SEED.csv, a recording that `footplate odometry --score` reads,
/// and NAME-SEED.toml, the vehicle as its operator knows it. The same seed writes the same bytes. With `--score`, runs go
/// through the odometer at once, both presets and what simpler ones make of the same counts, and a table says how good
/// each was.
#[derive(Args)]
#[command(
    arg_required_else_help = true,
    after_help = "Examples: footplate simulate line --scenario S1 --seed 7 --out runs
          footplate odometry runs/S1-7.csv --vehicle runs/S1-7.toml --score
          footplate simulate line --train train.toml --line line.toml --out runs
          footplate simulate line --score --seeds 1..100 --teeth 80,100,200
          footplate simulate line --score --worlds fresh:64 --level L1

Exit status: 0 done, 1 the truth left the intervals (--score), 2 wrong usage or input."
)]
pub(super) struct Arguments {
    /// List the scenarios.
    #[arg(long)]
    list: bool,
    /// The scenario, several with commas between them, or all.
    #[arg(long, value_name = "NAME", value_parser = Scenarios::parse, conflicts_with_all = ["train", "line"])]
    scenario: Option<Scenarios>,
    /// A full-size train's file instead of a scenario (docs/formats/train.md).
    #[arg(long, value_name = "FILE", requires = "line")]
    train: Option<PathBuf>,
    /// The line's file that it runs on, from the first stop to the last (docs/formats/line.md).
    #[arg(long, value_name = "FILE", requires = "train")]
    line: Option<PathBuf>,
    /// Random worlds instead of a scenario, by their seeds: 1..1000, or fresh:64 for seeds that the commit draws.
    #[arg(long, value_name = "N", value_parser = Seeds::parse,
          conflicts_with_all = ["scenario", "train", "line", "seed", "teeth", "period", "exact_diameters", "inertial"])]
    worlds: Option<Seeds>,
    /// What is known of a random world; left out, the scores are of every level, and files of L1.
    #[arg(long, value_enum, requires = "worlds")]
    level: Option<LevelName>,
    /// The seed of the run, or of many: 1..100.
    #[arg(long, visible_alias = "seeds", value_name = "N", default_value = "1", value_parser = Seeds::parse)]
    seed: Seeds,
    /// Pulses per revolution of both tachometers; with --score also several: 80,100,200.
    #[arg(long, value_name = "N", value_delimiter = ',', default_value = "100",
          value_parser = clap::value_parser!(u32).range(1..=10_000))]
    teeth: Vec<u32>,
    /// From one sample to the next, in seconds.
    #[arg(long, value_name = "S", default_value = "0.05", value_parser = period)]
    period: TimeSpan,
    /// The diameters that the vehicle states are the true ones.
    #[arg(long)]
    exact_diameters: bool,
    /// The train has an inertial sensor.
    #[arg(long)]
    inertial: bool,
    /// The folder to write to; made if it is not there.
    #[arg(long, value_name = "FOLDER", required_unless_present_any = ["list", "score"], conflicts_with = "score")]
    out: Option<PathBuf>,
    /// What recordings are written as.
    #[arg(long, value_enum, default_value_t = FormName::Csv)]
    format: FormName,
    /// Score the odometer on the runs, without files; all scenarios if none is named.
    #[arg(long)]
    score: bool,
    /// Write the scores as a page of the documentation.
    #[arg(long, requires = "score", conflicts_with = "json")]
    markdown: bool,
    /// Write JSON: a line for each recording, or the scores.
    #[arg(long)]
    json: bool,
    /// How many runs at once; without it, as many as there are cores. The result is the same.
    #[arg(long, value_name = "N")]
    threads: Option<NonZeroUsize>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum FormName {
    /// A text, a row a line.
    Csv,
    /// Columns, compressed.
    Parquet,
}

/// One run to be made.
#[derive(Debug, Clone, Copy)]
struct Job {
    world: usize,
    teeth: u32,
    seed: u64,
}

impl Arguments {
    pub(super) fn run(self, output: &mut dyn Write) -> anyhow::Result<Outcome> {
        if self.list {
            for scenario in LineScenario::all() {
                writeln!(output, "{:<4} {}", scenario.name(), scenario.description())?;
            }
            return Ok(Outcome::Done);
        }
        if let (Some(seeds), None) = (&self.worlds, &self.out) {
            return self.score_random_worlds(seeds, output);
        }
        let worlds = self.what_runs()?;
        match &self.out {
            Some(folder) => self.write_files(folder, &worlds, output),
            None => self.write_scores(&worlds, output),
        }
    }

    fn score_random_worlds(&self, seeds: &Seeds, output: &mut dyn Write) -> anyhow::Result<Outcome> {
        let levels = self.level.map_or(LineLevel::ALL.to_vec(), |name| vec![name.level()]);
        let jobs: Vec<(u64, LineLevel)> =
            levels.iter().flat_map(|level| seeds.iter().map(|seed| (seed, *level))).collect();
        let scored = each("worlds", &jobs, self.threads, |(seed, level)| ScoredWorld::new(*seed, *level))?;
        let level = self.level.map_or(String::new(), |name| format!(" --level {}", name.level().name()));
        let page = WorldsPage::new(scored, format!("--score --worlds {}{level} --markdown", seeds.written()));
        if self.json {
            writeln!(output, "{}", serde_json::to_string_pretty(&page.as_json())?)?;
        } else if self.markdown {
            page.write_markdown(output)?;
        } else {
            page.write_text(output)?;
        }
        Ok(if page.falls_short(SPEED_INSIDE_PCT) { Outcome::FallsShort } else { Outcome::Done })
    }

    fn what_runs(&self) -> anyhow::Result<Vec<World>> {
        if self.worlds.is_some() {
            return Ok(vec![World::Random(self.level.map_or(LineLevel::L1, LevelName::level))]);
        }
        if let (Some(train), Some(line)) = (&self.train, &self.line) {
            return Ok(vec![World::service(train, line)?]);
        }
        let scenarios = match &self.scenario {
            Some(Scenarios(scenarios)) => scenarios.clone(),
            None if self.score => LineScenario::all().to_vec(),
            None => bail!(
                "nothing says what runs; give --scenario with a name that `footplate simulate line --list` lists, or \
                 --train and --line"
            ),
        };
        Ok(scenarios.into_iter().map(World::Scenario).collect())
    }

    /// Every world with every number of teeth and every seed, in this order.
    fn jobs(&self, worlds: usize) -> Vec<Job> {
        let with_teeth = (0..worlds).flat_map(|world| self.teeth.iter().map(move |teeth| (world, *teeth)));
        with_teeth
            .flat_map(|(world, teeth)| {
                self.worlds.as_ref().unwrap_or(&self.seed).iter().map(move |seed| Job { world, teeth, seed })
            })
            .collect()
    }

    fn conditions(&self, teeth: u32) -> LineConditions {
        LineConditions {
            teeth,
            period: self.period,
            exact_diameters: self.exact_diameters,
            inertial_sensor: self.inertial,
        }
    }

    /// Does something for every job on all cores; results in the order of the jobs.
    fn each<T: Send>(
        &self,
        what: &'static str,
        worlds: &[World],
        work: impl Fn(Job, &World) -> anyhow::Result<T> + Sync,
    ) -> anyhow::Result<Vec<T>> {
        each(what, &self.jobs(worlds.len()), self.threads, |job| work(*job, &worlds[job.world]))
    }

    fn write_files(
        &self,
        folder: &Path,
        worlds: &[World],
        output: &mut dyn Write,
    ) -> anyhow::Result<Outcome> {
        if self.teeth.len() > 1 {
            bail!(
                "--out writes one recording for each seed; give --teeth one number and not {}",
                self.teeth.len()
            );
        }
        std::fs::create_dir_all(folder)
            .with_context(|| format!("cannot make folder `{}`", folder.display()))?;
        let form = match self.format {
            FormName::Csv => TableForm::Csv,
            FormName::Parquet => TableForm::Parquet,
        };
        let written = self.each("simulating", worlds, |Job { teeth, seed, .. }, world| {
            let run = world.run(seed, self.conditions(teeth));
            WrittenRun::write(folder, &world.file_name(), seed, form, &run)
        })?;
        for run in &written {
            if self.json {
                writeln!(output, "{}", run.as_json())?;
            } else {
                writeln!(output, "{}", run.as_text())?;
            }
        }
        Ok(Outcome::Done)
    }

    fn write_scores(&self, worlds: &[World], output: &mut dyn Write) -> anyhow::Result<Outcome> {
        let runs = self.each("simulating and scoring", worlds, |Job { world: at, teeth, seed }, world| {
            ScoredRun::new(at, seed, teeth, &world.run(seed, self.conditions(teeth)))
        })?;
        let names: Vec<String> = worlds.iter().map(|world| world.name().to_owned()).collect();
        let page = FamiliesPage::new(&names, &runs, self.train.is_some(), self.asked());
        if self.json {
            writeln!(output, "{}", serde_json::to_string_pretty(&page.as_json(&runs, &names))?)?;
        } else if self.markdown {
            page.write_markdown(output)?;
        } else {
            page.write_text(output)?;
        }
        Ok(if page.falls_short(SPEED_INSIDE_PCT) { Outcome::FallsShort } else { Outcome::Done })
    }

    /// What makes the same page again.
    fn asked(&self) -> String {
        let teeth: Vec<String> = self.teeth.iter().map(ToString::to_string).collect();
        let mut asked = format!("--score --seeds {} --teeth {}", self.seed.written(), teeth.join(","));
        if let Some(Scenarios(scenarios)) = &self.scenario {
            let names: Vec<&str> = scenarios.iter().map(LineScenario::name).collect();
            asked.push_str(&format!(" --scenario {}", names.join(",")));
        }
        if let (Some(train), Some(line)) = (&self.train, &self.line) {
            asked.push_str(&format!(" --train {} --line {}", train.display(), line.display()));
        }
        if self.period != LineConditions::default().period {
            asked.push_str(&format!(" --period {}", self.period.as_s()));
        }
        for (is_given, option) in
            [(self.exact_diameters, " --exact-diameters"), (self.inertial, " --inertial")]
        {
            if is_given {
                asked.push_str(option);
            }
        }
        asked.push_str(" --markdown");
        asked
    }
}

/// A period that an odometer takes.
fn period(text: &str) -> anyhow::Result<TimeSpan> {
    let (shortest, longest) = PERIODS_S;
    match text.parse() {
        Ok(seconds) if (shortest..=longest).contains(&seconds) => Ok(TimeSpan::from_s(seconds)),
        _ => bail!("a period is a number of seconds between {shortest} and {longest}, such as 0.05"),
    }
}
