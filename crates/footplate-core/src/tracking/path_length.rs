//! Path lengths: from sensor to sensor, to a place on the layout, and back.

use super::location::PathPoint;
use super::track_context::TrackContext;
use crate::ids::{NodeId, SensorId};
use crate::linalg::Gaussian;
use crate::model::{MotionModel, PATH_LENGTH_SPREAD};
use crate::track::{Hop, Landmark, Layout, MAX_MISSED, Position, Reach};
use crate::units::Length;

/// Chance of a missed detection, as ln: dirty track, a light pickup (chosen; the trains of the course miss fewer). Where trains
/// are distinguished, it is what was learnt of each.
const LOG_MISSED: f64 = -3.9;
/// Most hops of a path to a place: more than a lap of any layout in use.
const MOST_HOPS: usize = 200;
/// One standard deviation of where a sensor closes against the survey (m): half a pickup's springiness and the length of a
/// sensor track (chosen; tapes laid from sensors agree with it).
const SENSOR_PLACE_M: f64 = 0.005;

/// A path to a sensor, past missed detections, in path lengths.
#[derive(Debug, Clone, Copy)]
pub(super) struct PathReach {
    /// Its length (m).
    pub(super) length: Gaussian,
    /// Sensors on the path that did not report.
    pub(super) missed: usize,
}

impl PathReach {
    /// To the sensor from which distances count.
    pub(super) const NONE: Self = Self { length: Gaussian { mean: 0.0, variance: 0.0 }, missed: 0 };

    /// Whether it leads to the sensor from which distances count.
    pub(super) fn is_none(&self) -> bool {
        self.length.mean == 0.0
    }

    /// ln of the chance that these detections were missed.
    pub(super) fn log_chance(&self) -> f64 {
        LOG_MISSED * self.missed as f64
    }
}

/// The path length of a hop (m).
pub(super) fn hop_length(context: TrackContext<'_>, model: &MotionModel, hop: &Hop<'_>) -> Gaussian {
    let [length, uncertainty] = model.length(context.sections, hop).map(Length::as_m);
    Gaussian { mean: length, variance: uncertainty * uncertainty }
}

fn reach_length(context: TrackContext<'_>, model: &MotionModel, layout: &Layout, reach: &Reach) -> PathReach {
    let hops = reach.hops().iter().filter_map(|hop| layout.hop(*hop));
    let length = hops.map(|hop| hop_length(context, model, &hop)).fold(
        Gaussian { mean: 0.0, variance: 0.0 },
        |sum, hop| Gaussian { mean: sum.mean + hop.mean, variance: sum.variance + hop.variance },
    );
    PathReach { length, missed: reach.missed() }
}

/// Every path from a node to a sensor that is open by the known turnouts.
pub(super) fn path_reaches<'g>(
    context: TrackContext<'g>,
    model: &'g MotionModel,
    from: NodeId,
    sensor: SensorId,
) -> impl Iterator<Item = PathReach> + 'g {
    context
        .layout
        .reaches(from, context.turnouts, MAX_MISSED)
        .filter(move |reach| reach.sensor == Some(sensor))
        .map(move |reach| reach_length(context, model, context.layout, &reach))
}

/// The path length from a waypoint's node to a place on the layout, as the turnouts lie; `None` if no path leads there within
/// one lap.
pub fn distance_to(
    context: TrackContext<'_>,
    model: &MotionModel,
    from: NodeId,
    to: Position,
) -> Option<Length> {
    let mut distance = Length::ZERO;
    for (count, hop) in context.hops_ahead(from).take(MOST_HOPS).enumerate() {
        if count > 0 && hop.from == from {
            return None;
        }
        let [path_length, _] = model.length(context.sections, &hop);
        let mut along = Length::ZERO;
        for id in hop.edges {
            if *id == to.edge {
                return Some(distance + path_length * part(along + to.offset, hop.length));
            }
            along += context.layout.edge(*id)?.length;
        }
        distance += path_length;
    }
    None
}

/// The length of a hop between its two sensors by tape (m). The survey knows it to the errors of its edges and of where sensors
/// close, the train to the difference between path length and surveyed length. Both are weighted by their variance; the train
/// mostly knows it better.
pub(super) fn taped_length(context: TrackContext<'_>, model: &MotionModel, hop: &Hop<'_>) -> Gaussian {
    let path_length = hop_length(context, model, hop);
    let surveyed = hop.length.as_m();
    let survey =
        context.sections.section(hop.id).map_or(0.0, |section| context.sections.survey_variance(section))
            + 2.0 * SENSOR_PLACE_M * SENSOR_PLACE_M;
    let feels = PATH_LENGTH_SPREAD * surveyed;
    let train = path_length.variance + feels * feels;
    if train <= 0.0 {
        return Gaussian { mean: surveyed, variance: survey };
    }
    let (one, other) = (1.0 / survey, 1.0 / train);
    Gaussian {
        mean: (surveyed * one + path_length.mean * other) / (one + other),
        variance: 1.0 / (one + other),
    }
}

