//! The position of a train after it has reversed: the other end of its pickup leads.

use crate::model::MotionModel;
use crate::track::Position;
use crate::tracking::{Located, TrackContext, WayPoint, place_of, way_to};
use crate::units::Length;

/// Length of a pickup shoe along the track where it was not measured. Shoes for three-rail track are sold in lengths
/// of 30 to 50 mm; detections of the course's trains differ by 20 to 90 mm between directions.
const SHOE_LENGTH: Length = Length::from_mm(35.0);
/// One standard deviation of that.
const SHOE_DEVIATION: Length = Length::from_mm(12.0);

/// The position of a train at rest after reversing, and one standard deviation. It is measured from the node behind
/// the train: turnouts further away no longer affect it. `None` where the path back is unknown or does not lead to
/// the train.
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

/// Where the leading end of the pickup is once a train at rest has reversed.
pub(super) fn reversed_position(
    context: TrackContext<'_>,
    model: &MotionModel,
    at: WayPoint,
) -> Option<Position> {
    context.layout.reversed(trailing_position(context, model, at)?)
}

/// Where the trailing end of the pickup is, facing as the leading end does. Found along the path on which the train
/// came: a trailing turnout on it may be set for the other leg by now, or may have been run through.
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

/// The same for a train at rest at a position, whatever path it came on.
pub(super) fn reversed_on_current_path(context: TrackContext<'_>, place: Position) -> Option<Position> {
    context.layout.advance(context.layout.reversed(place)?, SHOE_LENGTH, context.turnouts).ok()
}
