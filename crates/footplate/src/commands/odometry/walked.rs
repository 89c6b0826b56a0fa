//! What all recordings of one call come to, and whether that is good enough.

use footplate_store::odometry::{OdometryScore, Preset, RunScores};

use super::recording::WalkedRecording;
use crate::commands::web_page::Language;

/// Least share of periods whose true speed has to lie within the interval (per cent): that it holds is promised for
/// all but one period in ten thousand.
const SPEED_INSIDE_PCT: f64 = 99.99;

/// What all recordings of one call come to.
pub(super) struct Walked {
    /// What people call the vehicle.
    pub(super) vehicle: String,
    pub(super) preset: Preset,
    pub(super) recordings: Vec<WalkedRecording>,
    /// In which a page says it.
    pub(super) language: Language,
    /// Whether a score was asked for; a page has one wherever the truth is known.
    pub(super) is_scored: bool,
}

impl Walked {
    /// The scores of all runs together, if that was asked for.
    pub(super) fn scores(&self) -> Option<RunScores> {
        if self.is_scored { self.known_scores() } else { None }
    }

    /// The scores of all runs whose truth is known.
    pub(super) fn known_scores(&self) -> Option<RunScores> {
        let runs = self.recordings.iter().flat_map(|recording| &recording.runs);
        let mut scores = runs.filter_map(|run| run.odometry.scores());
        let mut all = scores.next()?.clone();
        for scores in scores {
            all.merge(scores);
        }
        Some(all)
    }

    /// Whether the truth left the intervals more often than they promise.
    pub(super) fn falls_short(&self) -> bool {
        self.scores().is_some_and(|scores| leaves_bounds(&scores.preset(self.preset)))
    }
}

/// Whether the truth left the intervals of speed and distance more often than they promise.
pub(super) fn leaves_bounds(score: &OdometryScore) -> bool {
    score.speed_inside_pct.is_some_and(|share| share < SPEED_INSIDE_PCT)
        || score.distance_inside_pct.is_some_and(|share| share < 100.0)
}
