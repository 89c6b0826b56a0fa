//! The reference of a paced train, and the scale between surveyed lengths and its path lengths.

use crate::ids::NodeId;
use crate::model::MotionModel;
use crate::time::Timestamp;
use crate::tracking::TrackContext;
use crate::units::{Length, Speed};

/// Grid interval (s): a tenth of a hop between sensors, and short compared with a change of speed.
pub(super) const GRID_S: f64 = 0.2;
/// Points of the grid: a little longer than a change of step takes to take effect and to be corrected.
pub(super) const POINTS: usize = 12;

/// Where a train should be, from now on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::control::drive) struct Reference {
    /// Surveyed m past the last sensor passed, after 1, 2 … [`POINTS`] times [`GRID_S`].
    pub(super) places: [f64; POINTS],
    /// Its speed now and at the last point (surveyed m/s).
    pub(super) speeds: [f64; 2],
}

impl Reference {
    /// From now to the last point (s).
    pub(super) const SPAN: f64 = GRID_S * POINTS as f64;

    /// The reference from a function of time (s from now).
    pub(super) fn of(place_at: impl Fn(f64) -> f64, speeds: [f64; 2]) -> Self {
        Self { places: core::array::from_fn(|point| place_at(GRID_S * (point + 1) as f64)), speeds }
    }

    /// Where the train should be now, extrapolated.
    pub(super) fn now(&self) -> f64 {
        let [first, second, ..] = self.places;
        first + first - second
    }

    pub(super) fn last(&self) -> f64 {
        self.places.last().copied().unwrap_or_default()
    }
}

/// A speed held from a place and a time on, in surveyed lengths.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::control::drive) struct IdealLine {
    /// The sensor that distances are measured from.
    pub(in crate::control::drive) node: NodeId,
    /// The surveyed distance past it ...
    pub(in crate::control::drive) distance: Length,
    /// ... at this time.
    pub(in crate::control::drive) time: Timestamp,
    pub(in crate::control::drive) speed: Speed,
}

impl IdealLine {
    /// Surveyed distance past the sensor (m) at a time.
    pub(super) fn place(&self, time: Timestamp) -> f64 {
        (self.distance + self.speed * (time - self.time)).as_m()
    }

    /// The same line measured from another sensor near the train: passed since, or before if a detection was assigned
    /// wrongly. `None` if no path connects the two.
    pub(super) fn recount_from(
        self,
        context: TrackContext<'_>,
        node: NodeId,
        now: Timestamp,
    ) -> Option<Self> {
        if node == self.node {
            // Subtract the laps run since.
            let circuit_length = surveyed_distance(context, node, node);
            let laps = circuit_length.map_or(0.0, |circuit_length| {
                libm::round((self.place(now) / circuit_length.as_m()).max(0.0))
            });
            let distance = self.distance - circuit_length.unwrap_or(Length::ZERO) * laps;
            return Some(Self { distance, ..self });
        }
        let after = surveyed_distance(context, self.node, node).map(|between| self.distance - between);
        let before = surveyed_distance(context, node, self.node).map(|between| self.distance + between);
        let off = |distance: &Length| Self { distance: *distance, ..self }.place(now).abs();
        let distance =
            after.into_iter().chain(before).min_by(|one, other| off(one).total_cmp(&off(other)))?;
        Some(Self { node, distance, ..self })
    }
}

/// Hops between sensors considered: 3 m of the densest known track.
const MAX_HOPS: usize = 12;

/// The ends of the hops ahead of a sensor, as path lengths and surveyed lengths (m past the sensor).
#[derive(Debug, Clone, Copy)]
pub(super) struct SurveyedPath {
    ends: [[f64; 2]; MAX_HOPS],
    count: usize,
}

impl SurveyedPath {
    /// The path ahead of a node, with the turnouts as they are.
    pub(super) fn ahead(context: TrackContext<'_>, model: &MotionModel, node: NodeId) -> Self {
        let mut path = Self { ends: [[0.0; 2]; MAX_HOPS], count: 0 };
        let (mut length, mut surveyed) = (0.0, 0.0);
        for (hop, end) in context.hops_ahead(node).zip(&mut path.ends) {
            length += model.length(context.sections, &hop)[0].as_m();
            surveyed += hop.length.as_m();
            *end = [length, surveyed];
            path.count += 1;
        }
        path
    }

    /// The identity, for references in path lengths.
    pub(super) const fn unscaled() -> Self {
        Self { ends: [[0.0; 2]; MAX_HOPS], count: 0 }
    }

