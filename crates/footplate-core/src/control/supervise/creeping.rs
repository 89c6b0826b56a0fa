//! Where a train in recovery may creep: not into track that may be occupied, from wherever the train may be.

use alloc::collections::BTreeMap;
use alloc::vec::Vec;

use crate::control::dispatch::Reservation;
use crate::event::Approach;
use crate::ids::{EdgeId, NodeId, SpeedStep, TrainId};
use crate::model::MotionModel;
use crate::time::{TimeSpan, Timestamp};
use crate::track::{Layout, MAX_MISSED, Position, TurnoutNeed, TurnoutStates};
use crate::tracking::PathPoint;
use crate::units::Length;

use super::danger::{BODY, CERTAIN, CLEAR, LOST_REACH, rails_within};
use super::recovery::Recovery;
use super::unheard::{Behind, Unheard, has_points_behind};
use super::watchdog::Watchdog;

/// A lost train needs so many sensors ahead, one beyond all places where it may be: one may stay silent.
const SENSORS_AHEAD: usize = 2;
/// A train that has run less than this since a sensor reported it may still be on it: a pickup shoe is 50 to 80 mm long.
const HOLDS: Length = Length::from_mm(100.0);
/// A train runs no faster than its model, times this.
const FASTER: f64 = 1.2;
/// Commands that were sent this long before the station was found silent may be lost: it is silent for 1.5 s by then.
pub(super) const SILENT_FOR: TimeSpan = TimeSpan::from_ms(2_000);
/// A train should be at rest after its predicted time multiplied by this, ...
const REST_PART: f64 = 1.3;
/// ... plus this.
const REST_MORE: TimeSpan = TimeSpan::from_ms(700);
/// That of a train without a valid model (the longest published stop).
const REST_UNKNOWN: TimeSpan = TimeSpan::from_s(5.0);

impl Watchdog {
    /// The track that a train in recovery must not enter. Without a dispatcher, the track under the other trains.
    fn closed_to(&self, now: Timestamp, train: TrainId) -> Reservation {
        if let Some(closed) = self.dangers.get(&train).and_then(|recovery| recovery.closed.as_ref()) {
            return closed.clone();
        }
        let layout = self.driver.layout();
        let mut closed = Reservation::empty();
        for other in self.driver.trains().filter(|other| *other != train) {
            let place = self.driver.position(other, now);
            let Some((located, place)) = self.driver.locate(other, now).zip(place) else { continue };
            let reach = BODY + located.uncertainty * CERTAIN;
            for edge in rails_within(layout, place, reach, reach) {
                let length = layout.edge(edge).map_or(Length::ZERO, |edge| edge.length);
                closed.take_rails(layout, edge, Length::ZERO, length);
            }
        }
        closed
    }

    /// Sets the end of authority of a train in recovery before the next track that is closed to it. No other train
    /// runs meanwhile.
    pub(super) fn keep_clear(&mut self, now: Timestamp, train: TrainId) {
        let layout = self.driver.layout();
        let closed = self.closed_to(now, train);
        let limit = self.driver.locate(train, now).and_then(|located| {
            let place = self.driver.position(train, now);
            let hops = self.driver.context().hops_ahead(located.at.node).take(layout.nodes().len());
            let mut edges: Vec<EdgeId> = hops.flat_map(|hop| hop.edges.iter().copied()).collect();
            let here = place.and_then(|place| edges.iter().position(|edge| *edge == place.edge));
            edges.drain(..here.unwrap_or(0));
            let start = place.filter(|_| here.is_some()).map_or(Length::ZERO, |place| place.offset);
            let begin = edges.iter().enumerate().find_map(|(nth, edge)| {
                let from = if nth == 0 { start } else { Length::ZERO };
                Some(Position { edge: *edge, offset: closed.begins_on(layout, *edge, from)? })
            });
            let from = located.at.node;
            let mut at = match begin {
                Some(begin) => self.driver.path_point(train, from, begin)?,
                None => self.closed_beyond_unknown_points(train, from, edges.last().copied(), &closed)?,
            };
            at.distance += -(BODY + CLEAR);
            Some(at)
        });
        self.driver.set_end_of_authority(now, train, limit);
    }

