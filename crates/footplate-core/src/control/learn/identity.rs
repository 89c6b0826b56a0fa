//! Whether the train is the one of earlier sessions: its speeds beside those known before.

use alloc::vec::Vec;

use super::accuracy::steps;
use super::planner::KNOWN_FROM;
use crate::event::Approach;
use crate::ids::{NodeId, SpeedStep};
use crate::model::MotionModel;
use crate::time::Timestamp;
use crate::units::Speed;

/// Speeds of one train differ by 2 % from session to session (one standard deviation, published logs); beyond this it is
/// another engine, or its decoder was set anew.
const SAME_TRAIN: f64 = 0.10;

/// The number of hops that are compared.
const COMPARED: usize = 6;

/// A passage of a sensor: its node, its time, and the step.
pub(super) type Passage = (NodeId, Timestamp, SpeedStep);

/// The speeds of earlier sessions, and the ratios to them in this one.
#[derive(Debug, Clone, Default)]
pub(super) struct Identity {
    before: Vec<(SpeedStep, Speed)>,
    ratios: Vec<f64>,
    at: Option<Passage>,
}

impl Identity {
    /// Takes in what is known before the session.
    pub(super) fn of(model: &MotionModel) -> Self {
        let known = steps(model).filter_map(|step| {
            let speed = model.speed(step, Approach::Below);
            (speed.count >= KNOWN_FROM).then_some((step, speed.value))
        });
        Self { before: known.collect(), ..Self::default() }
    }

    /// The median of the ratios, once there are enough of them.
    fn ratio(&self) -> Option<f64> {
        let mut sorted = self.ratios.clone();
        sorted.sort_by(f64::total_cmp);
        (sorted.len() >= COMPARED).then(|| sorted.get(sorted.len() / 2).copied())?
    }

    /// Takes in a passage at a steady speed, `None` for any other. Returns the node and time of the passage before, and the known
    /// speed, if the step was the same.
    pub(super) fn advance(&mut self, here: Option<Passage>) -> Option<(NodeId, Timestamp, Speed)> {
        let before = core::mem::replace(&mut self.at, here);
        let ((from, since, earlier), (_, _, step)) = (before?, here?);
        let (_, known) = self.before.iter().find(|(known, _)| *known == step)?;
        (earlier == step).then_some((from, since, *known))
    }

    /// Takes in the speed of a hop divided by the known one. Returns the median of the ratios if it is another train's; then
    /// nothing more is compared.
    pub(super) fn compare(&mut self, ratio: f64) -> Option<f64> {
        self.ratios.push(ratio);
        let ratio = self.ratio()?;
        *self = Self::default();
        ((ratio - 1.0).abs() > SAME_TRAIN).then_some(ratio)
    }
}
