//! The moment at which a speed was farthest from the truth: what the train really did then, and what the odometer took it to do.

use footplate_core::odometry::{Mode, MotionEstimate};
use footplate_core::{Acceleration, TimeSpan, Timestamp};
use footplate_sim::line::{LineTruth, WheelTruth};

use super::world_score::WheelPhase;

/// The moment of the largest speed error of the recommended preset.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WorstMoment {
    /// When.
    pub time: Timestamp,
    /// Its speed less the true one (m/s).
    pub error_m_s: f64,
    /// The phase.
    pub phase: WheelPhase,
    /// The mode of the estimate.
    pub mode: Mode,
    /// The acceleration that the odometer estimated.
    pub estimated: Acceleration,
    /// What train, wheels and rail really did.
    pub truth: LineTruth,
    /// For how long each wheelset had not rolled.
    pub slipping_for: [TimeSpan; 2],
    /// The command, as far as it was recorded.
    pub command: Option<f64>,
    /// What the second sensor reported (pulses), if it was dead or stuck.
    pub faulty_count: Option<i64>,
}

/// Watches a run for its worst moment.
#[derive(Debug, Clone, Default)]
pub(super) struct WorstWatch {
    not_rolling_since: [Option<Timestamp>; 2],
    pub(super) worst: Option<WorstMoment>,
}

impl WorstWatch {
    /// Takes in a period.
    pub(super) fn see(
        &mut self,
        estimate: &MotionEstimate,
        truth: &LineTruth,
        phase: WheelPhase,
        command: Option<f64>,
        faulty_count: Option<i64>,
    ) {
        for (since, does) in self.not_rolling_since.iter_mut().zip(truth.wheels) {
            *since = since.or(Some(estimate.time)).filter(|_| does != WheelTruth::Rolling);
        }
        let error_m_s = (estimate.speed - truth.speed).as_m_per_s();
        if self.worst.is_some_and(|worst| error_m_s.abs() <= worst.error_m_s.abs()) {
            return;
        }
        self.worst = Some(WorstMoment {
            time: estimate.time,
            error_m_s,
            phase,
            mode: estimate.mode,
            estimated: estimate.acceleration,
            truth: *truth,
            slipping_for: self
                .not_rolling_since
                .map(|since| since.map_or(TimeSpan::ZERO, |since| estimate.time - since)),
            command,
            faulty_count,
        });
    }
}
