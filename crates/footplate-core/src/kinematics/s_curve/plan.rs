//! Selects the jerk-limited profile that leads to a target.
//!
//! With decreasing distance, from the most common to the rarest:
//!
//! 1. accelerate to the limit, cruise, decelerate to the target's speed;
//! 2. the same with a lower peak and no cruise;
//! 3. decelerate at once; below that distance the target cannot be reached at its speed.
//!
//! A train that already brakes has a case between 2 and 3: it eases off, but not to zero, and brakes on. A train
//! above the speed limit decelerates to it instead of accelerating, or only as far as the distance allows.

use super::peak::{Gains, Run, peak_from_rest_to_rest};
use super::ramp::{Level, Opening, Ramp, Rate};
use crate::kinematics::ahead::{Ahead, ROUNDINGS};
use crate::kinematics::bracket::crossing;
use crate::kinematics::limits::{Limits, ProfileError};
use crate::units::Acceleration;

/// Largest relative excess of the present state over its limits that counts as rounding.
const ROUNDING: f64 = 1e-12;

/// An opening, a cruise at its final speed, and the slowing down after it.
pub(super) struct Plan {
    pub(super) opening: Opening,
    pub(super) cruises: bool,
    /// From the speed at which acceleration is zero, before the opening's end in the rare case of easing off.
    pub(super) closing: Ramp,
    /// Time and distance from the end of the opening to that point.
    pub(super) level: (f64, f64),
}

impl Plan {
    /// From standstill to standstill, if the problem is valid: the most common problem has a path of its own, which
    /// calculates nothing that is zero.
    #[inline(always)]
    pub(super) fn from_rest_to_rest(ahead: &Ahead, limits: &Limits) -> Option<Self> {
        let jerk = limits.jerk.as_m_per_s3();
        let stands = ahead.speed == 0.0 && ahead.acceleration == 0.0 && ahead.target_speed == 0.0;
        let per_jerk = 1.0 / jerk;
        if !(stands && ahead.is_sound(limits) && jerk > 0.0 && per_jerk > 0.0) {
            return None;
        }
        let speeding = Rate::new(limits.acceleration.as_m_per_s2(), jerk, per_jerk);
        let braking = Rate::new(limits.deceleration.as_m_per_s2(), jerk, per_jerk);
        let peak = peak_from_rest_to_rest(ahead.distance, limits.speed.as_m_per_s(), &speeding, &braking);
        let opening = Opening::from_rest(peak, &speeding);
        Some(Self { opening, cruises: true, closing: Ramp::new(0.0, peak, &braking), level: (0.0, 0.0) })
    }
}

/// A problem with its limits, in plain SI numbers.
pub(super) struct Planner {
    ahead: Ahead,
    highest: f64,
    speeding: Rate,
    braking: Rate,
    /// The state at which acceleration was or will be zero if the train eases off from braking or continues to
    /// accelerate.
    level: Level,
    /// Speed once the present acceleration has been brought to zero.
    leveled: f64,
}

impl Planner {
    #[inline(always)]
    pub(super) fn new(ahead: &Ahead, limits: &Limits) -> Self {
        let Ahead { acceleration, speed, target_speed, .. } = *ahead;
        let jerk = limits.jerk.as_m_per_s3();
        let per_jerk = 1.0 / jerk;
        let mut level = Level::new(speed, acceleration, per_jerk);
        let mut leveled = speed + 0.5 * acceleration * acceleration.abs() * per_jerk;
        // A train that is about to arrive reaches acceleration zero exactly at the target's speed. The time to correct
        // a difference from rounding would grow with its square root.
        let difference = leveled - target_speed;
        if difference.abs() <= ROUNDING * speed {
            level.speed -= difference;
            leveled = target_speed;
        }
        Self {
            ahead: *ahead,
            highest: limits.speed.as_m_per_s(),
            speeding: Rate::new(limits.acceleration.as_m_per_s2(), jerk, per_jerk),
            braking: Rate::new(limits.deceleration.as_m_per_s2(), jerk, per_jerk),
            level,
            leveled,
        }
    }

    /// Whether it is a valid problem of the first two cases, by far the most common. Every comparison with NaN is
    /// false.
    #[inline(always)]
    pub(super) fn is_ordinary(&self) -> bool {
        let Self { ahead: Ahead { acceleration, distance, .. }, highest, leveled, .. } = *self;
        let (speeding, braking) = (self.speeding.limit, self.braking.limit);
        let lowest = self.lowest();
        self.speeding.jerk > 0.0
            && self.speeding.per_jerk > 0.0
            && acceleration <= speeding
            && -acceleration <= braking
            && leveled >= 0.0
            && leveled <= highest
            && (lowest == 0.0 || distance >= self.shortest(lowest))
    }

    /// Rejects an invalid problem, and corrects rounding.
    pub(super) fn checked(mut self, direction: f64) -> Result<Self, ProfileError> {
        let Ahead { acceleration, speed, .. } = self.ahead;
        let (speeding, braking, jerk) = (self.speeding.limit, self.braking.limit, self.speeding.jerk);
        if !(jerk > 0.0 && jerk.is_finite()) {
            return Err(ProfileError::NoLimit { limit: "jerk", found: jerk });
        }
        let found = Acceleration::from_m_per_s2(direction * acceleration);
        if acceleration > speeding * (1.0 + ROUNDING) || -acceleration > braking * (1.0 + ROUNDING) {
            return Err(ProfileError::BeyondLimits { found });
        }
        self.ahead.acceleration = acceleration.max(-braking).min(speeding);
        if self.leveled < -ROUNDING * speed {
            return Err(ProfileError::AtRestFirst { found });
        }
        self.leveled = self.leveled.max(0.0);
        self.level.speed = if acceleration < 0.0 { self.leveled } else { self.level.speed };
        Ok(self)
    }

