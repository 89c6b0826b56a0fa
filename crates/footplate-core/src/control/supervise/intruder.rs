//! Unauthorised movements: detections that no train of the driver explains, at one sensor after the next. A person or
//! another throttle moves something on this track.
//!
//! A single such detection may be spurious. Two at adjacent sensors within [`NEXT_WITHIN`] happen by chance once in a
//! thousand spurious ones: a layout has four neighbours to a sensor, each with one in 10⁵ s. While a train is in
//! danger they may be its own. What moved may stay where it is: only an operator can say that the track is clear.

use alloc::collections::BTreeSet;
use alloc::vec::Vec;

use crate::control::Notice;
use crate::control::drive::Order;
use crate::ids::{EdgeId, SensorId, SpeedStep, TrainId};
use crate::time::{TimeSpan, Timestamp};
use crate::track::{Layout, Position};
use crate::units::Length;

use super::danger::{LOST_REACH, rails_within};
use super::watchdog::Watchdog;

/// Two adjacent sensors that report within this time: the longest hop (1.5 m) at the speed of a slow hand, 50 mm/s.
const NEXT_WITHIN: TimeSpan = TimeSpan::from_ms(30_000);

/// What is known of a movement that no session drives.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Intruder {
    last: Option<(SensorId, Timestamp)>,
    /// The sensor that reported it last, until an operator says that the track is clear.
    near: Option<SensorId>,
}

impl Watchdog {
    /// A detection that no train explains: the second one at adjacent sensors raises the alarm.
    pub(super) fn note_unexplained(&mut self, now: Timestamp, sensor: SensorId, time: Timestamp) {
        let before = self.intruder.last.replace((sensor, time));
        if self.intruder.near.is_some() {
            self.intruder.near = Some(sensor);
            self.hold_endangered(now);
            return;
        }
        let Some((from, at)) = before.filter(|_| self.dangers.is_empty()) else { return };
        if (time - at).abs() > NEXT_WITHIN || !are_adjacent(self.driver.layout(), from, sensor) {
            return;
        }
        self.intruder.near = Some(sensor);
        let stopped = self.hold_endangered(now);
        self.notify(Notice::UnauthorisedMovement { from, to: sensor, stopped });
        // A decoder may have missed its stop: all trains that should be at rest are commanded to stop again.
        let rests = |train: &TrainId| self.driver.commanded(*train) == SpeedStep::STAND;
        let resting: Vec<TrainId> = self.driver.trains().filter(rests).collect();
        for train in resting {
            self.issue(now, Order::Speed { train, step: SpeedStep::STAND });
        }
    }

    /// The rails that whatever moves may be on; `None` if nothing does.
    pub(super) fn intruder_reach(&self) -> Option<BTreeSet<EdgeId>> {
        let layout = self.driver.layout();
        let node = layout.sensor_node(self.intruder.near?)?;
        let begins = layout.outgoing(node).edges().chain(layout.outgoing(node.reverse()).edges());
        let reach = |edge| {
            let place = Position { edge, offset: Length::ZERO };
            rails_within(layout, place, LOST_REACH, Length::ZERO)
        };
        Some(begins.flat_map(reach).collect())
    }

    /// The track is clear again: an operator said so, or a train was located that was lost.
    pub(super) fn clear_intruder(&mut self) {
        self.intruder.last = None;
        if self.intruder.near.take().is_some() {
            self.notify(Notice::TrackClear);
        }
    }

    /// Whether something moves that no session drives.
    pub(super) const fn has_intruder(&self) -> bool {
        self.intruder.near.is_some()
    }
}

/// Whether a path leads from one sensor to the other, in either direction, with no other sensor between them.
fn are_adjacent(layout: &Layout, one: SensorId, other: SensorId) -> bool {
    let Some(node) = layout.sensor_node(one) else { return false };
    let hops = [node, node.reverse()].into_iter().flat_map(|node| layout.hops_from(node));
    one != other && hops.into_iter().any(|hop| hop.sensor == Some(other))
}
