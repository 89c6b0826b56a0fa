//! The dashboard of machines that take no commands: calibrations and demonstrations.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use footplate_core::control::Driver;
use footplate_core::control::learn::{CalibrationNotice, Calibrator};
use footplate_core::track::{Layout, TurnoutStates};
use footplate_core::{Timestamp, TrainId};
use footplate_wire::BlockReports;

use super::alarm::Alarm;
use super::board::{Answer, Board, Request};
use super::painter::{Painter, TrainPassed};
use super::picture::TrainTask;
use super::server::Dashboard;
use crate::clock::Stopwatch;

/// The interval between two pictures of a calibration: 20 a second.
const PICTURE_INTERVAL: Duration = Duration::from_millis(50);

/// A dashboard that displays trains and rejects all commands but an emergency stop.
pub(crate) struct ReadOnlyDashboard {
    board: Arc<Board>,
    painter: Painter,
    stopwatch: Stopwatch,
    painted: Duration,
    began: Timestamp,
    follower: CalibrationFollower,
}

impl ReadOnlyDashboard {
    /// Opens the display on a dashboard; the session begins at `began` by the clock of the link.
    pub(crate) fn new(dashboard: &Dashboard, layout: &Layout, began: Timestamp) -> Self {
        Self {
            board: Arc::clone(&dashboard.board),
            painter: Painter::following(&dashboard.board),
            stopwatch: Stopwatch::start(),
            painted: Duration::ZERO,
            began,
            follower: CalibrationFollower::new(layout),
        }
    }

    /// Whether an emergency stop was requested. All other requests are rejected with `why`.
    pub(crate) fn is_halted(&mut self, now: Timestamp, why: &str) -> bool {
        let is_halt = |line: &str| line.trim() == "halt";
        let mut is_halted = false;
        while let Some(asked) = self.board.next_request(is_halt) {
            let is_taken = match &asked.request {
                Request::EmergencyStop => {
                    is_halted = true;
                    true
                }
                Request::Line(line) if is_halt(line) => {
                    is_halted = true;
                    true
                }
                Request::EndAlarm(id) => self.painter.end_alarm(now, *id),
                _ => false,
            };
            asked.answer(if is_taken { Answer::Taken } else { Answer::Refused(why.to_owned()) });
        }
        is_halted
    }

    /// Prints a line.
    pub(crate) fn say(&self, now: Timestamp, text: &str) {
        self.board.say((now - self.began).as_s(), text);
    }

    /// Displays a detection.
    pub(crate) fn passed(&mut self, passed: TrainPassed) {
        self.painter.passed(passed);
    }

    /// Displays an alarm.
    pub(crate) fn alarm(&mut self, now: Timestamp, alarm: &Alarm) {
        self.painter.alarm(now, alarm);
    }

    /// Displays which blocks are occupied.
    pub(crate) fn see_blocks(&mut self, blocks: &BlockReports) {
        self.painter.see_blocks(blocks.states());
    }

    /// Takes in a notice of a calibration; `said` is the line that was printed for it.
    pub(crate) fn hear(&mut self, now: Timestamp, train: TrainId, notice: &CalibrationNotice, said: &str) {
        self.painter.handle_calibration(self.follower.layout(), now, train, notice, said);
    }

    /// Displays the trains of a driver, if the next picture is due.
    pub(crate) fn driver(&mut self, driver: &Driver, tasks: &BTreeMap<TrainId, TrainTask>, now: Timestamp) {
        if self.is_due() {
            self.painter.end_calibration();
            self.painter.paint_undispatched(driver, tasks.clone(), now, self.began);
        }
    }

    /// Displays the train of a calibration, if the next picture is due.
    pub(crate) fn calibrator(&mut self, calibrator: &Calibrator<'_>, now: Timestamp) {
        if !self.is_due() {
            return;
        }
        self.painter.paint_undispatched(self.follower.of(calibrator), BTreeMap::new(), now, self.began);
    }

    fn is_due(&mut self) -> bool {
        let elapsed = self.stopwatch.elapsed();
        let is_due = elapsed >= self.painted + PICTURE_INTERVAL;
        if is_due {
            self.painted = elapsed;
        }
        is_due
    }
}

/// A driver that only displays the train of a calibration.
#[derive(Debug)]
pub(crate) struct CalibrationFollower {
    layout: Layout,
    driver: Option<(TurnoutStates, Driver)>,
}

impl CalibrationFollower {
    pub(crate) fn new(layout: &Layout) -> Self {
        Self { layout: layout.clone(), driver: None }
    }

    pub(super) const fn layout(&self) -> &Layout {
        &self.layout
    }

    /// A driver that has the train of the calibration at its current position.
    pub(crate) fn of(&mut self, calibrator: &Calibrator<'_>) -> &Driver {
        let (turnouts, train) = (calibrator.turnouts(), calibrator.locator().train());
        // A train that was calibrated earlier is no longer located.
        let is_same = |(known, driver): &(TurnoutStates, Driver)| {
            known == turnouts && driver.trains().all(|other| other == train)
        };
        let driver = self.driver.take().filter(is_same);
        let new_driver = || (turnouts.clone(), Driver::new(self.layout.clone(), turnouts.clone()));
        let (_, driver) = self.driver.insert(driver.unwrap_or_else(new_driver));
        driver.add_located(calibrator.fit().model().clone(), calibrator.locator().clone());
        driver
    }
}
