//! Which train a session took each detection to be of.
//!
//! A station reports sensors, not trains. The machine of a session says with its decisions which train it took a report to be of. A program
//! that learns from the session later reads it there, instead of deciding it once more with less knowledge.

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
    of_reports: BTreeMap<ReportKey, (TrainId, bool)>,
}

impl AssignedDetections {
    /// Those that decisions tell, in order; a later one may withdraw what an earlier one has assigned.
    pub fn of<'t>(trace: impl IntoIterator<Item = &'t Traced>) -> Self {
        let mut assigned = Self::default();
        for decision in
            trace.into_iter().filter(|traced| traced.side == Side::Decision && traced.kind == "notice")
        {
            if let Some((report, of)) = assigned_by(&decision.text) {
                assigned.of_reports.insert(report, of);
            } else if let Some(report) = withdrawn_by(&decision.text) {
                assigned.of_reports.remove(&report);
            }
        }
        assigned
    }

    /// Whether any report was assigned to a train.
    #[must_use]
    pub fn knows(&self, train: TrainId) -> bool {
        self.of_reports.values().any(|(of, _)| *of == train)
    }

    /// Whether an event is part of what a train did: a command to it, a report that was assigned to it, or a turnout on its path.
    #[must_use]
    pub fn concerns(&self, train: TrainId, event: &Event) -> bool {
        match event.kind {
            EventKind::Sensor(report) => {
                self.of_reports.get(&(event.time, report.sensor)).is_some_and(|(of, _)| *of == train)
            }
            EventKind::Speed { train: of, .. }
            | EventKind::Reverse { train: of }
            | EventKind::Stopped { train: of, .. } => of == train,
            EventKind::Turnout { .. } => true,
            // A detector of a block does not say whose end has left it.
            EventKind::Freed(_) => false,
        }
    }

    /// Whether a train was lost between two times, the second included, so that where it came from is unknown. Its first report after that
    /// may be one that a person has excluded.
    #[must_use]
    pub fn was_lost(&self, train: TrainId, after: Timestamp, until: Timestamp) -> bool {
        let between = (after, SensorId(u16::MAX))..=(until, SensorId(u16::MAX));
        after < until && self.of_reports.range(between).any(|(_, of)| *of == (train, true))
    }
}

impl Store {
    /// The detections of a session that its machines assigned to trains. Nothing where decisions are missing or cannot be read: what is
    /// left of them would join places between which a train was reported elsewhere.
    ///
    /// # Errors
    /// The store cannot be read.
    pub fn assigned_detections(&self, recording: RecordingKey) -> Result<AssignedDetections, StoreError> {
        let machines = || {
            let mut statement =
                self.connection.prepare("SELECT id FROM machines WHERE recording = ?1 ORDER BY id")?;
            let keys = statement.query_map([recording.0], |row| Ok(MachineKey(row.get(0)?)))?;
            keys.collect::<rusqlite::Result<Vec<MachineKey>>>()
        };
        let mut all = Vec::new();
        for machine in machines().map_err(|error| self.error(error))? {
            let Ok(trace) = self.trace(machine) else { return Ok(AssignedDetections::default()) };
            if (0..).zip(&trace).any(|(number, traced)| traced.number != number) {
                return Ok(AssignedDetections::default());
            }
            all.extend(trace);
        }
        Ok(AssignedDetections::of(&all))
    }
}

/// A report of a sensor: when, and which.
type ReportKey = (Timestamp, SensorId);

/// What a decision assigns: the notice that a train has passed a sensor, in the form that sessions write it down.
fn assigned_by(text: &str) -> Option<(ReportKey, (TrainId, bool))> {
    let text = Some(text).filter(|text| text.starts_with("Passed"))?;
    let train = TrainId(number_after(text, "train: TrainId(")?.try_into().ok()?);
    Some((report_of(text, "until: Timestamp(")?, (train, text.contains("late: None"))))
}

/// What a decision withdraws: the notice that a report has no explanation, which may come after it was assigned.
fn withdrawn_by(text: &str) -> Option<ReportKey> {
    Some(text)
        .filter(|text| text.contains("Unexplained {"))
        .and_then(|text| report_of(text, "time: Timestamp("))
}

fn report_of(text: &str, time: &str) -> Option<ReportKey> {
    let sensor = SensorId(number_after(text, "sensor: SensorId(")?.try_into().ok()?);
    Some((Timestamp::from_ns(number_after(text, time)?), sensor))
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
            traced(6, Side::Decision, &EXPECTED.replace("SensorId(46)", "SensorId(47)")),
            traced(7, Side::Decision, "Unexplained { sensor: SensorId(47), time: Timestamp(192461751140) }"),
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
        let lost = |train, after, until: &Event| {
            assigned.was_lost(TrainId(train), Timestamp::from_ns(after), until.time)
        };
        assert_eq!(
            [lost(24, 0, &found), lost(24, 0, &expected), lost(58, 0, &expected)],
            [true, true, false]
        );
        assert!(!lost(24, 6_194_770_729, &expected), "its own report is the first of the next stretch");
        // A report that was assigned to no train is of none.
        assert_eq!(of(&unassigned), [false, false]);
        assert_eq!(of(&stops), [false, true]);
    }
}
