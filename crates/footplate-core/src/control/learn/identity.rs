//! Whether the train is the one of earlier sessions: its speeds beside those known before.

use alloc::vec::Vec;

use super::accuracy::steps;
use super::calibrator::Calibrator;
use super::notice::Fault;
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

/// The speeds of earlier sessions, and the ratios to them in this one.
#[derive(Debug, Clone, Default)]
pub(super) struct Identity {
    before: Vec<(SpeedStep, Speed)>,
    ratios: Vec<f64>,
    at: Option<(NodeId, Timestamp, SpeedStep)>,
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
}

impl Calibrator<'_> {
    /// The train passed a sensor: compares its mean speed since the last one, if it was steady, with that of before.
    pub(super) fn compare_speed(&mut self, now: Timestamp, missed: usize, at: Timestamp) {
        if self.identity.before.is_empty() {
            return;
        }
        let step = self.throttle.step;
        let is_steady = now >= self.steady_at && self.requested.is_none();
        let here = self.tracker.last().filter(|_| is_steady).map(|node| (node, at, step));
        let before = core::mem::replace(&mut self.identity.at, here);
        let (Some((from, since, earlier)), Some((to, ..))) = (before, here) else { return };
        let known = self.identity.before.iter().find(|(known, _)| *known == step).map(|(_, speed)| *speed);
        let (Some(known), Some(hop), true) = (known, self.only_hop(from, to), earlier == step && missed == 0)
        else {
            return;
        };
        let speed = self.model().length(&self.sections, &hop)[0] / (at - since);
        self.identity.ratios.push(speed / known);
        if let Some(ratio) = self.identity.ratio() {
            self.identity = Identity::default();
            if (ratio - 1.0).abs() > SAME_TRAIN {
                self.report_fault(Fault::OtherSpeeds { ratio });
            }
        }
    }
}
