//! Where a train is once it has turned around: its shoe's other end leads.

use crate::model::MotionModel;
use crate::track::Position;
use crate::tracking::{Located, TrackContext, WayPoint, place_of, way_to};
use crate::units::Length;

/// The length of a pickup shoe along the track, which nobody has measured for this train. Shoes for three-rail track
/// are sold in lengths of 30 to 50 mm, and trains of the course were reported 20 to 90 mm apart by direction.
const SHOE: Length = Length::from_mm(35.0);
/// One standard deviation of that.
const SHOE_DOUBT: Length = Length::from_mm(12.0);

/// The place of a train at rest after it turned around on the spot, and one standard deviation of it. Counted from the
/// node behind it, whatever is there: how turnouts further away lie makes no difference then. `None` where the way back
/// is not known, or does not lead to where the train stands.
pub(super) fn turned(
    context: TrackContext<'_>,
    model: &MotionModel,
    located: Located,
) -> Option<(WayPoint, Length)> {
    let leading = turned_place(context, model, located.at)?;
    let behind = context.layout.edge(leading.edge)?.from;
    let way = way_to(context, model, behind, leading)?;
    let uncertainty = Length::from_m(libm::hypot(located.uncertainty.as_m(), SHOE_DOUBT.as_m()));
    Some((WayPoint { node: behind, way }, uncertainty))
}

/// Where the leading end of the pickup is once a train at rest has turned around.
pub(super) fn turned_place(context: TrackContext<'_>, model: &MotionModel, at: WayPoint) -> Option<Position> {
    context.layout.reversed(trailing_place(context, model, at)?)
}

/// Where the trailing end of the pickup is, facing as its leading end does: back along the way that the train came, over
/// points that may lie for another leg by now, or lay for it all the time and gave way.
pub(super) fn trailing_place(
    context: TrackContext<'_>,
    model: &MotionModel,
    at: WayPoint,
) -> Option<Position> {
    if at.way >= SHOE {
        return place_of(context, model, WayPoint { way: at.way - SHOE, ..at });
    }
    context.layout.reversed(turned_as_it_lies(context, place_of(context, model, at)?)?)
}

/// The same for a train that would stand at a place, wherever it came from.
pub(super) fn turned_as_it_lies(context: TrackContext<'_>, place: Position) -> Option<Position> {
    context.layout.advance(context.layout.reversed(place)?, SHOE, context.turnouts).ok()
}
