//! What the bytes of a line come to: periods, latencies, and what a command costs.

use std::io::Write;

use footplate_core::TimeSpan;

use super::answers::Answers;
use crate::commands::plot::{Ink, Layer, Panel, Picture, SHOWN, Shape, shares};
use crate::link::{Passed, Rhythm};

/// What the messages of a station come to that reports by itself.
pub(super) struct StationFigures {
    /// What the user should check, if none of this kind was heard.
    pub(super) missing: Option<&'static str>,
    /// Times to its answers.
    pub(super) answers: Answers,
    /// All figures except those of answers.
    pub(super) json: serde_json::Value,
    /// What the station is, in lines.
    pub(super) station: Vec<String>,
    /// What it reports, in lines.
    pub(super) reports: Vec<String>,
}

/// Bars of the histogram are as wide as this at most.
const BAR: usize = 40;
/// Bins of the histogram.
const BINS: usize = 8;

/// The figures of a line.
pub(super) struct Figures {
    /// Time between two polls with nothing between them, in ms, sorted.
    periods: Vec<f64>,
    /// The same with one command between them.
    with_command: Vec<f64>,
    /// Time from the last bit of a poll to the first byte of the reply.
    first_bytes: Vec<f64>,
    asked: usize,
    lost: usize,
}

impl Figures {
    pub(super) fn of(passed: &[Passed], lost: usize) -> Self {
        let mut figures =
            Self { periods: Vec::new(), with_command: Vec::new(), first_bytes: Vec::new(), asked: 0, lost };
        let mut rhythm = Rhythm::default();
        for one in passed {
            match *one {
                Passed::Written(at, byte) => {
                    let Some(request) = rhythm.written(at, byte) else { continue };
                    figures.asked += 1;
                    if let Some((span, others)) = request.after {
                        figures.period(span, others);
                    }
                }
                Passed::Heard(at, _) => figures.first_bytes.extend(rhythm.heard(at).map(TimeSpan::as_ms)),
            }
        }
        for figures in [&mut figures.periods, &mut figures.with_command, &mut figures.first_bytes] {
            figures.sort_by(f64::total_cmp);
        }
        figures
    }

    fn period(&mut self, span: TimeSpan, others: usize) {
        match others {
            0 => self.periods.push(span.as_ms()),
            1 => self.with_command.push(span.as_ms()),
            // Bytes that synchronise the line are no period.
            _ => {}
        }
    }

    /// Whether any poll was answered.
    pub(super) fn has_replies(&self) -> bool {
        !self.first_bytes.is_empty() && self.lost < self.asked
    }

    /// The share of requests whose answer was lost.
    pub(super) fn lost_share(&self) -> f64 {
        self.lost as f64 / self.asked.max(1) as f64
    }

    fn command_cost(&self) -> Option<f64> {
        Some(at(&self.with_command, 0.5)? - at(&self.periods, 0.5)?)
    }

    pub(super) fn json(&self) -> serde_json::Value {
        serde_json::json!({
            "polls": self.asked,
            "lost_replies": self.lost,
            "poll_period_ms": quantiles(&self.periods),
            "first_byte_ms": quantiles(&self.first_bytes),
            "command_cost_ms": self.command_cost(),
        })
    }

    pub(super) fn write(&self, output: &mut dyn Write) -> std::io::Result<()> {
        writeln!(output, "polls         {}, {} without a whole reply", self.asked, self.lost)?;
        line(output, "poll period", &self.periods)?;
        histogram(output, &self.periods)?;
        line(output, "first byte", &self.first_bytes)?;
        match self.command_cost() {
            Some(cost) => writeln!(
                output,
                "command       costs {cost:.1} ms of the line (one byte; two cost 5 ms more)"
            ),
            None => writeln!(output, "command       none was seen between two polls"),
        }
    }

    /// How periods and latencies are spread.
    pub(super) fn picture(&self) -> Picture {
        let curves = [
            ("first byte", Ink::Second, &self.first_bytes),
            ("poll period", Ink::First, &self.periods),
            ("the same with a command in it", Ink::Third, &self.with_command),
        ];
        let layers = curves
            .into_iter()
            .filter(|(_, _, values)| !values.is_empty())
            .map(|(label, ink, values)| Layer::new(label, ink, Shape::Line(shares(values.iter().copied()))));
        let panel = Panel {
            x: "at most (ms)".to_owned(),
            y: "share (%)".to_owned(),
            from_zero: true,
            layers: layers.collect(),
            ..Panel::default()
        };
        Picture {
            title: "How fast the line is".to_owned(),
            subtitle: format!(
                "{} polls, {} without a whole reply; every curve ends at {SHOWN:.0} % of its own",
                self.asked, self.lost
            ),
            panels: vec![panel],
        }
    }
}

fn at(sorted: &[f64], share: f64) -> Option<f64> {
    sorted.get(((sorted.len().checked_sub(1)?) as f64 * share).round() as usize).copied()
}

pub(super) fn quantiles(sorted: &[f64]) -> serde_json::Value {
    serde_json::json!({ "median": at(sorted, 0.5), "p5": at(sorted, 0.05), "p95": at(sorted, 0.95), "max": at(sorted, 1.0) })
}

pub(super) fn line(output: &mut dyn Write, name: &str, sorted: &[f64]) -> std::io::Result<()> {
    let [Some(low), Some(median), Some(high), Some(most)] =
        [0.05, 0.5, 0.95, 1.0].map(|share| at(sorted, share))
    else {
        return writeln!(output, "{name:<13} none");
    };
    writeln!(output, "{name:<13} median {median:.1} ms, 5 % {low:.1}, 95 % {high:.1}, longest {most:.1}")
}

/// Bars of how often times were seen, up to the longest but one in a hundred.
pub(super) fn histogram(output: &mut dyn Write, sorted: &[f64]) -> std::io::Result<()> {
    let (Some(low), Some(high)) = (at(sorted, 0.0), at(sorted, 0.99)) else { return Ok(()) };
    let width = ((high - low) / BINS as f64).max(0.1);
    let mut counts = [0_usize; BINS];
    for time in sorted.iter().filter(|time| **time <= high) {
        let bin = (((time - low) / width) as usize).min(BINS - 1);
        if let Some(count) = counts.get_mut(bin) {
            *count += 1;
        }
    }
    let most = counts.iter().copied().max().unwrap_or(1).max(1);
    for (bin, count) in counts.into_iter().enumerate() {
        let from = low + width * bin as f64;
        writeln!(output, "  {from:>7.1} ms  {}", "#".repeat((count * BAR).div_ceil(most)))?;
    }
    Ok(())
}
