//! What somebody sees while the demo runs: lines that stay, and under them, on a terminal, a picture of both trains.

use std::io::{self, Write};

use footplate_core::{Length, TrainId};
use serde_json::{Value, json};

use super::outcome::{self, Learnt, LearntStep, MadeStop};
use crate::live_lines::{LiveLines, Style};

/// Steps of a 14-step decoder side by side, as wide as a terminal of 80 columns allows.
const CELL: usize = 4;
/// The head of the rows with a number a step.
const LABEL: usize = 9;

/// How it is told.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Manner {
    /// For people.
    Text,
    /// A line of JSON for everything that stays.
    Json,
}

/// What is shown of a train.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct TrainPicture {
    pub(super) train: TrainId,
    /// What it is about, in a word or two.
    pub(super) does: String,
    /// The same in a line.
    pub(super) detail: String,
    /// Whether it is its turn.
    pub(super) is_at_work: bool,
    /// What is known of its steps.
    pub(super) steps: Vec<LearntStep>,
}

impl TrainPicture {
    pub(super) fn waiting(train: TrainId, does: &str) -> Self {
        Self { train, does: does.to_owned(), detail: String::new(), is_at_work: false, steps: Vec::new() }
    }
}

/// Where all of it goes.
pub(super) struct Screen<'o> {
    lines: LiveLines<'o>,
    manner: Manner,
    /// What was acknowledged last, so that it is said once.
    acknowledged: u64,
}

impl<'o> Screen<'o> {
    pub(super) fn new(output: &'o mut dyn Write, manner: Manner) -> Self {
        Self { lines: LiveLines::new(output), manner, acknowledged: 0 }
    }

    /// Whether anybody watches the picture.
    pub(super) fn is_watched(&self) -> bool {
        self.manner == Manner::Text && self.lines.is_terminal()
    }

    /// Whether it is time for the next picture.
    pub(super) fn is_due(&self) -> bool {
        self.manner == Manner::Text && self.lines.is_due()
    }

    /// A line that stays.
    pub(super) fn say(&mut self, text: &str) -> io::Result<()> {
        match self.manner {
            Manner::Text => self.lines.line(text),
            Manner::Json => Ok(()),
        }
    }

    /// A line that stays, of lesser weight.
    pub(super) fn mention(&mut self, text: &str) -> io::Result<()> {
        let text = self.lines.styled(Style::Dim, text);
        self.say(&text)
    }

    /// A heading.
    pub(super) fn announce(&mut self, text: &str) -> io::Result<()> {
        let text = self.lines.styled(Style::Bold, text);
        self.say(&text)
    }

    /// Something for programs only.
    pub(super) fn record(&mut self, value: &Value) -> io::Result<()> {
        match self.manner {
            Manner::Text => Ok(()),
            Manner::Json => self.lines.line(&value.to_string()),
        }
    }

    /// Something went wrong on the railway.
    pub(super) fn mishap(&mut self, train: TrainId, what: &str) -> io::Result<()> {
        self.record(&json!({ "mishap": what, "train": train.0 }))?;
        self.mention(&format!("  train {train}: {what}"))
    }

    /// A train is calibrated.
    pub(super) fn learnt(&mut self, learnt: &Learnt) -> io::Result<()> {
        self.record(&json!({ "learnt": learnt.value() }))?;
        self.say(&format!("  {}", learnt.sentence()))
    }

    /// A train stands where it was commanded to stop.
    pub(super) fn stopped(&mut self, stop: &MadeStop) -> io::Result<()> {
        self.record(&json!({ "stop": stop.value() }))?;
        self.say(&format!("  {}", stop.sentence()))
    }

    /// All stops, one below the other.
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

    /// So many events of the session are on the disk.
    pub(super) fn acknowledged(&mut self, count: u64) -> io::Result<()> {
        if count == self.acknowledged {
            return Ok(());
        }
        self.acknowledged = count;
        self.record(&json!({ "acknowledged": count }))
    }

    /// The picture: a line of the session and some of every train.
    pub(super) fn picture(&mut self, session: &str, trains: &[TrainPicture]) -> io::Result<()> {
        let mut lines = vec![String::new()];
        for train in trains {
            lines.push(self.of_train(train));
            if !train.steps.is_empty() && train.is_at_work {
                lines.extend(self.of_steps(&train.steps));
            }
        }
        lines.push(format!("  {}", self.lines.styled(Style::Dim, session)));
        self.lines.frame(&lines)
    }

    /// Takes the picture away.
    pub(super) fn clear(&mut self) -> io::Result<()> {
        self.lines.clear()
    }

    fn of_train(&self, train: &TrainPicture) -> String {
        let (mark, style) = if train.is_at_work { ("▶", Style::Moving) } else { ("·", Style::Dim) };
        let name = self.lines.styled(style, &format!("{mark} {:>3}  {:<11}", train.train, train.does));
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

/// Three digits at most; what is not known better than half a metre is not known.
fn shown_accuracy(within: Length) -> String {
    let mm = within.as_mm();
    if mm < 500.0 { format!("{mm:.0}") } else { "?".to_owned() }
}
