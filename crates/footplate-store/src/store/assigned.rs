//! Which train a session took each detection to be of.
//!
//! A station reports sensors, not trains. The machine of a session says with its decisions which train it took a report to be of, and
//! why is not to be decided twice: who learns from the session afterwards reads it there.

use std::collections::BTreeMap;

use footplate_core::{Event, EventKind, SensorId, Timestamp, TrainId};

use super::decisions::{MachineKey, Side, Traced};
use super::error::StoreError;
use super::file::Store;
use super::recordings::RecordingKey;

/// The detections of a session that were assigned to trains.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct AssignedDetections {
    /// By time and sensor of the report: the train, and whether it had been lost before.
    of_reports: BTreeMap<(Timestamp, SensorId), (TrainId, bool)>,
}

impl AssignedDetections {
    /// Those that decisions tell.
    pub fn of<'t>(trace: impl IntoIterator<Item = &'t Traced>) -> Self {
        Self { of_reports: trace.into_iter().filter_map(assigned_by).collect() }
    }

    /// Whether nothing was assigned, or nothing is known of it.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.of_reports.is_empty()
    }

    /// Whether an event is part of what a train did: a command to it, a report that was assigned to it, or a turnout on its path.
    #[must_use]
    pub fn concerns(&self, train: TrainId, event: &Event) -> bool {
        match event.kind {
            EventKind::Sensor(_) => self.of_report(event).is_some_and(|(of, _)| of == train),
            EventKind::Speed { train: of, .. }
            | EventKind::Reverse { train: of }
            | EventKind::Stopped { train: of, .. } => of == train,
            EventKind::Turnout { .. } => true,
            // A detector of a block does not say whose end has left it.
            EventKind::Freed(_) => false,
        }
    }

    /// Whether a report is the first of its train after that was lost: where it came from is unknown.
    #[must_use]
    pub fn was_lost_before(&self, event: &Event) -> bool {
        self.of_report(event).is_some_and(|(_, was_lost)| was_lost)
    }

    fn of_report(&self, event: &Event) -> Option<(TrainId, bool)> {
        let EventKind::Sensor(report) = event.kind else { return None };
        self.of_reports.get(&(event.time, report.sensor)).copied()
    }
}

impl Store {
    /// The detections of a session that its machines assigned to trains.
    ///
    /// # Errors
    /// The store cannot be read.
    pub fn assigned_detections(&self, recording: RecordingKey) -> Result<AssignedDetections, StoreError> {
        let machines = || {
            let mut statement = self.connection.prepare("SELECT id FROM machines WHERE recording = ?1")?;
            let keys = statement.query_map([recording.0], |row| Ok(MachineKey(row.get(0)?)))?;
            keys.collect::<rusqlite::Result<Vec<MachineKey>>>()
        };
        let mut trace = Vec::new();
        for machine in machines().map_err(|error| self.error(error))? {
            trace.extend(self.trace(machine)?);
        }
        Ok(AssignedDetections::of(&trace))
    }
}

/// What a decision assigns: the notice that a train has passed a sensor, in the form that sessions write it down.
fn assigned_by(traced: &Traced) -> Option<((Timestamp, SensorId), (TrainId, bool))> {
    let text = Some(traced.text.as_str()).filter(|text| {
        traced.side == Side::Decision && traced.kind == "notice" && text.starts_with("Passed")
    })?;
    let train = TrainId(number_after(text, "train: TrainId(")?.try_into().ok()?);
    let sensor = SensorId(number_after(text, "sensor: SensorId(")?.try_into().ok()?);
    let time = Timestamp::from_ns(number_after(text, "until: Timestamp(")?);
    Some(((time, sensor), (train, text.contains("late: None"))))
}

/// The number that stands behind the first of these words.
fn number_after(text: &str, words: &str) -> Option<i64> {
    let (_, behind) = text.split_once(words)?;
    behind.split_once(')')?.0.parse().ok()
}

#[cfg(test)]
mod tests {
    use std::borrow::Cow;

    use footplate_core::{Report, SpeedStep, TimeSpan};

    use super::*;

    /// As a session has written them down.
    const FOUND: &str = "Passed(TrainPassed { train: TrainId(24), passed: PassedSensor { sensor: SensorId(61), window: \
        DetectionWindow { after: Timestamp(6135291368), until: Timestamp(6194770729) }, at: Timestamp(6165031048), late: None, \
        short: None, missed: 0, is_origin: false }, next: None })";
    const EXPECTED: &str = "Passed(TrainPassed { train: TrainId(58), passed: PassedSensor { sensor: SensorId(46), window: \
        DetectionWindow { after: Timestamp(192402341837), until: Timestamp(192461751140) }, at: Timestamp(192431995474), late: \
        Some([TimeSpan(12143603193), TimeSpan(8377498889)]), short: Some(Length(-0.2693242714360553)), missed: 0, is_origin: false }, \
        next: None })";

    #[test]
    fn decisions_tell_which_train_a_report_was_of() {
        let traced = |number, side, text: &str| Traced {
            number,
            time: Timestamp::ZERO,
            side,
            kind: Cow::Borrowed("notice"),
            text: text.to_owned(),
        };
        let trace = [
            traced(1, Side::Decision, FOUND),
            traced(2, Side::Decision, EXPECTED),
            traced(3, Side::Input, EXPECTED),
            traced(4, Side::Decision, "Done(Finished { train: TrainId(24), until: Timestamp(1) })"),
            traced(5, Side::Decision, "Passed(TrainPassed { train: TrainId(99999999), passed: "),
        ];
        let assigned = AssignedDetections::of(&trace);
        assert_eq!(assigned.of_reports.len(), 2);
        let event = |ns, kind| Event { time: Timestamp::from_ns(ns), kind };
        let report = |ns, sensor| {
            let report = Report { sensor: SensorId(sensor), poll_interval: Some(TimeSpan::from_ms(60)) };
            event(ns, EventKind::Sensor(report))
        };
        let (found, expected) = (report(6_194_770_729, 61), report(192_461_751_140, 46));
        let unassigned = report(192_461_751_140, 61);
        let stops = event(1, EventKind::Speed { train: TrainId(58), step: SpeedStep::STAND });
        let of = |event: &Event| [24, 58].map(|train| assigned.concerns(TrainId(train), event));
        assert_eq!([of(&found), of(&expected)], [[true, false], [false, true]]);
        assert_eq!([&found, &expected].map(|event| assigned.was_lost_before(event)), [true, false]);
        // A report that was assigned to no train is of none.
        assert_eq!(of(&unassigned), [false, false]);
        assert_eq!(of(&stops), [false, true]);
    }
}
