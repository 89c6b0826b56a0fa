//! Data association during a calibration: one train runs, but detections are missed or spurious, turnouts fail, and
//! people lift trains.

use alloc::collections::BTreeMap;
use alloc::vec::Vec;

use crate::ids::{NodeId, SensorId, TurnoutId};
use crate::link::DetectionWindow;
use crate::model::MotionModel;
use crate::time::{TimeSpan, Timestamp};
use crate::track::{DirectionFinder, Layout, Leg, Reach, TurnoutStates};
use crate::tracking::{Locator, TrackContext};
use crate::units::{Length, Speed};

/// Most missed detections in a row. Beyond that the train is somewhere else.
const MAX_MISSED: usize = 2;

/// Reports of a sensor that follow each other within this are one detection: a pickup over it, or a sensor that sticks.
const ONE_DETECTION: TimeSpan = TimeSpan::from_ms(1_000);

/// No train in the published tables runs faster.
const FASTEST: Speed = Speed::from_mm_per_s(1_000.0);

/// This many unexplained reports, minus the explained ones between them, contradict the layout.
const MAX_UNEXPLAINED: usize = 4;

/// A report with a lower density (1/s) is spurious: sensors report by themselves about this often.
const LEAST_DENSITY: f64 = 1e-4;

/// The class of a report.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum ReportClass {
    /// The first detection of a lost train.
    First(NodeId),
    /// The train passed it on its path.
    Passed(NodeId),
    /// The train passed it over the leg of a turnout that was not set.
    ByOtherLeg {
        node: NodeId,
        turnout: TurnoutId,
        /// The leg it took.
        leg: Leg,
    },
    /// A repetition of the same detection.
    Again,
    /// Not caused by the train, or not part of this layout.
    Unexplained,
    /// The train was detected where it cannot have run.
    Moved { from: Option<NodeId>, to: NodeId },
    /// Too many unexplained reports to continue.
    WrongLayout { seen: Vec<SensorId>, expected: Vec<SensorId> },
}

/// The last detection of the train, and the unexplained ones since.
#[derive(Debug, Clone, Default)]
pub(super) struct Tracker {
    last: Option<(NodeId, Timestamp)>,
    directions: DirectionFinder,
    /// A sensor that reported where the train cannot have run; it may have been moved there.
    elsewhere: Option<(NodeId, Timestamp)>,
    reported: BTreeMap<SensorId, Timestamp>,
    unexplained: Vec<SensorId>,
    expected: Vec<SensorId>,
}

impl Tracker {
    /// The sensor passed last.
    pub(super) fn last(&self) -> Option<NodeId> {
        self.last.map(|(node, _)| node)
    }

    /// When it reported.
    pub(super) fn last_time(&self) -> Option<Timestamp> {
        self.last.map(|(_, time)| time)
    }

    /// The train is lost.
    pub(super) fn lose(&mut self) {
        self.last = None;
        self.elsewhere = None;
        self.directions.lose();
    }

    /// The train reverses.
    pub(super) fn reverse(&mut self, context: TrackContext<'_>) {
        self.directions.reverse(context.layout, context.turnouts);
    }

    /// How many sensors in a row have left the direction of the train open.
    pub(super) const fn undecided(&self) -> usize {
        self.directions.undecided()
    }

    /// The sensor that the train passed if one is reported; `None` for a lost train whose direction that does not show.
    pub(super) fn passed(&mut self, context: TrackContext<'_>, reported: SensorId) -> Option<SensorId> {
        let TrackContext { layout, turnouts, .. } = context;
        let found = self.directions.passed(layout, turnouts, reported);
        let Some(last) = self.last() else { return found };
        let reached = |turnouts: &TurnoutStates, missed| {
            let reaches = layout.reaches(last, turnouts, missed);
            let meant =
                reaches.filter(|reach| reach.sensor.is_some_and(|passed| layout.may_mean(reported, passed)));
            meant.min_by_key(Reach::missed).and_then(|reach| reach.sensor)
        };
        let by_other_leg = || reached(&TurnoutStates::unknown(), 0);
        reached(turnouts, MAX_MISSED).or_else(by_other_leg).or(found).or(Some(reported))
    }

