//! A session walked again for those who want to see it: pictures as the dashboard showed them, and what happened.

use std::collections::BTreeMap;

use anyhow::bail;
use footplate_core::control::{DriveNotice, Output};
use footplate_core::{TimeSpan, Timestamp};
use footplate_store::{RecordingKey, Side, Store, StoredMachine, Traced, parse_layout};

use super::session::read;
use crate::commands::demo::TourBeginning;
use crate::commands::drive::{Conductor, DriveBeginning, Spoken};
use crate::commands::written_layout::WrittenLayout;
use crate::dashboard::{Alarm, Board, LayoutPicture, Painter, TrainPassed};
use crate::witness::{Input, Listener};

/// Between two pictures, unless the session is so long that there would be too many of them.
const BETWEEN: TimeSpan = TimeSpan::from_ms(200);
/// The most pictures of one machine: what a slider can be moved over, and a few megabytes.
const MOST_PICTURES: i64 = 2_000;

/// A machine whose trains can be looked at.
trait Seen: Listener {
    /// Shows where trains are.
    fn show(&self, painter: &mut Painter, now: Timestamp);
    /// What of a notice can be shown.
    fn shown(notice: Self::Notice) -> Option<Shown>;
}

enum Shown {
    Line(String),
    Passed(TrainPassed),
    Alarm(Alarm),
}

impl Seen for Conductor {
    fn show(&self, painter: &mut Painter, now: Timestamp) {
        Self::show(self, painter, now);
    }

    fn shown(notice: Spoken) -> Option<Shown> {
        match notice {
            Spoken::Line { text, .. } => Some(Shown::Line(text)),
            Spoken::Passed(passed) => Some(Shown::Passed(passed)),
            Spoken::Alarm(alarm) => Some(Shown::Alarm(alarm)),
            _ => None,
        }
    }
}

impl Seen for footplate_core::control::Driver {
    fn show(&self, painter: &mut Painter, now: Timestamp) {
        painter.paint_alone(self, &BTreeMap::new(), now, Timestamp::ZERO);
    }

    fn shown(notice: DriveNotice) -> Option<Shown> {
        match notice {
            DriveNotice::Passed { train, passed, next } => {
                Some(Shown::Passed(TrainPassed { train, passed, next }))
            }
            _ => None,
        }
    }
}

/// The pictures of a recording, as JSON: its layout, pictures, and what happened.
///
/// # Errors
/// The recording has no machine that drives, or this program cannot make it again.
pub(crate) fn pictures(store: &Store, recording: RecordingKey) -> anyhow::Result<String> {
    let mut walked = Walked::default();
    for machine in store.machines()?.iter().filter(|machine| machine.recording == recording) {
        walked.walk(machine, &store.trace(machine.key)?)?;
    }
    let Some(layout) = &walked.layout else {
        bail!(
            "recording {recording} cannot be looked at: only sessions in which trains were driven have pictures of them"
        );
    };
    Ok(format!(
        "{{\"layout\":{layout},\"pictures\":[{}],\"happened\":[{}]}}",
        walked.pictures.join(","),
        walked.happened.join(",")
    ))
}

#[derive(Default)]
struct Walked {
    layout: Option<String>,
    pictures: Vec<String>,
    happened: Vec<String>,
}

impl Walked {
    fn walk(&mut self, stored: &StoredMachine, trace: &[Traced]) -> anyhow::Result<()> {
        match stored.kind.as_str() {
            DriveBeginning::KIND => {
                let beginning: DriveBeginning = read(stored)?;
                self.draws(beginning.layout())?;
                self.tell(&mut beginning.conductor()?, trace);
            }
            TourBeginning::KIND => {
                let beginning: TourBeginning = read(stored)?;
                self.draws(&beginning.layout)?;
                let layout = WrittenLayout::of("the layout of the session", beginning.layout.clone())?.layout;
                self.tell(&mut beginning.driver(&layout), trace);
            }
            // A calibration looks for its train and has no picture of it.
            _ => {}
        }
        Ok(())
    }

    fn draws(&mut self, layout: &str) -> anyhow::Result<()> {
        let file = parse_layout("the layout of the session", layout.as_bytes())?;
        self.layout = Some(serde_json::to_string(&LayoutPicture::of(&file))?);
        Ok(())
    }

    /// Tells a machine what it was told then, and looks at it between.
    fn tell<M: Seen>(&mut self, machine: &mut M, trace: &[Traced]) {
        let told = || trace.iter().filter(|row| row.side == Side::Input);
        let (Some(first), Some(last)) = (told().next(), told().next_back()) else { return };
        let even = TimeSpan::from_ns((last.time - first.time).as_ns() / MOST_PICTURES);
        let between = BETWEEN.max(even);
        let board = Board::new(0);
        let mut painter = Painter::new(&board);
        let mut next = first.time;
        for row in told() {
            // A row that this program cannot read ends what can be looked at.
            let Ok(input) = Input::read(&row.kind, &row.text) else { break };
            while next < row.time {
                machine.show(&mut painter, next);
                self.pictures.push(board.pictures().borrow().to_string());
                next += between;
            }
            machine.handle_input(row.time, &input);
            while let Some(output) = machine.poll_output() {
                let Output::Notice(notice) = output else { continue };
                match M::shown(notice) {
                    Some(Shown::Line(text)) => board.say((row.time - Timestamp::ZERO).as_s(), &text),
                    Some(Shown::Passed(passed)) => painter.passed(passed),
                    Some(Shown::Alarm(alarm)) => painter.alarm(row.time, &alarm),
                    None => {}
                }
            }
        }
        machine.show(&mut painter, last.time);
        self.pictures.push(board.pictures().borrow().to_string());
        let (happened, _) = board.happened_from(0);
        self.happened.extend(
            happened
                .iter()
                .map(|happening| format!("{{\"kind\":\"{}\",\"what\":{}}}", happening.kind, happening.json)),
        );
    }
}
