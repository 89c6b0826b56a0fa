//! Places where a train can be at rest, and whether it is clear of all turnouts there.

use alloc::vec::Vec;

use crate::track::{Layout, Position, TurnoutStates};
use crate::units::Length;

use super::movement_authority::{ClearanceEnvelope, standing};
use super::occupied_path::OccupiedPath;

/// The distance between two places that are tried: less than trains differ by.
const EVERY: Length = Length::from_mm(100.0);
/// The uncertainty of the place of a train after a future stop, one standard deviation.
pub(super) const PARKED: Length = Length::from_mm(15.0);
/// How far from its place a train is likely to stop.
pub(super) const OFF: Length = Length::from_mm(40.0);

/// All places on a layout with room for a train, each once, and whether it is clear of all turnouts there.
pub(super) fn parking_places(layout: &Layout, room: ClearanceEnvelope) -> Vec<(Position, bool)> {
    let turnouts = TurnoutStates::unknown();
    let room = ClearanceEnvelope { ahead: room.ahead + OFF, behind: room.behind + OFF, ..room };
    let mut places = Vec::new();
    for (id, edge) in layout.edges().filter(|(id, _)| *id < id.twin()) {
        let mut offset = EVERY / 2.0;
        while offset < edge.length {
            let place = Position { edge: id, offset };
            let taken = standing(layout, &turnouts, place, &OccupiedPath::default(), room);
            let length: Length = taken.spans().map(|(_, span)| span.to - span.from).sum();
            if length >= room.ahead + room.behind - Length::from_mm(1.0) {
                places.push((place, taken.turnouts().next().is_none()));
            }
            offset += EVERY;
        }
    }
    places
}
