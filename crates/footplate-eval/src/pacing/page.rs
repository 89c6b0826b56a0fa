//! The table of how well trains keep to a pace: for people, for the documentation, and for machines.

use std::io::{self, Write};
use std::ops::Range;

use serde_json::{Value, json};

use super::Scored;
use super::arrive::{self, Arrived};
use super::counted::By;
use super::follow::{self, Followed, Kept};
use super::hold::{Held, HoldRecord};
use crate::figures::{quantile, root_mean_square, shown, within_pct};
use crate::testbed::GRIEF;
use crate::written_scores::{Rate, WrittenScores};

const HEAD: &str = "\
# How well trains keep to a pace

Random simulated trains, three on a layout, each calibrated from nothing known over the bytes of a virtual 6051. Sensors
fail now and then. The simulator shares no formula with what drives, and its truth is used for these figures alone.
";

const HOLD: &str = "\
## A speed held

Speeds of 200 to 450 mm/s, each held for two minutes on a circuit that the calibration has partly seen. *Mean speed* is over every 3 m (asked: within 0.5 %). *Position* is relative
to that of a train that always ran at the speed, from the sensor at which the driver says it begins (asked: within 15 mm in
95 % of the time). Both are in surveyed lengths: a sensor is at its surveyed place, and between two sensors a train has run the
same share of the surveyed distance as of the true one. *As estimated* is the position that the driver estimated at the same
times: its error comes from the choice of steps and the response to detections, the rest from what the driver did not know. The
*oracle* is the same driver with a model made of the truth. The *nearest step* is the simple driver.
";

const ARRIVE: &str = "\
## In time at a place

Places 1.8 to 6 m ahead, each to be reached after a time that needs a mean speed of 170 to 320 mm/s; every other train runs
when it is ordered. *Near by* are places that turn out to lie less than 1.8 m ahead of a train at rest, as those a round and a
little ahead do: it waits, and moves up. Who cannot be in time is asked again for the time that it offers. True times and places
of rest (asked: 0.3 s and 25 mm at the 95th percentile), median / 95th percentile. As in a session, the driver learns from every
arrival, and first runs a train over a sensor that a sensor has missed. The *oracle* is the same driver with a
model made of the truth. The *step of the mean speed* stops at the same place.
";

const FOLLOW: &str = "\
## Behind each other

Three trains in a row for ten minutes, behind one that runs at 200 to 320 mm/s and changes its speed every 15 to 40 s. The
*gap* is the true time from the train ahead at a sensor to the follower there; *off* is what it differs from the one asked
for, root mean square (asked: 60 ms), mean, and 95th percentile. A gap that would not be safe is refused, and the shortest
safe one and 5 % kept instead. *Nearest* is truly from bumper to bumper (never less than 50 mm is promised). The follower
beside it runs at the step nearest to its leader's speed, and one up or down while it is off by more than 100 ms.
";

const FOLLOW_BY_LENGTH: &str = "\
The same with a gap in length, from the rear of the train ahead to the front of the follower, with the lengths that the driver
knows; *off* is what that differs from the one kept, twenty times a second.
";

/// The simple drivers in the three tables.
const HELD_BY: &str = "nearest step";
const ARRIVED_BY: &str = "step of the mean speed";
const FOLLOWED_BY: &str = "a step up or down";

/// What is asked of a mean speed (%), ...
const MEAN_WITHIN: f64 = 0.5;
/// ... and of a position (mm).
const PLACE_WITHIN: f64 = 15.0;

/// What is asked of an arrival: so many seconds and millimetres.
const ARRIVES_WITHIN: [f64; 2] = [0.3, 25.0];

/// Parts of a run that are distinguished: on the first round lengths are as good as their survey, or as a calibration elsewhere
/// left them.
const MINUTES: [(&str, Range<f64>); 2] = [("first", 0.0..60.0), ("second", 60.0..f64::INFINITY)];

/// All that was scored.
pub struct Page {
    /// What every seed came to.
    pub scored: Vec<Scored>,
    /// What was asked for, as on the command line.
    pub asked: String,
}

impl WrittenScores for Page {
    const SCORER: &'static str = "pacing";

    fn head(&self) -> String {
        format!("{HEAD}\nMade by `footplate simulate pacing {}`.\n", self.asked)
    }