    /// Where track begins that is closed to a train, if the path is known only to the end of an edge: behind that are points of unknown
    /// position, and the nearest of such places over any of their legs counts.
    fn closed_beyond_unknown_points(
        &self,
        train: TrainId,
        from: NodeId,
        last: Option<EdgeId>,
        closed: &Reservation,
    ) -> Option<PathPoint> {
        let layout = self.driver.layout();
        let (known_to, distance) = match last.and_then(|last| Some((last, layout.edge(last)?))) {
            Some((last, edge)) => {
                let end = Position { edge: last, offset: edge.length };
                (edge.to, self.driver.path_point(train, from, end)?.distance)
            }
            None => (from, Length::ZERO),
        };
        let is_unknown = self.driver.context().hop_from(known_to).is_none();
        let nearest = closed_within_hop(layout, self.driver.turnouts(), known_to, closed);
        Some(PathPoint { node: from, distance: distance + nearest.filter(|_| is_unknown)? })
    }

    /// Whether a lost train may creep ahead. From its last detection, over the leg to which each turnout is set or over both if
    /// that is unknown, and from wherever it may be, [`SENSORS_AHEAD`] sensors come before the end of the track and before any track that is
    /// closed to it; in both directions if it may face in either.
    pub(super) fn is_clear_ahead(&self, now: Timestamp, train: TrainId) -> bool {
        let Some(seen) = self.seen.get(&train) else { return false };
        let closed = self.closed_to(now, train);
        let layout = self.driver.layout();
        // Where sensors do not report the direction, it takes one more.
        let sensors = SENSORS_AHEAD + usize::from(layout.has_undirected_sensors());
        let ahead = Ahead { run: self.unheard_run(now, train), sensors };
        let back = layout.reversed(*seen).filter(|_| self.undirected.contains(&train));
        let begins = core::iter::once(*seen).chain(back).map(|place| (place.edge, place.offset)).collect();
        reports_before(layout, self.driver.turnouts(), begins, ahead, &closed)
    }

    /// The sensor to which a lost train may creep back, in its new direction: the one that reported it last. `None` if
    /// it could reach the end of the track, or track that is closed to it, before a sensor reports it, wherever it
    /// may be and however turnouts are set, if its direction is unknown, and if it may have come over a leg for which a turnout does not
    /// lie.
    pub(super) fn sensor_behind(&self, now: Timestamp, train: TrainId) -> Option<NodeId> {
        let layout = self.driver.layout();
        let behind = self.behind.get(&train).filter(|_| !self.undirected.contains(&train))?.sensor?;
        let run = self.unheard_run(now, train);
        let closed = self.closed_to(now, train);
        // Without a dispatcher, closed track is under other trains: this one is not beyond it.
        let occupied = if self.permits_all { &closed } else { &Reservation::empty() };
        let reach = edges_within(layout, behind, run + BODY, occupied);
        if self.has_pushed_over_points(now, train) {
            return None;
        }
        let length = |edge| layout.edge(edge).map_or(Length::ZERO, |edge| edge.length);
        let from = |(edge, left): (EdgeId, Length)| (edge.twin(), (length(edge) - left).max(Length::ZERO));
        let begins = reach.into_iter().map(from).collect();
        // It may still be on that sensor, which does not report it again then.
        let back = Ahead { run: Length::ZERO, sensors: if run < HOLDS { 2 } else { 1 } };
        // The train may have run over either leg of a turnout that was thrown since.
        let set = TurnoutStates::unknown();
        reports_before(layout, &set, begins, back, &closed).then(|| behind.reverse())
    }

    /// Whether a train may stand on points that it pushed over: back over them it would derail.
    pub(super) fn has_pushed_over_points(&self, now: Timestamp, train: TrainId) -> bool {
        self.pushed_over(now, train).is_some()
    }

