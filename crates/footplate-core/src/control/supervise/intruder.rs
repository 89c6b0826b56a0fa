//! Unauthorised movements: detections that no train of the driver explains, at one sensor after the next. A person or
//! another throttle moves something on this track.
//!
//! A single such detection may be spurious. Two at adjacent sensors within [`NEXT_WITHIN`] happen by chance once in a
//! thousand spurious ones: a layout has four neighbours to a sensor, each with one in 10⁵ s. While a train is in
//! danger they may be its own. What moved may stay where it is: only an operator can say that the track is clear.

use crate::ids::SensorId;
use crate::time::{TimeSpan, Timestamp};
use crate::track::Layout;

/// Two adjacent sensors that report within this time: the longest hop (1.5 m) at the speed of a slow hand, 50 mm/s.
const NEXT_WITHIN: TimeSpan = TimeSpan::from_ms(30_000);

/// What is known of a movement that no session drives.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Intruder {
    pub(super) last: Option<(SensorId, Timestamp)>,
    /// The sensor that reported it last, until an operator says that the track is clear.
    pub(super) near: Option<SensorId>,
    /// Detections in a row that no train explains.
    pub(super) in_a_row: usize,
}

impl Intruder {
    /// Takes a detection that no train explains. Returns the adjacent sensor that reported just before, if any did.
    pub(super) fn take(&mut self, layout: &Layout, sensor: SensorId, time: Timestamp) -> Option<SensorId> {
        self.in_a_row = self.in_a_row.saturating_add(1);
        let (from, at) = self.last.replace((sensor, time))?;
        ((time - at).abs() <= NEXT_WITHIN && are_adjacent(layout, from, sensor)).then_some(from)
    }
}

/// Whether a path leads from one sensor to the other, in either direction, with no other sensor between them.
pub(super) fn are_adjacent(layout: &Layout, one: SensorId, other: SensorId) -> bool {
    let Some(node) = layout.sensor_node(one) else { return false };
    let hops = [node, node.reverse()].into_iter().flat_map(|node| layout.hops_from(node));
    one != other
        && hops.into_iter().any(|hop| hop.sensor.is_some_and(|passed| layout.may_mean(other, passed)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::track::example::oval;

    #[test]
    fn a_movement_is_two_adjacent_sensors_in_time() {
        let layout = oval();
        let [a, c, d, e] = ["A1", "C1", "D1", "E1"].map(|name| layout.sensor_named(name).unwrap());
        let mut intruder = Intruder::default();
        let mut take = |seconds, sensor| intruder.take(&layout, sensor, Timestamp::from_s(seconds));
        assert_eq!(take(1.0, a), None);
        assert_eq!(take(3.0, a), None, "the same sensor again");
        assert_eq!(take(5.0, e), None, "another track");
        assert_eq!(take(7.0, a), None);
        assert_eq!(take(9.0, c), Some(a));
        assert_eq!(take(38.0, d), Some(c));
        assert_eq!(take(69.0, a), None, "too late");
    }
}