/// The path length from a waypoint's node to a landmark ahead: so many millimetres past the sensor of its name, whatever the
/// survey has for the rest of the hop. `None` if no path leads there within one lap.
pub fn distance_to_landmark(
    context: TrackContext<'_>,
    model: &MotionModel,
    from: NodeId,
    to: Landmark,
) -> Option<Length> {
    let Some((base, before)) = path_to_node(context, model, from, to.node) else {
        let position = context.layout.locate(to, context.turnouts).ok()?;
        return distance_to(context, model, from, position);
    };
    if to.offset < Length::ZERO {
        return Some(base + to.offset * before);
    }
    let (mut distance, mut left) = (base, to.offset);
    for hop in context.hops_ahead(to.node).take(MOST_HOPS) {
        let path_length = hop_length(context, model, &hop).mean;
        let taped = taped_length(context, model, &hop).mean;
        if left.as_m() <= taped {
            return Some(distance + left * if taped > 0.0 { path_length / taped } else { 1.0 });
        }
        (distance, left) = (distance + Length::from_m(path_length), left - Length::from_m(taped));
    }
    (left == Length::ZERO).then_some(distance)
}

/// The path to a node at which hops begin or end, and the ratio of path length to taped length on the hop before it.
fn path_to_node(
    context: TrackContext<'_>,
    model: &MotionModel,
    from: NodeId,
    to: NodeId,
) -> Option<(Length, f64)> {
    if from == to {
        return Some((Length::ZERO, 1.0));
    }
    let mut distance = 0.0;
    for (count, hop) in context.hops_ahead(from).take(MOST_HOPS).enumerate() {
        if count > 0 && hop.from == from {
            return None;
        }
        let path_length = hop_length(context, model, &hop).mean;
        distance += path_length;
        if hop.to == to {
            let taped = taped_length(context, model, &hop).mean;
            return Some((Length::from_m(distance), if taped > 0.0 { path_length / taped } else { 1.0 }));
        }
    }
    None
}

/// A point of the path as people name it and measure it with a tape: from the last sensor before it. Whole laps do not change
/// the place.
pub fn landmark_of(context: TrackContext<'_>, model: &MotionModel, at: PathPoint) -> Landmark {
    let [landmark, _] = taped(context, model, at);
    landmark
}

/// Standard deviation of a point of the path as people name it (m), for a train that knows its position exactly: past a sensor
/// the ratio of path length to taped length is uncertain.
pub(super) fn taping_deviation(context: TrackContext<'_>, model: &MotionModel, at: PathPoint) -> f64 {
    let [_, deviation] = taped(context, model, at);
    deviation.offset.as_m()
}

/// The landmark of a point on the path, and one standard deviation of its offset in the same form.
fn taped(context: TrackContext<'_>, model: &MotionModel, at: PathPoint) -> [Landmark; 2] {
    let mut from = at.node;
    let mut left = at.distance.as_m();
    for hop in context.hops_ahead(at.node).take(MOST_HOPS) {
        let path_length = hop_length(context, model, &hop).mean;
        if left > path_length && hop.sensor.is_some() {
            left -= path_length;
            from = hop.to;
            continue;
        }
        let length = taped_length(context, model, &hop);
        let scale = if path_length > 0.0 && left > 0.0 { length.mean / path_length } else { 1.0 };
        let relative = if length.mean > 0.0 { libm::sqrt(length.variance) / length.mean } else { 0.0 };
        let offset = Length::from_m(left * scale);
        return [Landmark { node: from, offset }, Landmark { node: from, offset: offset.abs() * relative }];
    }
    [Landmark { node: from, offset: Length::from_m(left) }, Landmark { node: from, offset: Length::ZERO }]
}

fn part(of: Length, whole: Length) -> f64 {
    if whole > Length::ZERO { of / whole } else { 0.0 }
}

