//! From reports of block detectors to the entries at which trains came in.
//!
//! A detector says that a train is in its block, and neither which nor from where. The train came from a block that was
//! occupied before, or over track without a detector. If several boundaries qualify, a train that was heading for this one
//! is likelier than a train that ran away from it and has reversed; the driver, which knows its trains, may decide otherwise.
//!
//! Dirty wheels make a detector flicker: it reports free, and occupied again a moment later. No train comes back that fast.

use alloc::vec::Vec;

use crate::event::{Event, EventKind, Report};
use crate::ids::{SensorId, TurnoutId};
use crate::time::{TimeSpan, Timestamp};
use crate::track::{Block, Layout, Leg, TurnoutStates};

/// A block that is occupied again this soon after it was free was occupied all along: a train that reverses at the boundary,
/// or the next one, takes longer (chosen; usual release delays of detectors are 0.3 to 2 s).
pub const FLICKER_TIME: TimeSpan = TimeSpan::from_ms(2_000);

/// The state of all blocks of a layout, by what their detectors reported.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Occupancy {
    /// In the order of the layout's blocks.
    blocks: Vec<BlockState>,
    turnouts: TurnoutStates,
}

#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct BlockState {
    is_occupied: bool,
    /// Where the last train came in; `None` if that is unknown.
    entry: Option<SensorId>,
    freed: Option<Timestamp>,
}

impl Occupancy {
    /// All blocks free.
    pub fn new(layout: &Layout) -> Self {
        let blocks = layout.blocks().iter().map(|_| BlockState::default()).collect();
        Self { blocks, turnouts: TurnoutStates::unknown() }
    }

    /// Every block by its detector, and whether it is occupied.
    pub fn states(&self, layout: &Layout) -> impl Iterator<Item = (SensorId, bool)> {
        layout.blocks().iter().zip(&self.blocks).map(|(block, state)| (block.detector, state.is_occupied))
    }

    /// A detector was occupied when it was first read. Returns whether there is such a detector.
    pub fn occupied_from_start(&mut self, layout: &Layout, detector: SensorId) -> bool {
        let state = self.state_of(layout, detector);
        state.map(|state| state.is_occupied = true).is_some()
    }

    /// Replaces the report of a detector by the entry of its block. Returns `None` for a report without news, and every other
    /// event as it is.
    pub fn take(&mut self, layout: &Layout, event: Event) -> Option<Event> {
        match event.kind {
            EventKind::Sensor(report) => {
                let Some(block) = layout.block_of_detector(report.sensor) else { return Some(event) };
                let entry = self.occupied(layout, block, event.time)?;
                Some(Event { kind: EventKind::Sensor(Report { sensor: entry, ..report }), ..event })
            }
            EventKind::Freed(report) => {
                let state = self.state_of(layout, report.sensor)?;
                if !core::mem::take(&mut state.is_occupied) {
                    return None;
                }
                state.freed = Some(event.time);
                Some(event)
            }
            EventKind::Turnout { turnout, curved } => {
                self.thrown(turnout, curved);
                Some(event)
            }
            EventKind::Speed { .. } | EventKind::Reverse { .. } | EventKind::Stopped { .. } => Some(event),
        }
    }

    fn thrown(&mut self, turnout: TurnoutId, curved: bool) {
        self.turnouts.set(turnout, Leg::from_curved(curved));
    }

    fn state_of(&mut self, layout: &Layout, detector: SensorId) -> Option<&mut BlockState> {
        let place = layout.blocks().iter().position(|block| block.detector == detector)?;
        self.blocks.get_mut(place)
    }

    /// A block is occupied; returns where the train came in.
    fn occupied(&mut self, layout: &Layout, block: &Block, now: Timestamp) -> Option<SensorId> {
        let likeliest = self.likeliest_entry(layout, block);
        let state = self.state_of(layout, block.detector)?;
        let flickers = state.freed.is_some_and(|freed| now - freed < FLICKER_TIME);
        if core::mem::replace(&mut state.is_occupied, true) || flickers {
            return None;
        }
        state.entry = likeliest;
        likeliest
    }

    /// The boundary at which a train most likely came into a block.
    fn likeliest_entry(&self, layout: &Layout, block: &Block) -> Option<SensorId> {
        let entries = block.entries.iter().rev().copied();
        entries.max_by_key(|entry| self.rank(layout, *entry))
    }

