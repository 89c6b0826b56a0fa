//! How well one half of a profile predicts the other half.
//!
//! Entries by throttle setting, every second one held out. The motion model's prior and the other half predict each with an
//! interval that contains the stated speed nineteen times in twenty if the stated uncertainty is true. Then the halves change places.

use footplate_core::model::{MotionFit, StatedMotion, StatedSpeed};
use footplate_core::{HALF_95, SpeedStep, TrainId};

use super::profile::SpeedProfile;

/// The score of one profile.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct HoldOut {
    /// Speeds that were predicted.
    pub predicted: usize,
    /// Those inside the interval of 95 %.
    pub inside: usize,
    /// Gross errors: more than five standard deviations from the prediction.
    pub gross: usize,
}

impl HoldOut {
    /// Adds the score of another profile.
    pub fn add(&mut self, other: &Self) {
        *self = Self {
            predicted: self.predicted + other.predicted,
            inside: self.inside + other.inside,
            gross: self.gross + other.gross,
        };
    }

    /// Scores a profile for a decoder with this highest step.
    pub fn of(profile: &SpeedProfile, highest: SpeedStep) -> Self {
        let (motion, _) = profile.stated();
        let mut speeds = motion.speeds.clone();
        speeds.sort_by(|one, other| one.throttle.total_cmp(&other.throttle));
        // Forward and reverse of one setting stay together.
        let mut settings: Vec<Vec<StatedSpeed>> = Vec::new();
        for speed in speeds {
            match settings.last_mut() {
                Some(last) if last.first().is_some_and(|one| one.throttle == speed.throttle) => {
                    last.push(speed);
                }
                _ => settings.push(vec![speed]),
            }
        }
        let mut score = Self::default();
        for held_out in [0, 1] {
            let half = |of: usize| {
                settings
                    .iter()
                    .enumerate()
                    .filter(move |(at, _)| at % 2 == of)
                    .flat_map(|(_, speeds)| speeds)
                    .copied()
            };
            let known = StatedMotion { speeds: half(1 - held_out).collect(), ..motion.clone() };
            let asked: Vec<StatedSpeed> = half(held_out).collect();
            let fit = MotionFit::new(TrainId(0), highest);
            for compared in fit.compare_stated(&known, &asked).into_iter().flatten() {
                score.predicted += 1;
                score.inside += usize::from(compared.sigmas.abs() <= HALF_95);
                score.gross += usize::from(compared.is_gross());
            }
        }
        score
    }
}
