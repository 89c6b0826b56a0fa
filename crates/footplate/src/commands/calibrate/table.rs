//! A calibration as a person reads it.

use std::io::{self, Write};

use footplate_core::Approach;
use footplate_core::calibration::Direction;
use footplate_store::{Batch, CalibrationFile, Quantity, StopForm, TrainForm};

/// How many other laws are told beside the best.
const RUNNERS_UP: usize = 2;

pub(super) fn write(file: &CalibrationFile, batch: &Batch, output: &mut dyn Write) -> io::Result<()> {
    for polling in &file.polling {
        match &polling.period {
            Some(period) => writeln!(
                output,
                "{}: polled every {} idle, {:.2} ms after a report, jitter {:.2} ms ({} gaps)",
                polling.recording,
                uncertain(period),
                polling.after_report_ms,
                polling.jitter_ms,
                period.measurements
            )?,
            None => writeln!(
                output,
                "{}: the reports show no rhythm of polls; taken as every {:.0} ms",
                polling.recording, polling.after_report_ms
            )?,
        }
    }
    for train in &file.trains {
        writeln!(output)?;
        write_train(train, batch, output)?;
    }
    writeln!(
        output,
        "\nvalue ± one standard deviation; hops and changes are measurements; lengths count in speeds, so all \
         speeds share\nthe uncertainty of the survey. The measurements behind a number: --explain SPEED:14"
    )
}

fn write_train(train: &TrainForm, batch: &Batch, output: &mut dyn Write) -> io::Result<()> {
    let own = || batch.passages.iter().filter(|run| run.train == train.train);
    let silent = own().filter(|run| run.passages.is_empty()).count();
    let passages: usize = own().map(|run| run.passages.len()).sum();
    write!(output, "Train {}: {} runs, {passages} contacts passed", train.train, own().count())?;
    if silent > 0 {
        write!(output, ", {silent} runs without a timed one (stalled, or too slow)")?;
    }
    writeln!(
        output,
        "\n  contacts scatter by {:.1} mm, a run deviates from the table by {:.1} %",
        train.contact_scatter_mm, train.run_deviation_percent
    )?;
    writeln!(output, "\n  step  reached from       speed mm/s    hops  runs")?;
    for speed in &train.speeds {
        writeln!(
            output,
            "  {:>4}  {:<12} {:>8.1} ± {:<5.1} {:>7} {:>5}",
            speed.step,
            approach(speed.approach),
            speed.speed.value,
            speed.speed.uncertainty,
            speed.speed.measurements,
            speed.runs
        )?;
    }
    for step in &train.hysteresis {
        writeln!(
            output,
            "  step {} from above less from below: {}{}",
            step.step,
            uncertain(&step.difference),
            if step.told_apart { "" } else { " (not told apart by the data)" }
        )?;
    }
    write_laws(train, output)?;
    if let Some(stops) = &train.stops {
        write_stops(stops, output)?;
    }
    write_lengths(train, output)?;
    write_suspicious(train, output)
}

fn write_laws(train: &TrainForm, output: &mut dyn Write) -> io::Result<()> {
    for law in &train.laws {
        let direction = match law.direction {
            Direction::Up => "faster",
            Direction::Down => "slower",
        };
        writeln!(output, "\n  getting {direction}: {}", law.best.name)?;
        writeln!(
            output,
            "    {}, begins {} after the command; {} changes, held-out error {:.0} mm",
            uncertain(&law.best.pace),
            uncertain(&law.best.delay),
            law.changes,
            law.best.held_out_mm
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
                "    no law explains it within poll and scatter (χ² {:.1} a degree of freedom): the best of those \
                 there are",
                law.best.chi_square_by_freedom
            )?;
        } else if !law.agreed {
            writeln!(output, "    another law forecasts held-out changes better by more than a tenth")?;
        }
    }
    if train.laws.is_empty() {
        writeln!(output, "\n  no law of speed change: fewer than three changes with three contacts each")?;
    }
    Ok(())
}

fn write_stops(stops: &StopForm, output: &mut dyn Write) -> io::Result<()> {
    writeln!(output, "\n  stops, counted from the command")?;
    writeln!(
        output,
        "  step  from mm/s       distance mm     time s          n  scatter mm  off the law mm"
    )?;
    for step in &stops.steps {
        let or_dash =
            |value: Option<f64>| value.map_or_else(|| "–".to_owned(), |value| format!("{value:.0}"));
        writeln!(
            output,
            "  {:>4}  {:>9.0} {:>11.0} ± {:<6.0} {:>13} {:>4} {:>11} {:>15}",
            step.step,
            step.speed_mm_per_s,
            step.distance.value,
            step.distance.uncertainty,
            step.time.as_ref().map_or_else(
                || "–".to_owned(),
                |time| format!("{:>5.2} ± {:<5.2}", time.value, time.uncertainty)
            ),
            step.distance.measurements,
            or_dash(step.scatter_mm),
            or_dash(step.residual_mm)
        )?;
    }
    if let Some(law) = &stops.law {
        writeln!(
            output,
            "  law: d = τ v + v²/2a with τ = {}, a = {}, rms {:.0} mm",
            uncertain(&law.delay),
            uncertain(&law.deceleration),
            law.rms_mm
        )?;
    }
    Ok(())
}

fn write_lengths(train: &TrainForm, output: &mut dyn Write) -> io::Result<()> {
    writeln!(output, "\n  lengths, to add to the survey (mm)")?;
    for row in train.sections.chunks(4) {
        let cells: Vec<String> = row
            .iter()
            .map(|section| {
                let name = format!("{}–{}", section.from, section.to);
                format!(
                    "{name:<8} {:>+5.1} ± {:<4.1}",
                    section.correction.value, section.correction.uncertainty
                )
            })
            .collect();
        writeln!(output, "  {}", cells.join("  "))?;
    }
    Ok(())
}

fn write_suspicious(train: &TrainForm, output: &mut dyn Write) -> io::Result<()> {
    if train.suspicious.is_empty() {
        return Ok(());
    }
    writeln!(output, "\n  suspicious, taken out of the fit")?;
    for suspicion in &train.suspicious {
        let number = suspicion.stored_as.map_or_else(String::new, |key| format!(", event {key}"));
        writeln!(
            output,
            "  {} line {}{number}: {} {:.0} ms {} than fitted ({:.0} mm); chance allows one in {:.0e}",
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

/// `179 ± 12 mm/s²`: two digits of the uncertainty, at most three behind the point.
fn uncertain(quantity: &Quantity) -> String {
    let digits = [10.0, 1.0, 0.1].iter().take_while(|place| quantity.uncertainty < **place).count();
    format!("{:.digits$} ± {:.digits$} {}", quantity.value, quantity.uncertainty, quantity.unit)
}
