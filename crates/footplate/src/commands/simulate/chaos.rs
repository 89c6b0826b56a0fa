//! `footplate simulate chaos`: the whole program in one process while everything around it fails.

use std::io::Write;
use std::num::NonZeroUsize;

use clap::Args;
use footplate_core::track::Layout;
use footplate_eval::figures::binomial_interval;
use footplate_eval::seeds::Seeds;
use footplate_store::layout_named;

use super::super::Outcome;
use super::again::{FailedRun, name_failed};
use crate::chaos::{Fate, Stage, story};
use crate::spread::each;

/// Run the whole program under seeds that draw a station, a line that fails, a disk that fails, and deaths at any step.
///
/// Three trains are sent to random places. A seed fails if trains touch, derail or run off the track, if an acknowledged
/// measurement is lost, if trains are not stopped within a second after a death, or if nothing moves without an alarm.
#[derive(Args)]
#[command(after_help = "Example: footplate simulate chaos --seeds 1..100")]
pub(super) struct Arguments {
    /// The seed of a story, or of many: 1..1000.
    #[arg(long, visible_alias = "seed", value_name = "N", default_value = "1", value_parser = Seeds::parse)]
    seeds: Seeds,
    /// Tell everything that happens.
    #[arg(long)]
    talk: bool,
    /// How many seeds at once; without it, as many as there are cores. The result is the same.
    #[arg(long, value_name = "N")]
    threads: Option<NonZeroUsize>,
}

impl Arguments {
    pub(super) fn run(self, output: &mut dyn Write) -> anyhow::Result<Outcome> {
        let layout = layout_named("track-a")?.layout;
        let mut stages: Vec<(u64, Vec<u64>)> = Vec::new();
        for seed in self.seeds.iter() {
            let number = Stage::number_of(seed);
            match stages.last_mut() {
                Some((last, seeds)) if *last == number => seeds.push(seed),
                _ => stages.push((number, vec![seed])),
            }
        }
        let fates = each("chaos", &stages, self.threads, |(number, seeds)| fates(&layout, *number, seeds))?;
        let fates: Vec<Fate> = fates.into_iter().flatten().collect();
        if self.talk {
            for (at, words) in fates.iter().flat_map(|fate| &fate.notes) {
                writeln!(output, "{:9.3} {words}", at.as_s())?;
            }
        }
        write(&fates, output)?;
        let failed: Vec<FailedRun> = fates.iter().filter_map(failed).collect();
        Ok(name_failed(&failed))
    }
}

fn fates(layout: &Layout, number: u64, seeds: &[u64]) -> anyhow::Result<Vec<Fate>> {
    let stage = Stage::set(layout, number)?;
    let folder = std::env::temp_dir().join(format!("footplate-chaos-{}-{number}", std::process::id()));
    let fate = |seed: &u64| {
        // Nothing of the story before is left.
        let _ = std::fs::remove_dir_all(&folder);
        std::fs::create_dir_all(&folder)?;
        story(&stage, *seed, &folder.join("railway.db"))
    };
    let fates = seeds.iter().map(fate).collect();
    let _ = std::fs::remove_dir_all(&folder);
    fates
}

fn write(fates: &[Fate], output: &mut dyn Write) -> std::io::Result<()> {
    let sum = |of: fn(&Fate) -> u32| fates.iter().map(of).sum::<u32>();
    let hours = fates.iter().map(|fate| fate.seconds).sum::<f64>() / 3600.0;
    let failed = fates.iter().filter(|fate| !fate.failures.is_empty()).count();
    let mut stopped: Vec<f64> = fates.iter().flat_map(|fate| fate.stopped_ms.iter().copied()).collect();
    stopped.sort_by(f64::total_cmp);
    writeln!(output, "{} stories, {hours:.2} h of track time, {failed} failed", fates.len())?;
    writeln!(output, "{} lives, {} deaths", sum(|fate| fate.lives), sum(|fate| fate.deaths))?;
    if let (Some(median), Some(longest)) = (stopped.get(stopped.len() / 2), stopped.last()) {
        let count = stopped.len();
        writeln!(
            output,
            "all trains stopped after a death: median {median:.0} ms, longest {longest:.0} ms ({count} times)"
        )?;
    }
    writeln!(output, "{} arrivals, {} alarms", sum(|fate| fate.arrivals), sum(|fate| fate.alarms))?;
    writeln!(output, "{} incidents while no command could reach the station", sum(|fate| fate.out_of_reach))?;
    let (entered, set) = (sum(|fate| fate.intrusions) as usize, sum(|fate| fate.grants) as usize);
    let [low, high] = binomial_interval(entered, set).map(|part| 100.0 * part);
    writeln!(
        output,
        "track entered without a reservation: {entered} times, {set} routes were set ({low:.2} to {high:.2} %)"
    )
}

fn failed(fate: &Fate) -> Option<FailedRun> {
    (!fate.failures.is_empty()).then(|| FailedRun {
        what: format!("seed {}: {}", fate.seed, fate.failures.join("; ")),
        again: format!("simulate chaos --seed {} --talk", fate.seed),
    })
}
