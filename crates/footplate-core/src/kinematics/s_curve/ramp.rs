//! From one speed to another with limited jerk: the ramp between two speeds, and the first part of a profile.
//!
//! ```text
//! J  limit of jerk      A  limit of acceleration      x  speed gained      p  peak acceleration
//! x ≥ A²/J    p = A         time A/J, then x/A − A/J, then A/J
//! x < A²/J    p = √(J x)    time √(x/J), 0, √(x/J)
//! ```
//!
//! In a ramp acceleration builds up, holds, and fades. It is symmetric, so its mean speed is the mean of both ends.
//! Slowing down is the same ramp backwards.
//!
//! A train that already accelerates is treated as if it had started earlier, and one that still brakes as if it started
//! later: the ramp starts where acceleration was or will be zero. The present state and the jerk give that time, distance
//! and speed.

/// The state at a boundary, in SI units, counted from the start of the profile.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Knot {
    pub(super) time: f64,
    pub(super) distance: f64,
    pub(super) speed: f64,
    pub(super) half_acceleration: f64,
}

/// Both limits, and the values that every ramp derives from them; SI units.
#[derive(Debug, Clone, Copy)]
pub(super) struct Rate {
    pub(super) limit: f64,
    pub(super) jerk: f64,
    /// Reciprocals of jerk and limit.
    pub(super) per_jerk: f64,
    per_limit: f64,
    /// Time to build up to the limit.
    full_build_up: f64,
    /// Speed gained while acceleration builds up to the limit and fades again at once.
    least_gain: f64,
}

impl Rate {
    #[inline(always)]
    pub(super) fn new(limit: f64, jerk: f64, per_jerk: f64) -> Self {
        let full_build_up = limit * per_jerk;
        Self {
            limit,
            jerk,
            per_jerk,
            per_limit: 1.0 / limit,
            full_build_up,
            least_gain: limit * full_build_up,
        }
    }

    /// Whether a gain of speed is large enough to reach the limit.
    #[inline(always)]
    pub(super) fn is_reached_by(&self, gain: f64) -> bool {
        gain >= self.least_gain
    }

    /// Peak acceleration for a gain of speed, with the times to build it up and to hold it.
    #[inline(always)]
    pub(super) fn peak_for(&self, gain: f64) -> (f64, f64, f64) {
        if self.is_reached_by(gain) {
            (self.limit, self.full_build_up, (gain - self.least_gain) * self.per_limit)
        } else {
            let build_up = libm::sqrt(gain * self.per_jerk);
            (self.jerk * build_up, build_up, 0.0)
        }
    }

    /// Distance of a ramp from `low` by a gain of speed, and its derivative with respect to the gain; a gain below
    /// zero is rounding.
    #[inline]
    pub(super) fn distance_and_slope(&self, low: f64, gain: f64) -> (f64, f64) {
        let gain = gain.max(0.0);
        let (_, build_up, hold) = self.peak_for(gain);
        let (time, mean) = (2.0 * build_up + hold, low + 0.5 * gain);
        // The time grows by x/A while the limit is held, and otherwise as 2√(x/J).
        let slope = if self.is_reached_by(gain) { self.per_limit } else { self.per_jerk / build_up };
        (mean * time, 0.5 * time + mean * slope)
    }
}

pub(super) const THIRD: f64 = 1.0 / 3.0;

/// A ramp, counted from its lower end; SI units.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ramp {
    low: f64,
    high: f64,
    /// End of the build-up of acceleration, and start of its fade.
    built_up: Knot,
    held: Knot,
    pub(super) time: f64,
    pub(super) distance: f64,
}

impl Ramp {
    /// From a speed by a gain. The gain is an argument because the difference to a peak hardly above `low` has few
    /// digits; a gain below zero is rounding.
    #[inline(always)]
    pub(super) fn new(low: f64, gain: f64, rate: &Rate) -> Self {
        let gain = if gain > 0.0 { gain } else { 0.0 };
        let high = low + gain;
        let (peak, build_up, hold) = rate.peak_for(gain);
        let half_acceleration = 0.5 * peak;
        let won = half_acceleration * build_up;
        let (slow, fast) = (low + won, high - won);
        let bent = THIRD * won;
        let build_up_distance = build_up * (low + bent);
        let held_time = build_up + hold;
        let held_distance = build_up_distance + hold * (0.5 * (slow + fast));
        Self {
            low,
            high,
            built_up: Knot { time: build_up, distance: build_up_distance, speed: slow, half_acceleration },
            held: Knot { time: held_time, distance: held_distance, speed: fast, half_acceleration },
            time: build_up + held_time,
            distance: held_distance + build_up * (high - bent),
        }
    }

    /// Its inner knots and its upper end, for a ramp that begins at time and distance 0.
    #[inline(always)]
    pub(super) fn upwards_from_here(&self) -> [Knot; 3] {
        let top = Knot { time: self.time, distance: self.distance, speed: self.high, half_acceleration: 0.0 };
        [self.built_up, self.held, top]
    }

