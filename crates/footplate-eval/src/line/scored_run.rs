//! One simulated run through every odometer, with their scores.

use footplate_core::odometry::WheelState;
use footplate_core::{TimeSpan, Timestamp};
use footplate_sim::line::{LineRun, WheelTruth};
use footplate_store::odometry::{
    OdometryRun, OdometryScore, Preset, Rival, RunContext, RunScores, simulated_rows, simulated_vehicle,
};

/// How long a wheel has to roll before a flag on it is false: a second until it is trusted again, as vehicles require, and a
/// second of tolerance.
const ROLLS_FOR: TimeSpan = TimeSpan::from_ms(2000);

/// An odometer that is scored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Odometer {
    Ours(Preset),
    Theirs(Rival),
}

/// One run with the scores of every odometer.
pub struct ScoredRun {
    /// Which of the families it is of.
    pub family: usize,
    /// Its seed.
    pub seed: u64,
    /// Pulses per revolution of both tachometers.
    pub teeth: u32,
    pub(crate) scores: RunScores,
    pub(crate) flags: FalseFlags,
}

/// Periods in which the recommended preset flags a wheel that rolls.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct FalseFlags {
    periods: u64,
    flagged: u64,
}

impl Odometer {
    /// All of them, in the order of tables.
    pub(crate) const ALL: [Self; 5] = [
        Self::Ours(Preset::Recommended),
        Self::Ours(Preset::Paper),
        Self::Theirs(Rival::RawMean),
        Self::Theirs(Rival::RawMax),
        Self::Theirs(Rival::WheelsOnly),
    ];

    pub(crate) const fn key(self) -> &'static str {
        match self {
            Self::Ours(preset) => preset.key(),
            Self::Theirs(rival) => rival.key(),
        }
    }

    pub(crate) const fn title(self) -> &'static str {
        match self {
            Self::Ours(preset) => preset.key(),
            Self::Theirs(rival) => rival.title(),
        }
    }

    /// Its score.
    pub(crate) fn score(self, scores: &RunScores) -> OdometryScore {
        match self {
            Self::Ours(preset) => scores.preset(preset),
            Self::Theirs(wanted) => scores
                .rivals()
                .find(|(rival, _)| *rival == wanted)
                .map_or_else(OdometryScore::default, |(_, score)| score),
        }
    }
}

impl FalseFlags {
    fn see(&mut self, flag: WheelState, rolls_for: TimeSpan) {
        if rolls_for >= ROLLS_FOR {
            self.periods += 1;
            self.flagged += u64::from(matches!(flag, WheelState::Spin | WheelState::Slide));
        }
    }

    pub(crate) fn merge(&mut self, other: Self) {
        self.periods += other.periods;
        self.flagged += other.flagged;
    }

    /// Share of all periods of wheels that roll (%).
    pub(crate) fn pct(self) -> Option<f64> {
        (self.periods > 0).then(|| 100.0 * self.flagged as f64 / self.periods as f64)
    }
}

impl ScoredRun {
    /// Walks the run of a seed with every odometer.
    ///
    /// # Errors
    /// When its vehicle is one that no railway has.
    pub fn new(family: usize, seed: u64, teeth: u32, run: &LineRun) -> anyhow::Result<Self> {
        let vehicle = simulated_vehicle(&run.vehicle)?.vehicle;
        let context = RunContext::new(vehicle, Preset::Recommended, true);
        let mut odometry = OdometryRun::new(&context)?;
        let mut flags = FalseFlags::default();
        let mut rolls_since: [Option<Timestamp>; 2] = [None; 2];
        for ((period, known), truth) in simulated_rows(run).zip(&run.truth) {
            let estimate = odometry.step(&period, || known);
            for ((since, does), flag) in rolls_since.iter_mut().zip(truth.wheels).zip(estimate.wheels) {
                *since = since.or(Some(period.time)).filter(|_| does == WheelTruth::Rolling);
                flags.see(flag, since.map_or(TimeSpan::ZERO, |since| period.time - since));
            }
        }
        let scores = odometry.scores().cloned();
        let scores = scores.ok_or_else(|| anyhow::anyhow!("a run that was to be scored has no score"))?;
        Ok(Self { family, seed, teeth, scores, flags })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_flag_is_false_on_a_wheel_that_has_rolled_for_two_seconds() {
        let mut flags = FalseFlags::default();
        assert_eq!(flags.pct(), None);
        flags.see(WheelState::Slide, TimeSpan::from_ms(1950));
        flags.see(WheelState::Slide, TimeSpan::from_ms(2000));
        flags.see(WheelState::Rolling, TimeSpan::from_ms(2050));
        flags.see(WheelState::Excluded, TimeSpan::from_ms(2050));
        flags.see(WheelState::Spin, TimeSpan::from_ms(2050));
        assert_eq!(flags.pct(), Some(50.0));
    }
}
