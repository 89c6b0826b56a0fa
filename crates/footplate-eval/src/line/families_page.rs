//! The table of scenarios: for people, for the documentation, and for machines.

use std::io::{self, Write};

use serde_json::{Map, Value, json};

use super::family::{Family, Figures, Spread};
use super::scored_run::{Odometer, ScoredRun};
use crate::commands::odometry::json::score;
use footplate_store::odometry::Preset;

/// All that was scored, and how.
pub(super) struct ScorePage<'r> {
    /// The worlds in order, each with its runs.
    pub(super) families: Vec<Family<'r>>,
    /// Worlds of a kind together: normal runs, slips and slides, faults.
    pub(super) groups: Vec<Family<'r>>,
    /// Everything.
    pub(super) all: Family<'r>,
    /// What was asked for, as on the command line.
    pub(super) asked: String,
}

const OURS: Odometer = Odometer::Ours(Preset::Recommended);

const HEAD: &str = "\
# How good the odometer is

Speed, distance and their bounds by the preset `recommended`, on simulated trains whose truth is known. The [simulator's
page](../theory/line_simulator.md) says what happens in each family of scenarios; it shares no formula with the
odometer. The [score's page](../formats/odometry-result.md) says what the figures mean.
";

const LEGEND: &str = "\
Two figures are the median over runs and the worst run. *Inside* is the share of all periods whose true speed lies within
the interval, rounded down, and the runs whose true distance never left its own. *ETCS* is the share of periods whose
speed is off by more than ETCS allows, over all runs and in the worst. *Delay* is from the first real slip or slide to the
flag on that wheelset; *false flags* is how often a wheelset is flagged that has rolled for two seconds, as part of all
periods of such wheelsets.
";

const OTHERS: &str = "\
The same runs by the published algorithm (`paper`) and by what simpler software makes of the same counts, for the families
of normal runs (N), slips and slides (S) and faults (F), each together.
";

impl ScorePage<'_> {
    /// The tables under a heading, with what the figures mean.
    pub(super) fn write_markdown(&self, output: &mut dyn Write) -> io::Result<()> {
        writeln!(output, "{HEAD}\nMade by `footplate simulate line {}`.\n\n{LEGEND}", self.asked)?;
        self.write_families(output)?;
        writeln!(output, "\n## Beside others\n\n{OTHERS}")?;
        self.write_others(output)
    }

    /// The tables alone.
    pub(super) fn write_text(&self, output: &mut dyn Write) -> io::Result<()> {
        self.write_families(output)?;
        writeln!(output)?;
        self.write_others(output)
    }

    fn write_families(&self, output: &mut dyn Write) -> io::Result<()> {
        writeln!(
            output,
            "| family | runs | speed rms m/s | speed max m/s | distance % | width m/s | speed inside % | distance inside \
             | ETCS % out | delay s | false flags % |\n\
             | --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |"
        )?;
        let last = [&self.all];
        for family in self.families.iter().chain(last.into_iter().filter(|_| self.families.len() > 1)) {
            let figures = family.figures(OURS);
            writeln!(
                output,
                "| {} | {} | {} | {} | {} | {} | {} | {} | {} | {} | {} |",
                family.name,
                family.runs(),
                both(figures.speed_rms_m_s, 3),
                both(figures.speed_max_m_s, 2),
                both(figures.distance_end_pct, 3),
                both(figures.speed_width_mean_m_s, 2),
                rounded_down(figures.speed_inside_pct),
                of_runs(&figures, family),
                etcs(&figures),
                both(figures.detect_delay_s, 2),
                one(family.false_flags_pct(), 3),
            )?;
        }
        Ok(())
    }

    fn write_others(&self, output: &mut dyn Write) -> io::Result<()> {
        writeln!(
            output,
            "| families | odometer | speed rms m/s | speed max m/s | distance % | width m/s | speed inside % \
             | distance inside | ETCS % out |\n| --- | --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: |"
        )?;
        for group in &self.groups {
            for odometer in Odometer::ALL {
                let figures = group.figures(odometer);
                writeln!(
                    output,
                    "| {} | {} | {} | {} | {} | {} | {} | {} | {} |",
                    group.name,
                    odometer.title(),
                    both(figures.speed_rms_m_s, 3),
                    both(figures.speed_max_m_s, 2),
                    both(figures.distance_end_pct, 3),
                    both(figures.speed_width_mean_m_s, 2),
                    rounded_down(figures.speed_inside_pct),
                    of_runs(&figures, group),
                    etcs(&figures),
                )?;
            }
        }
        Ok(())
    }

    /// Whether the truth left an interval of ours more often than they promise.
    pub(super) fn falls_short(&self, least_inside_pct: f64) -> bool {
        let figures = self.all.figures(OURS);
        figures.speed_inside_pct.is_some_and(|pct| pct < least_inside_pct)
            || figures.distance_inside_runs.is_some_and(|held| held < self.all.runs())
    }

    /// Everything for machines: families, all together, and each run with the scores that `footplate odometry` gives it.
    pub(super) fn as_json(&self, runs: &[ScoredRun], names: &[String]) -> Value {
        let each = runs.iter().map(|run| {
            let scores = Odometer::ALL
                .map(|odometer| (odometer.key().to_owned(), score(&odometer.score(&run.scores))));
            json!({
                "scenario": names.get(run.world), "seed": run.seed, "teeth": run.teeth,
                "scores": scores.into_iter().collect::<Map<_, _>>(), "false_flags_pct": run.flags.pct(),
            })
        });
        json!({
            "families": self.families.iter().map(family).collect::<Vec<_>>(),
            "all": family(&self.all),
            "runs": each.collect::<Vec<_>>(),
        })
    }
}

