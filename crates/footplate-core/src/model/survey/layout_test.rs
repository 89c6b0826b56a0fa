//! Whether recordings are of a layout: the order of sensors, and the lengths between them.
//!
//! The order is judged by [`SequenceTest`]. Lengths are judged without any model of the train: while it runs at one step, the
//! time over a section is as long as the section. With `t` times and `m` surveyed lengths of one such stretch of running,
//! `ln(t/m)` less its median there is by how much a section is longer than surveyed; the median of that over all stretches
//! is what [`SurveyTest`] compares.

use alloc::collections::BTreeMap;
use alloc::vec::Vec;

use super::section_index::SectionIndex;
use super::survey_test::{SurveyTest, median};
use crate::event::{Event, EventKind};
use crate::ids::NodeId;
use crate::time::{TimeSpan, Timestamp};
use crate::track::{DirectionFinder, Layout, Leg, SequenceTest, SequenceVerdict, TurnoutStates};

/// A train runs steadily this long after its last command (the longest changes of the published trains take 4 s).
const SETTLES: TimeSpan = TimeSpan::from_ms(4_000);

/// A stretch of running over fewer hops does not tell which of them is long.
const FEWEST_HOPS: usize = 5;

/// A section that was passed less often says nothing: one poll too late, or one spurious report, is no length.
const FEWEST_PASSES: usize = 3;

/// Times between two polled reports scatter by about so much of a distance (m), one standard deviation: one poll of 70 ms at mid
/// speed.
const SCATTER: f64 = 0.013;

/// Follows recordings over a layout and says whether they are of it.
#[derive(Debug, Clone, Default)]
pub struct LayoutTest {
    sequence: SequenceTest,
    turnouts: TurnoutStates,
    directions: DirectionFinder,
    last: Option<(NodeId, Timestamp)>,
    steady_from: Timestamp,
    /// Sections of the present stretch of running, with `ln(t/m)`.
    running: Vec<(usize, f64)>,
    /// By section, by how much `ln(t/m)` was above the median of its stretch.
    longer: BTreeMap<usize, Vec<f64>>,
}

impl LayoutTest {
    /// A run begins in which so many trains move; steadily already, or from rest.
    pub fn begin_run(&mut self, trains: usize) {
        self.begin_run_at_rest(trains);
        self.sequence.begin_run(trains);
    }

    /// A session begins in which all trains are at rest: reports before the first command come from no train.
    pub fn begin_run_at_rest(&mut self, trains: usize) {
        self.end_stretch();
        self.sequence.begin_run_at_rest(trains);
        self.turnouts = TurnoutStates::unknown();
        self.directions.lose();
        (self.last, self.steady_from) = (None, Timestamp::from_ns(i64::MIN));
    }

