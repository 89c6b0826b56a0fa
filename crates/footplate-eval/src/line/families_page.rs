//! The table of scenarios: for people, for the documentation, and for machines.

use std::io::{self, Write};

use footplate_store::odometry::Preset;
use serde_json::{Map, Value, json};

use super::family::{Family, Figures, Spread};
use super::score_figures::score_json;
use super::scored_run::{Odometer, ScoredRun};

/// All that was scored, and how.
pub struct FamiliesPage<'r> {
    /// In order, each with its runs.
    families: Vec<Family<'r>>,
    /// Those of a kind together: normal runs, slips and slides, faults.
    groups: Vec<Family<'r>>,
    /// Everything.
    all: Family<'r>,
    /// What was asked for, as on the command line.
    asked: String,
}

const OURS: Odometer = Odometer::Ours(Preset::Recommended);

const HEAD: &str = "\
# How good the odometer is

Speed, distance and their bounds by the preset `recommended`, on simulated trains whose truth is known. The [simulator's
page](../theory/line_simulator.md) says what happens in each family of scenarios; it shares no formula with the
odometer. The [score's page](../formats/odometry-result.md) says what the figures mean.
";

const LEGEND: &str = "\
Two figures are the median over runs and the worst run. *Guaranteed* and *99.99 %* are the two intervals: the mean width of
that of the speed, the share of all periods whose true speed lies within it, rounded down, and of the distance the runs that
never left the guaranteed one, and the share of periods within the other. *ETCS* is the share of periods whose
speed is off by more than ETCS allows, over all runs and in the worst. *Delay* is from the first real slip or slide to the
flag on that wheelset; *false flags* is how often a wheelset is flagged that has rolled for two seconds, as part of all
periods of such wheelsets.
";

/// The columns of both intervals, as [`intervals`] fills them.
const INTERVALS: &str =
    "| guaranteed m/s | guaranteed % | distance inside | 99.99 % m/s | 99.99 % | distance 99.99 %";
const INTERVAL_COLUMNS: &str = "| ---: | ---: | ---: | ---: | ---: | ---:";

const OTHERS: &str = "\
The same runs by the published algorithm (`paper`) and by what simpler software makes of the same counts, for the families
of normal runs (N), slips and slides (S) and faults (F), each together.
";

impl<'r> FamiliesPage<'r> {
    /// The page of runs of families with these names. Families whose names begin with the same letter are of a kind, unless
    /// they are `all_alike`, of one name and kind.
    pub fn new(names: &[String], runs: &'r [ScoredRun], all_alike: bool, asked: String) -> Self {
        let family = |name: &str, is_in: &dyn Fn(usize) -> bool| {
            Family::new(name, runs.iter().filter(|run| is_in(run.family)))
        };
        let families = names.iter().enumerate().map(|(at, name)| family(name, &|of| of == at));
        let kind = |name: &str| if all_alike { name.to_owned() } else { name.chars().take(1).collect() };
        let mut kinds: Vec<String> = names.iter().map(|name| kind(name)).collect();
        kinds.dedup();
        let of_kind =
            |wanted: &String| family(wanted, &|of| names.get(of).is_some_and(|name| kind(name) == *wanted));
        Self {
            families: families.collect(),
            groups: kinds.iter().map(of_kind).collect(),
            all: family("all", &|_| true),
            asked,
        }
    }

    /// The tables under a heading, with what the figures mean.
    ///
    /// # Errors
    /// Those of the output.
    pub fn write_markdown(&self, output: &mut dyn Write) -> io::Result<()> {
        writeln!(output, "{HEAD}\nMade by `footplate simulate line {}`.\n\n{LEGEND}", self.asked)?;
        self.write_families(output)?;
        writeln!(output, "\n## Beside others\n\n{OTHERS}")?;
        self.write_others(output)
    }

    /// The tables alone.
    ///
    /// # Errors
    /// Those of the output.
    pub fn write_text(&self, output: &mut dyn Write) -> io::Result<()> {
        self.write_families(output)?;
        writeln!(output)?;
        self.write_others(output)
    }

    fn write_families(&self, output: &mut dyn Write) -> io::Result<()> {
        writeln!(
            output,
            "| family | runs | speed rms m/s | speed max m/s | distance % {INTERVALS} | ETCS % out | delay s \
             | false flags % |\n\
             | --- | ---: | ---: | ---: | ---: {INTERVAL_COLUMNS} | ---: | ---: | ---: |"
        )?;
        let last = [&self.all];
        for family in self.families.iter().chain(last.into_iter().filter(|_| self.families.len() > 1)) {
            let figures = family.figures(OURS);
            writeln!(
                output,
                "| {} | {} | {} | {} | {} | {} | {} | {} | {} |",
                family.name,
                family.runs(),
                both(figures.speed_rms_m_s, 3),
                both(figures.speed_max_m_s, 2),
                both(figures.distance_end_pct, 3),
                intervals(&figures, family),
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
            "| families | odometer | speed rms m/s | speed max m/s | distance % {INTERVALS} | ETCS % out |\n\
             | --- | --- | ---: | ---: | ---: {INTERVAL_COLUMNS} | ---: |"
        )?;
        for group in &self.groups {
            for odometer in Odometer::ALL {
                let figures = group.figures(odometer);
                writeln!(
                    output,
                    "| {} | {} | {} | {} | {} | {} | {} |",
                    group.name,
                    odometer.title(),
                    both(figures.speed_rms_m_s, 3),
                    both(figures.speed_max_m_s, 2),
                    both(figures.distance_end_pct, 3),
                    intervals(&figures, group),
                    etcs(&figures),
                )?;
            }
        }
        Ok(())
    }

    /// Whether the truth left an interval of ours more often than they promise.
    pub fn falls_short(&self, least_inside_pct: f64) -> bool {
        let figures = self.all.figures(OURS);
        figures.guaranteed_speed_inside_pct.is_some_and(|pct| pct < least_inside_pct)
            || figures.guaranteed_distance_inside_runs.is_some_and(|held| held < self.all.runs())
    }

    /// Everything for machines: families, all together, and each run with the scores that `footplate odometry` gives it.
    pub fn as_json(&self, runs: &[ScoredRun], names: &[String]) -> Value {
        let each = runs.iter().map(|run| {
            let scores = Odometer::ALL
                .map(|odometer| (odometer.key().to_owned(), score_json(&odometer.score(&run.scores))));
            json!({
                "scenario": names.get(run.family), "seed": run.seed, "teeth": run.teeth,
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
        "guaranteed_speed_width_m_s": spread(figures.guaranteed_speed_width_m_s),
        "guaranteed_speed_inside_pct": figures.guaranteed_speed_inside_pct,
        "guaranteed_distance_inside_runs": figures.guaranteed_distance_inside_runs,
        "confidence_speed_width_m_s": spread(figures.confidence_speed_width_m_s),
        "confidence_speed_inside_pct": figures.confidence_speed_inside_pct,
        "confidence_distance_inside_pct": figures.confidence_distance_inside_pct,
        "etcs_speed_violation_pct": figures.etcs_speed_violation_pct,
        "etcs_speed_violation_worst_pct": figures.etcs_speed_violation_worst_pct,
        "detect_delay_s": spread(figures.detect_delay_s),
    })
}

pub(crate) fn one(value: Option<f64>, decimals: usize) -> String {
    value.map_or_else(|| "–".to_owned(), |value| format!("{value:.decimals$}"))
}

fn both(spread: Option<Spread>, decimals: usize) -> String {
    spread.map_or_else(
        || "–".to_owned(),
        |Spread { median, worst }| format!("{median:.decimals$} / {worst:.decimals$}"),
    )
}

/// To four decimals, so that 100 means all.
pub(crate) fn rounded_down(pct: Option<f64>) -> String {
    one(pct.map(|pct| (pct * 1e4).floor() / 1e4), 4)
}

/// Each interval with its own width.
fn intervals(figures: &Figures, family: &Family<'_>) -> String {
    let runs_inside = figures.guaranteed_distance_inside_runs;
    [
        both(figures.guaranteed_speed_width_m_s, 2),
        rounded_down(figures.guaranteed_speed_inside_pct),
        runs_inside.map_or_else(|| "–".to_owned(), |held| format!("{held} of {}", family.runs())),
        both(figures.confidence_speed_width_m_s, 2),
        rounded_down(figures.confidence_speed_inside_pct),
        rounded_down(figures.confidence_distance_inside_pct),
    ]
    .join(" | ")
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
