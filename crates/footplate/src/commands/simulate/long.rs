//! `footplate simulate long`: a day of driving, or days of odometry, and what each hour takes of the machine.

mod odometry;
mod process_load;

use std::io::Write;

use clap::Args;
use footplate_core::TimeSpan;
use footplate_eval::figures::{quantile, shown};
use footplate_sim::line::LineScenario;

use self::odometry::OdometerHours;
use self::process_load::ProcessLoad;
use super::super::Outcome;
use crate::commands::drive::LongDrive;
use crate::commands::written_layout::WrittenLayout;

/// A figure of the last quarter may differ from the second by this share (a requirement): the first quarter fills what is bounded.
const FLAT: f64 = 0.05;
/// Errors of some 40 arrivals and processor time differ more than that by chance, and by what else the machine does (seen: errors
/// by 28 %, time by 12 %). A fault shows beyond: the longest yet multiplied the time by four.
const ROUGHLY_FLAT: f64 = 0.5;

/// Drive for hours with a store and a dashboard, or give an odometer hours of periods, and print what each hour came to: memory,
/// descriptors, growth of the store, processor time, accuracy.
///
/// Trains are sent to random places; after a collision, a derailment or an overrun a new session begins. Exit status 1 says
/// that a figure of the last quarter differs from the second quarter by more than 5 %, errors and processor time by more than 50 %.
#[derive(Args)]
#[command(after_help = "\
Examples:
  footplate simulate long --hours 24
  footplate simulate long --odometry N2 --hours 100")]
pub(super) struct Arguments {
    /// Track time, in hours.
    #[arg(long, value_name = "H", default_value = "1", value_parser = hours)]
    hours: TimeSpan,
    /// The seed of rails, trains and places.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// How many trains.
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = clap::value_parser!(u8).range(1..=6))]
    trains: u8,
    /// Instead of driving, the runs of a scenario that `simulate line --list` lists, one after the other through one odometer.
    #[arg(long, value_name = "SCENARIO", value_parser = scenario, conflicts_with = "trains")]
    odometry: Option<LineScenario>,
}

/// Figures of so long are a row; of a quarter of a shorter run.
const PART: TimeSpan = TimeSpan::from_ms(3_600_000);
/// Track time in which each train is calibrated.
const BUDGET: TimeSpan = TimeSpan::from_ms(300_000);

fn hours(text: &str) -> Result<TimeSpan, String> {
    number_of_hours(text).map(|hours| TimeSpan::from_s(3_600.0 * hours))
}

/// Reads track time in hours.
pub(super) fn number_of_hours(text: &str) -> Result<f64, String> {
    let hours = text.parse::<f64>().ok().filter(|hours| (0.05..=10_000.0).contains(hours));
    hours.ok_or_else(|| format!("`{text}` is not a number of hours from 0.05 to 10000"))
}

fn scenario(name: &str) -> Result<LineScenario, String> {
    let found = LineScenario::by_name(name);
    found.ok_or_else(|| format!("there is no scenario `{name}`; `footplate simulate line --list` lists them"))
}

impl Arguments {
    pub(super) fn run(self, output: &mut dyn Write) -> anyhow::Result<Outcome> {
        let mut hours = Hours::default();
        match self.odometry {
            Some(scenario) => self.odometer(scenario, &mut hours, output)?,
            None => self.drive(&mut hours, output)?,
        }
        hours.conclude(output)
    }

    fn part(&self) -> TimeSpan {
        PART.min(TimeSpan::from_ns(self.hours.as_ns() / 4))
    }