    /// The edges that a train may have run over since its last detection, or since it was placed or reversed, if points that it pushed
    /// over may be among them.
    pub(super) fn pushed_over(&self, now: Timestamp, train: TrainId) -> Option<BTreeMap<EdgeId, Length>> {
        let reach = self.unheard_run(now, train) + BODY;
        let layout = self.driver.layout();
        let behind = self.behind.get(&train);
        let over = match (behind.and_then(|behind| behind.sensor), self.seen.get(&train)) {
            (Some(sensor), _) => {
                layout.edges_within(layout.outgoing(sensor).edges().map(|edge| (edge, reach)))
            }
            (None, Some(seen)) => layout.edges_within([(seen.edge, reach + seen.offset)]),
            (None, None) => BTreeMap::new(),
        };
        let trails_otherwise = behind.is_some_and(|behind| behind.trails_otherwise);
        (trails_otherwise || over.keys().any(|edge| self.lies_otherwise(*edge))).then_some(over)
    }

    /// What is behind a train that an operator places, if it may have run `over` points that it pushed over and may stand on them
    /// at its new place. A person who enters where its end is does not say over which leg it came.
    pub(super) fn behind_placed(
        &self,
        place: Position,
        uncertainty: Length,
        over: &BTreeMap<EdgeId, Length>,
    ) -> Option<Behind> {
        let within = BODY + uncertainty * CERTAIN;
        let may_stand_on_them =
            over.contains_key(&place.edge) && has_points_behind(self.driver.layout(), place, within);
        may_stand_on_them.then_some(Behind { sensor: None, trails_otherwise: true, was_placed: true })
    }

    /// Whether an operator placed a train where it may stand on points that it pushed over, and no sensor has reported it since.
    pub(in crate::control) fn was_placed_on_points(&self, train: TrainId) -> bool {
        self.behind.get(&train).is_some_and(|behind| behind.was_placed)
    }

    /// Whether a turnout that is trailed on an edge lies for the other leg, or may.
    fn lies_otherwise(&self, edge: EdgeId) -> bool {
        let is_other = |need: TurnoutNeed| {
            !need.facing && self.driver.turnouts().get(need.turnout).is_none_or(|leg| leg != need.leg)
        };
        self.driver.layout().needs_of(edge).any(is_other)
    }

    /// A train has passed a sensor.
    pub(super) fn note_behind(&mut self, train: TrainId, sensor: NodeId) {
        let before = self.behind.get(&train).and_then(|behind| behind.sensor);
        let trails_otherwise = before.is_some_and(|before| {
            let mut edges: Vec<EdgeId> = Vec::new();
            for hop in self.driver.context().hops_ahead(before).take(MAX_MISSED + 1) {
                edges.extend(hop.edges);
                if hop.to == sensor {
                    break;
                }
            }
            let mut left = BODY;
            let mut under = edges.into_iter().rev().take_while(|edge| {
                let is_under = left > Length::ZERO;
                left -= self.driver.layout().edge(*edge).map_or(Length::ZERO, |edge| edge.length);
                is_under
            });
            under.any(|edge| self.lies_otherwise(edge))
        });
        self.behind.insert(train, Behind { sensor: Some(sensor), trails_otherwise, was_placed: false });
    }

    /// The longest distance that a train can have run since its last detection.
    pub(super) fn unheard_run(&self, now: Timestamp, train: TrainId) -> Length {
        let known = self.unheard.get(&train).copied().unwrap_or_default();
        let Some(model) = self.base_model(train) else { return LOST_REACH };
        known.after(now, model).run * FASTER
    }

    /// The model of a train, from before an alarm.
    fn base_model(&self, train: TrainId) -> Option<&MotionModel> {
        self.dangers.get(&train).map(Recovery::base).or_else(|| self.driver.model(train))
    }

