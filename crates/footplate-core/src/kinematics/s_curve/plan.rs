//! Which of the possible jerk-limited profiles leads to a target.
//!
//! With the way left falling, from the most common to the rarest:
//!
//! 1. speed up to the limit, cruise, slow down to the target's speed;
//! 2. the same with a lower peak and no cruise;
//! 3. slow down at once; below that way the target cannot be reached at its speed.
//!
//! A train that brakes already has a case between 2 and 3: it eases off, but not to nothing, and brakes on. A
//! train above the limit of speed slows down to it instead of speeding up, or only as far as the way allows.

use super::opening::{Level, Opening};
use super::peak::{Gains, Run};
use super::ramp::{Ramp, way_and_slope};
use crate::kinematics::bracket::crossing;
use crate::kinematics::limits::{Ahead, Limits, ProfileError, ROUNDINGS};
use crate::units::Acceleration;

/// How much the present state may be outside of what is possible before it is more than rounding, relative.
const ROUNDING: f64 = 1e-12;

/// An opening, a cruise at its last speed, and the slowing down after it.
pub(super) struct Plan {
    pub(super) opening: Opening,
    pub(super) cruises: bool,
    /// From the speed at which acceleration is zero, before the opening's end in the rare case of easing off.
    pub(super) closing: Ramp,
    /// Time and way from the end of the opening to that point.
    pub(super) level: (f64, f64),
}

/// A problem with its limits, in plain SI numbers.
pub(super) struct Planner {
    ahead: Ahead,
    highest: f64,
    speeding: f64,
    braking: f64,
    jerk: f64,
    /// Where the present acceleration was or will be zero if the train now eases off from braking or goes on
    /// speeding up.
    level: Level,
    /// Speed when the present acceleration has been brought to zero.
    leveled: f64,
}

impl Planner {
    #[inline]
    pub(super) fn new(ahead: Ahead, limits: &Limits) -> Result<Self, ProfileError> {
        let (speeding, braking) = (limits.acceleration.as_m_per_s2(), limits.deceleration.as_m_per_s2());
        let jerk = limits.jerk.as_m_per_s3();
        if !(jerk > 0.0 && jerk.is_finite()) {
            return Err(ProfileError::NoLimit { limit: "jerk", found: jerk });
        }
        let Ahead { acceleration, speed, .. } = ahead;
        let found = Acceleration::from_m_per_s2(ahead.direction * acceleration);
        if acceleration > speeding * (1.0 + ROUNDING) || -acceleration > braking * (1.0 + ROUNDING) {
            return Err(ProfileError::BeyondLimits { found });
        }
        let acceleration = acceleration.max(-braking).min(speeding);
        let mut level = Level::new(speed, acceleration, jerk);
        let mut leveled =
            if acceleration > 0.0 { speed + 0.5 * acceleration * acceleration / jerk } else { level.speed };
        if leveled < -ROUNDING * speed {
            return Err(ProfileError::StandsFirst { found });
        }
        // A train that is about to arrive levels out at just the target's speed. The smallest difference left
        // by rounding would take as long as its square root to make up.
        let difference = leveled - ahead.target_speed;
        if difference.abs() <= ROUNDING * speed {
            level.speed -= difference;
            leveled = ahead.target_speed;
        }
        let ahead = Ahead { acceleration, ..ahead };
        Ok(Self { ahead, highest: limits.speed.as_m_per_s(), speeding, braking, jerk, level, leveled })
    }

    #[inline]
    pub(super) fn plan(&self) -> Result<Plan, ProfileError> {
        if self.leveled > self.highest {
            return self.slow_down_to_limit();
        }
        let Self { level, ahead: Ahead { way, target_speed, .. }, .. } = *self;
        let lowest = self.leveled.max(target_speed);
        let run = self.run();
        let at_least = if lowest > 0.0 { level.way + run.way_and_slope(run.gains_to(lowest)).0 } else { 0.0 };
        if way < at_least {
            if self.brakes_towards_target() {
                return self.ease_off();
            }
            self.refuse_nearer_than(at_least)?;
        }
        Ok(self.speed_up(run.gains_for(way - level.way, lowest, self.highest)))
    }

