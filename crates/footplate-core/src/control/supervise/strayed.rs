//! A train that is probably not where it was estimated: it is stopped, and searched from where it was detected.

use crate::ids::{NodeId, SensorId, TrainId};
use crate::time::{TimeSpan, Timestamp};
use crate::track::Position;
use crate::units::Length;

use super::alarm::Alarm;
use super::danger::BODY;
use super::recovery::Recovery;
use super::recovery_phase::RecoveryPhase;
use super::unheard::Behind;
use super::watchdog::Watchdog;

/// A detection elsewhere this long before a sensor is overdue may be the same train: from one to the other it runs two
/// hops (the longest, 1.5 m) at 200 mm/s.
const SAME_TRAIN_WITHIN: TimeSpan = TimeSpan::from_s(15.0);
/// A hand needs at least this long to lift a moving train and put it on other track (chosen: re-railing a locomotive takes a
/// practised hand two seconds). A report elsewhere sooner after its last detection is not of this train.
const HANDLED_IN: TimeSpan = TimeSpan::from_s(2.0);

impl Watchdog {
    /// Raises the alarm for a train that was detected elsewhere.
    pub(super) fn raise_elsewhere(
        &mut self,
        now: Timestamp,
        train: TrainId,
        sensor: SensorId,
        time: Timestamp,
    ) {
        if self.is_watching() && !self.is_in_danger(train) && self.may_have_been_moved(train, time) {
            self.note_elsewhere(train, sensor, time);
            self.raise(now, train, Alarm::Elsewhere(sensor));
        }
    }

    /// A sensor is silent at which a train is overdue: raises the alarm if another has reported, since its last detection,
    /// what no train explained and this one probably caused. An earlier report of the silent sensor itself says that the train was
    /// early, or that the report was spurious.
    pub(super) fn compare_with_unexplained(&mut self, now: Timestamp, train: TrainId, silent: SensorId) {
        let is_elsewhere = |(sensor, time): &(SensorId, Timestamp)| {
            *sensor != silent
                && now - *time <= SAME_TRAIN_WITHIN
                && !self.noise.covers(*time)
                && self.may_have_been_moved(train, *time)
        };
        let found = self.driver.probably_elsewhere(now, train).find(is_elsewhere);
        if let Some((sensor, time)) = found {
            self.raise_elsewhere(now, train, sensor, time);
        }
    }

    /// Whether there was time to move a train by hand between its last detection and a report elsewhere.
    fn may_have_been_moved(&self, train: TrainId, time: Timestamp) -> bool {
        let passed = self.monitors.get(&train).and_then(|monitor| monitor.last());
        passed.is_none_or(|passed| time - passed >= HANDLED_IN)
    }

    /// A detection that no train explains while a lost train comes to rest is of that train, if it can have run there. From anywhere
    /// else it is of a train that a hand has moved, or of none: nothing is known then of where this one is.
    pub(super) fn note_stopping(&mut self, sensor: SensorId, time: Timestamp) {
        let stops = |(train, danger): (&TrainId, &Recovery)| {
            (danger.is_searched() && danger.phase == RecoveryPhase::Stopping).then_some(*train)
        };
        let mut stopping = self.dangers.iter().filter_map(stops);
        if let (Some(train), None) = (stopping.next(), stopping.next()) {
            if self.permits_all || self.can_have_run_to(time, train, sensor) {
                self.note_elsewhere(train, sensor, time);
            } else {
                self.seen.remove(&train);
                self.undirected.insert(train);
            }
        }
    }

    /// Whether a train can have run to a sensor since its last detection, over either leg of any turnout.
    fn can_have_run_to(&self, now: Timestamp, train: TrainId, sensor: SensorId) -> bool {
        let layout = self.driver.layout();
        let run = self.unheard_run(now, train) + BODY;
        let Some(seen) = self.seen.get(&train) else { return false };
        let back = layout.reversed(*seen).filter(|_| self.undirected.contains(&train));
        let from = core::iter::once(*seen).chain(back).map(|place| (place.edge, run + place.offset));
        let reached = layout.edges_within(from);
        reached.into_iter().any(|(id, left)| {
            layout.edge(id).is_some_and(|edge| {
                let ends = [edge.to, edge.to.reverse()];
                left >= edge.length && ends.into_iter().any(|end| layout.sensor_at(end) == Some(sensor))
            })
        })
    }

    /// Searches for a train from a sensor. One that reports both directions of travel does not show the direction.
    fn note_elsewhere(&mut self, train: TrainId, sensor: SensorId, time: Timestamp) {
        let layout = self.driver.layout();
        let Some(node) = layout.sensor_node(sensor) else { return };
        let Some(edge) = layout.outgoing(node).edges().next() else { return };
        if layout.sensor_at(node.reverse()).is_none() || layout.both_directions(sensor).is_some() {
            self.undirected.insert(train);
        } else {
            self.undirected.remove(&train);
        }
        self.seen.insert(train, Position { edge, offset: Length::ZERO });
        self.behind.insert(train, Behind { sensor: Some(node), trails_otherwise: false, was_placed: false });
        self.note_detection(train, time);
    }

    /// A train was detected in a direction that is not known. One that creeps back is known to have reversed: it passes the sensor that
    /// reported it last or, if it stood on that, the next one.
    pub(super) fn direction_unknown(&mut self, now: Timestamp, train: TrainId, sensor: SensorId) {
        let may_be_turned = self.undirected.contains(&train);
        let Some(Recovery { phase: RecoveryPhase::Locating { pushed, seen, .. }, .. }) =
            self.dangers.get_mut(&train)
        else {
            return;
        };
        *pushed = now;
        let layout = self.driver.layout();
        let is_it =
            |node: &NodeId| layout.sensor_at(*node).is_some_and(|passed| layout.may_mean(sensor, passed));
        let behind = seen.filter(|_| !may_be_turned);
        let next = behind.into_iter().flat_map(|seen| layout.open_hops_from(seen, self.driver.turnouts()));
        let found = behind.into_iter().chain(next.map(|hop| hop.to)).find(is_it);
        if let Some(node) = found {
            self.driver.decide_direction(now, train, node);
        }
    }
}
