//! What may have closed a contact: each train that can be there, by the turnouts as they lie or by one that did not
//! move; a train that is lost, or has strayed; or nothing.

use alloc::collections::BTreeMap;
use alloc::vec::Vec;

use crate::event::Approach;
use crate::ids::{SensorId, TrainId, TurnoutId};
use crate::link::ContactWindow;
use crate::time::{TimeSpan, Timestamp};
use crate::track::{Leg, TurnoutStates};
use crate::tracking::TrackContext;

use super::driven_train::DrivenTrain;

/// Hops ahead of a train within which a turnout may have been taken the other way: the one it is on and the next.
const HOPS_AHEAD: usize = 2;
/// A turnout does not lie as it was told in 0.3 % of cases (chosen as [`LOG_CHANCE_OF_SILENCE`] is).
///
/// [`LOG_CHANCE_OF_SILENCE`]: crate::tracking::Locator::claim
const LOG_TURNOUT_FAILS: f64 = -5.809;
/// Where a way by the turnouts as they lie is as likely as this (ln 1/s), no other is looked for: half a second's doubt.
const LIKELY: f64 = 0.0;
/// A train that is not seen where it should be was missed by the contact (0.3 %), has changed (0.1 %, as in its claim),
/// or is not there at all (0.01 %, chosen: lifted, derailed, stuck). ln of the sum, and of the share of the last.
const LOG_MISSED: f64 = -5.5;
/// See [`LOG_MISSED`].
const LOG_STRAYED: f64 = -3.7;
/// A train of which nothing strange is known is elsewhere with this chance, as ln (chosen).
const LOG_LIFTED: f64 = -9.2;
/// Forecasts of when a train stands are wrong by less than this; for so long it may still close a contact.
const REST_TIME_ERROR: TimeSpan = TimeSpan::from_ms(1_500);
/// The length of way that a lost train may be anywhere on, where a layout says nothing (m).
const UNKNOWN_TRACK_M: f64 = 20.0;

/// A contact was seen closed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Detection {
    pub(super) sensor: SensorId,
    pub(super) window: ContactWindow,
}

/// What explains a detection.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Explanation {
    /// This train, which was expected somewhere there, or of which nobody knew where it was.
    Train(TrainId),
    /// This train, if the turnout lay otherwise than it was told.
    Turnout { train: TrainId, turnout: TurnoutId, leg: Leg },
    /// This train, which is not where it was believed to be.
    Strayed(TrainId),
}

impl Explanation {
    pub(super) const fn train(&self) -> TrainId {
        match self {
            Self::Train(train) | Self::Turnout { train, .. } | Self::Strayed(train) => *train,
        }
    }
}

/// An explanation and ln of the density (1/s) with which it makes the contact close at that time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Hypothesis {
    pub(super) explanation: Explanation,
    pub(super) log_density: f64,
}

/// Everything that trains have to do with a detection.
pub(super) fn hypotheses(
    trains: &BTreeMap<TrainId, DrivenTrain>,
    context: TrackContext<'_>,
    now: Timestamp,
    detection: Detection,
) -> Vec<Hypothesis> {
    let mut found = Vec::new();
    for train in trains.values().filter(|train| may_have_moved(train, context, now, detection.window)) {
        let id = train.id();
        let anywhere = log_anywhere(train, context);
        let mut add = |explanation, log_density: f64| {
            if log_density.is_finite() {
                found.push(Hypothesis { explanation, log_density });
            }
        };
        if !train.locator.is_located() {
            add(Explanation::Train(id), anywhere);
            continue;
        }
        let is_missed = train.missed_sensor().is_some();
        // That it was not seen has happened already, whichever way it is explained.
        let conditioned = if is_missed { -LOG_MISSED } else { 0.0 };
        let claim = |context: TrackContext<'_>| {
            let claim = train.locator.claim(context, &train.model, detection.sensor, detection.window)?;
            Some(claim + conditioned)
        };
        let current = claim(context);
        if let Some(log_density) = current {
            add(Explanation::Train(id), log_density);
        }
        if current.is_none_or(|log_density| log_density < LIKELY) {
            for (turnout, leg) in other_legs(train, context, now) {
                let mut turnouts: TurnoutStates = context.turnouts.clone();
                turnouts.set(turnout, leg);
                if let Some(log_density) = claim(TrackContext { turnouts: &turnouts, ..context }) {
                    let explanation = Explanation::Turnout { train: id, turnout, leg };
                    add(explanation, log_density + LOG_TURNOUT_FAILS);
                }
            }
        }
        let strayed = if is_missed { LOG_STRAYED } else { LOG_LIFTED };
        add(Explanation::Strayed(id), anywhere + strayed);
    }
    found
}

/// A train that stands closes no contact.
fn may_have_moved(
    train: &DrivenTrain,
    context: TrackContext<'_>,
    now: Timestamp,
    window: ContactWindow,
) -> bool {
    if train.may_move(context, now) {
        return true;
    }
    let before = train.located(context, window.after - REST_TIME_ERROR);
    before.is_some_and(|before| !before.at_rest)
}

/// ln of the density (1/s) with which a train that may be anywhere comes to one contact: its speed over all track there
/// are, in either direction.
fn log_anywhere(train: &DrivenTrain, context: TrackContext<'_>) -> f64 {
    let speed = train.model.speed(train.commanded, Approach::Below).value.as_m_per_s();
    let track: f64 = context.layout.edges().map(|(_, edge)| edge.length.as_m()).sum();
    let track = if track > 0.0 { track } else { UNKNOWN_TRACK_M };
    libm::log(speed.max(f64::MIN_POSITIVE) / track)
}

/// The turnouts that a train meets at their toes before long, with the leg for which they are not believed to lie.
fn other_legs<'g>(
    train: &DrivenTrain,
    context: TrackContext<'g>,
    now: Timestamp,
) -> impl Iterator<Item = (TurnoutId, Leg)> + use<'g> {
    let node = train.located(context, now).map(|located| located.at.node);
    node.into_iter()
        .flat_map(move |node| context.hops_ahead(node).take(HOPS_AHEAD))
        .flat_map(|hop| hop.needs.iter().filter(|need| need.facing))
        .map(|need| {
            let other = if need.leg.is_curved() { Leg::Straight } else { Leg::Curved };
            (need.turnout, other)
        })
}
