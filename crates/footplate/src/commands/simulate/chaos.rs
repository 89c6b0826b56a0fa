//! `footplate simulate chaos`: the whole program in one process while everything around it fails.

mod shares;

use std::collections::BTreeMap;
use std::io::Write;
use std::num::NonZeroUsize;
use std::path::PathBuf;

use clap::Args;
use footplate_core::track::Layout;
use footplate_eval::figures::binomial_interval;
use footplate_eval::seeds::Seeds;
use footplate_store::layout_named;

use self::shares::{Bound, Share};
use super::super::Outcome;
use super::again::{FailedRun, name_failed};
use crate::chaos::{
    FailureKind, Fate, NO_GUARDIAN_HANGS_UNTIL, Promises, STORIES_A_STAGE, Selection, Stage, story,
};
use crate::spread::each;
use crate::standard_error::say;

/// More minimised stories than these take long and say nothing new: a fault that many seeds show is the same one.
const MOST_MINIMISED: usize = 5;
/// Track entered without a reservation, of the routes set: 0.3 % were measured on 2 000 seeds.
const MOST_ENTERED: f64 = 0.005;
/// The stops that must be kept, of the 95 % intervals: what the world with all deviations at once keeps (docs/tables/worlds.md).
const LEAST_STOPS_KEPT: f64 = 0.88;
/// The reports that must come when they were predicted: the same.
const LEAST_TIMES_KEPT: f64 = 0.88;

/// Run the whole program under seeds that draw a station, a line that fails, a disk that fails, and deaths at any step.
///
/// Three trains are sent to random places. A seed fails if trains touch, derail or run off the track, if an acknowledged
/// measurement is lost, if trains are not stopped within a second after a death, or if nothing moves without an alarm. A run
/// of many seeds also fails if trains enter track without a reservation, or break promises of places and times, significantly more often
/// than expected. The first five failing seeds are run again with fewer and shorter troubles, as long as they fail alike.
#[derive(Args)]
#[command(after_help = "Example: footplate simulate chaos --seeds 1..100")]
pub(super) struct Arguments {
    /// The seed of a story, or of many: 1..1000, or fresh:1000, which the commit draws in rows of 32.
    #[arg(long, visible_alias = "seed", value_name = "N", default_value = "1", value_parser = seeds)]
    seeds: Seeds,
    /// Only these troubles of the story, deaths among them, by their numbers: 3,7; 3:0.5 lasts half of its time; none.
    #[arg(long, value_name = "NUMBERS")]
    only: Option<Selection>,
    /// Accept collisions, derailments, overruns and railways that stand without an alarm in so many stories. All other failures are
    /// never accepted.
    #[arg(long, value_name = "N", default_value_t = 0)]
    accept_known: usize,
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
        let only = self.only.as_ref();
        let run = each("chaos", &stages, self.threads, |(number, seeds)| {
            let stage = Stage::set(&layout, *number)?;
            seeds.iter().map(|seed| tell(&stage, *seed, only)).collect::<anyhow::Result<Vec<Fate>>>()
        })?;
        let fates: Vec<Fate> = run.into_iter().flatten().collect();
        if self.talk {
            for fate in &fates {
                list_troubles(&mut *output, fate, only.unwrap_or(&Selection::all(fate.troubles.len())))?;
                for (at, words) in &fate.notes {
                    writeln!(output, "{:9.3} {words}", at.as_s())?;
                }
            }
        }
        write(&fates, output)?;
        let broken: Vec<Share> = shares(&fates).into_iter().filter(Share::is_broken).collect();
        for share in &broken {
            say!("failed: {share}; docs/trust.md says where the bound comes from");
        }
        let failed: Vec<FailedRun> = fates.iter().filter_map(failed).collect();
        let all_well = name_failed(&failed);
        let is_accepted = failed.len() <= self.accept_known && fates.iter().all(|fate| !has_worse(fate));
        // A person who follows one story, or runs a part of it, has its least one already.
        if only.is_none() && !self.talk && !is_accepted {
            minimise(&layout, &fates, self.threads, output)?;
        }
        Ok(match (broken.is_empty(), is_accepted) {
            (false, _) => Outcome::FallsShort,
            (true, true) => Outcome::Done,
            (true, false) => all_well,
        })
    }
}

fn seeds(text: &str) -> anyhow::Result<Seeds> {
    Ok(Seeds::parse_in_rows(text, STORIES_A_STAGE)?.fresh_above(NO_GUARDIAN_HANGS_UNTIL))
}

/// Tells the story of a seed, with all of its troubles or only some.
fn tell(stage: &Stage<'_>, seed: u64, only: Option<&Selection>) -> anyhow::Result<Fate> {
    let folder = folder(seed);
    // Nothing of an earlier story is left.
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder)?;
    let fate = story(stage, seed, only, &folder.join("railway.db"));
    let _ = std::fs::remove_dir_all(&folder);
    fate
}

fn folder(seed: u64) -> PathBuf {
    std::env::temp_dir().join(format!("footplate-chaos-{}-{seed}", std::process::id()))
}