    /// The same for a ramp whose lower end is at another time and distance.
    #[inline(always)]
    pub(super) fn upwards(&self, time: f64, distance: f64) -> [Knot; 3] {
        self.upwards_from_here().map(|knot| Knot {
            time: time + knot.time,
            distance: distance + knot.distance,
            ..knot
        })
    }

    /// Its inner knots and its lower end in order of time, for a ramp run backwards (slowing down) that ends at a
    /// time and a distance.
    #[inline(always)]
    pub(super) fn downwards(&self, time: f64, distance: f64) -> [Knot; 3] {
        let before = |knot: Knot| Knot {
            time: time - knot.time,
            distance: distance - knot.distance,
            speed: knot.speed,
            half_acceleration: -knot.half_acceleration,
        };
        [
            before(self.held),
            before(self.built_up),
            Knot { time, distance, speed: self.low, half_acceleration: 0.0 },
        ]
    }
}

/// Time, distance and speed at which acceleration was, or will be, zero under a constant jerk.
#[derive(Debug, Clone, Copy)]
pub(super) struct Level {
    pub(super) time: f64,
    pub(super) distance: f64,
    pub(super) speed: f64,
}

impl Level {
    /// From the present speed and acceleration and the reciprocal of the jerk; a negative one leads into braking.
    #[inline(always)]
    pub(super) fn new(speed: f64, acceleration: f64, per_jerk: f64) -> Self {
        let time = -acceleration * per_jerk;
        Self {
            time,
            // v t + a t²/2 + j t³/6 with a = −j t
            distance: time * (speed + THIRD * acceleration * time),
            speed: speed + 0.5 * acceleration * time,
        }
    }

    #[inline(always)]
    fn knot(self) -> Knot {
        Knot { time: self.time, distance: self.distance, speed: self.speed, half_acceleration: 0.0 }
    }
}

/// The knots of four phases from now on: the first brings the acceleration to zero, three more are a ramp. Phases that
/// are not needed have no duration.
#[derive(Debug, Clone, Copy)]
pub(super) struct Opening {
    pub(super) knots: [Knot; 5],
    /// Whether the ramp slows the train down.
    pub(super) slows: bool,
}

impl Opening {
    /// Speeds up from standstill to a peak speed.
    #[inline(always)]
    pub(super) fn from_rest(peak: f64, rate: &Rate) -> Self {
        let [built_up, held, top] = Ramp::new(0.0, peak, rate).upwards_from_here();
        Self { knots: [Knot::default(), Knot::default(), built_up, held, top], slows: false }
    }

    /// Speeds up from the present speed and acceleration: first to `level`, then by a gain of speed.
    #[inline(always)]
    pub(super) fn speeding_up(speed: f64, acceleration: f64, level: Level, gain: f64, rate: &Rate) -> Self {
        let now = Knot { speed, half_acceleration: 0.5 * acceleration, ..Knot::default() };
        let eased = if acceleration < 0.0 { level.knot() } else { now };
        let [built_up, held, top] = Ramp::new(level.speed, gain, rate).upwards(level.time, level.distance);
        Self { knots: [now, eased, built_up, held, top], slows: false }
    }

    /// Slows down from the present speed and acceleration to a lower speed without acceleration.
    pub(super) fn slowing_down(speed: f64, acceleration: f64, lower: f64, rate: &Rate) -> Self {
        let now = Knot { speed, half_acceleration: 0.5 * acceleration, ..Knot::default() };
        let level = Level::new(speed, acceleration, -rate.per_jerk);
        let eased = if acceleration > 0.0 { level.knot() } else { now };
        let ramp = Ramp::new(lower, level.speed - lower, rate);
        let [built_up, held, bottom] = ramp.downwards(level.time + ramp.time, level.distance + ramp.distance);
        Self { knots: [now, eased, built_up, held, bottom], slows: true }
    }

    /// Eases off from a deceleration of `braking` to one of `eased`.
    pub(super) fn easing_off(speed: f64, braking: f64, eased: f64, rate: &Rate) -> Self {
        let now = Knot { speed, half_acceleration: -0.5 * braking, ..Knot::default() };
        let time = (braking - eased) * rate.per_jerk;
        let easier = Knot {
            time,
            // v t − b t²/2 + J t³/6 with J t = b − e
            distance: time * (speed - THIRD * time * (braking + 0.5 * eased)),
            speed: speed - 0.5 * time * (braking + eased),
            half_acceleration: -0.5 * eased,
        };
        Self { knots: [now, easier, easier, easier, easier], slows: false }
    }

    /// Its last knot.
    #[inline(always)]
    pub(super) fn end(&self) -> Knot {
        let [.., end] = self.knots;
        end
    }
}