    /// A command to a train was sent: until then it ran at the step before.
    pub(super) fn note_command(&mut self, train: TrainId, sent: Timestamp, step: SpeedStep) {
        let Some(model) = self.base_model(train) else { return };
        let known = self.unheard.get(&train).copied().unwrap_or_default();
        // A station that is silent may not have received it.
        let step = if self.is_silent() { step.max(known.step) } else { step };
        // Stops are repeated: the first one counts.
        if step == known.step {
            return;
        }
        let is_recent = sent - known.since <= SILENT_FOR;
        let before = if is_recent { known.step.max(known.before) } else { known.step };
        let known = known.after(sent, model);
        let stops = step == SpeedStep::STAND && known.step > SpeedStep::STAND;
        let stop = if stops { model.stop_distance(known.step, Approach::Above) } else { Length::ZERO };
        let run = known.run + stop;
        self.unheard.insert(train, Unheard { run, step, since: sent, before });
    }

    /// Whether a train was at rest at a time, however often it has been commanded to stop again since.
    pub(super) fn has_rested_since(&self, train: TrainId, at: Timestamp) -> bool {
        self.unheard
            .get(&train)
            .is_some_and(|known| known.step == SpeedStep::STAND && at - known.since >= REST_UNKNOWN)
    }

    /// The station has been silent for a while: it may not have received the last command of any train or turnout.
    pub(super) fn distrust_last_commands(&mut self, now: Timestamp) {
        self.driver.forget_turnouts_changed(now, now - SILENT_FOR);
        for known in self.unheard.values_mut().filter(|known| now - known.since <= SILENT_FOR) {
            known.step = known.step.max(known.before);
        }
    }

    /// When a train should be at rest whose stop command left the line at a time.
    pub(super) fn at_rest_by(&self, train: TrainId, left: Timestamp) -> Timestamp {
        let located = self.driver.locate(train, left);
        let model = self.driver.model(train);
        let (Some(located), Some(model), false) = (located, model, self.is_in_danger(train)) else {
            return left + REST_UNKNOWN;
        };
        let time = model.stop_time(located.step, Approach::Above);
        left + TimeSpan::from_s(time.as_s() * REST_PART) + REST_MORE
    }

    /// A train was detected or placed.
    pub(super) fn note_detection(&mut self, train: TrainId, now: Timestamp) {
        self.intruder.in_a_row = 0;
        let step = self.unheard.get(&train).map_or(SpeedStep::STAND, |known| known.step);
        self.unheard.insert(train, Unheard { step, since: now, before: step, ..Unheard::default() });
    }
}

/// The edges that begin within a distance of a node, over both legs of every turnout, with the distance that is left
/// at their beginning. Edges with occupied track are left out, and what is beyond them.
fn edges_within(
    layout: &Layout,
    from: NodeId,
    reach: Length,
    occupied: &Reservation,
) -> BTreeMap<EdgeId, Length> {
    let mut best: BTreeMap<EdgeId, Length> = BTreeMap::new();
    let mut open: Vec<(EdgeId, Length)> = layout.outgoing(from).edges().map(|edge| (edge, reach)).collect();
    while let Some((edge, left)) = open.pop() {
        let is_occupied = occupied.begins_on(layout, edge, Length::ZERO).is_some();
        if left <= Length::ZERO || is_occupied || best.get(&edge).is_some_and(|known| *known >= left) {
            continue;
        }
        best.insert(edge, left);
        let Some(known) = layout.edge(edge) else { continue };
        open.extend(layout.outgoing(known.to).edges().map(|next| (next, left - known.length)));
    }
    best
}