    /// The surveyed length of a path length: linear within each hop, and beyond the last hop as within it.
    pub(super) fn surveyed(&self, path_length: f64) -> f64 {
        let ([mut length, mut surveyed], mut slope) = ([0.0, 0.0], 1.0);
        for (nth, [until, there]) in self.ends.iter().take(self.count).enumerate() {
            if *until > length {
                slope = (there - surveyed) / (until - length);
            }
            // The last hop extends without end.
            if path_length <= *until || nth + 1 == self.count {
                break;
            }
            [length, surveyed] = [*until, *there];
        }
        surveyed + (path_length - length) * slope
    }
}

/// The surveyed distance from one sensor to the next passage of another; the circuit if both are the same.
pub(super) fn surveyed_distance(context: TrackContext<'_>, from: NodeId, to: NodeId) -> Option<Length> {
    let mut distance = Length::ZERO;
    for hop in context.hops_ahead(from).take(context.layout.nodes().len()) {
        distance += hop.length;
        if hop.to == to {
            return Some(distance);
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ids::TurnoutId;
    use crate::model::survey::SectionIndex;
    use crate::time::TimeSpan;
    use crate::track::example::oval;
    use crate::track::{Leg, TurnoutStates};

    #[test]
    fn a_path_length_is_surveyed_hop_by_hop_and_beyond_the_last_as_within_it() {
        let mut path = SurveyedPath::unscaled();
        assert_eq!(path.surveyed(0.3), 0.3);
        // Hops of 100 and 100 mm that were surveyed with 110 and 80 mm.
        path.ends[0] = [0.1, 0.11];
        path.ends[1] = [0.2, 0.19];
        path.count = 2;
        for (length, surveyed) in
            [(0.0, 0.0), (0.05, 0.055), (0.1, 0.11), (0.15, 0.15), (0.2, 0.19), (0.3, 0.27)]
        {
            assert!((path.surveyed(length) - surveyed).abs() < 1e-12, "{length}: {}", path.surveyed(length));
        }
        // Before the sensor as within the first hop.
        assert!((path.surveyed(-0.1) + 0.11).abs() < 1e-12, "{}", path.surveyed(-0.1));
    }

    #[test]
    fn a_reference_is_where_its_function_says_and_runs_on_before_its_first_point() {
        let reference = Reference::of(|time| 3.0 + 0.5 * time, [0.5, 0.5]);
        assert!((reference.now() - 3.0).abs() < 1e-12 && (reference.last() - 4.2).abs() < 1e-12);
        assert!((Reference::SPAN - 2.4).abs() < 1e-12);
    }

    #[test]
    fn a_line_is_measured_from_another_sensor_near_the_train() {
        let layout = oval();
        let sections = SectionIndex::of(&layout);
        let mut turnouts = TurnoutStates::unknown();
        [1, 2].into_iter().for_each(|turnout| turnouts.set(TurnoutId(turnout), Leg::Straight));
        let context = TrackContext { layout: &layout, sections: &sections, turnouts: &turnouts };
        let node = |name: &str| layout.node_named(name).unwrap();
        // A lap is A1 -300- B1 -300- D1 -500- A1.
        let distance = |from, to| surveyed_distance(context, node(from), node(to)).map(Length::as_mm);
        let near = |found: Option<f64>, mm: f64| found.is_some_and(|found| (found - mm).abs() < 1e-9);
        assert!(near(distance("A1", "D1"), 600.0) && near(distance("A1", "A1"), 1100.0));
        assert_eq!(distance("A1", "E1"), None);
        let start = Timestamp::from_s(10.0);
        let line = IdealLine {
            node: node("A1"),
            distance: Length::from_mm(50.0),
            time: start,
            speed: Speed::from_mm_per_s(100.0),
        };
        let at = |sensor, seconds| {
            let now = start + TimeSpan::from_s(seconds);
            Some(line.recount_from(context, node(sensor), now)?.distance.as_mm())
        };
        // After 3 s it is 350 mm past A1: 50 past B1, which it began 250 mm short of.
        assert!(near(at("B1", 3.0), -250.0), "{:?}", at("B1", 3.0));
        // At once it is 550 mm past D1, or 550 mm short of it; a second earlier the latter is farther.
        assert!(near(at("D1", -1.0), 550.0), "{:?}", at("D1", -1.0));
        assert!(near(at("D1", 1.0), -550.0), "{:?}", at("D1", 1.0));
        // The same sensor: two laps later it is 50 mm past it again.
        assert!(near(at("A1", 22.0), 50.0 - 2200.0), "{:?}", at("A1", 22.0));
        assert!(near(at("A1", 3.0), 50.0) && at("E1", 3.0).is_none());
    }
}
