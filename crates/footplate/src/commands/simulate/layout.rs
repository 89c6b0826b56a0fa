//! `footplate simulate layout`: a model train on a layout, polled as by a slow command station.

use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow};
use clap::Args;
use footplate_core::track::Layout;
use footplate_core::{DecoderSteps, TrainId};
use footplate_sim::{LawFamily, Railway, Scenario, SimulatedRecording};
use footplate_store::{layout_named, write_sensor_log, write_whole};

use super::super::Outcome;
use super::station::{Place, Wanted, place_named, serve};
use super::{recording, truth};
use crate::link::{Quirks, StationKind, decoder_of, quirks};

/// Let model trains run through a scenario, each on its own.
///
/// For every train three files are written to the folder: train-N.csv, a sensor log as `footplate calibrate` and
/// `footplate predict` read it; train-N-truth.csv, what was behind each line of it and where the train was; and
/// train-N-truth.json, the true speeds, law, delays and lengths. The same seed writes the same bytes.
///
/// With `--station` nothing is written: a simulated station with trains on the layout serves other programs at a network port
/// or a pseudo-terminal, whose link address is the one line it prints, until Ctrl-C.
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
    #[arg(long, value_parser = scenario_named, required_unless_present = "station")]
    scenario: Option<Scenario>,
    /// How the trains change speed; left out, each train has the next law.
    #[arg(long, value_parser = law_named)]
    law: Option<LawFamily>,
    /// How many trains, 1 if left out; with `--station` their addresses, 24,58 if left out.
    #[arg(long)]
    trains: Option<String>,
    /// The seed of the world.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// The folder to write to; made if it is not there.
    #[arg(long, required_unless_present = "station")]
    out: Option<PathBuf>,
    /// Report on the files as JSON, a line for each train.
    #[arg(long)]
    json: bool,
    /// Serve other programs instead: `tcp:127.0.0.1:0` for any free network port, `udp:127.0.0.1:0` for datagrams, `pty` for a
    /// pseudo-terminal.
    #[arg(long, value_parser = place_named, conflicts_with_all = ["scenario", "out", "json"])]
    station: Option<Place>,
    /// What the station is: `marklin`, a 6051, `dcc-ex`, a DCC-EX board, `z21`, a Z21, `marklin-can`, a Central Station, `loconet`, a
    /// command station on LocoNet behind a server, or `jmri`, JMRI.
    #[arg(long, value_parser = StationKind::named, default_value = "marklin", requires = "station")]
    protocol: StationKind,
    /// The steps of the trains' decoders: 14, 28 or 126.
    #[arg(long, value_parser = decoder_of, default_value = "14", requires = "station")]
    steps: DecoderSteps,
    /// How a station behaves, with commas between: chatter, merged, split, lossy, silent (DCC-EX); lossy, twice, overtaken,
    /// unsubscribed, strict, wrong-xor, short, first-only, locked, can, loconet, railcom, railcom-nonsense (Z21); refused, no-echo, no-version, one-slot, merged,
    /// split (LocoNet); no-prefix, no-power, polled, one-throttle (JMRI).
    #[arg(long, value_parser = quirks, requires = "station")]
    quirks: Option<Quirks>,
    /// How many times faster than real time the station runs.
    #[arg(long, default_value_t = 1.0, requires = "station")]
    speed: f64,
}

/// More trains than have addresses in any form of recording.
const MOST_TRAINS: u16 = 999;

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
        let (Some(scenario), Some(out)) = (self.scenario, &self.out) else {
            self.serve(&layout, output)?;
            return Ok(Outcome::Done);
        };
        let trains = self.train_count()?;
        let railway = Railway::draw(&layout, self.seed)?;
        std::fs::create_dir_all(out).with_context(|| format!("cannot make folder `{}`", out.display()))?;
        for number in 1..=trains {
            // Trains of one seed share the rails; seeds of neighbouring worlds share no train.
            let seed = self.seed.wrapping_mul(1000).wrapping_add(u64::from(number));
            let law = self.law.unwrap_or_else(|| nth_law(seed));
            let simulated = SimulatedRecording::draw(&railway, scenario, TrainId(number), law, seed);
            let files = Files { out, scenario, json: self.json };
            files.write(&layout, &railway, &simulated, output)?;
        }
        Ok(Outcome::Done)
    }

    fn train_count(&self) -> anyhow::Result<u16> {
        let Some(written) = &self.trains else { return Ok(1) };
        let count = written.parse().ok().filter(|count| (1..=MOST_TRAINS).contains(count));
        count.ok_or_else(|| anyhow!("`{written}` is not a number of trains; write 1 to {MOST_TRAINS}"))
    }

    fn serve(&self, layout: &Layout, output: &mut dyn Write) -> anyhow::Result<()> {
        let place = self.station.as_ref().context("say with --station where other programs find it")?;
        let trains = self.trains.as_deref();
        let wanted = Wanted {
            layout: &self.layout,
            seed: self.seed,
            trains,
            law: self.law,
            decoder: self.steps,
            speed: self.speed,
            protocol: self.protocol,
            quirks: self.quirks.unwrap_or_default(),
        };
        serve(place, &wanted, layout, output)
    }
}

/// Where the files of each train go.
struct Files<'a> {
    out: &'a Path,
    scenario: Scenario,
    json: bool,
}

impl Files<'_> {
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
