//! The page of the driving scores: as text, as documentation, and as JSON.

use std::io::{self, Write};

use footplate_core::HALF_95;
use footplate_sim::LawFamily;
use serde_json::{Value, json};

use super::figures::{Driven, Figures, Overruns, ScoredTrain};
use super::trial::{NOT_BEYOND_PERCENT, Results};
use crate::figures::{binomial_interval, quantile, shown_pair};
use crate::written_scores::{Rate, WrittenScores};

const HEAD: &str = "\
# How well trains are driven

Random simulated trains, each from nothing known: calibrated over the bytes of a virtual 6051, then driven to random
places. Sensors and turnouts fail now and then. The simulator shares no formula with what drives, and its truth is used
for these figures alone.
";

const LEGEND: &str = "\
*Stops* are at a random sensor and a random offset past it, from steps with true speeds of 200 to 450 mm/s (mid) and
from 500 mm/s on (top); *moves* are of 20 to 400 mm. Errors are true millimetres, median / 95th percentile. The *oracle* is
the same driver with a model made of the truth: what remains cannot be known, scatter of stops first of all. The
*course project* does what published projects do: a constant speed a step, stopping distances by bisection, v²/2a in
between (for moves, too: tables of those that some projects have are left out), no feedback from errors, a position counted
on from the last report; it may measure for as long as it likes.
";

const LEGEND_NOT_BEYOND: &str = "\
Stops that should end beyond their target no more often than stated, and how often they did, with the 95 % interval
(Wilson) of the true share. *Held short* is where half of them ended.
";

/// The content of the page.
pub struct Page<'r> {
    /// The results of all trains.
    pub trains: &'r [ScoredTrain],
    /// The arguments of the command line.
    pub asked: String,
}

impl WrittenScores for Page<'_> {
    const SCORER: &'static str = "driving";

    fn head(&self) -> String {
        format!("{HEAD}\nMade by `footplate simulate driving {}`.\n\n{LEGEND}", self.asked)
    }

    fn write_text(&self, output: &mut dyn Write) -> io::Result<()> {
        self.write_stops(output)?;
        writeln!(output, "\n## Not beyond\n\n{LEGEND_NOT_BEYOND}")?;
        self.write_not_beyond(output)?;
        writeln!(output, "\n## Calibration and position\n")?;
        self.write_rest(output)
    }

    fn write_json(&self, output: &mut dyn Write) -> io::Result<()> {
        let laws = LawFamily::ALL.iter().map(|law| Some(*law)).chain([None]);
        let rows = laws.flat_map(|law| {
            Driven::ALL.map(|by| {
                let figures = self.figures(law, by).json();
                json!({ "law": law.map(LawFamily::name), "by": by.key(), "figures": figures })
            })
        });
        let calibrations = self.trains.iter().map(|train| {
            let by = train.by.iter().zip(Driven::ALL).map(|(results, by)| {
                json!({
                    "by": by.key(), "mid_mm": results.mid, "top_mm": results.top, "moves_mm": results.moves,
                    "not_beyond_mm": results.not_beyond, "failures": results.failures,
                })
            });
            json!({
                "law": train.law.name(), "seed": train.seed, "calibration_s": train.calibration_s,
                "ending": train.ending, "driven": by.collect::<Vec<Value>>(),
            })
        });
        let all = json!({
            "rows": rows.collect::<Vec<Value>>(), "trains": calibrations.collect::<Vec<Value>>(),
        });
        writeln!(output, "{all}")
    }

    fn rates(&self) -> Vec<Rate> {
        let ours = self.figures(None, Driven::Calibrated);
        let [_, moves] = ours.good_moves;
        let limited: usize = ours.beyond.iter().map(|overruns| overruns.stops).sum();
        let orders = ours.stops[0] + ours.stops[1] + limited + moves + ours.failed as usize;
        let wrecked = self.trains.iter().filter(|train| !train.incidents().is_empty());
        let mut rates = vec![
            Rate::grief(wrecked.count(), self.trains.len()),
            Rate::new("orders not carried out", ours.failed as usize, orders),
        ];
        for (allowed, Overruns { over, stops }) in NOT_BEYOND_PERCENT.iter().zip(ours.beyond) {
            rates.push(Rate::new(format!("beyond, allowed {allowed} %"), over, stops));
        }
        rates
    }
}