    /// Classifies a report.
    pub(super) fn classify(
        &mut self,
        context: TrackContext<'_>,
        locator: &Locator,
        model: &MotionModel,
        sensor: SensorId,
        window: DetectionWindow,
    ) -> ReportClass {
        let time = window.until;
        let before = self.reported.insert(sensor, time);
        if before.is_some_and(|before| time - before < ONE_DETECTION) {
            return ReportClass::Again;
        }
        let Some(node) = context.node_of(sensor) else {
            return self.unexplained(context, sensor, None, time);
        };
        let Some((last, _)) = self.last else {
            self.take(node, time);
            return ReportClass::First(node);
        };
        let is_likely = locator.likelihood(context, model, sensor, window).map_or_else(
            || locator.locate(context, model, time).is_none(),
            |log| log > libm::log(LEAST_DENSITY),
        );
        // The very next sensor is accepted whenever a train can have reached it: spurious reports come from any
        // sensor, and predictions of an uncalibrated train are poor.
        let is_next = leads_to(context.layout, context.turnouts, last, node, 0)
            && self.in_time(context.layout, self.last, node, time);
        if is_next || is_likely && leads_to(context.layout, context.turnouts, last, node, MAX_MISSED) {
            self.take(node, time);
            return ReportClass::Passed(node);
        }
        if let Some((turnout, leg)) = other_leg(context, last, node)
            && self.in_time(context.layout, self.last, node, time)
        {
            self.take(node, time);
            return ReportClass::ByOtherLeg { node, turnout, leg };
        }
        if self.in_time(context.layout, self.elsewhere, node, time) {
            self.unexplained.push(sensor);
            self.take(node, time);
            return ReportClass::Moved { from: Some(last), to: node };
        }
        self.unexplained(context, sensor, Some(node), time)
    }

    /// The train was here: one unexplained report counts less.
    fn take(&mut self, node: NodeId, time: Timestamp) {
        self.unexplained.pop();
        self.last = Some((node, time));
        self.elsewhere = None;
    }

    fn unexplained(
        &mut self,
        context: TrackContext<'_>,
        sensor: SensorId,
        node: Option<NodeId>,
        time: Timestamp,
    ) -> ReportClass {
        if self.unexplained.is_empty() {
            let from = self.last.map(|(last, _)| last);
            let next = from.into_iter().flat_map(|last| context.layout.hops_from(last));
            self.expected = next.filter_map(|hop| hop.sensor).collect();
        }
        if !self.unexplained.contains(&sensor) {
            self.unexplained.push(sensor);
        }
        self.elsewhere = node.map(|node| (node, time));
        if self.unexplained.len() < MAX_UNEXPLAINED {
            return ReportClass::Unexplained;
        }
        let seen = core::mem::take(&mut self.unexplained);
        ReportClass::WrongLayout { seen, expected: core::mem::take(&mut self.expected) }
    }

    /// Whether a train that was at a node then can be at another now, by any leg, with one missed detection.
    fn in_time(
        &self,
        layout: &Layout,
        was: Option<(NodeId, Timestamp)>,
        node: NodeId,
        now: Timestamp,
    ) -> bool {
        let Some((from, then)) = was else { return false };
        let unknown = TurnoutStates::unknown();
        let farthest = (now - then) * FASTEST + Length::from_mm(50.0);
        let shortest = |reach: &Reach| -> Length {
            reach.hops().iter().filter_map(|id| layout.hop(*id)).map(|hop| layout.least_length(&hop)).sum()
        };
        layout.reaches(from, &unknown, 1).any(|reach| reach.to == node && shortest(&reach) <= farthest)
    }
}

fn leads_to(layout: &Layout, turnouts: &TurnoutStates, from: NodeId, to: NodeId, missed: usize) -> bool {
    layout.reaches(from, turnouts, missed).any(|reach| reach.to == to)
}

