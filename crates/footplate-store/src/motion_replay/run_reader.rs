//! From the raw events of a run to what a fit is given of one train: its commands, and the contacts it passed with the
//! interval in which each closed.

use footplate_core::link::{DetectionWindow, PollTiming};
use footplate_core::model::STALE_WITHIN;
use footplate_core::{Event, EventKind, Report, SpeedStep, TimeSpan, Timestamp, TrainId};

/// A train that runs and is told one step more when no contact and no command has been for so long was pushed: it had not come
/// where it should, and the calibration took it for stuck. No trip of an experiment takes as long between two of either.
const PUSHED_AFTER: TimeSpan = TimeSpan::from_ms(4_000);

/// Reads the events of one train in a run in which no other moves.
#[derive(Debug)]
pub(super) struct RunReader {
    train: TrainId,
    step: SpeedStep,
    /// When the train was commanded to start from rest last.
    started: Option<Timestamp>,
    /// The last command to the train or report.
    last: Option<Timestamp>,
    last_report: Option<Timestamp>,
    has_passed: bool,
    is_pushed: bool,
}

/// An event for the fit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ReadEvent {
    pub(super) event: Event,
    /// Whether a hand helped the train to the contact that is reported.
    pub(super) was_pushed: bool,
}

impl RunReader {
    /// A run begins with the train running at a step for long, or at rest.
    pub(super) const fn new(train: TrainId, step: SpeedStep) -> Self {
        Self {
            train,
            step,
            started: None,
            last: None,
            last_report: None,
            has_passed: false,
            is_pushed: false,
        }
    }

    /// The next event of the run; `None` where it says nothing of how the train moves.
    pub(super) fn take(&mut self, event: &Event, timing: PollTiming) -> Option<ReadEvent> {
        let Event { time, kind } = *event;
        let read = match kind {
            EventKind::Speed { train, step } if train == self.train => {
                self.command(time, step);
                ReadEvent { event: *event, was_pushed: false }
            }
            EventKind::Reverse { train } | EventKind::Stopped { train, .. } if train == self.train => {
                ReadEvent { event: *event, was_pushed: false }
            }
            EventKind::Sensor(report) => {
                let last = self.last_report.replace(time);
                let window = DetectionWindow::of_report(time, report.poll_interval, last, timing);
                if self.is_stale(time) {
                    return None;
                }
                self.has_passed = true;
                let report = Report { poll_interval: Some(window.width()), ..report };
                let event = Event { time, kind: EventKind::Sensor(report) };
                ReadEvent { event, was_pushed: core::mem::take(&mut self.is_pushed) }
            }
            _ => return None,
        };
        self.last = Some(time);
        Some(read)
    }

    fn command(&mut self, time: Timestamp, step: SpeedStep) {
        let is_one_more = self.step > SpeedStep::STAND && step.get() == self.step.get() + 1;
        self.is_pushed |= is_one_more && self.last.is_some_and(|last| time - last >= PUSHED_AFTER);
        if self.step == SpeedStep::STAND && step != SpeedStep::STAND {
            self.started = Some(time);
        }
        self.step = step;
    }

    /// Whether a report is of a contact that the station remembers from before the run.
    fn is_stale(&self, time: Timestamp) -> bool {
        if self.has_passed {
            return false;
        }
        match self.started {
            Some(started) => time - started < STALE_WITHIN,
            None => self.step == SpeedStep::STAND,
        }
    }
}
