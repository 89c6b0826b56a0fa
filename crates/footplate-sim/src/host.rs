//! The polling program and its operator: they follow a script and record what they see.

use footplate_core::track::Layout;
use footplate_core::{Event, EventKind, Length, Report, SensorId, SpeedStep, TimeSpan, Timestamp, TrainId};

use crate::draws::Draws;
use crate::path::Path;
use crate::poller::{Line, Link, Poll};
use crate::rolling::Rolling;
use crate::script::{Order, What, When};
use crate::sensors::Actuation;
use crate::truth::{CommandTruth, ReportTruth, StopTruth};

/// From standstill until the operator presses the key (measured).
const KEY_PRESS_S: core::ops::Range<f64> = 0.2..0.5;
/// Standard deviation of a tape laid along the rails (chosen).
const TAPE_SD_MM: f64 = 3.0;
/// Tapes are read to the centimetre (as in the recordings).
const TAPE_MARK_MM: f64 = 10.0;

/// The recording, and the truth behind it.
#[derive(Debug, Default)]
pub(crate) struct Notes {
    pub(crate) events: Vec<Event>,
    pub(crate) reports: Vec<ReportTruth>,
    pub(crate) commands: Vec<CommandTruth>,
    pub(crate) stops: Vec<StopTruth>,
}

/// The program and the operator during a run. Times in s since its start.
#[derive(Debug)]
pub(crate) struct Host<'w> {
    train: TrainId,
    link: &'w Link,
    layout: &'w Layout,
    clock: Timestamp,
    orders: std::slice::Iter<'w, Order>,
    /// The pending order, and the time at which it is ready once that is known.
    next: Option<(Order, Option<f64>)>,
    /// When the previous order was done.
    since: f64,
    /// How many new sensor reports have come since then.
    seen: u32,
    /// The sensor whose report the last order waited for.
    trigger: Option<SensorId>,
    /// Whether a command waits for the line.
    is_sending: bool,
    /// The sensors that the last poll saw closed, and since when.
    closed_sensors: Vec<(SensorId, f64)>,
    draws: Draws,
    notes: Notes,
}

impl<'w> Host<'w> {
    /// The start of a run, when the clock shows `clock`, after earlier `events`.
    pub(crate) fn new(
        train: TrainId,
        (link, layout): (&'w Link, &'w Layout),
        clock: Timestamp,
        orders: &'w [Order],
        events: Vec<Event>,
        draws: Draws,
    ) -> Self {
        let mut orders = orders.iter();
        let next = orders.next().map(|order| (*order, None));
        let (since, seen, trigger, is_sending, closed_sensors) = (0.0, 0, None, false, Vec::new());
        let notes = Notes { events, ..Notes::default() };
        Self {
            train,
            link,
            layout,
            clock,
            orders,
            next,
            since,
            seen,
            trigger,
            is_sending,
            closed_sensors,
            draws,
            notes,
        }
    }

    /// Whether the script is done.
    pub(crate) const fn is_done(&self) -> bool {
        self.next.is_none()
    }

    /// The recording and its truth.
    pub(crate) fn into_notes(self) -> Notes {
        self.notes
    }

    /// Carries out the next order if it is due.
    pub(crate) fn follow_script(
        &mut self,
        now: f64,
        rolling: &Rolling<'_>,
        path: &Path,
        line: &mut Line<SpeedStep>,
    ) {
        let Some((order, ready)) = &mut self.next else { return };
        if self.is_sending {
            return;
        }
        if ready.is_none() {
            *ready = match order.when {
                When::After(span) => Some(self.since + span.as_s()),
                // The operator needs a moment to notice.
                When::AtRest if rolling.stays_at_rest() => Some(match order.what {
                    What::Measure => rolling.rested_at().unwrap_or(now) + self.draws.uniform(KEY_PRESS_S),
                    What::Speed(_) => now,
                }),
                When::AtRest | When::OnReport { .. } => None,
            };
        }
        let Some(due) = ready.filter(|ready| *ready <= now) else { return };
        match order.what {
            What::Speed(step) => {
                line.send(due, step);
                self.is_sending = true;
            }
            What::Measure => {
                self.measure(now, rolling, path);
                self.advance(now);
            }
        }
    }