/// Says for the first stories that failed which of their troubles are needed for that.
fn minimise(
    layout: &Layout,
    fates: &[Fate],
    threads: Option<NonZeroUsize>,
    output: &mut dyn Write,
) -> anyhow::Result<()> {
    let failed = fates.iter().filter_map(|fate| Some((fate, fate.failures.first()?.kind)));
    let failed: Vec<(&Fate, FailureKind)> = failed.take(MOST_MINIMISED).collect();
    let least = each("fewer troubles", &failed, threads, |(fate, kind)| {
        let stage = Stage::set(layout, Stage::number_of(fate.seed))?;
        Selection::minimised(fate.troubles.len(), |only| {
            let again = tell(&stage, fate.seed, Some(only))?;
            Ok::<_, anyhow::Error>(again.failures.iter().any(|failure| failure.kind == *kind))
        })
    })?;
    for ((fate, _), least) in failed.iter().zip(&least) {
        let (seed, needed, all) = (fate.seed, least.numbers().count(), fate.troubles.len());
        say!(
            "seed {seed} fails alike with {needed} of its {all} troubles: footplate simulate chaos --seed {seed} --only {least} --talk"
        );
        list_troubles(output, fate, least)?;
    }
    Ok(())
}

fn list_troubles(output: &mut dyn Write, fate: &Fate, only: &Selection) -> std::io::Result<()> {
    let chosen = only.numbers().filter_map(|number| Some((number, fate.troubles.get(number - 1)?)));
    for (number, words) in chosen {
        writeln!(output, "seed {}, trouble {number}: {words}", fate.seed)?;
    }
    Ok(())
}

/// The number of stories in which a train came to grief.
fn griefs(fates: &[Fate]) -> usize {
    fates.iter().filter(|fate| fate.failures.iter().any(|failure| failure.kind.is_grief())).count()
}

/// Whether a story failed as none may.
fn has_worse(fate: &Fate) -> bool {
    fate.failures.iter().any(|failure| !failure.kind.is_known())
}

/// Of each station, how many stories failed, and how many there were.
fn by_station(fates: &[Fate]) -> BTreeMap<&'static str, (usize, usize)> {
    let mut stations = BTreeMap::<_, (usize, usize)>::new();
    for fate in fates {
        let (failed, stories) = stations.entry(fate.station.key()).or_default();
        *failed += usize::from(!fate.failures.is_empty());
        *stories += 1;
    }
    stations
}

fn write(fates: &[Fate], output: &mut dyn Write) -> std::io::Result<()> {
    let sum = |of: fn(&Fate) -> u32| fates.iter().map(of).sum::<u32>();
    let hours = fates.iter().map(|fate| fate.seconds).sum::<f64>() / 3600.0;
    let failed = fates.iter().filter(|fate| !fate.failures.is_empty()).count();
    let grieved = griefs(fates);
    let mut stopped: Vec<f64> = fates.iter().flat_map(|fate| fate.stopped_ms.iter().copied()).collect();
    stopped.sort_by(f64::total_cmp);
    writeln!(output, "{} stories, {hours:.2} h of track time, {failed} failed", fates.len())?;
    for (station, (failed, stories)) in by_station(fates) {
        writeln!(output, "{station}: {failed} of {stories} failed")?;
    }
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
    let [low, high] = binomial_interval(grieved, fates.len()).map(|part| 100.0 * part);
    writeln!(
        output,
        "collisions, derailments and overruns: in {grieved} of {} stories ({low:.2} to {high:.2} %)",
        fates.len()
    )?;
    shares(fates).iter().try_for_each(|share| writeln!(output, "{share}"))
}

/// What happens too seldom or too often only over many stories.
fn shares(fates: &[Fate]) -> [Share; 3] {
    let sum = |of: fn(&Fate) -> usize| fates.iter().map(of).sum::<usize>();
    let entered = Share {
        what: "track entered without a reservation, of routes set",
        times: sum(|fate| fate.intrusions as usize),
        of: sum(|fate| fate.grants as usize),
        bound: Bound::AtMost(MOST_ENTERED),
    };
    let kept = |what, of: fn(&Fate) -> Promises, least| {
        let mut promises = Promises::default();
        fates.iter().for_each(|fate| promises += of(fate));
        Share { what, times: promises.kept, of: promises.made, bound: Bound::AtLeast(least) }
    };
    let stops = kept("promises of places kept (stops)", |fate| fate.stops, LEAST_STOPS_KEPT);
    let times = kept("promises of times kept (reports)", |fate| fate.times, LEAST_TIMES_KEPT);
    [entered, stops, times]
}

fn failed(fate: &Fate) -> Option<FailedRun> {
    let words: Vec<&str> = fate.failures.iter().map(|failure| failure.words.as_str()).collect();
    (!words.is_empty()).then(|| FailedRun {
        what: format!("seed {}: {}", fate.seed, words.join("; ")),
        again: format!("simulate chaos --seed {} --talk", fate.seed),
    })
}
