//! What may have caused a detection: each train that can be there, with the turnouts as known or with one that
//! failed; a lost or displaced train; or no train.

use alloc::collections::BTreeMap;
use alloc::vec::Vec;

use crate::event::Approach;
use crate::ids::{SensorId, TrainId, TurnoutId};
use crate::link::DetectionWindow;
use crate::time::{TimeSpan, Timestamp};
use crate::track::{Leg, TurnoutStates};
use crate::tracking::TrackContext;

use super::driven_train::DrivenTrain;

/// How many hops ahead of a train a turnout failure is considered: the present hop and the next.
const HOPS_AHEAD: usize = 2;
/// ln of the probability that a turnout does not move when commanded, 0.3 % (chosen as that of a missed detection is).
const LOG_TURNOUT_FAILS: f64 = -5.809;
/// ln of the probability that a turnout over which a train has passed since it was set lies otherwise, one in 100 000 (chosen: a hand
/// or a magnet without a command throws one in a season).
const LOG_TURNOUT_MOVED: f64 = -11.513;
/// Turnout failures are considered only if the density (ln 1/s) with the known positions is below this: an
/// uncertainty of about half a second.
const LIKELY: f64 = 0.0;
/// A train that a sensor should have reported was missed by the sensor (the learnt share, usually 0.3 %), has changed (0.1 %,
/// as in its claim), ...
const CHANGED: f64 = 0.001;
/// ... or is not there (0.01 %, chosen: lifted, derailed, stalled).
const STRAYED: f64 = 0.0001;
/// ln of the probability that a train without any missed sensor is elsewhere (chosen).
const LOG_LIFTED: f64 = -9.2;
/// Largest error of a predicted time of rest: until then a train may still cause a detection.
const REST_TIME_ERROR: TimeSpan = TimeSpan::from_ms(1_500);
/// Total track length (m) assumed for a lost train if the layout states no lengths.
const UNKNOWN_TRACK_M: f64 = 20.0;

/// One detection: a sensor, and the time window in which it was reached.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Detection {
    pub(super) sensor: SensorId,
    pub(super) window: DetectionWindow,
}

/// What explains a detection.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Explanation {
    /// This train, near its predicted time, or a lost train.
    Train(TrainId),
    /// This train, if the turnout is not in its commanded position.
    Turnout { train: TrainId, turnout: TurnoutId, leg: Leg },
    /// This train, if it is not at its estimated position.
    Strayed(TrainId),
}

impl Explanation {
    pub(super) const fn train(&self) -> TrainId {
        match self {
            Self::Train(train) | Self::Turnout { train, .. } | Self::Strayed(train) => *train,
        }
    }
}

/// An explanation, and ln of the density (1/s) of the detection under it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Hypothesis {
    pub(super) explanation: Explanation,
    /// The sensor that the train passed: one of its two directions, where it does not report the direction.
    pub(super) sensor: SensorId,
    pub(super) log_density: f64,
}

/// All hypotheses in which a train caused a detection.
pub(super) fn hypotheses(
    trains: &BTreeMap<TrainId, DrivenTrain>,
    context: TrackContext<'_>,
    now: Timestamp,
    detection: Detection,
) -> Vec<Hypothesis> {
    let meanings = context.layout.meanings(detection.sensor);
    let of = |sensor| hypotheses_of(trains, context, now, Detection { sensor, ..detection });
    meanings.flat_map(of).collect()
}

/// The hypotheses in which a train passed a sensor in its direction.
fn hypotheses_of(
    trains: &BTreeMap<TrainId, DrivenTrain>,
    context: TrackContext<'_>,
    now: Timestamp,
    detection: Detection,
) -> Vec<Hypothesis> {
    let mut found = Vec::new();
    for train in trains.values().filter(|train| may_have_moved(train, context, now, detection.window)) {
        let id = train.id();
        let anywhere = log_density_if_lost(train, context);
        let mut add = |explanation, log_density: f64| {
            if log_density.is_finite() {
                found.push(Hypothesis { explanation, sensor: detection.sensor, log_density });
            }
        };
        if !train.locator.is_located() {
            add(Explanation::Train(id), anywhere);
            continue;
        }
        let is_missed = train.missed_sensor().is_some();
        let missed_share = train.missed_share(context, detection.window.middle());
        // The missed sensor has already happened under every hypothesis: condition on it.
        let conditioned = if is_missed { -libm::log(missed_or_elsewhere(missed_share)) } else { 0.0 };
        let claim = |context: TrackContext<'_>| {
            let Detection { sensor, window } = detection;
            let claim = train.locator.claim(context, &train.model, sensor, window, missed_share)?;
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
                let is_proven = context.turnouts.is_proven(turnout);
                let log_other = if is_proven { LOG_TURNOUT_MOVED } else { LOG_TURNOUT_FAILS };
                if let Some(log_density) = claim(TrackContext { turnouts: &turnouts, ..context }) {
                    let explanation = Explanation::Turnout { train: id, turnout, leg };
                    add(explanation, log_density + log_other);
                }
            }
        }
        let strayed = if is_missed { libm::log(STRAYED) + conditioned } else { LOG_LIFTED };
        add(Explanation::Strayed(id), anywhere + strayed);
    }
    found
}

/// The probability that a sensor does not report a train that should have passed it, of which sensors miss a share.
pub(super) const fn missed_or_elsewhere(missed_share: f64) -> f64 {
    missed_share + CHANGED + STRAYED
}

/// Whether a train moved in the window or just before it; a train at rest causes no detection.
fn may_have_moved(
    train: &DrivenTrain,
    context: TrackContext<'_>,
    now: Timestamp,
    window: DetectionWindow,
) -> bool {
    if train.may_move(context, now) {
        return true;
    }
    let before = train.located(context, window.after - REST_TIME_ERROR);
    before.is_some_and(|before| !before.at_rest)
}

/// ln of the density (1/s) with which a train of unknown position reaches one sensor: its speed over the length of
/// all track, both directions.
fn log_density_if_lost(train: &DrivenTrain, context: TrackContext<'_>) -> f64 {
    let speed = train.model.steady_speed(train.commanded, Approach::Below).as_m_per_s();
    let track: f64 = context.layout.edges().map(|(_, edge)| edge.length.as_m()).sum();
    let track = if track > 0.0 { track } else { UNKNOWN_TRACK_M };
    libm::log(speed.max(f64::MIN_POSITIVE) / track)
}

/// The turnouts that a train will soon pass from the toe, each with the leg that it is not set for.
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