    /// Records a command that was sent; `heard` is when the decoder receives it.
    pub(crate) fn note_command(&mut self, step: SpeedStep, began: f64, heard: f64) {
        let event = self.write(began, EventKind::Speed { train: self.train, step });
        self.notes.commands.push(CommandTruth { event, step, heard: self.at(heard) });
        self.is_sending = false;
        self.advance(began);
    }

    /// Records the answer of a poll.
    pub(crate) fn note_poll(&mut self, poll: Poll, closed: &[Actuation]) {
        for actuation in closed {
            let before =
                self.closed_sensors.iter().find(|(sensor, _)| *sensor == actuation.sensor).map(|(_, at)| *at);
            if before.is_none() {
                self.note_new_report(actuation.sensor, poll.stamp);
            }
            if before.is_some() && !self.link.repeats {
                continue;
            }
            let interval = TimeSpan::from_s(poll.stamp - poll.stamp_before);
            let poll_interval = self.link.intervals.then_some(interval);
            let report = Report { sensor: self.layout.input(actuation.sensor), poll_interval };
            let event = self.write(poll.stamp, EventKind::Sensor(report));
            self.notes.reports.push(ReportTruth {
                event,
                sensor: actuation.sensor,
                cause: actuation.cause_at(poll.before),
                first: before != Some(actuation.closed),
                closed: self.at(actuation.closed),
                reading: self.at(poll.reading),
                reading_before: self.at(poll.before),
            });
        }
        self.closed_sensors.clear();
        self.closed_sensors.extend(closed.iter().map(|actuation| (actuation.sensor, actuation.closed)));
    }

    /// Counts a sensor that was open at the previous poll.
    fn note_new_report(&mut self, sensor: SensorId, stamp: f64) {
        let Some((Order { when: When::OnReport { skipped, wait }, .. }, ready @ None)) = &mut self.next
        else {
            return;
        };
        if self.seen == *skipped {
            *ready = Some(stamp + wait.as_s());
            self.trigger = Some(sensor);
        }
        self.seen += 1;
    }

    /// Measures with a tape from the landmark that the script or the path suggests.
    fn measure(&mut self, now: f64, rolling: &Rolling<'_>, path: &Path) {
        let [here, _] = rolling.state();
        let passed = path.landmarks.partition_point(|point| point.at_mm <= here);
        let behind = path.landmarks.get(..passed).unwrap_or_default();
        let triggered = behind.iter().rev().find(|point| Some(point.what) == self.trigger);
        let Some(landmark) = triggered.or(behind.last()) else { return };
        let true_mm = here - landmark.at_mm;
        let read_mm = self.draws.normal(true_mm, TAPE_SD_MM);
        let offset = Length::from_mm((read_mm / TAPE_MARK_MM).round() * TAPE_MARK_MM);
        let event =
            self.write(now, EventKind::Stopped { train: self.train, landmark: landmark.what, offset });
        let rested = self.at(rolling.rested_at().unwrap_or(0.0));
        self.notes.stops.push(StopTruth { event, rested, offset: Length::from_mm(true_mm) });
    }

    /// Proceeds to the next order.
    fn advance(&mut self, now: f64) {
        self.next = self.orders.next().map(|order| (*order, None));
        self.since = now;
        self.seen = 0;
    }

    fn write(&mut self, at: f64, kind: EventKind) -> usize {
        let time = self.at(at);
        self.notes.events.push(Event { time, kind });
        self.notes.events.len() - 1
    }

    fn at(&self, seconds: f64) -> Timestamp {
        self.clock + TimeSpan::from_s(seconds)
    }
}
