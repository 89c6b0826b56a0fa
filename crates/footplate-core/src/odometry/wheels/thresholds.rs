//! Where detection and correction draw their lines, each with a default that follows from the vehicle.

use super::vehicle::VehicleError;
use crate::time::TimeSpan;
use crate::units::{Acceleration, Speed};

/// How much beyond what the train can do a wheelset has to accelerate to be slipping (m/s²): the noise of the fast
/// wheel filter at 80 teeth.
const BEYOND_THE_TRAIN_M_PER_S2: f64 = 0.4;

/// The lines that detection and correction draw.
///
/// Two roles are kept apart that are often one number: the acceleration at which a slide is *detected* is beyond
/// what the train can do; the one that *corrects* lies between what low adhesion gives and what the train can do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Thresholds {
    /// A wheelset that accelerates more is slipping.
    pub slip_acceleration: Acceleration,
    /// A wheelset that decelerates more is sliding.
    pub slide_deceleration: Acceleration,
    /// Creepage, as part of the larger speed, beyond which a wheelset slips or slides.
    pub creepage: f64,
    /// Creepage that a fully braked wheelset can have while it rolls and keeps up with the other; in proportion below.
    pub rolling_creepage: f64,
    /// Least difference to the train for the test of creepage.
    pub creepage_floor: Speed,
    /// Difference between the wheelsets beyond which at least one of them slips or slides ...
    pub difference: Speed,
    /// ... or this part of the speed, whichever is larger.
    pub difference_ratio: f64,
    /// Below this speed there is no test of ratios.
    pub slowest_ratio: Speed,
    /// How long a symptom has to last to count.
    pub raise_after: TimeSpan,
    /// How long a wheelset has to roll to be trusted again.
    pub clear_after: TimeSpan,
    /// How fast the corrected speed falls in a slide.
    pub correction: Acceleration,
    /// How fast it falls when both wheelsets are locked.
    pub lock_correction: Acceleration,
    /// After so much correction without a wheelset that rolls, the speed is ambiguous.
    pub longest_correction: TimeSpan,
    /// What the train decelerates at least while both wheelsets slide, downhill included; nothing is claimed at 0.
    pub least_sliding_deceleration: Acceleration,
}

impl Thresholds {
    /// The lines for a train that can do so much.
    #[must_use]
    pub fn derived(max_traction: Acceleration, max_brake: Acceleration) -> Self {
        let beyond = Acceleration::from_m_per_s2(BEYOND_THE_TRAIN_M_PER_S2);
        Self {
            slip_acceleration: max_traction + beyond,
            slide_deceleration: max_brake + beyond,
            // Beyond the peak of adhesion on dry rail and near it on wet rail (Polach).
            creepage: 0.08,
            // Full braking on wet rail uses a third of the adhesion, and creeps by a fifth of where that peaks (Polach).
            rolling_creepage: 0.016,
            creepage_floor: Speed::from_m_per_s(0.3),
            difference: Speed::from_m_per_s(1.0),
            difference_ratio: 0.025,
            slowest_ratio: Speed::from_m_per_s(1.0),
            raise_after: TimeSpan::from_ms(100),
            clear_after: TimeSpan::from_ms(1000),
            correction: Acceleration::from_m_per_s2(0.6),
            lock_correction: Acceleration::from_m_per_s2(0.3),
            longest_correction: TimeSpan::from_s(75.0),
            least_sliding_deceleration: Acceleration::ZERO,
        }
    }

    pub(super) fn check(&self) -> Result<(), VehicleError> {
        let within = |key, value: f64, highest: f64| {
            let fits = (0.0..=highest).contains(&value);
            if fits { Ok(()) } else { Err(VehicleError { key, value, lowest: 0.0, highest }) }
        };
        within("slip_acceleration_m_s2", self.slip_acceleration.as_m_per_s2(), 50.0)?;
        within("slide_deceleration_m_s2", self.slide_deceleration.as_m_per_s2(), 50.0)?;
        within("creepage", self.creepage, 1.0)?;
        within("rolling_creepage", self.rolling_creepage, 1.0)?;
        within("creepage_floor_m_s", self.creepage_floor.as_m_per_s(), 10.0)?;
        within("difference_m_s", self.difference.as_m_per_s(), 50.0)?;
        within("difference_ratio", self.difference_ratio, 1.0)?;
        within("slowest_ratio_m_s", self.slowest_ratio.as_m_per_s(), 50.0)?;
        within("raise_after_s", self.raise_after.as_s(), 10.0)?;
        within("clear_after_s", self.clear_after.as_s(), 60.0)?;
        within("correction_m_s2", self.correction.as_m_per_s2(), 5.0)?;
        within("lock_correction_m_s2", self.lock_correction.as_m_per_s2(), 5.0)?;
        within("longest_correction_s", self.longest_correction.as_s(), 3600.0)?;
        within("least_sliding_deceleration_m_s2", self.least_sliding_deceleration.as_m_per_s2(), 5.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wheelset_slips_or_slides_beyond_what_the_train_can_do_by_the_noise_of_the_filter() {
        let derived = Thresholds::derived(Acceleration::from_m_per_s2(1.2), Acceleration::from_m_per_s2(1.4));
        // 1.2 + 0.4 and 1.4 + 0.4 m/s².
        assert!((derived.slip_acceleration.as_m_per_s2() - 1.6).abs() < 1e-12, "{derived:?}");
        assert!((derived.slide_deceleration.as_m_per_s2() - 1.8).abs() < 1e-12, "{derived:?}");
    }
}
