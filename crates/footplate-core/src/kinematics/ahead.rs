//! A profile's problem, mirrored so that the train runs forwards from distance 0.

use super::limits::{Limits, ProfileError};
use super::motion::MotionState;
use crate::units::{Length, Speed};

/// Current and target state of a train, in plain SI numbers.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ahead {
    /// 1, or −1 where the target lies at the smaller distance.
    pub(super) direction: f64,
    /// Speed and acceleration now.
    pub(super) speed: f64,
    pub(super) acceleration: f64,
    /// Distance to the target, and the speed there.
    pub(super) distance: f64,
    pub(super) target_speed: f64,
}

/// Largest accumulated rounding of a state, in units in the last place.
pub(super) const ROUNDINGS: f64 = 16.0;

impl Ahead {
    #[inline(always)]
    pub(super) fn new(current: &MotionState, target: &MotionState) -> Self {
        let difference = (target.distance - current.distance).as_m();
        // At zero distance, the speeds decide which direction is ahead.
        let back = difference < 0.0 || (difference == 0.0 && current.speed + target.speed < Speed::ZERO);
        let direction = if back { -1.0 } else { 1.0 };
        Self {
            direction,
            speed: direction * current.speed.as_m_per_s(),
            acceleration: direction * current.acceleration.as_m_per_s2(),
            distance: direction * difference,
            target_speed: direction * target.speed.as_m_per_s(),
        }
    }

    /// Whether [`check`](Self::check) would succeed, at the least cost. Every comparison with NaN is false.
    #[inline(always)]
    pub(super) fn is_sound(&self, limits: &Limits) -> bool {
        let highest = limits.speed.as_m_per_s();
        let (speeding, braking) = (limits.acceleration.as_m_per_s2(), limits.deceleration.as_m_per_s2());
        let sum = self.distance.abs() + self.speed + self.acceleration.abs() + (highest + speeding + braking);
        sum < f64::INFINITY
            && highest > 0.0
            && speeding > 0.0
            && braking > 0.0
            && self.speed >= 0.0
            && self.target_speed >= 0.0
            && self.target_speed <= highest
    }

    /// Rejects limits and states that no kind of profile accepts.
    pub(super) fn check(
        &self,
        current: &MotionState,
        target: &MotionState,
        limits: &Limits,
    ) -> Result<(), ProfileError> {
        let rates = [
            ("speed", limits.speed.as_m_per_s()),
            ("acceleration", limits.acceleration.as_m_per_s2()),
            ("deceleration", limits.deceleration.as_m_per_s2()),
        ];
        for (limit, found) in rates {
            if !(found > 0.0 && found.is_finite()) {
                return Err(ProfileError::NoLimit { limit, found });
            }
        }
        for &found in [current, target] {
            let MotionState { distance, speed, acceleration } = found;
            if !(distance.is_finite() && speed.is_finite() && acceleration.is_finite()) {
                return Err(ProfileError::NotFinite { found });
            }
        }
        if self.speed < 0.0 {
            return Err(ProfileError::MovesAway { found: current.speed });
        }
        if !(0.0..=limits.speed.as_m_per_s()).contains(&self.target_speed) {
            return Err(ProfileError::TargetSpeed { found: target.speed, highest: limits.speed });
        }
        Ok(())
    }

    /// Rejects a target that is nearer than `shortest` by more than rounding, the `grain`.
    pub(super) fn refuse_nearer_than(&self, shortest: f64, grain: f64) -> Result<(), ProfileError> {
        if self.distance < shortest - grain {
            let (found, shortest) = (Length::from_m(self.distance), Length::from_m(shortest));
            return Err(ProfileError::TooNear { found, shortest });
        }
        Ok(())
    }
}

/// The precision of a distance computed from two states.
pub(super) fn grain(current: &MotionState, target: &MotionState) -> f64 {
    ROUNDINGS * f64::EPSILON * current.distance.abs().max(target.distance.abs()).as_m()
}
