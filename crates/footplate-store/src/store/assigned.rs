//! Which train a session took each detection to be of.
//!
//! A station reports sensors, not trains. The machine of a session says with its decisions which train it took a report to be of. A program
//! that learns from the session later reads it there, instead of deciding it once more with less knowledge.

use std::collections::{BTreeMap, BTreeSet};

use footplate_core::track::Layout;
use footplate_core::{Event, EventKind, Report, SensorId, Timestamp, TrainId};

use super::decisions::{MachineKey, Side, Traced};
use super::error::StoreError;
use super::file::Store;
use super::keys::RecordingKey;

/// The detections of a session that were assigned to trains.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct AssignedDetections {
    /// By time of the report and input of the station.
    of_reports: BTreeMap<ReportKey, Assigned>,
    /// When an operator said where a train is.
    placed: BTreeSet<(TrainId, Timestamp)>,
}

/// What a report was taken for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Assigned {
    train: TrainId,
    /// The sensor that the train passed. The detector of a block reports trains that come in at any of its ends.
    sensor: SensorId,
    /// Whether the train had been lost before.
    was_lost: bool,
}

impl AssignedDetections {
    /// Those that decisions tell, in order; a later one may withdraw what an earlier one has assigned.
    pub fn of<'t>(layout: &Layout, trace: impl IntoIterator<Item = &'t Traced>) -> Self {
        let mut assigned = Self::default();
        for decision in
            trace.into_iter().filter(|traced| traced.side == Side::Decision && traced.kind == "notice")
        {
            let key = |time, sensor| (time, layout.input(sensor));
            if let Some((time, of)) = assigned_by(&decision.text) {
                assigned.of_reports.insert(key(time, of.sensor), of);
            } else if let Some((time, sensor)) = withdrawn_by(&decision.text) {
                assigned.of_reports.remove(&key(time, sensor));
            } else if let Some(train) = placed_by(&decision.text) {
                assigned.placed.insert((train, decision.time));
            }
        }
        assigned
    }

    /// Whether any report was assigned to a train.
    pub fn knows(&self, train: TrainId) -> bool {
        self.of_reports.values().any(|of| of.train == train)
    }

    /// An event as part of what a train did: a command to it, a report that was assigned to it, of the sensor that it was taken to have
    /// passed, or a turnout on its path. `None` if the event is not part of that.
    pub fn own(&self, layout: &Layout, train: TrainId, event: &Event) -> Option<Event> {
        let is_own = match event.kind {
            EventKind::Sensor(report) => {
                let assigned = self.of_reports.get(&(event.time, layout.input(report.sensor)));
                let sensor = assigned.filter(|of| of.train == train)?.sensor;
                return Some(Event { kind: EventKind::Sensor(Report { sensor, ..report }), ..*event });
            }
            EventKind::Speed { train: of, .. }
            | EventKind::Reverse { train: of }
            | EventKind::Stopped { train: of, .. } => of == train,
            EventKind::Turnout { .. } => true,
            // A detector of a block does not say whose end has left it.
            EventKind::Freed(_) => false,
        };
        is_own.then_some(*event)
    }

    /// Whether a train was lost, or put elsewhere by an operator, between two times, the second included, so that where it came from is
    /// unknown. Its first report after that may be one that a person has excluded.
    pub fn was_lost(&self, train: TrainId, after: Timestamp, until: Timestamp) -> bool {
        let between = (after, SensorId(u16::MAX))..=(until, SensorId(u16::MAX));
        after < until
            && (self.of_reports.range(between).any(|(_, of)| of.train == train && of.was_lost)
                || self.placed.range((train, after)..=(train, until)).next().is_some())
    }
}

impl Store {
    /// The detections of a session that its machines assigned to trains. Nothing where decisions are missing or cannot be read: what is
    /// left of them would join places between which a train was reported elsewhere.
    ///
    /// # Errors
    /// The store cannot be read.
    pub fn assigned_detections(
        &self,
        layout: &Layout,
        recording: RecordingKey,
    ) -> Result<AssignedDetections, StoreError> {
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
        Ok(AssignedDetections::of(layout, &all))
    }
}