impl Page<'_> {
    fn of(&self, law: Option<LawFamily>) -> impl Iterator<Item = &ScoredTrain> + Clone {
        self.trains.iter().filter(move |train| law.is_none_or(|law| train.law == law))
    }

    fn figures(&self, law: Option<LawFamily>, by: Driven) -> Figures {
        let place = Driven::ALL.iter().position(|one| *one == by).unwrap_or_default();
        let results: Vec<&Results> = self.of(law).filter_map(|train| train.by.get(place)).collect();
        Figures::of(&results)
    }

    fn laws(&self) -> impl Iterator<Item = Option<LawFamily>> {
        let some = LawFamily::ALL.into_iter().filter(|law| self.of(Some(*law)).next().is_some());
        some.map(Some).chain([None])
    }

    fn write_stops(&self, output: &mut dyn Write) -> io::Result<()> {
        writeln!(
            output,
            "| law | driven by | mid stops | mm | top stops | mm | moves | mm | within 8 mm or 5 % |\n\
             | --- | --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: |"
        )?;
        for law in self.laws() {
            for by in Driven::ALL {
                let figures = self.figures(law, by);
                if figures.stops == [0, 0] {
                    continue;
                }
                let [good, moves] = figures.good_moves;
                writeln!(
                    output,
                    "| {} | {} | {} | {} | {} | {} | {moves} | {} | {} |",
                    law.map_or("all", LawFamily::name),
                    by.key(),
                    figures.stops[0],
                    shown_pair(figures.mid),
                    figures.stops[1],
                    shown_pair(figures.top),
                    shown_pair(figures.moves),
                    share(good, moves),
                )?;
            }
        }
        Ok(())
    }

    fn write_not_beyond(&self, output: &mut dyn Write) -> io::Result<()> {
        writeln!(
            output,
            "| allowed % | driven by | stops | beyond | share % | interval % | held short mm |\n\
             | ---: | --- | ---: | ---: | ---: | ---: | ---: |"
        )?;
        for (nth, allowed) in NOT_BEYOND_PERCENT.iter().enumerate() {
            for by in [Driven::Calibrated, Driven::Oracle] {
                let figures = self.figures(None, by);
                let Overruns { over, stops } = figures.beyond[nth];
                let [low, high] = binomial_interval(over, stops);
                writeln!(
                    output,
                    "| {allowed} | {} | {stops} | {over} | {} | {:.1} to {:.1} | {} |",
                    by.key(),
                    share(over, stops),
                    100.0 * low,
                    100.0 * high,
                    figures.median_rest[nth].map_or_else(none, |mm| format!("{:.0}", -mm)),
                )?;
            }
        }
        Ok(())
    }

    fn write_rest(&self, output: &mut dyn Write) -> io::Result<()> {
        let mut seconds: Vec<f64> = self.trains.iter().map(|train| train.calibration_s).collect();
        seconds.sort_by(f64::total_cmp);
        let middle = seconds.get(seconds.len() / 2).copied().unwrap_or_default();
        let longest = seconds.last().copied().unwrap_or_default();
        writeln!(
            output,
            "{} trains were calibrated in {middle:.0} s of track time (median), the longest in {longest:.0} s.",
            seconds.len(),
        )?;
        let lengths: Vec<[f64; 2]> = self.trains.iter().filter_map(|train| train.length_error_mm).collect();
        let within = |part: f64| quantile(lengths.iter().map(|[error, _]| error.abs()), part);
        if let (Some(median), Some(high)) = (within(0.5), within(0.95)) {
            let inside =
                lengths.iter().filter(|[error, deviation]| error.abs() <= HALF_95 * deviation).count();
            writeln!(
                output,
                "The length of {} trains was learnt from releases of blocks within {median:.1} mm (median), {high:.1} \
                 mm (95 %); {inside} of the 95 % intervals held it.",
                lengths.len(),
            )?;
        }
        for by in Driven::ALL {
            let figures = self.figures(None, by);
            let Some(covered) = figures.covered_pct() else { continue };
            writeln!(
                output,
                "The position interval (95 %) of the {} held the truth {covered:.1} % of the time, changes of speed \
                 included.",
                by.key(),
            )?;
        }
        let counted = |figure: fn(&Figures) -> usize| {
            Driven::ALL.map(|by| format!("{} {}", by.key(), figure(&self.figures(None, by)))).join(", ")
        };
        writeln!(output, "Orders not carried out: {}.", counted(|figures| figures.failed as usize))?;
        writeln!(output, "Trains that came to grief: {}.", counted(|figures| figures.incidents))
    }
}

fn share(of: usize, all: usize) -> String {
    if all == 0 { none() } else { format!("{:.1}", 100.0 * of as f64 / all as f64) }
}

fn none() -> String {
    "–".to_owned()
}