    fn write_text(&self, output: &mut dyn Write) -> io::Result<()> {
        writeln!(output, "{HOLD}")?;
        self.write_held(output)?;
        writeln!(output, "\n{ARRIVE}")?;
        self.write_arrived(output)?;
        writeln!(output, "\n{FOLLOW}")?;
        self.write_followed(output)
    }

    fn write_json(&self, output: &mut dyn Write) -> io::Result<()> {
        let hold = held_rows().map(|(row, minute, span)| {
            let figures = Figures::of(self.held(row.by), row.course, span);
            json!({
                "by": row.name, "minute": minute, "runs": figures.runs, "means_within_0_5_pct": figures.means_within_pct,
                "mean_off_pct_p95": figures.mean_off, "places_within_15_mm_pct": figures.places_within_pct,
                "place_off_mm_p95": figures.place_off, "place_off_mm_most": figures.farthest,
                "commands_per_s": figures.commands_per_s,
            })
        });
        let runs = self.scored.iter().flat_map(|scored| {
            scored.held.iter().map(move |held| {
                let figures = Figures::of(core::iter::once(held), |held| &held.course, 0.0..f64::INFINITY);
                json!({
                    "seed": scored.seed, "train": held.train.0, "by": held.by.key(HELD_BY), "mm_per_s": held.speed,
                    "means_within_0_5_pct": figures.means_within_pct, "mean_off_pct_p95": figures.mean_off,
                    "place_off_mm_p95": figures.place_off, "place_off_mm_most": figures.farthest,
                    "commands_per_s": figures.commands_per_s, "trouble": held.trouble,
                })
            })
        });
        let arrived = self.scored.iter().flat_map(|scored| {
            scored.arrived.iter().map(move |arrived| {
                json!({
                    "seed": scored.seed, "train": arrived.train.0, "by": arrived.by.key(ARRIVED_BY), "from": arrived.from.key(),
                    "within_s": arrived.asked[0], "distance_mm": arrived.asked[1], "offered": arrived.refused,
                    "late_s": arrived.late_and_beyond.map(|[late, _]| late),
                    "beyond_mm": arrived.late_and_beyond.map(|[_, beyond]| beyond),
                    "commands": arrived.commands, "trouble": arrived.trouble,
                })
            })
        });
        let followed = self.scored.iter().flat_map(|scored| {
            scored.followed.iter().map(move |run| {
                let (kept, scale) = match run.kept {
                    Kept::Time => ("s", 1e3),
                    Kept::Length => ("mm", 1.0),
                };
                let off = || run.off.iter().map(|off| scale * off);
                json!({
                    "seed": scored.seed, "train": run.train.0, "by": run.by.key(FOLLOWED_BY), "place": run.place, "gap_in": kept,
                    "gap": run.gaps[0], "kept": run.gaps[1], "rms_ms_or_mm": root_mean_square(off()),
                    "mean_ms_or_mm": off().sum::<f64>() / run.off.len().max(1) as f64, "looks": run.off.len(),
                    "nearest_mm": run.nearest, "held_back": run.held_back,
                    "commands_per_s": run.commands as f64 / run.seconds.max(1.0), "trouble": run.trouble,
                })
            })
        });
        let all = json!({ "hold": hold.collect::<Vec<Value>>(), "held": runs.collect::<Vec<Value>>(), "arrived": arrived.collect::<Vec<Value>>(),
            "followed": followed.collect::<Vec<Value>>(),
        });
        writeln!(output, "{all}")
    }

    fn rates(&self) -> Vec<Rate> {
        let griefs = |scored: &&Scored| scored.troubles().any(|(_, trouble)| trouble.starts_with(GRIEF));
        let failed = self.scored.iter().filter(|scored| scored.troubles().next().is_some());
        let arrived: Vec<[f64; 2]> = self
            .scored
            .iter()
            .flat_map(|scored| &scored.arrived)
            .filter(|arrived| arrived.by == By::Footplate)
            .filter_map(|arrived| arrived.late_and_beyond)
            .collect();
        let is_off =
            |[late, beyond]: &&[f64; 2]| late.abs() > ARRIVES_WITHIN[0] || beyond.abs() > ARRIVES_WITHIN[1];
        vec![
            Rate::grief(self.scored.iter().filter(griefs).count(), self.scored.len()),
            Rate::new("seeds with an order that failed", failed.count(), self.scored.len()),
            Rate::new(
                "arrivals not within 0.3 s and 25 mm",
                arrived.iter().filter(is_off).count(),
                arrived.len(),
            ),
        ]
    }
}

