//! Where a train is once it has reversed_location around: its shoe's other end leads.

use crate::model::MotionModel;
use crate::track::Position;
use crate::tracking::{Located, TrackContext, WayPoint, place_of, way_to};
use crate::units::Length;

/// The length of a pickup shoe along the track, which nobody has measured for this train. Shoes for three-rail track
/// are sold in lengths of 30 to 50 mm, and trains of the course were reported 20 to 90 mm apart by direction.
const SHOE_LENGTH: Length = Length::from_mm(35.0);
/// One standard deviation of that.
const SHOE_DEVIATION: Length = Length::from_mm(12.0);

/// The place of a train at rest after it reversed_location around on the spot, and one standard deviation of it. Counted from the
/// node behind it, whatever is there: how turnouts further away lie makes no difference then. `None` where the way back
/// is not known, or does not lead to where the train stands.
pub(super) fn reversed_location(
    context: TrackContext<'_>,
    model: &MotionModel,
    located: Located,
) -> Option<(WayPoint, Length)> {
    let leading = reversed_position(context, model, located.at)?;
    let behind = context.layout.edge(leading.edge)?.from;
    let way = way_to(context, model, behind, leading)?;
    let uncertainty = Length::from_m(libm::hypot(located.uncertainty.as_m(), SHOE_DEVIATION.as_m()));
    Some((WayPoint { node: behind, way }, uncertainty))
}

/// Where the leading end of the pickup is once a train at rest has reversed_location around.
pub(super) fn reversed_position(
    context: TrackContext<'_>,
    model: &MotionModel,
    at: WayPoint,
) -> Option<Position> {
    context.layout.reversed(trailing_position(context, model, at)?)
}

/// Where the trailing end of the pickup is, facing as its leading end does: back along the way that the train came, over
/// points that may lie for another leg by now, or lay for it all the time and gave way.
pub(super) fn trailing_position(
    context: TrackContext<'_>,
    model: &MotionModel,
    at: WayPoint,
) -> Option<Position> {
    if at.way >= SHOE_LENGTH {
        return place_of(context, model, WayPoint { way: at.way - SHOE_LENGTH, ..at });
    }
    context.layout.reversed(reversed_on_current_path(context, place_of(context, model, at)?)?)
}

/// The same for a train that would stand at a place, wherever it came from.
pub(super) fn reversed_on_current_path(context: TrackContext<'_>, place: Position) -> Option<Position> {
    context.layout.advance(context.layout.reversed(place)?, SHOE_LENGTH, context.turnouts).ok()
}