/// The distance from a node to the nearest track that is closed, on any path that the turnouts allow as they are `set`, to the next
/// sensor and the length that a train needs to stop behind it.
fn closed_within_hop(
    layout: &Layout,
    set: &TurnoutStates,
    from: NodeId,
    closed: &Reservation,
) -> Option<Length> {
    let leads_from = |node: NodeId, until: Length, left: Option<Length>| {
        let is_open = |edge: &EdgeId| {
            layout
                .needs_of(*edge)
                .filter(|need| need.facing)
                .all(|need| set.get(need.turnout).is_none_or(|leg| leg == need.leg))
        };
        let edges: Vec<EdgeId> = layout.outgoing(node).edges().filter(is_open).collect();
        edges.into_iter().map(move |edge| (edge, until, left))
    };
    let mut open: Vec<(EdgeId, Length, Option<Length>)> = leads_from(from, Length::ZERO, None).collect();
    let mut nearest: Option<Length> = None;
    let mut known: BTreeMap<EdgeId, Length> = BTreeMap::new();
    while let Some((id, until, left)) = open.pop() {
        let Some(edge) = layout.edge(id) else { continue };
        if left.is_none() && known.get(&id).is_some_and(|known| *known <= until) {
            continue;
        }
        known.insert(id, until);
        if let Some(at) = closed.begins_on(layout, id, Length::ZERO) {
            if left.is_none_or(|left| at < left) {
                nearest = Some(nearest.map_or(until + at, |nearest| nearest.min(until + at)));
            }
            continue;
        }
        let is_sensor = [edge.to, edge.to.reverse()].into_iter().any(|node| layout.sensor_at(node).is_some());
        let left = left.map(|left| left - edge.length).or(is_sensor.then_some(BODY + CLEAR));
        if left.is_none_or(|left| left > Length::ZERO) {
            open.extend(leads_from(edge.to, until + edge.length, left));
        }
    }
    nearest
}

/// What has to be free ahead of a place: the sensors of the distance that a train may have run from there already do
/// not report it.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Ahead {
    run: Length,
    /// The number of sensors on the path, one of them beyond the run.
    sensors: usize,
}

