//! Shows on the dashboard what machines do that take no orders: a train that is being calibrated, or a demonstration.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use footplate_core::control::Driver;
use footplate_core::control::learn::{CalibrationNotice, Calibrator};
use footplate_core::track::Layout;
use footplate_core::{Timestamp, TrainId};

use super::alarm::Alarm;
use super::board::{Answer, Board, Request};
use super::painter::{Painter, TrainPassed};
use super::picture::TrainTask;
use super::server::Dashboard;
use super::shadow::Shadow;
use crate::clock::Stopwatch;

/// A calibration is watched, not driven: twenty pictures a second are enough.
const BETWEEN_PICTURES: Duration = Duration::from_millis(50);

/// Somebody else's trains on a board.
pub(crate) struct Showing {
    board: Arc<Board>,
    painter: Painter,
    stopwatch: Stopwatch,
    painted: Duration,
    began: Timestamp,
    shadow: Shadow,
}

impl Showing {
    /// On a dashboard, of a session that begins at a time of the line's clock.
    pub(crate) fn new(dashboard: &Dashboard, layout: &Layout, began: Timestamp) -> Self {
        Self {
            board: Arc::clone(&dashboard.board),
            painter: Painter::following(&dashboard.board),
            stopwatch: Stopwatch::start(),
            painted: Duration::ZERO,
            began,
            shadow: Shadow::new(layout),
        }
    }

    /// Whether somebody asks for an emergency stop. Everything else is refused: `why` says what would be right.
    pub(crate) fn is_halted(&self, why: &str) -> bool {
        let mut is_halted = false;
        while let Some(asked) = self.board.next_asked() {
            let halts = match &asked.request {
                Request::EmergencyStop => true,
                Request::Line(line) => line.trim() == "halt",
            };
            is_halted |= halts;
            asked.answer(if halts { Answer::Taken } else { Answer::Refused(why.to_owned()) });
        }
        is_halted
    }

    /// Says a line.
    pub(crate) fn say(&self, now: Timestamp, text: &str) {
        self.board.say((now - self.began).as_s(), text);
    }

    /// A train passed a contact.
    pub(crate) fn passed(&mut self, passed: TrainPassed) {
        self.painter.passed(passed);
    }

    /// Something is not as it should be.
    pub(crate) fn alarm(&mut self, now: Timestamp, alarm: &Alarm) {
        self.painter.alarm(now, alarm);
    }

    /// Takes in what the calibration of a train says, and in which words that is said elsewhere.
    pub(crate) fn hear(&mut self, now: Timestamp, train: TrainId, notice: &CalibrationNotice, said: &str) {
        self.painter.hear_calibration(self.shadow.layout(), now, train, notice, said);
    }

    /// Shows the trains of a driver and what they are busy with, if it is time to.
    pub(crate) fn driver(&mut self, driver: &Driver, tasks: &BTreeMap<TrainId, TrainTask>, now: Timestamp) {
        if self.is_due() {
            self.painter.calibrates_no_more();
            self.painter.paint_alone(driver, tasks, now, self.began);
        }
    }

    /// Shows the train of a calibration, if it is time to.
    pub(crate) fn calibrator(&mut self, calibrator: &Calibrator<'_>, now: Timestamp) {
        if !self.is_due() {
            return;
        }
        self.painter.paint_alone(self.shadow.of(calibrator), &BTreeMap::new(), now, self.began);
    }

    fn is_due(&mut self) -> bool {
        let elapsed = self.stopwatch.elapsed();
        let is_due = elapsed >= self.painted + BETWEEN_PICTURES;
        if is_due {
            self.painted = elapsed;
        }
        is_due
    }
}
