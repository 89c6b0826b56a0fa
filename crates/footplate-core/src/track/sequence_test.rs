//! Tests whether reports can come from a layout: a sensor reports after another only if rails lead from one to the
//! other.
//!
//! Turnouts may be in any position, up to [`MAX_SILENT`] sensors in a row may stay silent, sensors report without a
//! train now and then, and people lift trains. So a single stray report proves nothing. The layout is contradicted if
//! more reports are stray than the right layout would show by chance (a one-sided binomial test). Reports while all
//! trains are at rest are no evidence: no train caused them.

use alloc::collections::BTreeMap;
use alloc::vec::Vec;

use crate::event::{Event, EventKind};
use crate::ids::{NodeId, SensorId, SpeedStep, TrainId};
use crate::time::{TimeSpan, Timestamp};
use crate::track::{Layout, TurnoutStates};

/// A train is at rest this long after its stop command (the longest published stop).
const STOPS_WITHIN: TimeSpan = TimeSpan::from_s(5.0);

/// Most silent sensors in a row.
const MAX_SILENT: usize = 2;

/// Largest share of stray reports on the right layout (1 % in the real logs, 0.2 % in the simulator; chosen for layouts
/// in a worse state).
const STRAY: f64 = 0.05;

/// A layout is contradicted if chance alone would show as many stray reports with this probability.
const SIGNIFICANCE: f64 = 1e-4;

/// A report that no train ahead of the sensor can have caused.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StrayReport {
    /// The sensor that reported.
    pub seen: SensorId,
    /// The sensor that a train had passed before; `None` if the layout does not have the sensor that reported.
    pub after: Option<SensorId>,
    /// How often this occurred.
    pub times: u32,
}

/// The result of the test.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum SequenceVerdict {
    /// The reports do not contradict the layout, or are too few.
    Fits,
    /// The reports do not come from this layout.
    Contradicts {
        /// The stray reports, the most frequent first.
        stray: Vec<StrayReport>,
        /// Reports that followed others, stray ones included.
        reports: u32,
    },
}

/// Follows the reports of a recording over a layout.
#[derive(Debug, Clone, Default)]
pub struct SequenceTest {
    /// How many trains may be running.
    trains: usize,
    /// Where they were detected last, the latest first.
    places: Vec<NodeId>,
    /// The last stray report: a train may be there after all.
    elsewhere: Option<NodeId>,
    last: Option<SensorId>,
    /// Trains that have not been commanded yet and may be running.
    uncommanded: usize,
    /// The last command to each train: the time of a stop, `None` for a step that moves it.
    stops: BTreeMap<TrainId, Option<Timestamp>>,
    followed: u32,
    stray: BTreeMap<(Option<SensorId>, SensorId), u32>,
}

impl SequenceTest {
    /// Begins a run in which `trains` trains may already be running, at unknown positions.
    pub fn begin_run(&mut self, trains: usize) {
        self.begin_run_at_rest(trains);
        self.uncommanded = self.trains;
    }

    /// Begins a run with `trains` trains at rest, at unknown positions: none runs before it is commanded to.
    pub fn begin_run_at_rest(&mut self, trains: usize) {
        self.trains = trains.max(1);
        self.uncommanded = 0;
        self.stops.clear();
        self.forget_places();
    }

    fn forget_places(&mut self) {
        self.places.clear();
        (self.elsewhere, self.last) = (None, None);
    }

    /// Adds the next event of the run.
    pub fn take(&mut self, layout: &Layout, event: &Event) {
        match event.kind {
            EventKind::Sensor(_) if self.in_motion(event.time) == 0 => {}
            EventKind::Sensor(report) => self.report(layout, report.sensor),
            // The positions do not show which one is this train's, and it reverses there.
            EventKind::Reverse { .. } => self.forget_places(),
            EventKind::Speed { train, step } => {
                let stop = (step == SpeedStep::STAND).then_some(event.time);
                match self.stops.get_mut(&train) {
                    // Stations repeat commands: the first one stopped the train.
                    Some(known) => *known = stop.map(|time| known.unwrap_or(time)),
                    None => {
                        self.stops.insert(train, stop);
                        self.uncommanded = self.uncommanded.saturating_sub(1);
                    }
                }
            }
            EventKind::Turnout { .. } | EventKind::Stopped { .. } | EventKind::Freed(_) => {}
        }
    }

    /// How many trains may be in motion by the commands so far.
    pub fn in_motion(&self, now: Timestamp) -> usize {
        let rests = |stop: &Option<Timestamp>| stop.is_some_and(|since| now - since >= STOPS_WITHIN);
        self.uncommanded + self.stops.values().filter(|stop| !rests(stop)).count()
    }