    /// The refusal of a target that is nearer than `shortest`, unless by no more than rounding explains: a
    /// speed to make up for takes as long as its square root, 2√(v/J), even where it is but a rounding.
    fn refuse_nearer_than(&self, shortest: f64) -> Result<(), ProfileError> {
        let speed = self.leveled.max(self.ahead.target_speed);
        let rounding = ROUNDINGS * f64::EPSILON * speed;
        let grain = self.ahead.grain + 2.0 * speed * libm::sqrt(rounding / self.jerk);
        Ahead { grain, ..self.ahead }.refuse_nearer_than(shortest)
    }

    /// Speeding up from where the acceleration is level, and slowing down to the target's speed.
    #[inline]
    fn run(&self) -> Run {
        Run {
            start: self.level.speed,
            end: self.ahead.target_speed,
            acceleration: self.speeding,
            deceleration: self.braking,
            jerk: self.jerk,
        }
    }

    /// To the target's speed at once, wherever that is reached.
    pub(super) fn at_once(&self) -> Plan {
        let target_speed = self.ahead.target_speed;
        let plan = if target_speed >= self.leveled {
            self.speed_up(self.run().gains_to(target_speed))
        } else {
            self.slow_down(target_speed)
        };
        Plan { cruises: false, ..plan }
    }

    fn brakes_towards_target(&self) -> bool {
        self.ahead.acceleration < 0.0 && self.ahead.target_speed < self.leveled
    }

    #[inline]
    fn speed_up(&self, Gains { first, second }: Gains) -> Plan {
        let Ahead { speed, acceleration, target_speed, .. } = self.ahead;
        let opening = Opening::speeding_up(speed, acceleration, self.level, first, self.speeding, self.jerk);
        let closing = Ramp::new(target_speed, second, self.braking, self.jerk);
        Plan { opening, cruises: true, closing, level: (0.0, 0.0) }
    }

    fn slow_down(&self, lower: f64) -> Plan {
        let Ahead { speed, acceleration, target_speed, .. } = self.ahead;
        let opening = Opening::slowing_down(speed, acceleration, lower, self.braking, self.jerk);
        let closing = Ramp::new(target_speed, lower - target_speed, self.braking, self.jerk);
        Plan { opening, cruises: true, closing, level: (0.0, 0.0) }
    }

    /// The train is above the limit of speed, or about to be.
    fn slow_down_to_limit(&self) -> Result<Plan, ProfileError> {
        let Ahead { speed, acceleration, way, target_speed, .. } = self.ahead;
        let level = Level::new(speed, acceleration, -self.jerk);
        let way_by = |lower: f64| {
            let (first, _) = way_and_slope(lower, level.speed - lower, self.braking, self.jerk);
            let (second, _) = way_and_slope(target_speed, lower - target_speed, self.braking, self.jerk);
            level.way + first + second
        };
        if way_by(self.highest) <= way {
            return Ok(self.slow_down(self.highest));
        }
        let at_least = way_by(self.leveled);
        if at_least <= way {
            return Ok(self.slow_down(crossing(self.highest, self.leveled, |lower| way_by(lower) - way)));
        }
        if self.brakes_towards_target() {
            return self.ease_off();
        }
        self.refuse_nearer_than(at_least)?;
        Ok(self.slow_down(self.leveled))
    }

    /// The train brakes, and would run past the target if it eased off altogether.
    fn ease_off(&self) -> Result<Plan, ProfileError> {
        let Ahead { speed, acceleration, way, target_speed, .. } = self.ahead;
        let plan_by = |eased: f64| {
            let opening = Opening::easing_off(speed, -acceleration, eased, self.jerk);
            let level = Level::new(opening.speed, -eased, -self.jerk);
            let closing = Ramp::new(target_speed, level.speed - target_speed, self.braking, self.jerk);
            Plan { opening, cruises: false, closing, level: (level.time, level.way) }
        };
        let way_by = |eased: f64| {
            let Plan { opening, closing, level, .. } = plan_by(eased);
            opening.end().1 + level.1 + closing.way
        };
        let at_least = way_by(-acceleration);
        self.refuse_nearer_than(at_least)?;
        Ok(plan_by(crossing(0.0, -acceleration, |eased| way_by(eased) - way)))
    }
}
