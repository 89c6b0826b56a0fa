//! Where a train in recovery may creep: not into track that may be occupied, from wherever the train may be.

use alloc::collections::{BTreeMap, BTreeSet};
use alloc::vec::Vec;

use crate::control::dispatch::Reservation;
use crate::ids::{EdgeId, NodeId, TrainId};
use crate::time::Timestamp;
use crate::track::{Layout, Position};
use crate::units::Length;

use super::danger::{BODY, CERTAIN, CLEAR, LOST_REACH, rails_within};
use super::watchdog::Watchdog;

/// A lost train needs this many sensors ahead of its last detection: two may have stayed silent, and the third
/// reports it.
const SENSORS_AHEAD: usize = 3;
/// A train that is lost again while it is measured is before the second sensor ahead of its last detection.
const LOST_WITHIN: usize = 2;

/// The track that a dispatcher allots to a train in danger. Nobody else moves while it creeps.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Clearance {
    /// The track where the train may be; empty if that is not known.
    pub own: Reservation,
    /// The track that is reserved for other trains: it does not enter it.
    pub others: Reservation,
}

impl Watchdog {
    /// The track that a train in recovery must not enter. Without a dispatcher, the track under the other trains.
    fn closed_to(&self, now: Timestamp, train: TrainId) -> Reservation {
        if let Some(clearance) = self.clearance(train) {
            return clearance.others.clone();
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

    fn clearance(&self, train: TrainId) -> Option<&Clearance> {
        self.dangers.get(&train)?.clearance.as_ref()
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
            })?;
            let mut at = self.driver.path_point(train, located.at.node, begin)?;
            at.distance += -(BODY + CLEAR);
            Some(at)
        });
        self.driver.set_end_of_authority(now, train, limit);
    }

    /// Whether a lost train may creep ahead: from its last detection, over the turnouts as set, [`SENSORS_AHEAD`]
    /// sensors come before the end of the track and before any track that is closed to it.
    pub(super) fn is_clear_ahead(&self, now: Timestamp, train: TrainId) -> bool {
        let layout = self.driver.layout();
        let closed = self.closed_to(now, train);
        let Some(seen) = self.seen.get(&train) else { return false };
        let is_free = |edge: EdgeId, from| closed.begins_on(layout, edge, from).is_none();
        let Some(edge) = layout.edge(seen.edge).filter(|_| is_free(seen.edge, seen.offset)) else {
            return false;
        };
        let mut sensors = usize::from(layout.sensor_at(edge.to).is_some());
        for hop in self.driver.context().hops_ahead(edge.to).take(layout.nodes().len()) {
            if hop.sensor.is_none() || hop.edges.iter().any(|edge| !is_free(*edge, Length::ZERO)) {
                return false;
            }
            sensors += 1;
            if sensors >= SENSORS_AHEAD {
                return true;
            }
        }
        false
    }

    /// The sensor to which a lost train may creep back, in its new direction: the one that reported it last. `None` if
    /// it could reach the end of the track, or track that is closed to it, before a sensor reports it, wherever it
    /// may be and whichever way turnouts behind it are set.
    pub(super) fn sensor_behind(&self, train: TrainId) -> Option<NodeId> {
        let layout = self.driver.layout();
        let clearance = self.clearance(train)?;
        let behind = *self.behind.get(&train)?;
        let reach = edges_within(layout, behind, LOST_REACH);
        let mut begins: Vec<(EdgeId, Length)> = Vec::new();
        for (stretch, span) in clearance.own.spans() {
            for edge in reach.iter().filter(|edge| edge.stretch() == stretch) {
                // The farther end of the interval, counted from the end of the edge.
                let length = layout.edge(*edge)?.length;
                let from = if *edge < edge.twin() { length - span.to } else { span.from };
                begins.push((edge.twin(), from));
            }
        }
        if begins.is_empty() {
            let hops = self.driver.context().hops_ahead(behind).take(LOST_WITHIN);
            begins.extend(hops.flat_map(|hop| hop.edges.iter().map(|edge| (edge.twin(), Length::ZERO))));
        }
        let is_clear = !begins.is_empty() && reports_before(layout, begins, &clearance.others);
        is_clear.then(|| behind.reverse())
    }
}

/// The edges that begin within a distance of a node, over both legs of every turnout.
fn edges_within(layout: &Layout, from: NodeId, reach: Length) -> BTreeSet<EdgeId> {
    let mut best: BTreeMap<EdgeId, Length> = BTreeMap::new();
    let mut open: Vec<(EdgeId, Length)> = layout.outgoing(from).edges().map(|edge| (edge, reach)).collect();
    while let Some((edge, left)) = open.pop() {
        if left <= Length::ZERO || best.get(&edge).is_some_and(|known| *known >= left) {
            continue;
        }
        best.insert(edge, left);
        let Some(known) = layout.edge(edge) else { continue };
        open.extend(layout.outgoing(known.to).edges().map(|next| (next, left - known.length)));
    }
    best.into_keys().collect()
}

/// Whether on every path, over both legs of every turnout, a sensor comes before closed track and before the end of
/// the track, with the length that a train needs to stop behind it.
fn reports_before(layout: &Layout, begins: Vec<(EdgeId, Length)>, closed: &Reservation) -> bool {
    let mut open: Vec<(EdgeId, Length, Option<Length>)> =
        begins.into_iter().map(|(edge, from)| (edge, from, None)).collect();
    let mut known: BTreeSet<EdgeId> = BTreeSet::new();
    while let Some((id, from, left)) = open.pop() {
        let Some(edge) = layout.edge(id) else { return false };
        let closed_at = closed.begins_on(layout, id, from);
        if closed_at.is_some_and(|at| left.is_none_or(|left| at < left)) {
            return false;
        }
        let left = left.map(|left| left - edge.length);
        if left.is_some_and(|left| left <= Length::ZERO) {
            continue;
        }
        let has_sensor =
            [edge.to, edge.to.reverse()].into_iter().any(|node| layout.sensor_at(node).is_some());
        let left = left.or_else(|| has_sensor.then_some(BODY + CLEAR));
        let mut next = layout.outgoing(edge.to).edges().peekable();
        if next.peek().is_none() {
            return false;
        }
        // Beyond a sensor only a short distance counts.
        open.extend(
            next.filter(|next| left.is_some() || known.insert(*next)).map(|next| (next, Length::ZERO, left)),
        );
    }
    true
}