fn family(family: &Family<'_>) -> Value {
    let odometers =
        Odometer::ALL.map(|odometer| (odometer.key().to_owned(), figures(&family.figures(odometer))));
    json!({
        "name": family.name, "runs": family.runs(), "false_flags_pct": family.false_flags_pct(),
        "odometers": odometers.into_iter().collect::<Map<_, _>>(),
    })
}

fn figures(figures: &Figures) -> Value {
    let spread = |spread: Option<Spread>| {
        spread.map(|Spread { median, worst }| json!({ "median": median, "worst": worst }))
    };
    json!({
        "speed_rms_m_s": spread(figures.speed_rms_m_s),
        "speed_max_m_s": spread(figures.speed_max_m_s),
        "distance_end_pct": spread(figures.distance_end_pct),
        "speed_width_mean_m_s": spread(figures.speed_width_mean_m_s),
        "speed_inside_pct": figures.speed_inside_pct,
        "distance_inside_runs": figures.distance_inside_runs,
        "etcs_speed_violation_pct": figures.etcs_speed_violation_pct,
        "etcs_speed_violation_worst_pct": figures.etcs_speed_violation_worst_pct,
        "detect_delay_s": spread(figures.detect_delay_s),
    })
}

pub(super) fn one(value: Option<f64>, decimals: usize) -> String {
    value.map_or_else(|| "–".to_owned(), |value| format!("{value:.decimals$}"))
}

fn both(spread: Option<Spread>, decimals: usize) -> String {
    spread.map_or_else(
        || "–".to_owned(),
        |Spread { median, worst }| format!("{median:.decimals$} / {worst:.decimals$}"),
    )
}

/// To four decimals, so that 100 means all.
pub(super) fn rounded_down(pct: Option<f64>) -> String {
    one(pct.map(|pct| (pct * 1e4).floor() / 1e4), 4)
}

fn of_runs(figures: &Figures, family: &Family<'_>) -> String {
    figures.distance_inside_runs.map_or_else(|| "–".to_owned(), |held| format!("{held} of {}", family.runs()))
}

fn etcs(figures: &Figures) -> String {
    format!(
        "{} / {}",
        one(figures.etcs_speed_violation_pct, 3),
        one(figures.etcs_speed_violation_worst_pct, 2)
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hundred_per_cent_means_all() {
        assert_eq!(rounded_down(Some(99.999_99)), "99.9999");
        assert_eq!(rounded_down(Some(100.0)), "100.0000");
        assert_eq!(rounded_down(None), "–");
    }
}
