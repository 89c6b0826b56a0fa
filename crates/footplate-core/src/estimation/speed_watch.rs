//! The speed of each step as plain averages see it, beside what the filter makes of it.
//!
//! Every settled hop gives one speed. A running average of power-of-two weight and the extremes of the last
//! few hops follow it without any model: people know them from command stations, a controller without
//! floating point can keep them, and where they leave the filter behind something is wrong with one of both.

use alloc::vec::Vec;

use crate::calibration::{RecentExtremes, ShiftAverage};
use crate::ids::SpeedStep;
use crate::units::Speed;

/// α = 2⁻⁴: about the last sixteen hops count, a lap and a half of a course track.
const SHIFT: u32 = 4;
/// Hops of which the extremes are kept: as many.
const RECENT: usize = 16;
/// Averages count in µm/s.
const MICROMETRES: f64 = 1e6;
/// The standard deviation of normal scatter over its mean distance: √(π/2).
const DEVIATION_OVER_DISTANCE: f64 = 1.253_314_137;

/// One step as plain averages see it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WatchedSpeed {
    /// Running mean.
    pub mean: Speed,
    /// Running standard deviation of single hops.
    pub spread: Speed,
    /// The slowest of the last hops.
    pub slowest: Speed,
    /// The fastest of the last hops.
    pub fastest: Speed,
    /// Hops seen in all.
    pub hops: u32,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Watch {
    average: ShiftAverage,
    extremes: RecentExtremes<RECENT>,
}

/// Plain averages of all steps of a train.
#[derive(Debug, Clone, Default)]
pub(super) struct SpeedWatch {
    /// By step.
    watches: Vec<Option<Watch>>,
}

impl SpeedWatch {
    /// A settled hop at a step was run at this speed (m/s).
    pub(super) fn take(&mut self, step: SpeedStep, speed: f64) {
        let place = usize::from(step.get());
        if self.watches.len() <= place {
            self.watches.resize(place + 1, None);
        }
        if let Some(slot) = self.watches.get_mut(place).filter(|_| speed.is_finite()) {
            let fresh = Watch { average: ShiftAverage::new(SHIFT), extremes: RecentExtremes::default() };
            let watch = slot.get_or_insert(fresh);
            watch.average.take((speed * MICROMETRES) as i64);
            watch.extremes.take(speed);
        }
    }

    /// What is seen of a step; `None` before its first hop.
    pub(super) fn step(&self, step: SpeedStep) -> Option<WatchedSpeed> {
        let watch = self.watches.get(usize::from(step.get()))?.as_ref()?;
        let (slowest, fastest) = watch.extremes.range()?;
        let spread = watch.average.spread() as f64 / MICROMETRES;
        Some(WatchedSpeed {
            mean: Speed::from_m_per_s(watch.average.mean()? as f64 / MICROMETRES),
            spread: Speed::from_m_per_s(DEVIATION_OVER_DISTANCE * spread),
            slowest: Speed::from_m_per_s(slowest),
            fastest: Speed::from_m_per_s(fastest),
            hops: watch.average.count(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_train_that_slows_down_leaves_its_old_extremes_behind() {
        let step = SpeedStep::new(8).unwrap();
        let mut watch = SpeedWatch::default();
        assert_eq!(watch.step(step), None);
        (0..20).for_each(|_| watch.take(step, 0.400));
        (0..20).for_each(|hop| watch.take(step, if hop % 2 == 0 { 0.315 } else { 0.325 }));
        let seen = watch.step(step).unwrap();
        assert_eq!(seen.hops, 40);
        assert!(
            (seen.fastest.as_mm_per_s() - 325.0).abs() < 1e-6
                && (seen.slowest.as_mm_per_s() - 315.0).abs() < 1e-6
        );
        // After twenty hops the old speed still weighs (15/16)²⁰ = 27 %.
        assert!((seen.mean.as_mm_per_s() - (320.0 + 0.275 * 80.0)).abs() < 1.5, "{seen:?}");
    }
}