    fn drive(&self, hours: &mut Hours, output: &mut dyn Write) -> anyhow::Result<()> {
        let folder = std::env::temp_dir().join(format!("footplate-long-{}", std::process::id()));
        std::fs::create_dir_all(&folder)?;
        let store = folder.join("railway.db");
        let written = WrittenLayout::named("track-a")?;
        let long = LongDrive::new(&written, self.seed, usize::from(self.trains), BUDGET, &store)?;
        writeln!(
            output,
            "| hour | arrivals | refused | helped | grief | error mm | kept % | state kB | store kB | memory kB | descriptors | CPU s |"
        )?;
        writeln!(
            output,
            "| ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |"
        )?;
        let mut before = (ProcessLoad::now(), 0);
        let driven = long.drive(self.hours, self.part(), |hour| {
            let load = ProcessLoad::now();
            let cpu_s = load.cpu_since(&before.0);
            let grown = hour.store_bytes.saturating_sub(before.1);
            before = (load, hour.store_bytes);
            let errors = |part| quantile(hour.errors.iter().map(|error| error.abs().as_mm()), part);
            let kept = 100.0 * hour.kept as f64 / hour.errors.len().max(1) as f64;
            writeln!(
                output,
                "| {:.2} | {} | {} | {} | {} | {} / {} | {kept:.1} | {} | {} | {} | {} | {} |",
                hour.until.as_s() / 3_600.0,
                hour.errors.len(),
                hour.refused,
                hour.helped,
                hour.incidents,
                shown(errors(0.5), 1),
                shown(errors(0.95), 1),
                hour.state_bytes / 1_000,
                grown / 1_000,
                shown(load.memory_kb, 0),
                shown(load.descriptors, 0),
                shown(cpu_s, 1),
            )?;
            output.flush()?;
            hours.add("median error", errors(0.5), ROUGHLY_FLAT);
            hours.add("promises kept", Some(kept), FLAT);
            hours.add("state", Some(hour.state_bytes as f64), FLAT);
            hours.add("growth of the store", Some(grown as f64), FLAT);
            hours.see(&load, cpu_s);
            Ok(())
        });
        let removed = std::fs::remove_dir_all(&folder);
        driven?;
        Ok(removed?)
    }

    fn odometer(
        &self,
        scenario: LineScenario,
        hours: &mut Hours,
        output: &mut dyn Write,
    ) -> anyhow::Result<()> {
        let odometer = OdometerHours::new(scenario, self.seed)?;
        writeln!(
            output,
            "| hour | km | speed rms m/s | distance % | inside | width m/s | memory kB | descriptors | CPU s |"
        )?;
        writeln!(output, "| ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |")?;
        let mut before = ProcessLoad::now();
        odometer.run(self.hours, self.part(), |hour| {
            let load = ProcessLoad::now();
            let cpu_s = load.cpu_since(&before);
            before = load;
            let [rms, distance, width] = [hour.speed_rms(), hour.distance_pct(), hour.mean_width()];
            writeln!(
                output,
                "| {:.2} | {:.1} | {} | {} | {} | {} | {} | {} | {} |",
                hour.until.as_s() / 3_600.0,
                hour.ran.as_m() / 1_000.0,
                shown(rms, 4),
                shown(distance, 4),
                if hour.is_inside { "yes" } else { "no" },
                shown(width, 3),
                shown(load.memory_kb, 0),
                shown(load.descriptors, 0),
                shown(cpu_s, 2),
            )?;
            hours.add("speed rms", rms, FLAT);
            hours.add("width of the interval", width, FLAT);
            hours.see(&load, cpu_s);
            Ok(())
        })
    }
}

