//! No turnout is thrown under a train.

use alloc::collections::BTreeMap;

use crate::estimation::{Ground, Located, place_of};
use crate::ids::{NodeId, TrainId, TurnoutId};
use crate::time::{TimeSpan, Timestamp};
use crate::track::{Position, Ways};
use crate::units::Length;

use super::driven_train::DrivenTrain;
use super::felt_way::nodes_of_turnout;

/// From the pickup to either end of a train, which nobody has measured: a long locomotive of the gauge, or a short one
/// with a wagon.
pub(super) const TRAIN_REACH: Length = Length::from_mm(250.0);
/// A train is within this many standard deviations of where it is believed to be, but for one time in 15 000.
const CERTAIN: f64 = 4.0;
/// From the order until the points lie: a poll and the command on the line, and the solenoid.
const THROWING: TimeSpan = TimeSpan::from_ms(500);

/// A train that is on a turnout as far as is known, or will be before it has been thrown.
pub(super) fn train_on(
    trains: &BTreeMap<TrainId, DrivenTrain>,
    ground: Ground<'_>,
    now: Timestamp,
    turnout: TurnoutId,
) -> Option<TrainId> {
    let nodes = nodes_of_turnout(ground, turnout)?;
    let on_it = |train: &DrivenTrain| {
        train.located(ground, now).is_some_and(|located| is_near(ground, train, &located, nodes))
    };
    trains.values().find(|train| on_it(train)).map(DrivenTrain::id)
}

fn is_near(ground: Ground<'_>, train: &DrivenTrain, located: &Located, nodes: [NodeId; 2]) -> bool {
    let Some(place) = place_of(ground, &train.model, located.at) else { return false };
    let [ahead, behind] = train.reach.map(|reach| reach + located.uncertainty * CERTAIN);
    let ahead = ahead + located.speed * THROWING;
    let within = |from: Position, to: Position, limit: Length| {
        ground.layout.distance_ahead(from, to, ground.turnouts).is_some_and(|way| way <= limit)
    };
    // Either way along the rails: the train may be seen from the toe or from a leg.
    let positions = || nodes.into_iter().flat_map(|node| starts_at(ground, node));
    let back = ground.layout.reversed(place);
    positions().any(|node| within(place, node, ahead) || within(node, place, behind))
        || back.is_some_and(|back| positions().any(|node| within(back, node, behind)))
}

/// A node as positions, one for each edge that leaves it.
fn starts_at(ground: Ground<'_>, node: NodeId) -> impl Iterator<Item = Position> + use<'_> {
    let edges = match ground.layout.ways(node) {
        Ways::Ahead(edge) => [Some(edge), None],
        Ways::Legs { straight, curved } => [Some(straight), Some(curved)],
        Ways::Ended => [None, None],
    };
    edges.into_iter().flatten().map(|edge| Position { edge, offset: Length::ZERO })
}
