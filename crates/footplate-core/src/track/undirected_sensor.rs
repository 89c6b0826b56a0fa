//! Sensors that report one number whichever direction a train passes in, such as a single reed switch or a light barrier.
//!
//! Such a sensor has a node for each direction of travel, as every sensor has. The first has the number that the station reports,
//! the second one above all numbers of the layout file. So a report means either of the two until it is decided: by `control::drive`
//! from where its trains are, by [`DirectionFinder`] for a single train.

use alloc::vec::Vec;

use crate::event::{Event, EventKind, Report};
use crate::ids::{NodeId, SensorId, TrainId};
use crate::track::{Layout, TurnoutStates};

/// Most sensors in a row that stay silent before a train is taken to be elsewhere.
const MAX_SILENT: usize = 2;

/// A direction is known if the other one needs so many silent sensors more: one alone is missed now and then.
const DECIDES: usize = 2;

/// A train that was lifted counts as so many silent sensors: more than the longest path that is followed.
const ELSEWHERE: usize = MAX_SILENT + DECIDES;

impl Layout {
    /// The number under which the station reports a sensor: that of the detector for the entry of a block, and that of the first
    /// direction for a sensor that does not report the direction.
    pub fn input(&self, sensor: SensorId) -> SensorId {
        if let Some([reported, _]) = self.undirected.get(&sensor) {
            return *reported;
        }
        self.block_of_entry(sensor).map_or(sensor, |block| block.detector)
    }

    /// The two directions of a sensor that reports the same number for both; `None` for any other sensor.
    pub fn both_directions(&self, sensor: SensorId) -> Option<[SensorId; 2]> {
        self.undirected.get(&sensor).copied()
    }

    /// The sensors that a train may have passed if one is reported: both directions where it does not report the direction.
    pub fn meanings(&self, sensor: SensorId) -> impl Iterator<Item = SensorId> + use<> {
        let [one, other] = self.both_directions(sensor).map_or([Some(sensor), None], |both| both.map(Some));
        one.into_iter().chain(other)
    }

    /// Whether a report of one sensor may be of a train that passed the other: the same, or its other direction.
    pub fn may_mean(&self, reported: SensorId, passed: SensorId) -> bool {
        self.meanings(reported).any(|one| one == passed)
    }

    /// Whether no station reports this number, although a place has it: the entry of a block, or the second direction of a sensor.
    pub fn is_never_reported(&self, sensor: SensorId) -> bool {
        self.input(sensor) != sensor
    }

    /// Whether stations report a train without saying where it came from: at a block, or a sensor without a direction.
    pub fn has_open_reports(&self) -> bool {
        !self.blocks.is_empty() || self.has_undirected_sensors()
    }

    /// Whether a sensor does not report the direction.
    pub fn has_undirected_sensors(&self) -> bool {
        !self.undirected.is_empty()
    }
}

/// Finds the direction in which one train passes sensors that do not report it, by the order in which they report.
///
/// Each possible place of the train has a cost: the silent sensors on the path that leads there.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct DirectionFinder {
    /// Where the train may have been detected last.
    places: Vec<(NodeId, usize)>,
    last: Option<SensorId>,
    /// How many sensors in a row have left its direction open.
    undecided: usize,
}

impl DirectionFinder {
    /// How many sensors in a row have left the direction of the train open.
    pub const fn undecided(&self) -> usize {
        self.undecided
    }

    /// The train may be anywhere.
    pub fn lose(&mut self) {
        *self = Self::default();
    }

    /// Replaces a report by the sensor that the train passed. Returns `None` while its direction is unknown, and every event of
    /// another kind as it is.
    pub fn take(
        &mut self,
        layout: &Layout,
        turnouts: &TurnoutStates,
        train: TrainId,
        event: &Event,
    ) -> Option<Event> {
        match event.kind {
            EventKind::Sensor(report) => {
                let sensor = self.passed(layout, turnouts, report.sensor)?;
                Some(Event { kind: EventKind::Sensor(Report { sensor, ..report }), ..*event })
            }
            EventKind::Reverse { train: reversed } if reversed == train => {
                self.reverse(layout, turnouts);
                Some(*event)
            }
            _ => Some(*event),
        }
    }

    /// The sensor that the train passed; `None` while its direction is unknown.
    pub fn passed(
        &mut self,
        layout: &Layout,
        turnouts: &TurnoutStates,
        reported: SensorId,
    ) -> Option<SensorId> {
        if !layout.has_undirected_sensors() {
            return Some(reported);
        }
        let input = layout.input(reported);
        // It is on it for several polls.
        if self.last.replace(input) != Some(input) {
            let elsewhere = |node| (node, ELSEWHERE);
            let mut places: Vec<(NodeId, usize)> = layout
                .meanings(reported)
                .filter_map(|sensor| layout.sensor_node(sensor))
                .map(elsewhere)
                .collect();
            for (from, cost) in &self.places {
                for reach in layout.reaches(*from, turnouts, MAX_SILENT) {
                    let reached = places.iter_mut().find(|(node, _)| *node == reach.to);
                    if let Some((_, known)) = reached {
                        *known = (*known).min(cost + reach.missed());
                    }
                }
            }
            // A sensor that the layout does not have says nothing of where the train is.
            let Some(least) = places.iter().map(|(_, cost)| *cost).min() else { return Some(reported) };
            places.iter_mut().for_each(|(_, cost)| *cost -= least);
            self.places = places;
            self.undecided = if self.decided().is_some() { 0 } else { self.undecided + 1 };
        }
        self.decided().and_then(|node| layout.sensor_at(node))
    }

