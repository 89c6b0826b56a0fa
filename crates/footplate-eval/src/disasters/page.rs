//! The page of the disturbance scores: as text, as documentation, and as JSON.

use std::io::{self, Write};

use serde_json::{Value, json};

use super::Scored;
use super::association::AssociationCounts;
use super::disturbed_run::Outcomes;
use super::figures::Figures;
use super::kind::Kind;
use crate::figures::{median_and_high, shown_pair};
use crate::written_scores::{Rate, WrittenScores};

const HEAD: &str = "\
# What becomes of trains that something happens to

Random simulated trains, calibrated over the bytes of a virtual 6051 and driven round and round under a watchdog, beside
another train that stands. Sensors and turnouts fail now and then. Then something happens that is not reported to the
program. The simulator's truth is used for these figures alone.
";

const LEGEND: &str = "\
*Noticed* is from what happened until the train is commanded to stop for it, and how far it ran in between; *unnoticed* if it is
not, and the train does not stop again and again within 60 mm of where it is ordered to (one that is put down where its next reports
are due runs and stops as if nothing had happened); *known again* until
the train stands, is located again and measured, and may be ordered again: as it was before, its model rescaled, or learnt
anew. *Stops* are at random places, from the step with about 280 mm/s, as far from there as the truth says (mm, median /
95th percentile), before and afterwards. *Grief* counts collisions, derailments and trains that ran past the end of
their track.
";

/// The content of the page.
pub struct Page {
    /// The results of all seeds.
    pub scored: Vec<Scored>,
    /// The arguments of the command line.
    pub asked: String,
}

impl WrittenScores for Page {
    const SCORER: &'static str = "disasters";

    fn head(&self) -> String {
        format!("{HEAD}\nMade by `footplate simulate disasters {}`.\n\n{LEGEND}", self.asked)
    }

    fn write_text(&self, output: &mut dyn Write) -> io::Result<()> {
        writeln!(
            output,
            "| what happened | runs | noticed | unnoticed | after s | distance mm | known again | after s | as before | rescaled | \
             anew | person | power off | stops before | mm | stops after | mm | grief |\n\
             | --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | \
             ---: | ---: | ---: | ---: |"
        )?;
        for figures in self.figures() {
            let [as_before, rescaled, anew] = figures.outcomes;
            writeln!(
                output,
                "| {} | {} | {} | {} | {} | {} | {} | {} | {as_before} | {rescaled} | {anew} | {} | {} | {} | {} | {} | {} | {} |",
                figures.kind.description(),
                figures.runs,
                figures.noticed.len(),
                figures.unnoticed,
                shown_pair(median_and_high(figures.noticed.iter().map(|[seconds, _]| *seconds))),
                shown_pair(median_and_high(figures.noticed.iter().map(|[_, mm]| *mm))),
                figures.recovered.len(),
                shown_pair(median_and_high(figures.recovered.iter().copied())),
                figures.needed_operator,
                figures.powered_off,
                figures.before.len(),
                shown_pair(median_and_high(figures.before.iter().copied())),
                figures.after.len(),
                shown_pair(median_and_high(figures.after.iter().copied())),
                figures.incidents,
            )?;
        }
        let (alarms, hours) = self.alarms();
        writeln!(
            output,
            "\nFalse alarms: {alarms} in {hours:.1} hours of running with nothing but the usual faults of sensors and \
             turnouts.\n\n## Who is where\n"
        )?;
        writeln!(
            output,
            "| trains running | detections of them | associated with the right one | with another | with none | spurious | of these \
             associated |\n| ---: | ---: | ---: | ---: | ---: | ---: | ---: |"
        )?;
        for (trains, counted) in self.associations() {
            let AssociationCounts { right, wrong, rejected, taken, spurious } = counted;
            let all = right + wrong + rejected;
            writeln!(
                output,
                "| {trains} | {all} | {} | {} | {} | {} | {taken} |",
                share(right, all),
                share(wrong, all),
                share(rejected, all),
                taken + spurious,
            )?;
        }
        Ok(())
    }

    fn write_json(&self, output: &mut dyn Write) -> io::Result<()> {
        let kinds: Vec<Value> = self.figures().map(|figures| figures.json()).collect();
        let runs =
            self.scored.iter().flat_map(|scored| scored.runs.iter().map(move |run| (scored.seed, run)));
        let runs = runs.map(|(seed, (kind, run))| {
            json!({
                "seed": seed, "kind": kind.key(), "noticed": run.noticed, "recovered": run.recovered,
                "needed_person": run.needed_operator, "false_alarms": run.false_alarms, "incidents": run.incidents,
                "before_mm": run.before, "after_mm": run.after, "said": run.notices,
            })
        });
        let associations: Vec<Value> = self
            .associations()
            .into_iter()
            .map(|(trains, counted)| {
                json!({
                    "trains": trains, "right": counted.right, "wrong": counted.wrong,
                    "rejected": counted.rejected, "taken": counted.taken, "spurious": counted.spurious,
                })
            })
            .collect();
        let (false_alarms, hours) = self.alarms();
        let all = json!({
            "kinds": kinds, "false_alarms": false_alarms, "hours": hours, "attributed": associations,
            "runs": runs.collect::<Vec<Value>>(),
        });
        writeln!(output, "{all}")
    }

    fn rates(&self) -> Vec<Rate> {
        let runs = || self.scored.iter().flat_map(|scored| &scored.runs);
        let happened = || self.figures();
        let [events, unnoticed, persons] = happened().fold([0; 3], |[all, unnoticed, persons], figures| {
            [all + figures.runs, unnoticed + figures.unnoticed, persons + figures.needed_operator]
        });
        vec![
            Rate::grief(runs().filter(|(_, run)| !run.incidents.is_empty()).count(), runs().count()),
            Rate::new("not noticed", unnoticed, events),
            Rate::new("needed a person", persons, events),
        ]
    }
}

impl Page {
    fn runs(&self, kind: Kind) -> Vec<&Outcomes> {
        self.scored
            .iter()
            .flat_map(|scored| &scored.runs)
            .filter(|(of, _)| *of == kind)
            .map(|(_, run)| run)
            .collect()
    }

    fn figures(&self) -> impl Iterator<Item = Figures> {
        let happened = Kind::ALL.into_iter().filter(|kind| *kind != Kind::Faultless);
        happened.map(|kind| Figures::of(kind, &self.runs(kind)))
    }

    fn alarms(&self) -> (usize, f64) {
        let runs = || self.scored.iter().flat_map(|scored| &scored.runs).map(|(_, run)| run);
        (runs().map(|run| run.false_alarms).sum(), runs().map(|run| run.watched_s).sum::<f64>() / 3600.0)
    }

    fn associations(&self) -> Vec<(usize, AssociationCounts)> {
        let mut sums: Vec<(usize, AssociationCounts)> = Vec::new();
        for (trains, counted) in self.scored.iter().flat_map(|scored| &scored.associations) {
            match sums.iter_mut().find(|(known, _)| known == trains) {
                Some((_, sum)) => sum.add(*counted),
                None => sums.push((*trains, *counted)),
            }
        }
        sums
    }
}

fn share(of: usize, all: usize) -> String {
    if all == 0 { "–".to_owned() } else { format!("{of} ({:.2} %)", 100.0 * of as f64 / all as f64) }
}