/// The first turnout that was not in its commanded position if a train ran from one node to another, and its actual
/// position.
fn other_leg(context: TrackContext<'_>, from: NodeId, to: NodeId) -> Option<(TurnoutId, Leg)> {
    let unknown = TurnoutStates::unknown();
    // Without a missed detection: two rare faults at once are less likely than a spurious report.
    let reach = context.layout.reaches(from, &unknown, 0).find(|reach| reach.to == to)?;
    let hops = reach.hops().iter().filter_map(|id| context.layout.hop(*id));
    let mut needs = hops.flat_map(|hop| hop.needs.iter());
    needs.find(|need| !context.turnouts.allow(**need)).map(|need| (need.turnout, need.leg))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ids::{SpeedStep, TrainId};
    use crate::model::survey::SectionIndex;
    use crate::track::example::oval;
    use std::vec;

    struct Scene {
        layout: Layout,
        sections: SectionIndex,
        turnouts: TurnoutStates,
        tracker: Tracker,
    }

    fn scene() -> Scene {
        let layout = oval();
        let turnouts = [(TurnoutId(1), Leg::Straight), (TurnoutId(2), Leg::Straight)].into_iter().collect();
        Scene { sections: SectionIndex::of(&layout), layout, turnouts, tracker: Tracker::default() }
    }

    impl Scene {
        /// Classifies a report of a sensor by name at a time in seconds, with a locator without a position.
        fn classify(&mut self, seconds: f64, name: &str) -> ReportClass {
            let context =
                TrackContext { layout: &self.layout, sections: &self.sections, turnouts: &self.turnouts };
            let train = TrainId(24);
            let until = Timestamp::from_s(seconds);
            let window = DetectionWindow { after: until - TimeSpan::from_ms(70), until };
            let sensor = self.layout.sensor_named(name).unwrap();
            let model = MotionModel::unknown(train, SpeedStep::new(14).unwrap());
            self.tracker.classify(context, &Locator::new(train), &model, sensor, window)
        }

        fn node(&self, name: &str) -> NodeId {
            self.layout.node_named(name).unwrap()
        }
    }

    #[test]
    fn a_train_is_tracked_past_a_silent_sensor_and_a_stuck_one() {
        let mut scene = scene();
        let (a, b, a_again) = (scene.node("A1"), scene.node("B1"), scene.node("A1"));
        assert_eq!(scene.classify(1.0, "A1"), ReportClass::First(a));
        assert_eq!(scene.classify(1.07, "A1"), ReportClass::Again);
        assert_eq!(scene.classify(3.0, "B1"), ReportClass::Passed(b));
        assert_eq!(scene.classify(8.0, "A1"), ReportClass::Passed(a_again), "D1 was missed");
    }

    #[test]
    fn a_turnout_that_did_not_move_is_noticed_on_the_other_leg() {
        let mut scene = scene();
        let c = scene.node("C1");
        scene.classify(1.0, "A1");
        let verdict = scene.classify(3.0, "C1");
        assert_eq!(verdict, ReportClass::ByOtherLeg { node: c, turnout: TurnoutId(1), leg: Leg::Curved });
    }

    #[test]
    fn one_unexplained_report_changes_nothing_and_two_consistent_ones_move_the_train() {
        let mut scene = scene();
        let (a, d, b2) = (scene.node("A1"), scene.node("D1"), scene.node("B2"));
        assert_eq!(scene.classify(1.0, "A1"), ReportClass::First(a));
        assert_eq!(scene.classify(2.0, "E1"), ReportClass::Unexplained);
        let b = scene.node("B1");
        assert_eq!(scene.classify(3.0, "B1"), ReportClass::Passed(b));
        assert_eq!(scene.classify(5.0, "D1"), ReportClass::Passed(d));
        // It was reversed by hand.
        assert_eq!(scene.classify(9.0, "D2"), ReportClass::Unexplained);
        assert_eq!(scene.classify(11.0, "B2"), ReportClass::Moved { from: Some(d), to: b2 });
    }

    #[test]
    fn sensors_that_never_fit_are_another_layout() {
        let mut scene = scene();
        scene.classify(1.0, "A1");
        for (at, name) in [(3.0, "E1"), (5.0, "C2"), (7.0, "E2")] {
            assert_eq!(scene.classify(at, name), ReportClass::Unexplained, "{name}");
        }
        let sensor = |name| scene.layout.sensor_named(name).unwrap();
        let seen = vec![sensor("E1"), sensor("C2"), sensor("E2"), sensor("A2")];
        let expected = vec![sensor("B1"), sensor("C1")];
        assert_eq!(scene.classify(9.0, "A2"), ReportClass::WrongLayout { seen, expected });
    }
}