    /// The plan of an ordinary problem.
    #[inline(always)]
    pub(super) fn ordinary(&self) -> Plan {
        let run = self.run();
        self.speed_up(run.gains_for(self.ahead.distance - self.level.distance, self.lowest(), self.highest))
    }

    /// The plan of any problem, if there is one. Distances are as precise as their `grain`.
    pub(super) fn any(&self, grain: f64) -> Result<Plan, ProfileError> {
        if self.leveled > self.highest {
            return self.slow_down_to_limit(grain);
        }
        let shortest = self.shortest(self.lowest());
        if self.ahead.distance < shortest {
            if self.ahead.acceleration < 0.0 && self.ahead.target_speed < self.leveled {
                return self.ease_off(grain);
            }
            self.refuse_nearer_than(shortest, grain)?;
        }
        Ok(self.ordinary())
    }

    /// The lowest possible peak.
    #[inline(always)]
    fn lowest(&self) -> f64 {
        if self.leveled > self.ahead.target_speed { self.leveled } else { self.ahead.target_speed }
    }

    /// To the target's speed at once, over whatever distance it takes.
    pub(super) fn at_once(&self) -> Plan {
        let target_speed = self.ahead.target_speed;
        let plan = if target_speed >= self.leveled {
            self.speed_up(self.run().gains_to(target_speed))
        } else {
            self.slow_down(target_speed)
        };
        Plan { cruises: false, ..plan }
    }

    /// Speeding up from the state of zero acceleration, and slowing down to the target's speed.
    #[inline(always)]
    fn run(&self) -> Run {
        Run {
            start: self.level.speed,
            end: self.ahead.target_speed,
            speeding: self.speeding,
            braking: self.braking,
        }
    }

    /// The distance with the lowest possible peak.
    #[inline(always)]
    fn shortest(&self, lowest: f64) -> f64 {
        let run = self.run();
        self.level.distance + run.distance_and_slope(run.gains_to(lowest)).0
    }

    /// Rejects a target that is nearer than `shortest` by more than rounding. The time to correct a difference of
    /// speed, 2√(v/J), grows with its square root, even if the difference is only rounding.
    fn refuse_nearer_than(&self, shortest: f64, grain: f64) -> Result<(), ProfileError> {
        let speed = self.leveled.max(self.ahead.target_speed);
        let rounding = ROUNDINGS * f64::EPSILON * speed.max(self.ahead.speed);
        let grain = grain + 2.0 * speed * libm::sqrt(rounding * self.braking.per_jerk);
        self.ahead.refuse_nearer_than(shortest, grain)
    }

    #[inline(always)]
    fn speed_up(&self, Gains { first, second }: Gains) -> Plan {
        let Ahead { speed, acceleration, target_speed, .. } = self.ahead;
        let opening = Opening::speeding_up(speed, acceleration, self.level, first, &self.speeding);
        let closing = Ramp::new(target_speed, second, &self.braking);
        Plan { opening, cruises: true, closing, level: (0.0, 0.0) }
    }

    fn slow_down(&self, lower: f64) -> Plan {
        let Ahead { speed, acceleration, target_speed, .. } = self.ahead;
        let opening = Opening::slowing_down(speed, acceleration, lower, &self.braking);
        let closing = Ramp::new(target_speed, lower - target_speed, &self.braking);
        Plan { opening, cruises: true, closing, level: (0.0, 0.0) }
    }

    /// For a train that is above the speed limit, or will be.
    fn slow_down_to_limit(&self, grain: f64) -> Result<Plan, ProfileError> {
        let Ahead { speed, acceleration, distance, target_speed, .. } = self.ahead;
        let level = Level::new(speed, acceleration, -self.braking.per_jerk);
        let distance_by = |lower: f64| {
            let (first, _) = self.braking.distance_and_slope(lower, level.speed - lower);
            let (second, _) = self.braking.distance_and_slope(target_speed, lower - target_speed);
            level.distance + first + second
        };
        if distance_by(self.highest) <= distance {
            return Ok(self.slow_down(self.highest));
        }
        let at_least = distance_by(self.leveled);
        if at_least <= distance {
            return Ok(
                self.slow_down(crossing(self.highest, self.leveled, |lower| distance_by(lower) - distance))
            );
        }
        if acceleration < 0.0 {
            return self.ease_off(grain);
        }
        self.refuse_nearer_than(at_least, grain)?;
        Ok(self.slow_down(self.leveled))
    }

    /// For a train that brakes and would overrun the target if it eased off completely.
    fn ease_off(&self, grain: f64) -> Result<Plan, ProfileError> {
        let Ahead { speed, acceleration, distance, target_speed, .. } = self.ahead;
        let plan_by = |eased: f64| {
            let opening = Opening::easing_off(speed, -acceleration, eased, &self.braking);
            let level = Level::new(opening.end().speed, -eased, -self.braking.per_jerk);
            let closing = Ramp::new(target_speed, level.speed - target_speed, &self.braking);
            Plan { opening, cruises: false, closing, level: (level.time, level.distance) }
        };
        let distance_by = |eased: f64| {
            let Plan { opening, closing, level, .. } = plan_by(eased);
            opening.end().distance + level.1 + closing.distance
        };
        let at_least = distance_by(-acceleration);
        self.refuse_nearer_than(at_least, grain)?;
        Ok(plan_by(crossing(0.0, -acceleration, |eased| distance_by(eased) - distance)))
    }
}
