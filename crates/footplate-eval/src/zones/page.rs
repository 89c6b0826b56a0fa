//! The table of how well trains keep to speed restrictions: for people, for the documentation, and for machines.

use std::io::{self, Write};

use serde_json::json;

use super::Scored;
use super::passage::Passage;
use super::ride::{Ridden, Task};
use crate::figures::{quantile, shown};
use crate::written_scores::{Rate, WrittenScores};

const HEAD: &str = "\
# How well trains keep to speed restrictions

Random simulated trains, three on a layout, each calibrated from nothing known over the bytes of a virtual 6051. For each of them two
stretches of 25 cm and more of its circuit are restricted to 170 to 280 mm/s, and it is commanded for two minutes each to run at a step
(300 to 450 mm/s), to stop at one place after the other, to hold a speed (300 to 450 mm/s), to arrive at places in time, and to follow
another train. The simulator shares no formula with what drives, and its truth is used for these figures alone.
";

const LEGEND: &str = "\
A *passage* is from the front end's coming into a zone until the rear end has left it; it is *too fast* if the train was ever faster
than the limit meanwhile (asked: no more than 1 % of them for the place and 1 % for the speed), and the *worst* is by how much. What it
costs: the *mean* speed in the zone as part of the limit, and how far before the zone the train was *early* within the limit for the last
time (median). *Distance* is that run in two minutes as part of that of the same train on a layout without zones.
";

/// All that was scored.
pub struct Page {
    /// What every seed came to.
    pub scored: Vec<Scored>,
    /// What was asked for, as on the command line.
    pub asked: String,
}

/// What many passages come to.
struct Figures {
    passages: usize,
    too_fast: usize,
    /// (mm/s).
    worst: f64,
    /// Of those that were too fast, by how much of the limit (%).
    worst_pct: f64,
    /// (%).
    mean: Option<f64>,
    /// (mm).
    early: Option<f64>,
}

impl Figures {
    fn of<'p>(passages: impl Iterator<Item = &'p Passage> + Clone) -> Self {
        let beyond = |passage: &Passage| passage.fastest - passage.limit;
        let too_fast = passages.clone().filter(|passage| beyond(passage) > 0.0);
        let run = passages.clone().filter(|passage| passage.seconds > 0.0);
        let means = run.map(|passage| 100.0 * passage.distance / passage.seconds / passage.limit);
        let early = passages.clone().map(|passage| passage.early).filter(|early| early.is_finite());
        Self {
            passages: passages.count(),
            too_fast: too_fast.clone().count(),
            worst: too_fast.clone().map(beyond).fold(0.0, f64::max),
            worst_pct: too_fast.map(|passage| 100.0 * beyond(passage) / passage.limit).fold(0.0, f64::max),
            mean: quantile(means, 0.5),
            early: quantile(early, 0.5),
        }
    }

    fn too_fast_pct(&self) -> f64 {
        100.0 * self.too_fast as f64 / self.passages.max(1) as f64
    }
}

impl WrittenScores for Page {
    const SCORER: &'static str = "zones";

    fn head(&self) -> String {
        format!("{HEAD}\nMade by `footplate simulate zones {}`.\n", self.asked)
    }

    fn write_text(&self, output: &mut dyn Write) -> io::Result<()> {
        writeln!(output, "{LEGEND}")?;
        writeln!(
            output,
            "| order | rides | failed | passages | too fast | worst mm/s | worst % | mean of the limit | early mm | distance |\n\
             | --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |"
        )?;
        for task in Task::ALL {
            let rides: Vec<&Ridden> = self.rides(task).collect();
            let found = Figures::of(rides.iter().flat_map(|ride| &ride.passages));
            let distance = rides.iter().map(|ride| ride.distance).sum::<f64>();
            let free = self.rides(Task::Unheeding).map(|ride| ride.distance).sum::<f64>();
            writeln!(
                output,
                "| {} | {} | {} | {} | {:.1} % | {:.1} | {:.1} | {} % | {} | {} |",
                task.key(),
                rides.len(),
                rides.iter().filter(|ride| ride.trouble.is_some()).count(),
                found.passages,
                found.too_fast_pct(),
                found.worst,
                found.worst_pct,
                shown(found.mean, 0),
                shown(found.early, 0),
                // Who stops again and again runs less for other reasons.
                if matches!(task, Task::Unheeding | Task::Speed) {
                    format!("{:.0} %", 100.0 * distance / free.max(1.0))
                } else {
                    "–".to_owned()
                },
            )?;
        }
        Ok(())
    }

    fn write_json(&self, output: &mut dyn Write) -> io::Result<()> {
        let rides = self.scored.iter().flat_map(|scored| scored.rides.iter().map(move |ride| (scored, ride)));
        let rides = rides.map(|(scored, ride)| {
            let passages = ride.passages.iter().map(|passage| {
                json!({
                    "limit_mm_s": passage.limit, "fastest_mm_s": passage.fastest, "seconds": passage.seconds,
                    "distance_mm": passage.distance, "early_mm": passage.early.is_finite().then_some(passage.early),
                })
            });
            json!({
                "seed": scored.seed, "train": ride.train.0, "order": ride.task.key(), "distance_mm": ride.distance,
                "seconds": ride.seconds, "done": ride.done, "trouble": ride.trouble,
                "passages": passages.collect::<Vec<_>>(),
            })
        });
        serde_json::to_writer_pretty(&mut *output, &json!({ "rides": rides.collect::<Vec<_>>() }))?;
        writeln!(output)
    }

    fn rates(&self) -> Vec<Rate> {
        let rides: Vec<&Ridden> = self.scored.iter().flat_map(|scored| &scored.rides).collect();
        let heeding = rides.iter().filter(|ride| ride.task != Task::Unheeding);
        let found = Figures::of(heeding.flat_map(|ride| &ride.passages).collect::<Vec<_>>().into_iter());
        let failed = rides.iter().filter(|ride| ride.trouble.is_some()).count();
        vec![
            Rate::new("passages too fast", found.too_fast, found.passages),
            Rate::new("rides that failed", failed, rides.len()),
        ]
    }
}

impl Page {
    fn rides(&self, task: Task) -> impl Iterator<Item = &Ridden> {
        self.scored.iter().flat_map(|scored| &scored.rides).filter(move |ride| ride.task == task)
    }
}