    /// How likely a train comes in at an entry: 0 from a free block, 1 over track without a detector, 2 from an occupied block,
    /// 3 from a block whose train heads for this entry.
    fn rank(&self, layout: &Layout, entry: SensorId) -> u8 {
        let Some(node) = layout.sensor_node(entry) else { return 0 };
        let Some(before) = layout.block_left_at(node) else { return 1 };
        let place = layout.blocks().iter().position(|known| known == before);
        let Some(state) = place.and_then(|place| self.blocks.get(place)) else { return 0 };
        let leads_here = |from: SensorId| {
            let node = layout.sensor_node(from);
            let mut hops = node.into_iter().flat_map(|node| layout.open_hops_from(node, &self.turnouts));
            hops.any(|hop| hop.sensor == Some(entry))
        };
        match state.entry {
            _ if !state.is_occupied => 0,
            Some(from) if leads_here(from) => 3,
            _ => 2,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::track::example::oval_of_blocks;

    struct Scene {
        layout: Layout,
        occupancy: Occupancy,
    }

    impl Scene {
        fn new(curved: bool) -> Self {
            let layout = oval_of_blocks();
            let mut occupancy = Occupancy::new(&layout);
            for turnout in [TurnoutId(1), TurnoutId(2)] {
                let kind = EventKind::Turnout { turnout, curved };
                let event = Event { time: Timestamp::ZERO, kind };
                assert_eq!(occupancy.take(&layout, event), Some(event));
            }
            Self { layout, occupancy }
        }

        fn report(&mut self, seconds: f64, block: &str, is_occupied: bool) -> Option<&str> {
            let found = self.layout.blocks().iter().find(|known| known.name == block).unwrap();
            let report = Report { sensor: found.detector, poll_interval: None };
            let kind = if is_occupied { EventKind::Sensor(report) } else { EventKind::Freed(report) };
            let event = Event { time: Timestamp::from_s(seconds), kind };
            let taken = self.occupancy.take(&self.layout, event)?;
            let (EventKind::Sensor(report) | EventKind::Freed(report)) = taken.kind else { panic!() };
            Some(self.layout.sensor_name(report.sensor))
        }

        fn occupied(&mut self, seconds: f64, block: &str) -> Option<&str> {
            self.report(seconds, block, true)
        }

        fn freed(&mut self, seconds: f64, block: &str) -> Option<&str> {
            self.report(seconds, block, false)
        }
    }

    #[test]
    fn a_train_comes_from_the_block_that_was_occupied() {
        let mut scene = Scene::new(false);
        let station = scene.layout.block_of_detector(SensorId(1)).unwrap().detector;
        assert!(scene.occupancy.occupied_from_start(&scene.layout, station));
        let occupied = |scene: &Scene| -> Vec<_> {
            scene
                .occupancy
                .states(&scene.layout)
                .filter(|(_, is_occupied)| *is_occupied)
                .map(|(detector, _)| detector)
                .collect()
        };
        assert_eq!(occupied(&scene), [station], "its detector reports it before any train is known");
        assert_eq!(scene.occupied(5.0, "main"), Some("S3"));
        assert_eq!(scene.freed(7.0, "station"), Some("station"));
        assert_eq!(scene.freed(12.0, "main"), Some("main"), "it runs on where no detector is");
        assert_eq!(occupied(&scene), []);
        assert_eq!(scene.occupied(16.0, "station"), Some("S1"), "and comes back from there");
        assert_eq!(scene.occupied(20.0, "main"), Some("S3"));
    }

    #[test]
    fn a_train_that_reverses_comes_back_over_the_boundary_that_it_left_by() {
        let mut scene = Scene::new(false);
        scene.occupied(1.0, "station");
        scene.occupied(4.0, "main");
        scene.freed(6.0, "station");
        assert_eq!(scene.occupied(20.0, "station"), Some("S4"));
    }

    #[test]
    fn of_two_neighbours_the_one_heading_for_the_block_comes_in() {
        let mut scene = Scene::new(false);
        scene.occupied(1.0, "station");
        scene.occupied(4.0, "main");
        scene.freed(6.0, "station");
        // One train is ahead, in `main`; another comes over the track without a detector.
        assert_eq!(scene.occupied(9.0, "station"), Some("S4"), "the detectors alone cannot know");
        // A train that heads for the block is likelier than one that ran away from it: `main` was entered from there.
        let mut scene = Scene::new(false);
        scene.occupied(1.0, "station");
        scene.occupied(4.0, "main");
        scene.freed(6.0, "station");
        assert_eq!(scene.occupied(9.0, "siding"), Some("S10"));
        assert_eq!(scene.occupied(12.0, "station"), Some("S6"));
    }

    #[test]
    fn a_flicker_is_no_train() {
        let mut scene = Scene::new(false);
        assert_eq!(scene.occupied(1.0, "station"), Some("S1"));
        assert_eq!(scene.occupied(1.1, "station"), None, "it is still there");
        assert_eq!(scene.freed(2.0, "station"), Some("station"));
        assert_eq!(scene.freed(2.1, "station"), None);
        assert_eq!(scene.occupied(2.5, "station"), None);
        assert_eq!(scene.freed(4.0, "station"), Some("station"));
        assert_eq!(scene.occupied(9.0, "station"), Some("S1"));
    }

    #[test]
    fn sensors_and_commands_pass_unchanged() {
        let layout = crate::track::example::oval();
        let mut occupancy = Occupancy::new(&layout);
        let time = Timestamp::from_s(1.0);
        let report = Report { sensor: SensorId(3), poll_interval: None };
        let event = Event { time, kind: EventKind::Sensor(report) };
        assert_eq!(occupancy.take(&layout, event), Some(event));
        assert_eq!(occupancy.take(&layout, Event { time, kind: EventKind::Freed(report) }), None);
        assert!(!occupancy.occupied_from_start(&layout, SensorId(3)));
    }
}
