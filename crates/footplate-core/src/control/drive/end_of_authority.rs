//! What a train shall not pass, whatever it was ordered, and places as whoever sets limits needs them.

use alloc::collections::BTreeSet;

use crate::ids::{NodeId, SensorId, TrainId, TurnoutId};
use crate::time::Timestamp;
use crate::track::Position;
use crate::tracking::{Rest, TrackContext, WayPoint, place_of, way_to};
use crate::units::Length;

use super::driven_train::DrivenTrain;
use super::driver::Driver;
use super::order::OrderId;
use super::path_length::{circuit_length, recount_from};
use super::turning::{reversed_on_current_path, reversed_position, trailing_position};
use super::turnout_guard::turnouts_under;

impl Driver {
    /// What a train shall not pass, whatever it is ordered to do and whatever is reported: it is commanded to stop in time, by
    /// the clock if nothing is heard of it, so that it comes to rest before but for one time in a thousand. Whoever plans
    /// a stop plans it before the limit. A train that is put elsewhere or turned around may not move until it is given
    /// another limit; `None` lifts it.
    pub fn set_limit(&mut self, now: Timestamp, train: TrainId, end: Option<WayPoint>) {
        let context = self.track.context();
        if let Some(train) = self.trains.get_mut(&train) {
            train.set_end_of_authority(context, now, end);
        }
        self.update_line_requests(now);
    }

    /// What a train shall not pass.
    #[must_use]
    pub fn limit(&self, train: TrainId) -> Option<WayPoint> {
        self.trains.get(&train)?.end_of_authority
    }

    /// A number for something that is made of several orders: no order will have it.
    pub(in crate::control) const fn number(&mut self) -> OrderId {
        let id = OrderId(self.orders);
        self.orders = self.orders.wrapping_add(1);
        id
    }

    /// Where a train comes to rest, most likely, if the command to stop leaves at a time that is not before the last
    /// entry.
    #[must_use]
    pub fn rest_if_stopped(&self, train: TrainId, at: Timestamp) -> Option<WayPoint> {
        Some(self.stopped_at(train, at)?.at)
    }

    /// The same with how sure that is, and when it stands.
    #[must_use]
    pub fn stopped_at(&self, train: TrainId, at: Timestamp) -> Option<Rest> {
        let train = self.trains.get(&train)?;
        train.locator.rest_if_stopped(self.track.context(), &train.model, at)
    }

    /// How far a train reaches ahead of and behind the leading end of its pickup, whichever way it runs. Unless it is said,
    /// as far as a long locomotive might (250 mm).
    pub fn set_reach(&mut self, train: TrainId, ahead: Length, behind: Length) {
        if let Some(train) = self.trains.get_mut(&train) {
            train.reach = [ahead, behind].map(|reach| reach.max(Length::ZERO));
        }
    }

    /// One standard deviation of the widest stop that a train may make from a step that moves it; `None` if none is known
    /// to.
    #[must_use]
    pub fn widest_stop(&self, train: TrainId) -> Option<Length> {
        self.trains.get(&train)?.widest_stop
    }

    /// A contact that a train should have closed and did not, since it was seen last: it may be far behind where it is
    /// believed to be.
    #[must_use]
    pub fn unseen(&self, train: TrainId, now: Timestamp) -> Option<SensorId> {
        let (train, context) = (self.trains.get(&train)?, self.track.context());
        train.missed_sensor().or_else(|| train.sensor_missed_before(context, &train.located(context, now)?))
    }

    /// Whether it is not sure which contacts a train has passed: it may be where it would be otherwise.
    #[must_use]
    pub fn is_in_doubt(&self, train: TrainId) -> bool {
        self.association.is_ambiguous(train)
    }

