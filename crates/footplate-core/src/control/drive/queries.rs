//! Queries about trains and their paths, and the corrections that dispatcher and watchdog make.

use alloc::collections::BTreeSet;

use crate::ids::{NodeId, SensorId, TrainId, TurnoutId};
use crate::model::MotionFit;
use crate::time::Timestamp;
use crate::track::Position;
use crate::tracking::{PassedSensor, PathPoint, Rest, TrackContext, distance_to, place_of};
use crate::units::Length;

use super::driver::Driver;
use super::order::OrderId;
use super::path::{circuit_length, reversed_on_current_path, reversed_position, trailing_position};
use super::turnout_guard::turnouts_under;

impl Driver {
    /// An order number for a sequence of orders; no single order gets it.
    pub(in crate::control) const fn number(&mut self) -> OrderId {
        let id = OrderId(self.orders);
        self.orders = self.orders.wrapping_add(1);
        id
    }

    /// The median place of rest if a stop command is sent at a time not before the last event.
    pub fn rest_if_stopped(&self, train: TrainId, at: Timestamp) -> Option<PathPoint> {
        Some(self.stopped_at(train, at)?.at)
    }

    /// The same with its uncertainty and the time of rest.
    pub fn stopped_at(&self, train: TrainId, at: Timestamp) -> Option<Rest> {
        let train = self.trains.get(&train)?;
        train.locator.rest_if_stopped(self.track.context(), &train.model, at)
    }

    /// Sets the lengths of a train ahead of and behind the leading end of its pickup; not exchanged when it reverses.
    /// The default is 250 mm, for a long locomotive.
    pub fn set_reach(&mut self, train: TrainId, ahead: Length, behind: Length) {
        if let Some(train) = self.trains.get_mut(&train) {
            train.reach = [ahead, behind].map(|reach| reach.max(Length::ZERO));
        }
    }

    /// One standard deviation of the least precise stop from a step that moves the train; `None` if no step is known
    /// to.
    pub fn widest_stop(&self, train: TrainId) -> Option<Length> {
        self.trains.get(&train)?.widest_stop
    }

    /// Whether the direction of a train is the opposite of that at the begin of the session.
    pub fn is_reversed(&self, train: TrainId) -> bool {
        self.trains.get(&train).is_some_and(|train| train.is_reversed)
    }

    /// A sensor that should have reported the train since its last detection and did not: the train may be far behind
    /// its estimate.
    pub fn missed_sensor(&self, train: TrainId, now: Timestamp) -> Option<SensorId> {
        let (train, context) = (self.trains.get(&train)?, self.track.context());
        train.missed_sensor().or_else(|| train.sensor_missed_before(context, &train.located(context, now)?))
    }

    /// Whether it is known where a train is, and no sensor that should have reported it is silent.
    pub fn is_found(&self, train: TrainId, now: Timestamp) -> bool {
        self.locate(train, now).is_some() && self.missed_sensor(train, now).is_none()
    }

    /// The share of detections that sensors miss of a train at its speed, as learnt in this session.
    pub fn missed_share(&self, train: TrainId, now: Timestamp) -> f64 {
        self.trains.get(&train).map_or(0.0, |train| train.missed_share(self.track.context(), now))
    }

    /// Whether the position of a train depends on an ambiguous detection that later ones may still resolve.
    pub fn is_position_ambiguous(&self, train: TrainId, now: Timestamp) -> bool {
        self.association.is_ambiguous(train, now)
    }

    /// Measures the position of a train at rest from the node behind its pickup: turnouts further away no longer
    /// affect it.
    pub(in crate::control) fn count_from_behind(&mut self, now: Timestamp, train: TrainId) {
        let Some(located) = self.locate(train, now).filter(|located| located.at_rest) else { return };
        let at = self.position_at(train, located.at).and_then(|place| {
            let model = &self.trains.get(&train)?.model;
            let trailing = trailing_position(self.track.context(), model, located.at)?;
            let behind = self.track.layout.edge(trailing.edge)?.from;
            if behind == located.at.node { None } else { self.path_point(train, behind, place) }
        });
        if let Some(at) = at {
            self.place(now, train, at, located.uncertainty);
        }
    }

    /// The turnouts that cannot be thrown now because of this train.
    pub fn turnouts_under(&self, train: TrainId, now: Timestamp) -> BTreeSet<TurnoutId> {
        let train = self.trains.get(&train);
        train.map_or_else(BTreeSet::new, |train| turnouts_under(self.track.context(), train, now))
    }