impl Page {
    fn write_followed(&self, output: &mut dyn Write) -> io::Result<()> {
        for (kept, unit, off_in) in [(Kept::Time, "s", "ms"), (Kept::Length, "mm", "mm")] {
            writeln!(
                output,
                "| driven by | asked {unit} | follower | runs | kept {unit} | off {off_in} | mean {off_in} | 95th percentile \
                 {off_in} | nearest mm | held back | failed | commands a second |\n\
                 | --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |"
            )?;
            let gaps = super::GAPS.into_iter().filter(|(of, _)| *of == kept);
            let rows = gaps.flat_map(|(_, gap)| follow::DRIVERS.map(|by| (gap, by)));
            for (gap, by, place) in rows.flat_map(|(gap, by)| [(gap, by, 1), (gap, by, 2)]) {
                self.write_gap(output, (kept, gap), by, place)?;
            }
            if kept == Kept::Time {
                writeln!(output, "\n{FOLLOW_BY_LENGTH}")?;
            }
        }
        Ok(())
    }

    fn write_gap(
        &self,
        output: &mut dyn Write,
        (kept, gap): (Kept, f64),
        by: By,
        place: usize,
    ) -> io::Result<()> {
        let is_of = |run: &&Followed| {
            (run.kept, run.by, run.place) == (kept, by, place) && (run.gaps[0] - gap).abs() < 1e-9
        };
        let all: Vec<&Followed> =
            self.scored.iter().flat_map(|scored| &scored.followed).filter(is_of).collect();
        if all.is_empty() {
            return Ok(());
        }
        let (scale, digits) = match kept {
            Kept::Time => (1e3, 1),
            Kept::Length => (1.0, 0),
        };
        let off = || all.iter().flat_map(|run| &run.off).map(|off| scale * off);
        let count = off().count().max(1) as f64;
        let gaps = all.iter().map(|run| run.gaps[1]);
        let [least, most] = [gaps.clone().fold(f64::INFINITY, f64::min), gaps.fold(0.0, f64::max)];
        let commands: usize = all.iter().map(|run| run.commands).sum();
        let seconds: f64 = all.iter().map(|run| run.seconds).sum();
        writeln!(
            output,
            "| {} | {gap} | {} | {} | {least:.digits$} to {most:.digits$} | {} | {} | {} | {} | {} | {} | {:.2} |",
            by.key(FOLLOWED_BY),
            ["first", "second"][place - 1],
            all.len(),
            shown(root_mean_square(off()), 0),
            shown(Some(off().sum::<f64>() / count), 0),
            shown(quantile(off().map(f64::abs), 0.95), 0),
            shown(quantile(all.iter().map(|run| run.nearest), 0.0), 0),
            all.iter().map(|run| run.held_back).sum::<usize>(),
            all.iter().filter(|run| run.trouble.is_some()).count(),
            commands as f64 / seconds.max(1.0),
        )
    }

    fn arrived(&self, by: By, from: arrive::Began) -> impl Iterator<Item = &Arrived> {
        let all = self.scored.iter().flat_map(|scored| &scored.arrived);
        all.filter(move |arrived| arrived.by == by && arrived.from == from)
    }

    fn write_arrived(&self, output: &mut dyn Write) -> io::Result<()> {
        writeln!(
            output,
            "| driven by | asked | orders | other time offered | failed | late or early s | off mm | commands each |\n\
             | --- | --- | ---: | ---: | ---: | ---: | ---: | ---: |"
        )?;
        for (by, from) in By::ALL.into_iter().flat_map(|by| arrive::Began::ALL.map(|from| (by, from))) {
            let all: Vec<&Arrived> = self.arrived(by, from).collect();
            let off = |which: usize| {
                let values = all.iter().filter_map(|arrived| arrived.late_and_beyond);
                let values: Vec<f64> = values.map(|off| off[which].abs()).collect();
                [0.5, 0.95].map(|part| quantile(values.iter().copied(), part))
            };
            let ([late, latest], [beyond, farthest]) = (off(0), off(1));
            let commands: usize = all.iter().map(|arrived| arrived.commands).sum();
            writeln!(
                output,
                "| {} | {} | {} | {} | {} | {} / {} | {} / {} | {:.1} |",
                by.key(ARRIVED_BY),
                from.key(),
                all.len(),
                all.iter().filter(|arrived| arrived.refused).count(),
                all.iter().filter(|arrived| arrived.trouble.is_some()).count(),
                shown(late, 2),
                shown(latest, 2),
                shown(beyond, 1),
                shown(farthest, 1),
                commands as f64 / all.len().max(1) as f64,
            )?;
        }
        Ok(())
    }

