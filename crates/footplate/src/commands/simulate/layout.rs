//! `footplate simulate layout`: a model train on a layout, polled as by a slow command station.

use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow};
use clap::Args;
use footplate_core::TrainId;
use footplate_core::track::Layout;
use footplate_sim::{LawFamily, Railway, Scenario, SimulatedRecording};
use footplate_store::{layout_named, write_sensor_log, write_whole};

use super::super::Outcome;
use super::{recording, truth};

/// Let model trains run through a scenario, each on its own.
///
/// For every train three files are written to the folder: train-N.csv, a sensor log as `footplate calibrate` and
/// `footplate predict` read it; train-N-truth.csv, what was behind each line of it and where the train was; and
/// train-N-truth.json, the true speeds, law, delays and lengths. The same seed writes the same bytes.
#[derive(Args)]
#[command(
    after_help = "Example: footplate simulate layout --layout track-a --trains 3 --scenario calibration --seed 7 \
                        --out runs"
)]
pub(super) struct Arguments {
    /// The layout: the name of a built-in one or a layout file.
    #[arg(long, default_value = "track-a")]
    layout: String,
    /// What is done; `footplate simulate --list` names all.
    #[arg(long, value_parser = scenario_named)]
    scenario: Scenario,
    /// How the trains change speed; left out, each train has the next law.
    #[arg(long, value_parser = law_named)]
    law: Option<LawFamily>,
    /// How many trains.
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=999))]
    trains: u16,
    /// The seed of the world.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// The folder to write to; made if it is not there.
    #[arg(long)]
    out: PathBuf,
    /// Report on the files as JSON, a line for each train.
    #[arg(long)]
    json: bool,
}

/// Prints the scenarios and laws.
pub(super) fn list(output: &mut dyn Write) -> anyhow::Result<()> {
    writeln!(output, "Scenarios:")?;
    for scenario in Scenario::all() {
        writeln!(output, "  {:<12}  {}", scenario.name(), scenario.says())?;
    }
    let laws: Vec<&str> = LawFamily::ALL.iter().map(|law| law.name()).collect();
    writeln!(output, "\nLaws of speed change:\n  {}", laws.join(", "))?;
    Ok(())
}

impl Arguments {
    pub(super) fn run(self, output: &mut dyn Write) -> anyhow::Result<Outcome> {
        let layout = layout_named(&self.layout)?.layout;
        let railway = Railway::draw(&layout, self.seed)?;
        std::fs::create_dir_all(&self.out)
            .with_context(|| format!("cannot make folder `{}`", self.out.display()))?;
        for number in 1..=self.trains {
            // Trains of one seed share the rails; seeds of neighbouring worlds share no train.
            let seed = self.seed.wrapping_mul(1000).wrapping_add(u64::from(number));
            let law = self.law.unwrap_or_else(|| nth_law(seed));
            let simulated = SimulatedRecording::draw(&railway, self.scenario, TrainId(number), law, seed);
            self.write(&layout, &railway, &simulated, output)?;
        }
        Ok(Outcome::Done)
    }

    fn write(
        &self,
        layout: &Layout,
        railway: &Railway<'_>,
        simulated: &SimulatedRecording,
        output: &mut dyn Write,
    ) -> anyhow::Result<()> {
        let name = format!("train-{}", simulated.train_id);
        let mut log = Vec::new();
        let recording = recording::of(simulated, &name);
        write_sensor_log(&recording, layout, &mut log)?;
        let path = self.out.join(format!("{name}.csv"));
        write_file(&path, &log)?;
        write_file(&self.out.join(format!("{name}-truth.csv")), truth::csv(layout, simulated).as_bytes())?;
        let parameters = serde_json::to_vec_pretty(&truth::parameters(railway, simulated, self.scenario))?;
        write_file(&self.out.join(format!("{name}-truth.json")), &parameters)?;

        let reports: usize = simulated.runs.iter().map(|run| run.truth.reports.len()).sum();
        let lasted = simulated.runs.iter().map(|run| run.truth.motion.ends() - run.truth.motion.begins());
        let lasted_s = lasted.fold(0.0, |total, span| total + span.as_s());
        let runs = simulated.runs.len();
        let law = simulated.train.law.family();
        if self.json {
            let line = serde_json::json!({
                "train": simulated.train_id.0, "law": law.name(), "log": path, "runs": runs, "reports": reports,
                "simulated_s": lasted_s,
            });
            writeln!(output, "{line}")?;
        } else {
            writeln!(
                output,
                "{}: law {law}, {runs} runs of {lasted_s:.0} s in all, {reports} reports",
                path.display()
            )?;
        }
        Ok(())
    }
}

fn write_file(path: &Path, contents: &[u8]) -> anyhow::Result<()> {
    write_whole(path, contents).with_context(|| format!("cannot write `{}`", path.display()))
}

fn nth_law(seed: u64) -> LawFamily {
    let [first, ..] = LawFamily::ALL;
    LawFamily::ALL.into_iter().cycle().nth((seed % LawFamily::ALL.len() as u64) as usize).unwrap_or(first)
}

fn scenario_named(name: &str) -> anyhow::Result<Scenario> {
    let names = || Scenario::all().iter().map(Scenario::name).collect::<Vec<_>>().join(", ");
    Scenario::named(name).ok_or_else(|| anyhow!("there is no scenario of that name; there are {}", names()))
}

fn law_named(name: &str) -> anyhow::Result<LawFamily> {
    let names = || LawFamily::ALL.map(LawFamily::name).join(", ");
    LawFamily::ALL
        .into_iter()
        .find(|law| law.name() == name)
        .ok_or_else(|| anyhow!("there is no law of that name; there are {}", names()))
}