    /// The position of a train on the layout; `None` if it is unknown.
    pub fn position(&self, train: TrainId, now: Timestamp) -> Option<Position> {
        self.position_at(train, self.locate(train, now)?.at)
    }

    /// A point of a train's path as a position on the layout, with the turnouts as they are.
    pub fn position_at(&self, train: TrainId, at: PathPoint) -> Option<Position> {
        place_of(self.track.context(), &self.trains.get(&train)?.model, at)
    }

    /// A position on the layout as a point of a train's path ahead of another point, about `away` from it: a circuit may
    /// lead past the position at once and again after a lap.
    pub fn path_point_ahead(
        &self,
        train: TrainId,
        from: PathPoint,
        to: Position,
        away: Length,
    ) -> Option<PathPoint> {
        let first = self.path_point(train, from.node, to)?;
        let lap = circuit_length(self.track.context(), &self.trains.get(&train)?.model, from.node);
        let next = lap.map(|lap| PathPoint { distance: first.distance + lap, ..first });
        let ahead = [Some(first), next].into_iter().flatten().filter(|found| found.distance > from.distance);
        let error = |found: &PathPoint| (found.distance - from.distance - away).abs();
        ahead.min_by(|a, b| error(a).as_m().total_cmp(&error(b).as_m()))
    }

    /// Where the leading end of the pickup will be once a train at rest has reversed. It is then measured from the
    /// node behind it: a turnout there must be set for the track under the train.
    pub fn reversed_position(&self, train: TrainId, now: Timestamp) -> Option<Position> {
        let at = self.locate(train, now)?.at;
        reversed_position(self.track.context(), &self.trains.get(&train)?.model, at)
    }

    /// The same for a train that would be at rest at a position, arriving on any path.
    pub fn reversed_position_at(&self, place: Position) -> Option<Position> {
        reversed_on_current_path(self.track.context(), place)
    }

    /// A position on the layout as a point of a train's path from a node, with the turnouts as they are; `None` if no
    /// path leads there.
    pub fn path_point(&self, train: TrainId, from: NodeId, to: Position) -> Option<PathPoint> {
        let distance = distance_to(self.track.context(), &self.trains.get(&train)?.model, from, to)?;
        Some(PathPoint { node: from, distance })
    }

    /// Gives up the position of a train that was found to be wrong.
    pub fn lose(&mut self, now: Timestamp, train: TrainId) {
        self.association.forget(train);
        let context = self.track.context();
        if let Some(train) = self.trains.get_mut(&train) {
            train.locator.lose();
            train.passages.forget();
            train.clear_missed();
            train.expect_next(context, now);
        }
        self.update_line_requests(now);
    }

