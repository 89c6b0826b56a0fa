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

#[cfg(test)]
mod tests {
    use alloc::vec;

    use super::*;

    fn step(step: u8) -> SpeedStep {
        SpeedStep::new(step).expect("a step")
    }

    fn known() -> Identity {
        Identity { before: vec![(step(4), Speed::from_mm_per_s(160.0))], ..Identity::default() }
    }

    #[test]
    fn the_median_of_six_ratios_beyond_a_tenth_is_another_train_and_is_said_once() {
        // Sorted 1.0, 1.02, 1.1, 1.11, 1.3, 9: the upper of the middle two.
        for (ratios, expected) in [
            ([9.0, 1.0, 1.11, 1.3, 1.02, 1.1], Some(1.11)),
            ([0.5, 1.0, 0.89, 0.4, 0.88, 0.95], Some(0.89)),
            ([9.0, 1.0, 1.09, 1.3, 1.02, 1.05], None),
            ([0.5, 1.0, 0.91, 0.4, 0.90, 0.95], None),
        ] {
            let mut identity = known();
            let [first @ .., last] = ratios;
            assert!(first.into_iter().all(|ratio| identity.compare(ratio).is_none()));
            assert_eq!(identity.compare(last), expected, "{ratios:?}");
            let passage = Some((NodeId(1), Timestamp::ZERO, step(4)));
            assert!(identity.advance(passage).is_none() && identity.advance(passage).is_none(), "it is over");
        }
    }

    #[test]
    fn two_passages_in_a_row_at_one_known_step_are_compared() {
        let at = |node, seconds, number| Some((NodeId(node), Timestamp::from_s(seconds), step(number)));
        let mut identity = known();
        assert_eq!(identity.advance(at(1, 1.0, 4)), None, "the first");
        let found = identity.advance(at(2, 2.0, 4));
        assert_eq!(found, Some((NodeId(1), Timestamp::from_s(1.0), Speed::from_mm_per_s(160.0))));
        assert_eq!(identity.advance(at(3, 3.0, 5)), None, "not known");
        assert_eq!(identity.advance(at(4, 4.0, 4)), None, "the step has changed");
        assert!(identity.advance(at(5, 5.0, 4)).is_some());
        assert_eq!(identity.advance(None), None, "not steady");
        assert_eq!(identity.advance(at(6, 6.0, 4)), None);
    }
}