    fn report(&mut self, layout: &Layout, sensor: SensorId) {
        if self.last.replace(sensor) == Some(sensor) {
            return;
        }
        let Some(node) = layout.sensor_node(sensor) else {
            self.note_stray(None, sensor);
            return;
        };
        let unknown = TurnoutStates::unknown();
        let is_here = |to: NodeId| to == node || is_undirected(layout, to) && to == node.reverse();
        // How many sensors further on this one is, at the least.
        let sensors_on = |from: &NodeId| {
            let back = Some(from.reverse()).filter(|_| is_undirected(layout, *from));
            let reaches = core::iter::once(*from)
                .chain(back)
                .flat_map(|from| layout.reaches(from, &unknown, MAX_SILENT));
            reaches.filter(|reach| is_here(reach.to)).map(|reach| reach.hops().len()).min()
        };
        // Another train may be behind this one: the nearest was here. Of several, the one that was detected longest ago.
        let nearest = (0..self.places.len())
            .rev()
            .filter_map(|place| Some((sensors_on(self.places.get(place)?)?, place)))
            .min_by_key(|(sensors_on, _)| *sensors_on);
        if let Some((_, train)) = nearest {
            self.followed += 1;
            self.places.remove(train);
        } else if self.elsewhere.as_ref().and_then(sensors_on).is_some() {
            // It was a train: the one detected longest ago.
            self.followed += 1;
            self.places.pop();
        } else if self.places.len() >= self.trains || self.places.contains(&node) {
            let after = self.places.first().and_then(|place| layout.sensor_at(*place));
            self.note_stray(after, sensor);
            self.elsewhere = Some(node);
            return;
        }
        self.elsewhere = None;
        self.places.insert(0, node);
    }

    fn note_stray(&mut self, after: Option<SensorId>, seen: SensorId) {
        *self.stray.entry((after, seen)).or_default() += 1;
    }

    /// The result of all runs so far.
    pub fn verdict(&self) -> SequenceVerdict {
        let count: u32 = self.stray.values().sum();
        let reports = self.followed + count;
        if chance_of_as_many(count, reports) >= SIGNIFICANCE {
            return SequenceVerdict::Fits;
        }
        let mut stray: Vec<StrayReport> = self
            .stray
            .iter()
            .map(|((after, seen), times)| StrayReport { seen: *seen, after: *after, times: *times })
            .collect();
        stray.sort_by_key(|stray| core::cmp::Reverse(stray.times));
        SequenceVerdict::Contradicts { stray, reports }
    }
}

/// Whether the sensor at a node does not report the direction: a train may have left it in either.
fn is_undirected(layout: &Layout, node: NodeId) -> bool {
    layout.sensor_at(node).is_some_and(|sensor| layout.both_directions(sensor).is_some())
}