/// A report: when, and of which input of the station.
type ReportKey = (Timestamp, SensorId);

/// What a decision assigns: the notice that a train has passed a sensor, in the form that sessions write it down.
fn assigned_by(text: &str) -> Option<(Timestamp, Assigned)> {
    let text = Some(text).filter(|text| text.starts_with("Passed"))?;
    let train = TrainId(number_after(text, "train: TrainId(")?.try_into().ok()?);
    let (time, sensor) = report_of(text, "until: Timestamp(")?;
    Some((time, Assigned { train, sensor, was_lost: text.contains("late: None") }))
}

/// The train whose place an operator said, by a decision.
fn placed_by(text: &str) -> Option<TrainId> {
    let text = Some(text).filter(|text| text.starts_with("Placed("))?;
    Some(TrainId(number_after(text, "TrainId(")?.try_into().ok()?))
}

/// What a decision withdraws: the notice that a report has no explanation, which may come after it was assigned.
fn withdrawn_by(text: &str) -> Option<(Timestamp, SensorId)> {
    Some(text)
        .filter(|text| text.contains("Unexplained {"))
        .and_then(|text| report_of(text, "time: Timestamp("))
}

fn report_of(text: &str, time: &str) -> Option<(Timestamp, SensorId)> {
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
    use crate::layout_named;

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
        let layout = layout_named("track-a").unwrap().layout;
        let assigned = AssignedDetections::of(&layout, &trace);
        assert_eq!(assigned.of_reports.len(), 2);
        let event = |ns, kind| Event { time: Timestamp::from_ns(ns), kind };
        let report = |ns, sensor| {
            let report = Report { sensor: SensorId(sensor), poll_interval: Some(TimeSpan::from_ms(60)) };
            event(ns, EventKind::Sensor(report))
        };
        let (found, expected) = (report(6_194_770_729, 61), report(192_461_751_140, 46));
        let unassigned = report(192_461_751_140, 61);
        let stops = event(1, EventKind::Speed { train: TrainId(58), step: SpeedStep::STAND });
        let of = |event: &Event| [24, 58].map(|train| assigned.own(&layout, TrainId(train), event).is_some());
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

    #[test]
    fn a_train_is_taken_to_have_passed_the_end_of_its_block_that_the_session_found() {
        let layout = layout_named("oval-blocks").unwrap().layout;
        let block = layout.blocks().iter().find(|block| block.entries.len() > 1).unwrap();
        let (reported, found) = (block.entries[0], block.entries[1]);
        let text = FOUND.replace("SensorId(61)", &format!("SensorId({})", found.0));
        let traced = |number, text: String| Traced {
            number,
            time: Timestamp::from_s(8.0),
            side: Side::Decision,
            kind: Cow::Borrowed("notice"),
            text,
        };
        let trace = [traced(0, text), traced(1, "Placed(TrainId(24))".to_owned())];
        let assigned = AssignedDetections::of(&layout, &trace);
        let event = |sensor| {
            let report = Report { sensor, poll_interval: Some(TimeSpan::from_ms(60)) };
            Event { time: Timestamp::from_ns(6_194_770_729), kind: EventKind::Sensor(report) }
        };
        assert_eq!(assigned.own(&layout, TrainId(24), &event(reported)), Some(event(found)));
        // Put elsewhere after 8 s, it did not come from there.
        let lost = |train, [after, until]: [f64; 2]| {
            assigned.was_lost(TrainId(train), Timestamp::from_s(after), Timestamp::from_s(until))
        };
        assert_eq!([lost(24, [7.0, 9.0]), lost(24, [9.0, 10.0]), lost(58, [7.0, 9.0])], [true, false, false]);
    }
}