    /// Where the train was detected last, if that is known.
    fn decided(&self) -> Option<NodeId> {
        let (node, _) = self.places.iter().find(|(_, cost)| *cost == 0)?;
        let is_known = self.places.iter().all(|(other, cost)| other == node || *cost >= DECIDES);
        is_known.then_some(*node)
    }

    /// The train reverses at rest: it comes from the sensor that was ahead of it.
    pub fn reverse(&mut self, layout: &Layout, turnouts: &TurnoutStates) {
        let behind = self.places.iter().flat_map(|(node, cost)| {
            layout.open_hops_from(*node, turnouts).map(move |hop| (hop.to.reverse(), *cost))
        });
        self.places = behind.collect();
        self.last = None;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ids::TurnoutId;
    use crate::track::example::{stretch, undirected_oval};
    use crate::track::{Leg, Place};
    use alloc::format;
    use alloc::string::String;

    struct Scene {
        layout: Layout,
        turnouts: TurnoutStates,
        finder: DirectionFinder,
    }

    impl Scene {
        fn new() -> Self {
            let turnouts =
                [(TurnoutId(1), Leg::Straight), (TurnoutId(2), Leg::Straight)].into_iter().collect();
            Self { layout: undirected_oval(), turnouts, finder: DirectionFinder::default() }
        }

        fn hear(&mut self, name: &str) -> Option<&str> {
            let reported = self.layout.input(self.layout.sensor_named(name).unwrap());
            let passed = self.finder.passed(&self.layout, &self.turnouts, reported)?;
            Some(self.layout.sensor_name(passed))
        }
    }

    #[test]
    fn both_directions_have_one_input_and_nodes_that_are_each_others_reverse() {
        let layout = undirected_oval();
        let [there, back] = ["B1", "B2"].map(|name| layout.sensor_named(name).unwrap());
        assert_eq!((there, layout.input(back)), (SensorId(2), SensorId(2)));
        assert!(back > SensorId(8), "above all numbers of the plan: {back}");
        assert_eq!(layout.both_directions(back), Some([there, back]));
        assert!(layout.is_never_reported(back) && !layout.is_never_reported(there));
        let node = layout.sensor_node(there).unwrap();
        assert_eq!(layout.sensor_at(node.reverse()), Some(back));
    }

    #[test]
    fn the_order_of_reports_shows_the_direction_and_a_reversal_turns_it() {
        let mut scene = Scene::new();
        assert_eq!(scene.hear("A1"), None, "either direction");
        assert_eq!(scene.hear("A1"), None, "still on it");
        assert_eq!(scene.hear("B1"), None, "backwards if D was silent");
        assert_eq!(scene.hear("D1"), Some("D1"));
        assert_eq!(scene.hear("A1"), Some("A1"));
        scene.finder.reverse(&scene.layout, &scene.turnouts);
        assert_eq!(scene.hear("A1"), Some("A2"));
        assert_eq!(scene.hear("D1"), Some("D2"));
        assert_eq!(scene.hear("A1"), Some("A2"), "B was silent");
    }

    #[test]
    fn a_train_turned_by_hand_is_found_to_run_backward() {
        let mut scene = Scene::new();
        let passed: Vec<_> = "ABDAB ADBADB"
            .split(' ')
            .map(|names| {
                names.chars().map(|name| scene.hear(&format!("{name}1")).map(String::from)).last().flatten()
            })
            .collect();
        assert_eq!(passed, [Some("B1".into()), Some("B2".into())]);
    }

    #[test]
    fn on_a_circuit_of_two_their_order_shows_nothing() {
        let mut plan = crate::track::example::oval_plan();
        let undirected = |name: &str, number| Place::UndirectedSensor {
            names: [format!("{name}1"), format!("{name}2")],
            sensor: SensorId(number),
        };
        plan.places = alloc::vec![undirected("A", 0), undirected("B", 1)];
        plan.stretches = alloc::vec![stretch("A1", "B1", 800.0), stretch("B1", "A1", 900.0)];
        let turnouts = TurnoutStates::unknown();
        let (layout, mut finder) = (Layout::build(&plan).unwrap(), DirectionFinder::default());
        for number in (0..10).map(|nth| nth % 2) {
            assert_eq!(finder.passed(&layout, &turnouts, SensorId(number)), None);
        }
        assert_eq!(finder.undecided(), 10);
    }

    #[test]
    fn a_lost_train_may_have_either_direction() {
        let mut scene = Scene::new();
        for name in ["A1", "B1"] {
            scene.hear(name);
        }
        assert_eq!(scene.hear("D1"), Some("D1"));
        scene.finder.lose();
        assert_eq!(scene.hear("A1"), None);
    }
}