    /// The layout, turnouts and lengths as estimators use them.
    pub(crate) const fn context(&self) -> TrackContext<'_> {
        self.track.context()
    }

    /// The next sensor ahead of a train, with the turnouts as they are, whether or not the train moves.
    pub fn sensor_ahead(&self, train: TrainId, now: Timestamp) -> Option<SensorId> {
        let located = self.locate(train, now)?;
        let context = self.track.context();
        let model = self.model(train)?;
        let mut distance = Length::ZERO;
        let hops = context.hops_ahead(located.at.node).take(context.layout.nodes().len());
        for hop in hops {
            distance += model.length(context.sections, &hop)[0];
            if distance > located.at.distance {
                return hop.sensor;
            }
        }
        None
    }

    /// The path length of a train from one node to the next sensor's node; `None` if `to` is not that node.
    pub fn hop_length(&self, train: TrainId, from: NodeId, to: NodeId) -> Option<Length> {
        let context = self.track.context();
        let hop = context.hop_from(from).filter(|hop| hop.to == to)?;
        Some(self.model(train)?.length(context.sections, &hop)[0])
    }

    /// The node of the sensor that a train passed.
    pub fn node_passed(&self, passed: &PassedSensor) -> Option<NodeId> {
        self.track.layout.sensor_node(passed.sensor)
    }

    /// Repeats the fit of a train's motion; see [`MotionFit::refit`].
    pub(crate) fn refit(&self, fit: &mut MotionFit) {
        fit.refit(&self.track.sections);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ids::SpeedStep;
    use crate::model::MotionModel;
    use crate::track::example::oval;
    use crate::track::{Leg, TurnoutStates};
    use crate::tracking::Locator;

    const TRAIN: TrainId = TrainId(24);
    const NOW: Timestamp = Timestamp::ZERO;

    /// A driver on the oval, with both turnouts straight and a train at rest, 40 mm ahead and 60 mm behind of which belong to it.
    fn driver(name: &str, past_mm: f64) -> Driver {
        let layout = oval();
        let mut turnouts = TurnoutStates::unknown();
        [1, 2].into_iter().for_each(|turnout| turnouts.set(TurnoutId(turnout), Leg::Straight));
        let node = layout.node_named(name).unwrap();
        let mut driver = Driver::new(layout, turnouts);
        driver.add_located(MotionModel::unknown(TRAIN, SpeedStep::new(14).unwrap()), Locator::new(TRAIN));
        driver.set_reach(TRAIN, Length::from_mm(40.0), Length::from_mm(60.0));
        driver.place(
            NOW,
            TRAIN,
            PathPoint { node, distance: Length::from_mm(past_mm) },
            Length::from_mm(1.0),
        );
        driver
    }

    fn place(driver: &Driver, from: &str, to: &str, mm: f64) -> Position {
        let node = |name: &str| driver.layout().node_named(name).unwrap();
        let edge = driver.layout().edge_between(node(from), node(to)).unwrap();
        Position { edge, offset: Length::from_mm(mm) }
    }

    fn mm(found: Option<Length>) -> Option<f64> {
        found.map(|length| (length.as_mm() * 1e6).round() / 1e6)
    }

    #[test]
    fn a_train_at_rest_is_where_it_was_placed_until_it_is_given_up() {
        let mut driver = driver("D1", 100.0);
        assert!(driver.is_found(TRAIN, NOW) && !driver.is_reversed(TRAIN));
        let at = driver.position(TRAIN, NOW).unwrap();
        assert_eq!(at.edge, place(&driver, "D1", "A1", 0.0).edge);
        assert_eq!(mm(Some(at.offset)), Some(100.0));
        let rest = driver.rest_if_stopped(TRAIN, NOW).unwrap();
        assert_eq!(
            (Some(rest.node), mm(Some(rest.distance))),
            (driver.layout().node_named("D1"), Some(100.0))
        );
        assert_eq!(driver.sensor_ahead(TRAIN, NOW), Some(SensorId(0)), "A1");
        let back = driver.reversed_position(TRAIN, NOW).unwrap();
        assert_eq!(back.edge, at.edge.twin());
        assert!((400.0..=500.0).contains(&back.offset.as_mm()), "{back:?}");
        driver.lose(NOW, TRAIN);
        assert!(!driver.is_found(TRAIN, NOW));
        assert_eq!(driver.position(TRAIN, NOW), None);
    }

    #[test]
    fn a_place_is_ahead_at_once_or_after_a_lap_whichever_is_nearer_to_what_was_asked() {
        let driver = driver("D1", 100.0);
        let node = |name: &str| driver.layout().node_named(name).unwrap();
        let from = PathPoint { node: node("D1"), distance: Length::from_mm(100.0) };
        let ahead = |to, away| {
            let found = driver.path_point_ahead(TRAIN, from, to, Length::from_mm(away))?;
            mm(Some(found.distance))
        };
        let (near, behind) = (place(&driver, "D1", "A1", 300.0), place(&driver, "D1", "A1", 50.0));
        // A lap is 1100 mm.
        assert_eq!(
            [ahead(near, 200.0), ahead(near, 700.0), ahead(near, 800.0)].map(|at| at.unwrap()),
            [300.0, 300.0, 1400.0]
        );
        assert_eq!(ahead(behind, 0.0), Some(1150.0));
        assert_eq!(ahead(place(&driver, "BR1", "C1", 50.0), 0.0), None, "the turnout lies straight");
        assert_eq!(mm(driver.hop_length(TRAIN, node("D1"), node("A1"))), Some(500.0));
        assert_eq!(driver.hop_length(TRAIN, node("D1"), node("B1")), None, "not the next sensor");
    }

    #[test]
    fn a_turnout_is_under_a_train_from_its_front_to_its_rear() {
        // The turnout is 100 mm past A1.
        let under = |past| driver("A1", past).turnouts_under(TRAIN, NOW).contains(&TurnoutId(1));
        assert_eq!([20.0, 80.0, 130.0, 250.0].map(under), [false, true, true, false]);
    }
}