/// The probability that at least `count` of `all` reports are stray on the right layout.
fn chance_of_as_many(count: u32, all: u32) -> f64 {
    // From the lowest count up, each term from the previous one: P(k + 1) = P(k) (n − k)/(k + 1) p/(1 − p).
    let mut term = libm::pow(1.0 - STRAY, f64::from(all));
    if term == 0.0 {
        // Too many reports for this sum: the share decides.
        return if f64::from(count) > 2.0 * STRAY * f64::from(all) { 0.0 } else { 1.0 };
    }
    let mut fewer = 0.0;
    for k in 0..count {
        fewer += term;
        term *= f64::from(all - k) / f64::from(k + 1) * STRAY / (1.0 - STRAY);
    }
    1.0 - fewer
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::event::Report;
    use crate::track::example::{oval, oval_plan, stretch};
    use crate::track::{LayoutPlan, Place};
    use alloc::format;

    fn walked(trains: usize, names: &[&str]) -> SequenceVerdict {
        walked_on(&oval(), trains, names)
    }

    fn walked_on(layout: &Layout, trains: usize, names: &[&str]) -> SequenceVerdict {
        let mut test = SequenceTest::default();
        test.begin_run(trains);
        for (second, name) in names.iter().enumerate() {
            let sensor = layout.sensor_named(name).unwrap_or(SensorId(90 + second as u16));
            let kind = EventKind::Sensor(Report { sensor, poll_interval: None });
            test.take(layout, &Event { time: Timestamp::from_s(second as f64), kind });
        }
        test.verdict()
    }

    #[test]
    fn silent_sensors_wrong_turnouts_repetitions_and_a_few_stray_reports_fit() {
        // Round by B, past a silent D, by C, with two reports without a train, one stuck sensor and one train lifted.
        let names =
            ["A1", "B1", "D1", "A1", "A1", "E1", "C1", "D1", "A1", "B1", "A1", "C1", "D1", "B2", "A2", "D2"];
        assert_eq!(walked(1, &names), SequenceVerdict::Fits);
        assert_eq!(walked(1, &[]), SequenceVerdict::Fits);
        assert_eq!(walked(1, &["A1", "E1", "B2"]), SequenceVerdict::Fits, "too few to tell");
    }

    #[test]
    fn a_report_ahead_of_two_trains_is_of_the_nearer_one() {
        // Given a ring of eight sensors, each 500 mm behind the one before,
        let names = ["A", "B", "C", "D", "E", "F", "G", "H"];
        let place = |(nth, name): (usize, &&str)| Place::Sensor {
            names: [format!("{name}1"), format!("{name}2")],
            sensors: [SensorId(2 * nth as u16), SensorId(2 * nth as u16 + 1)],
        };
        let nexts = names.iter().cycle().skip(1);
        let stretches = names.iter().zip(nexts);
        let plan = LayoutPlan {
            name: "ring".into(),
            places: names.iter().enumerate().map(place).collect(),
            stretches: stretches
                .map(|(from, to)| stretch(&format!("{from}1"), &format!("{to}1"), 500.0))
                .collect(),
            ..oval_plan()
        };
        let layout = Layout::build(&plan).unwrap();
        // when a train follows another one sensor behind it, for two rounds,
        let round = (0..16).flat_map(|nth| [names[(nth + 1) % 8], names[nth % 8]]);
        let reports: Vec<_> = round.map(|name| format!("{name}1")).collect();
        let reports: Vec<&str> = reports.iter().map(|name| name.as_str()).collect();
        // then each report has a train that caused it.
        assert_eq!(walked_on(&layout, 2, &reports), SequenceVerdict::Fits);
    }

    #[test]
    fn reports_while_all_trains_are_at_rest_are_no_evidence() {
        let layout = oval();
        let mut test = SequenceTest::default();
        let sensors = ["A1", "E1", "A1", "E1", "B2", "E1", "A1", "E1"].map(|name| layout.sensor_named(name));
        let take = |test: &mut SequenceTest, time: f64, kind| {
            test.take(&layout, &Event { time: Timestamp::from_s(time), kind });
        };
        let stray = |test: &mut SequenceTest, from: f64| {
            for (nth, sensor) in sensors.into_iter().flatten().enumerate() {
                let kind = EventKind::Sensor(Report { sensor, poll_interval: None });
                take(test, from + nth as f64, kind);
            }
        };
        test.begin_run_at_rest(1);
        stray(&mut test, 0.0);
        assert_eq!(test.verdict(), SequenceVerdict::Fits, "no command so far");
        let command = |step| EventKind::Speed { train: TrainId(24), step: SpeedStep::new(step).unwrap() };
        for (time, step) in [(20.0, 5), (30.0, 0)] {
            test.take(&layout, &Event { time: Timestamp::from_s(time), kind: command(step) });
        }
        stray(&mut test, 36.0);
        assert_eq!(test.verdict(), SequenceVerdict::Fits, "stopped 6 s before");
        test.take(&layout, &Event { time: Timestamp::from_s(50.0), kind: command(5) });
        stray(&mut test, 51.0);
        assert!(matches!(test.verdict(), SequenceVerdict::Contradicts { .. }), "it runs");
    }

    #[test]
    fn two_trains_are_followed_apart() {
        let names = ["A1", "A2", "B1", "D2", "D1", "B2", "A1", "A2", "C1", "D2", "D1", "C2"];
        assert_eq!(walked(2, &names), SequenceVerdict::Fits);
        assert!(matches!(walked(1, &names), SequenceVerdict::Contradicts { .. }));
    }

    #[test]
    fn a_sequence_that_no_rails_make_contradicts_and_names_its_sensors() {
        let names = ["A1", "E1", "A1", "E1", "B2", "E1", "A1", "E1"];
        let SequenceVerdict::Contradicts { stray, reports } = walked(1, &names) else { panic!("it fits") };
        let layout = oval();
        let sensor = |name| layout.sensor_named(name).unwrap();
        assert_eq!((stray[0].seen, stray[0].after, stray[0].times), (sensor("E1"), Some(sensor("A1")), 4));
        assert_eq!(reports, 7);
        let of_another = walked(1, &["A1", "Z1", "Z2", "Z3", "Z4"]);
        assert!(matches!(of_another, SequenceVerdict::Contradicts { stray, .. } if stray[0].after.is_none()));
    }

    #[test]
    fn the_chance_of_stray_reports_is_that_of_a_binomial_distribution() {
        assert!((chance_of_as_many(0, 10) - 1.0).abs() < 1e-12);
        assert!((chance_of_as_many(10, 10) - libm::pow(0.05, 10.0)).abs() < 1e-12);
        assert!((chance_of_as_many(3, 10) - 0.011_504).abs() < 1e-5);
        assert!(chance_of_as_many(500, 10_000) > 0.1 && chance_of_as_many(5_000, 1_000_000) > 0.99);
    }
}
