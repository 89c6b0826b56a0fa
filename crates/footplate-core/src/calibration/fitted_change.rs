//! A change of speed as the fitted law of its train has it, laid through the contacts that were measured.

use alloc::vec::Vec;

use super::calibrate::{Calibration, step_table};
use super::law_fit::{FittedLaw, LawKind, at, motion, residuals};
use super::transient::Transient;
use crate::kinematics::{Motion, MotionState, StepTable};
use crate::time::TimeSpan;
use crate::units::{Acceleration, Length, Speed};

/// Half the time over which the speed of a look-up table is differenced for its acceleration (s): short beside a
/// change, long beside rounding.
const HALF_DIFFERENCE_S: f64 = 0.05;

/// A law through the contacts of one change.
#[derive(Debug, Clone, PartialEq)]
pub struct FittedChange {
    /// The law at the times asked for; distance counts from the first contact of the change.
    pub states: Vec<MotionState>,
    /// How far beyond the law each contact lies.
    pub residuals: Vec<Length>,
}

impl Calibration {
    /// The law that was found for the direction of a change, through its contacts: where the train was at the
    /// command is fitted (x₀ of the law fit). `times` are since the command. `None` where no law was found.
    #[must_use]
    pub fn fitted_change(&self, change: &Transient, times: &[TimeSpan]) -> Option<FittedChange> {
        let comparison = self.laws.get(&(change.train, change.direction()))?;
        let law = comparison.laws.get(comparison.best)?;
        let table = step_table(&self.fit, change.train);
        let state = |since: f64| law_state(law, change, table.as_ref(), since);
        let ways: Vec<(f64, f64)> = change
            .points
            .iter()
            .map(|point| {
                state(point.since_command).map(|state| (state.distance.as_m(), state.speed.as_m_per_s()))
            })
            .collect::<Option<_>>()?;
        let off = residuals(&ways, change);
        // Every contact has the same x₀; the first tells it.
        let (first, (way, _)) = (change.points.first()?, ways.first()?);
        let x0 = Length::from_m(first.way - way - off.first()?.1);
        let placed = |state: MotionState| MotionState { distance: state.distance + x0, ..state };
        Some(FittedChange {
            states: times.iter().map(|time| state(time.as_s()).map(placed)).collect::<Option<_>>()?,
            residuals: off.into_iter().map(|(_, metres)| Length::from_m(metres)).collect(),
        })
    }
}

/// The state at a time since the command (s); distance counts from where the law takes effect.
fn law_state(
    law: &FittedLaw,
    change: &Transient,
    table: Option<&StepTable>,
    since_command: f64,
) -> Option<MotionState> {
    if let (LawKind::Table, Some(curve)) = (law.kind, &law.curve) {
        let speed = |time: f64| curve.at(change.speeds, time).1;
        let gained = speed(since_command + HALF_DIFFERENCE_S) - speed(since_command - HALF_DIFFERENCE_S);
        let (way, now) = curve.at(change.speeds, since_command);
        return Some(MotionState {
            distance: Length::from_m(way),
            speed: Speed::from_m_per_s(now),
            acceleration: Acceleration::from_m_per_s2(gained / (2.0 * HALF_DIFFERENCE_S)),
        });
    }
    let [pace, _] = law.pace;
    let [delay, _] = law.delay;
    let motion = motion(law.kind, pace, change, table)?;
    let since_effect = since_command - delay;
    let (way, speed) = at(&motion, change.speeds[0].as_m_per_s(), since_effect);
    let acceleration = if since_effect <= 0.0 {
        Acceleration::ZERO
    } else {
        motion.state_at(TimeSpan::from_s(since_effect)).acceleration
    };
    Some(MotionState { distance: Length::from_m(way), speed: Speed::from_m_per_s(speed), acceleration })
}
