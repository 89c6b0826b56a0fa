//! The table of promises kept: for people, for the documentation, and for machines.

use std::io::{self, Write};

use serde_json::{Value, json};

use super::figures::Figures;
use super::sessions::ScoredWorld;
use super::world::WorldName;
use crate::standard_error::say;
use footplate_eval::figures::shown;
use footplate_eval::written_scores::{Rate, WrittenScores};

const HEAD: &str = "\
# Promises kept on worlds that differ from ours

Each train is calibrated once and then driven in sessions of stops, in which it goes on learning. The physics of each world
are drawn from a wide range that the estimator is not built on.
";

const LEGEND: &str = "\
A stop is *kept* when the train really comes to rest inside the interval that was promised with 95 % before the stop; the
interval of the share is Wilson's (95 %). *Worst* is the session that kept the smallest share, *below 85 %* how many
sessions did worse than that. Errors are absolute true millimetres, median / 95th percentile; *bias* is their median with the
sign, positive beyond the target. *Width* is the median width of promises that were kept / broken.
";

/// All that was scored.
pub(super) struct Page<'r> {
    pub(super) names: &'r [WorldName],
    pub(super) worlds: &'r [ScoredWorld],
    pub(super) asked: String,
}

impl Page<'_> {
    fn of(&self, name: WorldName) -> Vec<&ScoredWorld> {
        self.worlds.iter().filter(|world| world.name == name).collect()
    }
}

impl WrittenScores for Page<'_> {
    const SCORER: &'static str = "worlds";

    fn head(&self) -> String {
        format!("{HEAD}\nMade by `footplate simulate worlds {}`.\n\n{LEGEND}", self.asked)
    }

    fn write_text(&self, output: &mut dyn Write) -> io::Result<()> {
        writeln!(
            output,
            "| world | stops | kept % | interval % | worst % | below 85 % | error mm | bias mm | width mm | failed | \
             grief |\n| --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |"
        )?;
        for name in self.names {
            let figures = Figures::of(&self.of(*name));
            let percent = |share: f64| format!("{:.1}", 100.0 * share);
            let share = figures.share();
            writeln!(
                output,
                "| {name} | {} | {} | {} | {} | {} of {} | {} / {} | {} | {} / {} | {} | {} |",
                figures.stops,
                share.map_or_else(none, |[share, ..]| percent(share)),
                share.map_or_else(none, |[_, low, high]| format!("{} to {}", percent(low), percent(high))),
                figures.worst.map_or_else(none, |(share, ..)| percent(share)),
                figures.below,
                figures.sessions,
                shown(figures.errors[0], 1),
                shown(figures.errors[1], 1),
                shown(figures.bias, 1),
                shown(figures.widths[0], 0),
                shown(figures.widths[1], 0),
                figures.failed,
                figures.incidents,
            )?;
        }
        let stops: usize = self.worlds.iter().map(|world| world.stops.len()).sum();
        let taken: f64 = self.worlds.iter().map(|world| world.taken.as_secs_f64()).sum();
        let longest = self.worlds.iter().map(|world| world.longest.as_secs_f64()).fold(0.0, f64::max);
        // Times differ from run to run and from machine to machine: they do not go into a page.
        say!(
            "computing: {:.1} ms per stop, {:.1} ms at most at once",
            1e3 * taken / stops.max(1) as f64,
            1e3 * longest
        );
        Ok(())
    }

    fn write_json(&self, output: &mut dyn Write) -> io::Result<()> {
        let rows: Vec<Value> = self
            .names
            .iter()
            .map(|name| json!({ "world": name.to_string(), "figures": Figures::of(&self.of(*name)).json() }))
            .collect();
        let worlds: Vec<Value> = self.worlds.iter().map(world_json).collect();
        writeln!(output, "{}", json!({ "rows": rows, "worlds": worlds }))
    }

    fn rates(&self) -> Vec<Rate> {
        let mut rates = Vec::new();
        for name in self.names {
            let worlds = self.of(*name);
            let figures = Figures::of(&worlds);
            let wrecked = worlds.iter().filter(|world| !world.incidents.is_empty()).count();
            let broken = figures.stops - figures.kept;
            rates.push(Rate::grief(wrecked, worlds.len()));
            rates.push(Rate::new(format!("{name}: 95 % promises broken"), broken, figures.stops));
            rates.push(Rate::new(format!("{name}: sessions below 85 %"), figures.below, figures.sessions));
        }
        rates
    }
}

fn world_json(world: &ScoredWorld) -> Value {
    let stops: Vec<Value> = world
        .stops
        .iter()
        .map(|stop| {
            json!({
                "session": stop.session, "step": stop.step.get(), "target": stop.target, "true_error_mm": stop.error,
                "promised_low_mm": stop.promised[0], "promised_high_mm": stop.promised[1], "kept": stop.is_kept(),
            })
        })
        .collect();
    let per_stop = 1e3 * world.taken.as_secs_f64() / world.stops.len().max(1) as f64;
    json!({
        "world": world.name.to_string(), "seed": world.seed, "calibration_s": world.calibration_s,
        "ending": world.ending, "incidents": world.incidents, "sessions_warned": world.sessions_warned, "failures": world.failures,
        "computing_ms_per_stop": per_stop, "computing_ms_longest": 1e3 * world.longest.as_secs_f64(), "stops": stops,
    })
}

fn none() -> String {
    "–".to_owned()
}