/// Whether on every path that the turnouts allow as they are `set`, a sensor comes before closed track and before the end of
/// the track, with the length that a train needs to stop behind it.
fn reports_before(
    layout: &Layout,
    set: &TurnoutStates,
    begins: Vec<(EdgeId, Length)>,
    ahead: Ahead,
    closed: &Reservation,
) -> bool {
    let mut open: Vec<(EdgeId, Length, Ahead, Option<Length>)> =
        begins.into_iter().map(|(edge, from)| (edge, from, ahead, None)).collect();
    // The most that was still wanted on each edge.
    let mut known: BTreeMap<EdgeId, Ahead> = BTreeMap::new();
    while let Some((id, from, mut ahead, left)) = open.pop() {
        let Some(edge) = layout.edge(id) else { return false };
        let closed_at = closed.begins_on(layout, id, from);
        if closed_at.is_some_and(|at| left.is_none_or(|left| at - from < left)) {
            return false;
        }
        let left = left.map(|left| left - (edge.length - from));
        if left.is_some_and(|left| left <= Length::ZERO) {
            continue;
        }
        ahead.run -= edge.length - from;
        if [edge.to, edge.to.reverse()].into_iter().any(|node| layout.sensor_at(node).is_some()) {
            ahead.sensors = ahead.sensors.saturating_sub(1).max(usize::from(ahead.run > Length::ZERO));
        }
        let left = left.or_else(|| (ahead.sensors == 0).then_some(BODY + CLEAR));
        let is_open = |next: &EdgeId| {
            let leg = layout.edge(*next).and_then(|next| next.leg);
            let turnout = layout.turnouts().find(|(_, branch)| *branch == edge.to);
            let is_set = turnout.and_then(|(turnout, _)| set.get(turnout));
            leg.zip(is_set).is_none_or(|(leg, set)| leg == set)
        };
        let mut next = layout.outgoing(edge.to).edges().filter(is_open).peekable();
        if next.peek().is_none() {
            return false;
        }
        let is_new = |next: &EdgeId| {
            let is_covered = |other: &Ahead| other.run >= ahead.run && other.sensors >= ahead.sensors;
            left.is_some() || !known.get(next).is_some_and(is_covered)
        };
        let next: Vec<EdgeId> = next.filter(is_new).collect();
        for next in next {
            if left.is_none() {
                known.insert(next, ahead);
            }
            open.push((next, Length::ZERO, ahead, left));
        }
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::track::example::oval;

    const BACK: Ahead = Ahead { run: Length::ZERO, sensors: 1 };

    #[test]
    fn a_train_creeps_back_only_if_a_sensor_comes_before_track_of_others_over_either_leg() {
        let layout = oval();
        let node = |name| layout.node_named(name).unwrap();
        let edge = |from, to| layout.edge_between(node(from), node(to)).unwrap();
        let closed = |from, to, until| {
            let mut closed = Reservation::empty();
            closed.take_rails(&layout, edge(from, to), Length::ZERO, Length::from_mm(until));
            closed
        };
        // It is somewhere between turnout 2 and D1, and creeps back over either leg: to B1 or C1.
        let begins = || alloc::vec![(edge("MR2", "D1").twin(), Length::ZERO)];
        assert!(reports_before(&layout, &TurnoutStates::unknown(), begins(), BACK, &Reservation::empty()));
        assert!(!reports_before(
            &layout,
            &TurnoutStates::unknown(),
            begins(),
            BACK,
            &closed("C1", "MR2", 100.0)
        ));
        assert!(!reports_before(
            &layout,
            &TurnoutStates::unknown(),
            begins(),
            BACK,
            &closed("B1", "MR2", 100.0)
        ));
        // Beyond those sensors it needs 400 mm to stop, as far as 100 mm before D1.
        assert!(!reports_before(
            &layout,
            &TurnoutStates::unknown(),
            begins(),
            BACK,
            &closed("A1", "BR1", 10.0)
        ));
        assert!(!reports_before(
            &layout,
            &TurnoutStates::unknown(),
            begins(),
            BACK,
            &closed("D1", "A1", 500.0)
        ));
        assert!(reports_before(
            &layout,
            &TurnoutStates::unknown(),
            begins(),
            BACK,
            &closed("D1", "A1", 390.0)
        ));
        // Track that ends is no better.
        assert!(!reports_before(
            &layout,
            &TurnoutStates::unknown(),
            alloc::vec![(edge("EN1", "E1").twin(), Length::ZERO)],
            BACK,
            &Reservation::empty()
        ));
    }

    #[test]
    fn beyond_points_of_unknown_position_the_nearest_closed_track_over_either_leg_counts() {
        let layout = oval();
        let node = |name| layout.node_named(name).unwrap();
        let edge = |from, to| layout.edge_between(node(from), node(to)).unwrap();
        // From A1 the points BR1 lead to B1 or C1.
        let to_points = layout.edge(edge("A1", "BR1")).unwrap().length;
        let mut closed = Reservation::empty();
        let on_leg = Length::from_mm(60.0);
        closed.take_rails(&layout, edge("BR1", "C1"), on_leg, on_leg + Length::from_mm(100.0));
        let nearest =
            |set: &TurnoutStates, closed: &Reservation| closed_within_hop(&layout, set, node("A1"), closed);
        assert_eq!(nearest(&TurnoutStates::unknown(), &Reservation::empty()), None);
        assert_eq!(nearest(&TurnoutStates::unknown(), &closed), Some(to_points + on_leg));
        // Track of others just behind the sensor is too near, too, and further on there is time for the sensor to report.
        let behind = |mm: f64| {
            let mut closed = Reservation::empty();
            let from = Length::from_mm(mm);
            closed.take_rails(&layout, edge("C1", "MR2"), from, from + Length::from_mm(10.0));
            closed
        };
        let to_c1 = to_points + layout.edge(edge("BR1", "C1")).unwrap().length;
        let within = nearest(&TurnoutStates::unknown(), &behind(100.0)).unwrap();
        assert!((within - to_c1 - Length::from_mm(100.0)).abs() < Length::from_mm(0.01));
    }
}
