//! A change of speed by the best law of its direction, fitted to its detections.

use alloc::vec::Vec;

use super::law_fit::{FittedLaw, at, motion, residuals};
use super::review::{Review, step_table};
use super::transient::Transient;
use crate::kinematics::{Motion, MotionState, StepTable};
use crate::model::MotionModel;
use crate::time::TimeSpan;
use crate::units::{Acceleration, Length, Speed};

/// A law fitted to the detections of one change.
#[derive(Debug, Clone, PartialEq)]
pub struct FittedChange {
    /// The law at the requested times; distances are from the first detection of the change.
    pub states: Vec<MotionState>,
    /// The distance of each detection beyond the law.
    pub residuals: Vec<Length>,
}

impl Review {
    /// The best law of the direction of a change, fitted to its detections: the position of the train at the command is
    /// fitted (x₀ of the law fit). `times` are since the command. `None` if no law was found.
    pub fn fitted_change(
        &self,
        model: &MotionModel,
        change: &Transient,
        times: &[TimeSpan],
    ) -> Option<FittedChange> {
        let law = self.laws.get(&change.direction())?.laws.first()?;
        let table = step_table(model);
        let state = |since: f64| law_state(law, change, table.as_ref(), since);
        let distances: Vec<(f64, f64)> = change
            .points
            .iter()
            .map(|point| {
                state(point.since_command).map(|state| (state.distance.as_m(), state.speed.as_m_per_s()))
            })
            .collect::<Option<_>>()?;
        let off = residuals(&distances, change);
        // All detections have the same x₀: take it from the first.
        let (first, (distance, _)) = (change.points.first()?, distances.first()?);
        let x0 = Length::from_m(first.distance - distance - off.first()?.1);
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
    let [pace, _] = law.pace;
    let [delay, _] = law.delay;
    let motion = motion(law.kind, pace, change, table)?;
    let since_effect = since_command - delay;
    let (distance, speed) = at(&motion, change.speeds[0].as_m_per_s(), since_effect);
    let acceleration = if since_effect <= 0.0 {
        Acceleration::ZERO
    } else {
        motion.state_at(TimeSpan::from_s(since_effect)).acceleration
    };
    Some(MotionState { distance: Length::from_m(distance), speed: Speed::from_m_per_s(speed), acceleration })
}
