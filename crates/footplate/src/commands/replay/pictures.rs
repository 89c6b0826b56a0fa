//! A session walked again for those who want to see it: pictures as the dashboard showed them, and what happened.

use std::collections::BTreeMap;
use std::sync::Arc;

use anyhow::bail;
use footplate_core::control::{CalibrationNotice, Calibrator, Driver, Notice, Output};
use footplate_core::track::Layout;
use footplate_core::{TimeSpan, Timestamp, TrainId};
use footplate_store::{RecordingKey, Side, Store, StoredMachine, Traced, parse_layout};

use super::recorded_blocks::RecordedBlocks;
use super::session::read;
use crate::commands::calibrate::{CalibrationBeginning, calibration_line};
use crate::commands::demo::TourBeginning;
use crate::commands::drive::{DriveBeginning, ScriptRunner, SessionMessage};
use crate::commands::written_layout::WrittenLayout;
use crate::dashboard::{Alarm, Board, CalibrationFollower, LayoutPicture, Painter, TrainPassed};
use crate::recorded::{Input, Listener};

/// Between two pictures, unless the session is so long that there would be too many of them.
const BETWEEN: TimeSpan = TimeSpan::from_ms(200);
/// The most pictures of one machine: what a slider can be moved over, and a few megabytes.
const MOST_PICTURES: i64 = 2_000;

/// What of a notice can be shown.
enum Shown {
    Line(String),
    Passed(TrainPassed),
    Alarm(Alarm),
    Calibration(CalibrationNotice),
}

fn of_session(notice: SessionMessage) -> Option<Shown> {
    match notice {
        SessionMessage::Line { text, .. } => Some(Shown::Line(text)),
        SessionMessage::Passed(passed) => Some(Shown::Passed(passed)),
        SessionMessage::Alarm(alarm) => Some(Shown::Alarm(alarm)),
        _ => None,
    }
}

fn of_driver(notice: &Notice) -> Option<Shown> {
    match *notice {
        Notice::Passed { train, passed, next } => Some(Shown::Passed(TrainPassed { train, passed, next })),
        _ => None,
    }
}

