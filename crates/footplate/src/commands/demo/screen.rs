//! The terminal output of the demo: permanent lines and, below them, a live picture of both trains.

use std::io::{self, Write};

use footplate_core::{Length, TrainId};
use serde_json::{Value, json};

use super::outcome::{self, Learnt, LearntStep, MadeStop};
use crate::live_lines::{LiveLines, Style};

/// The width of a step's column: 14 steps fit into 80 characters.
const CELL: usize = 4;
/// The width of the row labels.
const LABEL: usize = 9;

/// The form of the output.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Manner {
    /// For people.
    Text,
    /// One line of JSON for each permanent line.
    Json,
}

/// The display of one train.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct TrainPicture {
    pub(super) train: TrainId,
    /// Its activity, in a word or two.
    pub(super) activity: String,
    /// Its activity, in a line.
    pub(super) detail: String,
    /// Whether it is the active train.
    pub(super) is_active: bool,
    /// Its calibrated steps.
    pub(super) steps: Vec<LearntStep>,
}

impl TrainPicture {
    pub(super) fn waiting(train: TrainId, activity: &str) -> Self {
        Self {
            train,
            activity: activity.to_owned(),
            detail: String::new(),
            is_active: false,
            steps: Vec::new(),
        }
    }
}

/// The terminal.
pub(super) struct Screen<'o> {
    lines: LiveLines<'o>,
    manner: Manner,
    /// The last acknowledged event count, so that it is printed once.
    acknowledged: u64,
}

impl<'o> Screen<'o> {
    pub(super) fn new(output: &'o mut dyn Write, manner: Manner) -> Self {
        Self { lines: LiveLines::new(output), manner, acknowledged: 0 }
    }

    /// Whether the live picture is visible.
    pub(super) fn is_watched(&self) -> bool {
        self.manner == Manner::Text && self.lines.is_terminal()
    }

    /// Whether the next picture is due.
    pub(super) fn is_due(&self) -> bool {
        self.manner == Manner::Text && self.lines.is_due()
    }

    /// Prints a permanent line.
    pub(super) fn say(&mut self, text: &str) -> io::Result<()> {
        match self.manner {
            Manner::Text => self.lines.line(text),
            Manner::Json => Ok(()),
        }
    }

    /// Prints a permanent line, dimmed.
    pub(super) fn mention(&mut self, text: &str) -> io::Result<()> {
        let text = self.lines.styled(Style::Dim, text);
        self.say(&text)
    }

    /// Prints a heading.
    pub(super) fn announce(&mut self, text: &str) -> io::Result<()> {
        let text = self.lines.styled(Style::Bold, text);
        self.say(&text)
    }

    /// Prints a line for programs only.
    pub(super) fn record(&mut self, value: &Value) -> io::Result<()> {
        match self.manner {
            Manner::Text => Ok(()),
            Manner::Json => self.lines.line(&value.to_string()),
        }
    }

    /// Reports a fault.
    pub(super) fn fault(&mut self, train: TrainId, what: &str) -> io::Result<()> {
        self.record(&json!({ "mishap": what, "train": train.0 }))?;
        self.mention(&format!("  train {train}: {what}"))
    }

    /// Reports a calibration.
    pub(super) fn learnt(&mut self, learnt: &Learnt) -> io::Result<()> {
        self.record(&json!({ "learnt": learnt.value() }))?;
        self.say(&format!("  {}", learnt.sentence()))
    }

    /// Reports a stop.
    pub(super) fn stopped(&mut self, stop: &MadeStop) -> io::Result<()> {
        self.record(&json!({ "stop": stop.value() }))?;
        self.say(&format!("  {}", stop.sentence()))
    }

    /// Prints the table of stops.
    pub(super) fn table(&mut self, stops: &[MadeStop]) -> io::Result<()> {
        let head = self.lines.styled(Style::Dim, &outcome::head());
        self.say(&head)?;
        for stop in stops {
            let style = if stop.is_inside() { Style::Good } else { Style::Bad };
            let verdict = self.lines.styled(style, stop.verdict());
            self.say(&format!("{}{verdict}", stop.row()))?;
        }
        Ok(())
    }

    /// Reports how many events of the session are on disk.
    pub(super) fn acknowledged(&mut self, count: u64) -> io::Result<()> {
        if count == self.acknowledged {
            return Ok(());
        }
        self.acknowledged = count;
        self.record(&json!({ "acknowledged": count }))
    }

    /// Draws the live picture: the trains, then a line for the session.
    pub(super) fn picture(&mut self, session: &str, trains: &[TrainPicture]) -> io::Result<()> {
        let mut lines = vec![String::new()];
        for train in trains {
            lines.push(self.of_train(train));
            if !train.steps.is_empty() && train.is_active {
                lines.extend(self.of_steps(&train.steps));
            }
        }
        lines.push(format!("  {}", self.lines.styled(Style::Dim, session)));
        self.lines.frame(&lines)
    }

    /// Removes the live picture.
    pub(super) fn clear(&mut self) -> io::Result<()> {
        self.lines.clear()
    }

    fn of_train(&self, train: &TrainPicture) -> String {
        let (mark, style) = if train.is_active { ("▶", Style::Moving) } else { ("·", Style::Dim) };
        let name = self.lines.styled(style, &format!("{mark} {:>3}  {:<11}", train.train, train.activity));
        format!("  {name} {}", train.detail)
    }

    fn of_steps(&self, steps: &[LearntStep]) -> [String; 3] {
        let row = |label: &str, cell: &dyn Fn(&LearntStep) -> String| {
            let cells: String = steps.iter().map(|known| format!("{:>CELL$}", cell(known))).collect();
            format!("        {label:<LABEL$}{cells}")
        };
        let steps_row = row("step", &|known| known.step.to_string());
        [
            self.lines.styled(Style::Dim, &steps_row),
            row("mm/s", &|known| format!("{:.0}", known.mm_per_s)),
            row("stop ±mm", &|known| shown_accuracy(known.stops_within)),
        ]
    }
}

/// At most three digits; half a metre or more counts as unknown.
fn shown_accuracy(within: Length) -> String {
    let mm = within.as_mm();
    if mm < 500.0 { format!("{mm:.0}") } else { "?".to_owned() }
}
