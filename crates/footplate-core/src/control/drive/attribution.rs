//! Which train closed a contact.

use alloc::collections::BTreeMap;

use crate::estimation::Ground;
use crate::ids::{SensorId, TrainId, TurnoutId};
use crate::latency::ContactWindow;
use crate::time::Timestamp;
use crate::track::{Leg, TurnoutStates};

use super::driven_train::DrivenTrain;

/// Hops ahead of a train within which a turnout may have been taken the other way: the one it is on and the next.
const HOPS_LOOKED_AT: usize = 2;

/// What explains a report best.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Explanation {
    /// This train, which was expected somewhere there, or of which nobody knew where it was.
    Train(TrainId),
    /// This train, if the turnout lay otherwise than it was told.
    Turnout { train: TrainId, turnout: TurnoutId, leg: Leg },
    /// This train, which should have been reported elsewhere long ago.
    Strayed(TrainId),
}

/// The train that most likely closed a contact: of those whose place is known the one that is likeliest there; else
/// one that took the other leg of a turnout; else the one that runs and has been lost, or is overdue, if it is the
/// only one.
pub(super) fn explain(
    trains: &BTreeMap<TrainId, DrivenTrain>,
    ground: Ground<'_>,
    now: Timestamp,
    sensor: SensorId,
    window: ContactWindow,
) -> Option<Explanation> {
    let located = || trains.values().filter(|train| train.located(ground, now).is_some());
    let likelihood = |train: &DrivenTrain, ground: Ground<'_>| {
        train.locator.likelihood(ground, &train.model, sensor, window)
    };
    let likeliest = located()
        .filter_map(|train| Some((train.id(), likelihood(train, ground)?)))
        .max_by(|(_, one), (_, other)| one.total_cmp(other));
    if let Some((train, _)) = likeliest {
        return Some(Explanation::Train(train));
    }
    let strayed = located().filter(|train| train.may_move(ground, now)).find_map(|train| {
        other_legs(train, ground, now).find_map(|(turnout, leg)| {
            let mut turnouts: TurnoutStates = ground.turnouts.clone();
            turnouts.set(turnout, leg);
            likelihood(train, Ground { turnouts: &turnouts, ..ground })?;
            Some(Explanation::Turnout { train: train.id(), turnout, leg })
        })
    });
    if strayed.is_some() {
        return strayed;
    }
    let only = |trains: &mut dyn Iterator<Item = TrainId>| {
        let first = trains.next()?;
        trains.next().is_none().then_some(first)
    };
    let mut lost = trains
        .values()
        .filter(|train| train.located(ground, now).is_none() && train.may_move(ground, now))
        .map(DrivenTrain::id);
    if let Some(train) = only(&mut lost) {
        return Some(Explanation::Train(train));
    }
    let mut overdue = located().filter(|train| train.unseen().is_some()).map(DrivenTrain::id);
    only(&mut overdue).map(Explanation::Strayed)
}

/// The turnouts that a train meets at their toes before long, with the leg for which they are not believed to lie.
fn other_legs<'g>(
    train: &DrivenTrain,
    ground: Ground<'g>,
    now: Timestamp,
) -> impl Iterator<Item = (TurnoutId, Leg)> + use<'g> {
    let node = train.located(ground, now).map(|located| located.at.node);
    node.into_iter()
        .flat_map(move |node| ground.hops_ahead(node).take(HOPS_LOOKED_AT))
        .flat_map(|hop| hop.needs.iter().filter(|need| need.facing))
        .map(|need| {
            let other = if need.leg.is_curved() { Leg::Straight } else { Leg::Curved };
            (need.turnout, other)
        })
}