    /// Takes a whole run in which so many trains move, or may.
    pub fn take_run<'e>(
        &mut self,
        layout: &Layout,
        sections: &SectionIndex,
        trains: usize,
        events: impl Iterator<Item = &'e Event>,
    ) {
        self.begin_run(trains);
        for event in events {
            self.take(layout, sections, event);
        }
    }

    /// The next entry of the run.
    pub fn take(&mut self, layout: &Layout, sections: &SectionIndex, event: &Event) {
        self.sequence.take(layout, event);
        match event.kind {
            EventKind::Sensor(report) => {
                let passed = self.directions.passed(layout, &self.turnouts, report.sensor);
                if let Some(node) = passed.and_then(|sensor| layout.sensor_node(sensor)) {
                    self.pass(layout, sections, node, event.time);
                }
            }
            EventKind::Turnout { turnout, curved } => self.turnouts.set(turnout, Leg::from_curved(curved)),
            EventKind::Speed { .. } | EventKind::Reverse { .. } => {
                if matches!(event.kind, EventKind::Reverse { .. }) {
                    self.directions.reverse(layout, &self.turnouts);
                }
                self.end_stretch();
                (self.last, self.steady_from) = (None, event.time + SETTLES);
            }
            EventKind::Stopped { .. } | EventKind::Freed(_) => {}
        }
    }

    fn pass(&mut self, layout: &Layout, sections: &SectionIndex, node: NodeId, time: Timestamp) {
        if self.sequence.in_motion(time) > 1 {
            // Which train these times belong to is unknown.
            self.running.clear();
            self.last = None;
            return;
        }
        if time < self.steady_from || self.last.is_some_and(|(last, _)| last == node) {
            return;
        }
        let Some((from, then)) = self.last.replace((node, time)) else { return };
        let mut hops = layout.open_hops_from(from, &self.turnouts).filter(|hop| hop.to == node);
        let only = hops.next().filter(|_| hops.next().is_none());
        drop(hops);
        let Some(hop) = only else {
            self.end_stretch();
            return;
        };
        let slowness = (time - then).as_s() / hop.length.as_m();
        if let Some(section) = sections.section(hop.id).filter(|_| slowness.is_finite() && slowness > 0.0) {
            self.running.push((section, libm::log(slowness)));
        }
    }

    /// Compares the sections of a stretch of running with each other.
    fn end_stretch(&mut self) {
        let running = core::mem::take(&mut self.running);
        if running.len() < FEWEST_HOPS {
            return;
        }
        let Some(usual) = median(running.iter().map(|(_, slowness)| *slowness)) else { return };
        for (section, slowness) in running {
            self.longer.entry(section).or_default().push(slowness - usual);
        }
    }

    /// What the order of the reports says.
    pub fn sequence(&self) -> SequenceVerdict {
        self.sequence.verdict()
    }

    /// How the lengths compare with those of the layout.
    pub fn lengths(&self, sections: &SectionIndex) -> SurveyTest {
        let mut test = self.clone();
        test.end_stretch();
        let passed = test.longer.iter().filter(|(_, longer)| longer.len() >= FEWEST_PASSES);
        let path_length = passed.filter_map(|(section, longer)| {
            let length = sections.surveyed_length(*section);
            let by = length * libm::expm1(median(longer.iter().copied())?);
            // The median of n values is by a quarter worse than their mean.
            Some((*section, by, 1.57 * SCATTER * SCATTER / longer.len() as f64))
        });
        SurveyTest::of(sections, path_length)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::event::Report;
    use crate::track::example::{oval, oval_plan};
    use crate::units::Length;

    /// Laps of the oval at 0.3 m/s with these edges longer (m), as a test of the oval sees them.
    fn laps(longer: &[(usize, f64)]) -> SurveyTest {
        let mut plan = oval_plan();
        for (stretch, by) in longer {
            let length = plan.stretches[*stretch].length.estimate(&plan.survey).0;
            plan.stretches[*stretch].length = (length + Length::from_m(*by)).into();
        }
        let (layout, real) = (oval(), Layout::build(&plan).unwrap());
        let sections = SectionIndex::of(&layout);
        let mut test = LayoutTest::default();
        test.begin_run(1);
        let mut time = 0.0;
        for lap in 0..8 {
            let by = if lap % 2 == 0 { "B1" } else { "C1" };
            for (from, to) in [("A1", by), (by, "D1"), ("D1", "A1")] {
                let node = real.node_named(from).unwrap();
                let to = real.node_named(to).unwrap();
                let hop = real.hops_from(node).find(|hop| hop.to == to).unwrap();
                time += hop.length.as_m() / 0.3;
                let kind = EventKind::Sensor(Report { sensor: hop.sensor.unwrap(), poll_interval: None });
                test.take(&layout, &sections, &Event { time: Timestamp::from_s(time), kind });
            }
        }
        assert_eq!(test.sequence(), SequenceVerdict::Fits);
        test.lengths(&sections)
    }

    #[test]
    fn lengths_that_are_those_of_the_layout_pass_and_one_that_is_not_is_found() {
        assert!(laps(&[]).is_passed());
        let test = laps(&[(4, 0.2)]);
        assert_eq!(test.odd.len(), 1, "{test:?}");
        assert!((test.odd[0].path_length - test.odd[0].surveyed - 0.2).abs() < 0.01, "{test:?}");
    }
}
