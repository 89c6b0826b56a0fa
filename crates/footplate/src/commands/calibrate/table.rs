//! A calibration as a person reads it.

use std::io::{self, Write};

use footplate_core::Approach;
use footplate_core::model::report::Direction;
use footplate_store::{Findings, MotionStepForm, TrainFindings};

use crate::counted::counted;

/// How many other laws are printed beside the best.
const RUNNERS_UP: usize = 2;

pub(super) fn write(report: &Findings, output: &mut dyn Write) -> io::Result<()> {
    for polling in &report.polling {
        match &polling.period {
            Some(period) => writeln!(
                output,
                "{}: polled every {} idle, {:.2} ms after a report, jitter {:.2} ms ({} gaps)",
                polling.recording, period, polling.after_report_ms, polling.jitter_ms, period.measurements
            )?,
            None => writeln!(
                output,
                "{}: the reports show no poll period; {:.0} ms is assumed",
                polling.recording, polling.after_report_ms
            )?,
        }
    }
    for train in &report.trains {
        writeln!(output)?;
        write_train(train, output)?;
    }
    writeln!(
        output,
        "\nvalue ± one standard deviation of the estimate; std dev is the repeatability of a single \
         stop. Speeds are computed from\nlengths, so all of them share the uncertainty of the survey. \
         For the measurements behind a number: --explain SPEED:14"
    )
}

fn write_train(train: &TrainFindings, output: &mut dyn Write) -> io::Result<()> {
    write!(
        output,
        "Train {}: {}, {}",
        train.train,
        counted(train.runs, "run"),
        counted(train.contacts, "sensor report")
    )?;
    if train.silent_runs > 0 {
        write!(output, ", {} runs without a timed one (stalled, or too slow)", train.silent_runs)?;
    }
    writeln!(
        output,
        "\n  sensors repeat to {:.1} mm, runs to {:.1} % of the speed of their step (one standard \
         deviation)",
        train.contact_scatter_mm, train.run_deviation_percent
    )?;
    writeln!(
        output,
        "\n  step  reached from       speed mm/s    reports         stop mm   std dev   time s   stops"
    )?;
    for step in train.steps.iter().filter(|step| step.is_measured()) {
        let MotionStepForm { speed, stop, .. } = step;
        writeln!(
            output,
            "  {:>4}  {:<12} {:>8.1} ± {:<5.1} {:>7} {:>9.0} ± {:<5.0} {:>7.0} {:>8.2} {:>7}",
            step.step,
            approach(step.approach),
            speed.value,
            speed.uncertainty,
            speed.measurements,
            stop.value,
            stop.uncertainty,
            step.stop_scatter_mm,
            step.stop_s,
            stop.measurements
        )?;
    }
    write_stops(train, output)?;
    write_laws(train, output)?;
    write_lengths(train, output)?;
    write_suspicious(train, output)
}

fn write_laws(train: &TrainFindings, output: &mut dyn Write) -> io::Result<()> {
    for law in &train.laws {
        let direction = match law.direction {
            Direction::Up => "faster",
            Direction::Down => "slower",
        };
        writeln!(output, "\n  getting {direction}, best described by: {}", law.best.name)?;
        writeln!(
            output,
            "    {}, begins {} after the command; {} changes, held-out error {:.0} mm",
            law.best.pace, law.best.delay, law.changes, law.best.held_out_mm
        )?;
        let others: Vec<String> = law
            .others
            .iter()
            .take(RUNNERS_UP)
            .map(|other| {
                format!(
                    "{} ({:+.0}, {:.0} mm)",
                    other.name,
                    other.criterion - law.best.criterion,
                    other.held_out_mm
                )
            })
            .collect();
        writeln!(output, "    next best (criterion above it, held-out error): {}", others.join("; "))?;
        if !law.fits {
            writeln!(
                output,
                "    no law explains it within polling and repeatability (χ² {:.1} a degree of \
                 freedom): this is the best available",
                law.best.chi_square_by_freedom
            )?;
        } else if !law.agreed {
            writeln!(output, "    another law predicts held-out changes better by more than a tenth")?;
        }
    }
    if train.laws.is_empty() {
        writeln!(
            output,
            "\n  no law of speed change: fewer than three changes with three sensor \
                          reports each"
        )?;
    }
    Ok(())
}

fn write_stops(train: &TrainFindings, output: &mut dyn Write) -> io::Result<()> {
    if train.stops.is_empty() {
        return Ok(());
    }
    writeln!(output, "\n  stops measured with a tape, counted from the command")?;
    writeln!(output, "  step  from mm/s     distance mm   time s  run")?;
    for stop in &train.stops {
        let time = stop.time_s.map_or_else(|| "–".to_owned(), |time| format!("{time:.2}"));
        writeln!(
            output,
            "  {:>4}  {:>9.0} {:>9.0} ± {:<3.0} {time:>8}  {}:{}",
            stop.step, stop.speed_mm_per_s, stop.distance_mm, stop.uncertainty_mm, stop.recording, stop.run
        )?;
    }
    Ok(())
}

fn write_lengths(train: &TrainFindings, output: &mut dyn Write) -> io::Result<()> {
    writeln!(output, "\n  lengths, to add to the survey (mm)")?;
    for row in train.sections.chunks(4) {
        let cells: Vec<String> = row
            .iter()
            .map(|section| {
                let name = format!("{}–{}", section.from, section.to);
                format!("{name:<8} {:>+5.1} ± {:<4.1}", section.add.value, section.add.uncertainty)
            })
            .collect();
        writeln!(output, "  {}", cells.join("  "))?;
    }
    Ok(())
}

fn write_suspicious(train: &TrainFindings, output: &mut dyn Write) -> io::Result<()> {
    if train.suspicious.is_empty() {
        return Ok(());
    }
    writeln!(output, "\n  suspicious, of little weight in the fit")?;
    for suspicion in &train.suspicious {
        let number = suspicion.stored_as.map_or_else(String::new, |key| format!(", event {key}"));
        writeln!(
            output,
            "  {} line {}{number}: {} {:.0} ms {} than its neighbours say ({:.0} mm); chance allows one in {:.0e}",
            suspicion.recording,
            suspicion.line,
            suspicion.sensor,
            suspicion.late_ms.abs(),
            if suspicion.late_ms > 0.0 { "later" } else { "earlier" },
            suspicion.late_mm,
            1.0 / suspicion.probability.max(1e-300)
        )?;
    }
    Ok(())
}

pub(super) fn approach(approach: Approach) -> &'static str {
    match approach {
        Approach::Below => "below",
        Approach::Above => "above",
        Approach::Unknown => "not recorded",
    }
}