    fn held(&self, by: By) -> impl Iterator<Item = &Held> {
        self.scored.iter().flat_map(|scored| &scored.held).filter(move |held| held.by == by)
    }

    fn write_held(&self, output: &mut dyn Write) -> io::Result<()> {
        writeln!(
            output,
            "| driven by | minute | runs | mean speed within 0.5 % | off % (95th percentile) | position within 15 mm | off mm (95th \
             percentile) | most mm | commands a second |\n\
             | --- | --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: |"
        )?;
        for (row, minute, span) in held_rows() {
            let figures = Figures::of(self.held(row.by), row.course, span);
            writeln!(
                output,
                "| {} | {minute} | {} | {} % | {} | {} % | {} | {} | {:.2} |",
                row.name,
                figures.runs,
                shown(figures.means_within_pct, 1),
                shown(figures.mean_off, 2),
                shown(figures.places_within_pct, 1),
                shown(figures.place_off, 1),
                shown(figures.farthest, 0),
                figures.commands_per_s,
            )?;
        }
        Ok(())
    }
}

/// A row of the table of held speeds: whose runs, and which course of theirs.
#[derive(Clone, Copy)]
struct HeldRow {
    name: &'static str,
    by: By,
    course: fn(&Held) -> &HoldRecord,
}

/// All rows, for each part of a run.
fn held_rows() -> impl Iterator<Item = (HeldRow, &'static str, Range<f64>)> {
    let row = |by: By| HeldRow { name: by.key(HELD_BY), by, course: |held| &held.course };
    let estimated = HeldRow { name: "as estimated", by: By::Footplate, course: |held| &held.estimated };
    let rows = [row(By::Footplate), estimated, row(By::Oracle), row(By::Step)];
    rows.into_iter().flat_map(|row| MINUTES.map(|(minute, span)| (row, minute, span)))
}

/// What several runs come to.
struct Figures {
    runs: usize,
    means_within_pct: Option<f64>,
    /// 95 % of mean speeds were off by no more (%).
    mean_off: Option<f64>,
    places_within_pct: Option<f64>,
    /// 95 % of positions were off by no more (mm), ...
    place_off: Option<f64>,
    /// ... and none by more than this.
    farthest: Option<f64>,
    commands_per_s: f64,
}

impl Figures {
    fn of<'h>(
        runs: impl Iterator<Item = &'h Held>,
        course: fn(&Held) -> &HoldRecord,
        span: Range<f64>,
    ) -> Self {
        let runs: Vec<&Held> = runs.collect();
        let within = |looks: &[[f64; 2]]| {
            let looks = looks.iter().filter(|[since, _]| span.contains(since));
            looks.map(|[_, off]| *off).collect::<Vec<f64>>()
        };
        let off = || runs.iter().flat_map(|held| within(&course(held).off));
        let ahead = || runs.iter().flat_map(|held| within(&course(held).ahead));
        let seconds: f64 = runs.iter().map(|held| held.seconds).sum();
        let commands: usize = runs.iter().map(|held| held.commands).sum();
        Self {
            runs: runs.len(),
            means_within_pct: within_pct(off(), MEAN_WITHIN),
            mean_off: quantile(off().map(f64::abs), 0.95),
            places_within_pct: within_pct(ahead(), PLACE_WITHIN),
            place_off: quantile(ahead().map(f64::abs), 0.95),
            farthest: quantile(ahead().map(f64::abs), 1.0),
            commands_per_s: if seconds > 0.0 { commands as f64 / seconds } else { 0.0 },
        }
    }
}