    /// Counts a train at rest from the node behind its pickup, whatever is there: how turnouts further away lie makes no
    /// difference from now on.
    pub(in crate::control) fn count_from_behind(&mut self, now: Timestamp, train: TrainId) {
        let Some(located) = self.locate(train, now).filter(|located| located.at_rest) else { return };
        let at = self.position_at(train, located.at).and_then(|place| {
            let model = &self.trains.get(&train)?.model;
            let trailing = trailing_position(self.track.context(), model, located.at)?;
            let behind = self.track.layout.edge(trailing.edge)?.from;
            if behind == located.at.node { None } else { self.way_point(train, behind, place) }
        });
        if let Some(at) = at {
            self.place(now, train, at, located.uncertainty);
        }
    }

    /// The turnouts that cannot be thrown now for this train.
    #[must_use]
    pub fn turnouts_under(&self, train: TrainId, now: Timestamp) -> BTreeSet<TurnoutId> {
        let train = self.trains.get(&train);
        train.map_or_else(BTreeSet::new, |train| turnouts_under(self.track.context(), train, now))
    }

    /// The place of a train on the layout; `None` if nobody knows it.
    #[must_use]
    pub fn position(&self, train: TrainId, now: Timestamp) -> Option<Position> {
        self.position_at(train, self.locate(train, now)?.at)
    }

    /// The place on the layout of a point of a train's way as the turnouts lie.
    #[must_use]
    pub fn position_at(&self, train: TrainId, at: WayPoint) -> Option<Position> {
        place_of(self.track.context(), &self.trains.get(&train)?.model, at)
    }

    /// The same ahead of a point of its way: where the way leads there only once round, that is taken.
    #[must_use]
    pub fn way_point_ahead(&self, train: TrainId, from: WayPoint, to: Position) -> Option<WayPoint> {
        let found = self.way_point(train, from.node, to)?;
        if found.way > from.way {
            return Some(found);
        }
        let round = circuit_length(self.track.context(), &self.trains.get(&train)?.model, from.node)?;
        Some(WayPoint { way: found.way + round, ..found })
    }

    /// Where the leading end of the pickup will be taken to be when a train at rest has turned around. It is counted from
    /// the node behind it then: a turnout there has to lie for where it stands.
    #[must_use]
    pub fn turned_place(&self, train: TrainId, now: Timestamp) -> Option<Position> {
        let at = self.locate(train, now)?.at;
        reversed_position(self.track.context(), &self.trains.get(&train)?.model, at)
    }

    /// The same for a train that would stand at a place, wherever it came from.
    #[must_use]
    pub fn turned_place_at(&self, place: Position) -> Option<Position> {
        reversed_on_current_path(self.track.context(), place)
    }

    /// A place on the layout as a point of a train's way, counted from a node as the turnouts lie; `None` if none leads
    /// there.
    #[must_use]
    pub fn way_point(&self, train: TrainId, from: NodeId, to: Position) -> Option<WayPoint> {
        let way = way_to(self.track.context(), &self.trains.get(&train)?.model, from, to)?;
        Some(WayPoint { node: from, way })
    }
}

impl DrivenTrain {
    /// Sets another limit, or none.
    pub(super) fn set_end_of_authority(
        &mut self,
        context: TrackContext<'_>,
        now: Timestamp,
        end: Option<WayPoint>,
    ) {
        self.end_of_authority = end;
        self.update_authority_stop(context, now);
    }

    /// The train was put somewhere or turned around: whatever it was allowed before, it was not allowed from here.
    pub(super) fn end_authority_here(&mut self, context: TrackContext<'_>, now: Timestamp) {
        if self.end_of_authority.is_some() {
            self.end_of_authority = self.located(context, now).map(|located| located.at);
        }
    }

    /// The train has come to a contact. Where no way leads from there to the limit it is somewhere else than it should
    /// be, and the limit is here.
    pub(super) fn recount_end_of_authority(&mut self, context: TrackContext<'_>, node: NodeId) {
        if let Some(end) = self.end_of_authority {
            let counted = recount_from(context, &self.model, end, node);
            self.end_of_authority = Some(counted.unwrap_or(WayPoint { node, way: Length::ZERO }));
        }
    }
}