/// The place on the layout of a point on the path, as the turnouts lie; for a point behind its node, the node.
pub fn place_of(context: TrackContext<'_>, model: &MotionModel, at: PathPoint) -> Option<Position> {
    let mut left = at.distance.max(Length::ZERO);
    for hop in context.hops_ahead(at.node).take(MOST_HOPS) {
        let [path_length, _] = model.length(context.sections, &hop);
        if left > path_length && hop.sensor.is_some() {
            left -= path_length;
            continue;
        }
        let mut along = (hop.length * part(left, path_length)).min(hop.length);
        let mut last = None;
        for id in hop.edges {
            let length = context.layout.edge(*id)?.length;
            if along <= length {
                return Some(Position { edge: *id, offset: along });
            }
            along -= length;
            last = Some(Position { edge: *id, offset: length });
        }
        return last;
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ids::{SpeedStep, TrainId, TurnoutId};
    use crate::model::survey::SectionIndex;
    use crate::track::example::oval;
    use crate::track::{Leg, TurnoutStates};

    /// Asks about the oval with both turnouts straight, round which it is 500 + 100 + 400 + 100 mm, and a train that runs as far as its
    /// survey says.
    fn on_the_oval(asks: impl Fn(TrackContext<'_>, &MotionModel)) {
        let layout = oval();
        let mut turnouts = TurnoutStates::unknown();
        [1, 2].into_iter().for_each(|turnout| turnouts.set(TurnoutId(turnout), Leg::Straight));
        let sections = SectionIndex::of(&layout);
        let context = TrackContext { layout: &layout, sections: &sections, turnouts: &turnouts };
        asks(context, &MotionModel::unknown(TrainId(24), SpeedStep::new(14).unwrap()));
    }

    fn mm(found: Option<Length>) -> Option<f64> {
        found.map(|length| (length.as_mm() * 1e6).round() / 1e6)
    }

    #[test]
    fn a_place_is_as_far_as_its_edges_are_long() {
        on_the_oval(|context, model| {
            let node = |name: &str| context.layout.node_named(name).unwrap();
            let at = |from, to, mm| Position {
                edge: context.layout.edge_between(node(from), node(to)).unwrap(),
                offset: Length::from_mm(mm),
            };
            let from = |name, to| mm(distance_to(context, model, node(name), to));
            assert_eq!(from("D1", at("D1", "A1", 30.0)), Some(30.0));
            assert_eq!(from("D1", at("A1", "BR1", 30.0)), Some(530.0));
            assert_eq!(from("D1", at("BR1", "B1", 30.0)), Some(630.0));
            assert_eq!(from("A1", at("D1", "A1", 30.0)), Some(630.0));
            assert_eq!(from("D1", at("BR1", "C1", 30.0)), None, "the turnout lies straight");
            for (distance, edge) in [
                (30.0, ("D1", "A1")),
                (530.0, ("A1", "BR1")),
                (630.0, ("BR1", "B1")),
                (1030.0, ("MR2", "D1")),
            ] {
                let point = PathPoint { node: node("D1"), distance: Length::from_mm(distance) };
                let place = place_of(context, model, point).unwrap();
                assert_eq!(place.edge, at(edge.0, edge.1, 0.0).edge, "{distance}");
                assert_eq!(mm(Some(place.offset)), Some(30.0), "{distance}");
            }
            let behind = PathPoint { node: node("D1"), distance: Length::from_mm(-30.0) };
            assert_eq!(
                place_of(context, model, behind),
                Some(at("D1", "A1", 0.0)),
                "behind its node: the node"
            );
        });
    }

    #[test]
    fn a_landmark_is_past_the_last_sensor_before_it_or_before_its_own() {
        on_the_oval(|context, model| {
            let node = |name: &str| context.layout.node_named(name).unwrap();
            let landmark = |name, offset| Landmark { node: node(name), offset: Length::from_mm(offset) };
            let to =
                |name, offset| mm(distance_to_landmark(context, model, node("D1"), landmark(name, offset)));
            assert_eq!(
                [to("D1", 30.0), to("A1", 30.0), to("B1", 30.0)],
                [Some(30.0), Some(530.0), Some(830.0)]
            );
            assert_eq!([to("A1", -30.0), to("A1", 330.0)], [Some(470.0), Some(830.0)]);
            assert_eq!(to("C1", 30.0), None, "the turnout lies straight");
            for (distance, name, offset) in
                [(30.0, "D1", 30.0), (530.0, "A1", 30.0), (830.0, "B1", 30.0), (1130.0, "D1", 30.0)]
            {
                let point = PathPoint { node: node("D1"), distance: Length::from_mm(distance) };
                let found = landmark_of(context, model, point);
                assert_eq!((found.node, mm(Some(found.offset))), (node(name), Some(offset)), "{distance}");
            }
            // Nothing is known better than the tape and both sensors, 2 · (5 mm)²; the train feels 500 mm less well.
            let hop = context.hop_from(node("D1")).unwrap();
            let taped = taped_length(context, model, &hop);
            let sensors = libm::sqrt(2.0) * 0.005;
            assert!((taped.mean - 0.5).abs() < 1e-9, "{taped:?}");
            assert!((0.0..libm::hypot(sensors, 0.003)).contains(&libm::sqrt(taped.variance)), "{taped:?}");
            let deviation = |distance| {
                let at = PathPoint { node: node("D1"), distance: Length::from_mm(distance) };
                taping_deviation(context, model, at)
            };
            assert!((deviation(250.0) - 0.5 * libm::sqrt(taped.variance)).abs() < 1e-9, "half of it halfway");
        });
    }
}