/// The pictures of a recording, as JSON: its layout, pictures, and what happened.
///
/// # Errors
/// The recording has no machine that moves trains, or this program cannot make it again.
pub(crate) fn pictures(store: &Store, recording: RecordingKey) -> anyhow::Result<String> {
    let mut walked = Walked::default();
    for machine in store.machines()?.iter().filter(|machine| machine.recording == recording) {
        walked.walk(machine, &store.trace(machine.key)?)?;
    }
    let Some(layout) = &walked.layout else {
        bail!(
            "recording {recording} cannot be looked at: only sessions in which trains were driven or calibrated have \
             pictures of them"
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
    /// The layout that a calibration was made on, to name places, and its train.
    calibrated: Option<(Layout, TrainId)>,
    pictures: Vec<String>,
    happened: Vec<String>,
}

impl Walked {
    fn walk(&mut self, stored: &StoredMachine, trace: &[Traced]) -> anyhow::Result<()> {
        match stored.kind.as_str() {
            DriveBeginning::KIND => {
                let beginning: DriveBeginning = read(stored)?;
                self.draws(beginning.layout())?;
                let look = |machine: &ScriptRunner, painter: &mut Painter, now| machine.show(painter, now);
                let mut machine = beginning.script_runner()?;
                let blocks = RecordedBlocks::of(machine.driver().layout(), trace);
                self.tell(&mut machine, trace, blocks, Painter::new, look, of_session);
            }
            TourBeginning::KIND => {
                let beginning: TourBeginning = read(stored)?;
                self.draws(&beginning.layout)?;
                let layout = WrittenLayout::of("the layout of the session", beginning.layout.clone())?.layout;
                let look = |machine: &Driver, painter: &mut Painter, now| {
                    painter.paint_undispatched(machine, BTreeMap::new(), now, Timestamp::ZERO);
                };
                let blocks = RecordedBlocks::of(&layout, trace);
                self.tell(&mut beginning.driver(&layout), trace, blocks, Painter::new, look, |notice| {
                    of_driver(&notice)
                });
            }
            CalibrationBeginning::KIND => {
                let beginning: CalibrationBeginning = read(stored)?;
                self.draws(&beginning.layout)?;
                let layout = WrittenLayout::of("the layout of the session", beginning.layout.clone())?.layout;
                let mut shadow = CalibrationFollower::new(&layout);
                let look = |machine: &Calibrator<'_>, painter: &mut Painter, now| {
                    painter.paint_undispatched(shadow.of(machine), BTreeMap::new(), now, Timestamp::ZERO);
                };
                let mut calibrator = beginning.calibrator(&layout);
                let heard = |notice| Some(Shown::Calibration(notice));
                self.calibrated = Some((layout.clone(), calibrator.locator().train()));
                self.tell(
                    &mut calibrator,
                    trace,
                    RecordedBlocks::of(&layout, trace),
                    Painter::following,
                    look,
                    heard,
                );
            }
            _ => {}
        }
        Ok(())
    }

    /// Takes in what a calibration said.
    fn hear(&self, board: &Board, painter: &mut Painter, at: Timestamp, notice: &CalibrationNotice) {
        let Some((layout, train)) = &self.calibrated else { return };
        let line = calibration_line(layout, notice);
        painter.handle_calibration(layout, at, *train, notice, line.as_deref().unwrap_or_default());
        if let Some(line) = line {
            board.say((at - Timestamp::ZERO).as_s(), &line);
        }
    }

    fn draws(&mut self, layout: &str) -> anyhow::Result<()> {
        let file = parse_layout("the layout of the session", layout.as_bytes())?;
        self.layout = Some(serde_json::to_string(&LayoutPicture::of(&file))?);
        Ok(())
    }

    /// Gives a machine its recorded inputs, and shows it between them.
    fn tell<M: Listener>(
        &mut self,
        machine: &mut M,
        trace: &[Traced],
        mut blocks: RecordedBlocks,
        paints: impl Fn(&Arc<Board>) -> Painter,
        mut look: impl FnMut(&M, &mut Painter, Timestamp),
        shown: impl Fn(M::Notice) -> Option<Shown>,
    ) {
        let inputs = || trace.iter().filter(|row| row.side == Side::Input);
        let (Some(first), Some(last)) = (inputs().next(), inputs().next_back()) else { return };
        let even = TimeSpan::from_ns((last.time - first.time).as_ns() / MOST_PICTURES);
        let between = BETWEEN.max(even);
        let board = Board::new(0);
        let mut painter = paints(&board);
        let mut look = |machine: &M, painter: &mut Painter, now| {
            painter.see_blocks(blocks.at(now));
            look(machine, painter, now);
        };
        let mut next = first.time;
        for row in inputs() {
            // A row that this program cannot read ends what can be looked at.
            let Ok(input) = Input::read(&row.kind, &row.text) else { break };
            while next < row.time {
                look(machine, &mut painter, next);
                self.pictures.push(board.pictures().borrow().to_string());
                next += between;
            }
            machine.handle_input(row.time, &input);
            while let Some(output) = machine.poll_output() {
                let Output::Notice(notice) = output else { continue };
                match shown(notice) {
                    Some(Shown::Line(text)) => board.say((row.time - Timestamp::ZERO).as_s(), &text),
                    Some(Shown::Passed(passed)) => painter.passed(passed),
                    Some(Shown::Alarm(alarm)) => painter.alarm(row.time, &alarm),
                    Some(Shown::Calibration(notice)) => self.hear(&board, &mut painter, row.time, &notice),
                    None => {}
                }
            }
        }
        look(machine, &mut painter, last.time);
        self.pictures.push(board.pictures().borrow().to_string());
        let (happened, _) = board.events_from(0);
        self.happened.extend(
            happened
                .iter()
                .map(|happening| format!("{{\"kind\":\"{}\",\"what\":{}}}", happening.kind, happening.json)),
        );
    }
}
