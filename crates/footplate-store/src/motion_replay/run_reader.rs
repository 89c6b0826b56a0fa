//! From the raw events of a run to what a fit is given of one train: its commands, and the sensors it passed with the
//! interval in which each closed.

use footplate_core::link::{DetectionWindow, PollTiming};
use footplate_core::model::STALE_WITHIN;
use footplate_core::{Event, EventKind, Report, SensorId, SpeedStep, TimeSpan, Timestamp, TrainId};

/// A train that runs and is commanded one step more when no detection and no command has been for so long was pushed: it had not come
/// where it should, and the calibration took it for stuck. No trip of an experiment takes as long between two of either.
const PUSHED_AFTER: TimeSpan = TimeSpan::from_ms(4_000);

/// Reads the events of one train in a run, without those that other trains caused.
#[derive(Debug)]
pub(super) struct RunReader {
    train: TrainId,
    step: SpeedStep,
    /// When the train was commanded to start from rest last.
    started: Option<Timestamp>,
    /// The last command to the train or report.
    last: Option<Timestamp>,
    last_report: Option<Timestamp>,
    /// The sensor whose reports say nothing of when the train passed it, with its last one.
    stale: Option<(SensorId, Timestamp)>,
    has_passed: bool,
    is_pushed: bool,
}

/// An event for the fit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ReadEvent {
    pub(super) event: Event,
    /// Whether a hand helped the train to the sensor that is reported.
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
            stale: None,
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
                if self.is_stale(time, report.sensor, last.is_none()) {
                    self.stale = Some((report.sensor, time));
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

    /// Whether a report is of a sensor that the station remembers from before the run, or that the train has been on since: the
    /// first answer of a station reports all that closed since its last one, be that minutes ago.
    fn is_stale(&self, time: Timestamp, sensor: SensorId, is_first: bool) -> bool {
        if self.has_passed {
            return false;
        }
        if self.stale.is_some_and(|(stale, last)| stale == sensor && time - last < STALE_WITHIN) {
            return true;
        }
        match self.started {
            Some(started) => time - started < STALE_WITHIN,
            None => is_first || self.step == SpeedStep::STAND,
        }
    }
}

#[cfg(test)]
mod tests {
    use footplate_core::link::PollTiming;

    use super::*;

    #[test]
    fn a_report_that_the_station_remembered_says_nothing_of_the_motion() {
        // Given a recording that begins with the train running,
        let train = TrainId(24);
        let mut reader = RunReader::new(train, SpeedStep::new(5).unwrap());
        let mut is_read = |at: f64, sensor| {
            let report = Report { sensor: SensorId(sensor), poll_interval: Some(TimeSpan::from_ms(80)) };
            let event = Event { time: Timestamp::from_s(at), kind: EventKind::Sensor(report) };
            reader.take(&event, PollTiming::ASSUMED).is_some()
        };
        // then the first report, and what repeats it, may be of a detection long before; those behind it are not.
        assert_eq!(
            [is_read(0.02, 20), is_read(0.1, 20), is_read(3.8, 43), is_read(8.7, 3)],
            [false, false, true, true]
        );
    }
}