/// The figures of all hours, each with the share by which its last quarter may differ from its second.
#[derive(Default)]
struct Hours(Vec<(&'static str, f64, Vec<f64>)>);

impl Hours {
    fn add(&mut self, name: &'static str, value: Option<f64>, flat: f64) {
        let Some(value) = value else { return };
        match self.0.iter_mut().find(|(known, ..)| *known == name) {
            Some((.., values)) => values.push(value),
            None => self.0.push((name, flat, vec![value])),
        }
    }

    fn see(&mut self, load: &ProcessLoad, cpu_s: Option<f64>) {
        self.add("memory", load.memory_kb, FLAT);
        self.add("descriptors", load.descriptors, FLAT);
        self.add("CPU", cpu_s, ROUGHLY_FLAT);
    }

    /// Prints how far the last quarter of the hours differs from the second.
    fn conclude(&self, output: &mut dyn Write) -> anyhow::Result<Outcome> {
        let mut is_flat = true;
        writeln!(output)?;
        for (name, flat, values) in &self.0 {
            let Some(change) = change(values) else { continue };
            is_flat &= change.abs() <= *flat;
            writeln!(output, "{name}: last quarter {:+.1} % of the second", 100.0 * change)?;
        }
        Ok(if is_flat { Outcome::Done } else { Outcome::FallsShort })
    }
}

/// The mean of the last quarter over that of the second, less one; none for fewer than four values.
fn change(values: &[f64]) -> Option<f64> {
    let quarter = values.len() / 4;
    let mean = |part: &[f64]| part.iter().sum::<f64>() / part.len() as f64;
    let [second, last] = [quarter..2 * quarter, values.len() - quarter..values.len()];
    (quarter > 0).then(|| mean(&values[last]) / mean(&values[second]) - 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_whose_processor_time_doubles_falls_short_and_one_that_takes_a_tenth_more_does_not() {
        let ends = |last: f64| {
            let mut hours = Hours::default();
            for cpu_s in [7.0, 7.0, 7.0, last] {
                hours.add("CPU", Some(cpu_s), ROUGHLY_FLAT);
                hours.add("memory", Some(48_000.0), FLAT);
            }
            let mut page = Vec::new();
            let outcome = hours.conclude(&mut page).unwrap();
            (matches!(outcome, Outcome::Done), String::from_utf8(page).unwrap())
        };
        let (is_flat, page) = ends(7.7);
        assert!(is_flat && page.contains("CPU: last quarter +10.0 % of the second"), "{page}");
        assert!(!ends(14.0).0);
    }

    /// The store has one more open for moments, such as its folder; one that each of a hundred orders leaves behind adds a hundred.
    const MOST_MORE_DESCRIPTORS: f64 = 4.0;
    /// The resident memory that twelve minutes may add after as many of warm-up. An object of 100 bytes that each of 100 turns of the loop a
    /// second leaves behind adds 7 MB; a day adds 1 MB (`docs/trust.md`).
    const MOST_GROWN_KB: f64 = 3_000.0;

    #[test]
    fn a_session_keeps_its_descriptors_and_its_memory() {
        let folder = tempfile::tempdir().expect("a folder");
        let written = WrittenLayout::named("track-a").expect("built in");
        let minutes = |minutes: f64| TimeSpan::from_s(60.0 * minutes);
        let store = folder.path().join("railway.db");
        let long = LongDrive::new(&written, 1, 2, minutes(2.0), &store).expect("room for two trains");
        let mut loads = Vec::new();
        let keep = |_: &_| {
            loads.push(ProcessLoad::now());
            Ok(())
        };
        long.drive(minutes(24.0), minutes(6.0), keep).expect("driven");
        let [_, second, _, last] = &loads[..] else { panic!("{} parts", loads.len()) };
        let more = last.descriptors.zip(second.descriptors).map(|(last, second)| last - second);
        assert!(more.is_none_or(|more| more < MOST_MORE_DESCRIPTORS), "{more:?} more descriptors");
        if let (Some(before), Some(after)) = (second.memory_kb, last.memory_kb) {
            assert!(after - before < MOST_GROWN_KB, "{before} to {after} kB");
        }
    }

    #[test]
    fn the_last_quarter_is_compared_with_the_second() {
        assert_eq!(change(&[9.0, 2.0, 7.0, 3.0]), Some(0.5));
        assert_eq!(change(&[9.0, 9.0, 1.0, 3.0, 7.0, 7.0, 1.0, 1.0]), Some(-0.5));
        assert_eq!(change(&[1.0, 1.0, 1.0]), None);
    }
}
