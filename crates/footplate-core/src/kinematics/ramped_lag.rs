//! A linear ramp followed with a lag: one shape of speed change for all decoders and motors.
//!
//! A decoder moves its set speed from the old to the new one in a time `T` (zero: it jumps) and the motor follows
//! with a time constant `θ` (zero: at once). Between the two extremes lie, to within millimetres of distance, all
//! laws that model trains follow in recordings: constant rate (θ → 0), first-order lag (T → 0), eased and rounded
//! ramps (θ models the rounding), and momentum. Letters: `τ` time since the change took effect, `r` share of the
//! change that is done, `R` its integral over time:
//!
//! ```text
//! h(τ) = τ − θ (1 − e^(−τ/θ))                        integral of a lag's step response
//! H(τ) = τ²/2 − θ τ + θ² (1 − e^(−τ/θ))              integral of h
//! r(τ) = (h(τ) − h(τ − T)) / T                        terms of negative times are zero
//! R(τ) = (H(τ) − H(τ − T)) / T  →  τ − (T/2 + θ)
//! ```

/// Ramps below this (s) are a jump: the shorter a ramp, the more digits the differences above lose.
const SHORTEST_RAMP: f64 = 1e-3;
/// A lag below this (s) counts as none.
const SHORTEST_LAG: f64 = 1e-4;

/// The shape of one change.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct RampedLag {
    ramp: f64,
    lag: f64,
}

impl RampedLag {
    /// From the duration of the ramp and the time constant of the lag, in s; negative values count as zero.
    pub const fn new(ramp: f64, lag: f64) -> Self {
        Self { ramp: ramp.max(SHORTEST_RAMP), lag: lag.max(SHORTEST_LAG) }
    }

    /// `r`, the share of the change that is done at a time (s), from 0 to 1.
    pub fn share(&self, time: f64) -> f64 {
        self.at(time).share()
    }

    /// `R`, the integral of [`share`](Self::share) over time (s).
    pub fn area(&self, time: f64) -> f64 {
        self.at(time).area()
    }

    /// All that follows from one time (s), with each exponential computed once.
    pub(crate) fn at(&self, time: f64) -> ChangeAt {
        let lagging = |since: f64| Lagging::new(since, self.lag);
        ChangeAt { shape: *self, since_begin: lagging(time), since_ramp: lagging(time - self.ramp) }
    }

    /// The share of the change that the set speed, without the lag, has made at a time (s).
    pub const fn set_share(&self, time: f64) -> f64 {
        (time / self.ramp).clamp(0.0, 1.0)
    }

    /// The duration `T` of the ramp (s).
    pub const fn ramp(&self) -> f64 {
        self.ramp
    }

    /// The time constant `θ` (s).
    pub const fn lag(&self) -> f64 {
        self.lag
    }

    /// Mean delay against an instantaneous change: T/2 + θ, in s.
    pub const fn delay(&self) -> f64 {
        0.5 * self.ramp + self.lag
    }

    /// The time (s) after which no more than this share of the change remains.
    pub fn settled(&self, left: f64) -> f64 {
        self.ramp + self.lag * libm::log(1.0 / left.clamp(1e-9, 1.0))
    }
}

/// A change at one moment.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ChangeAt {
    shape: RampedLag,
    since_begin: Lagging,
    /// Since the set speed is there.
    since_ramp: Lagging,
}

impl ChangeAt {
    /// See [`RampedLag::share`].
    pub(crate) fn share(&self) -> f64 {
        let RampedLag { ramp, lag } = self.shape;
        (self.since_begin.once(lag) - self.since_ramp.once(lag)) / ramp
    }

    /// See [`RampedLag::area`].
    pub(crate) fn area(&self) -> f64 {
        let RampedLag { ramp, lag } = self.shape;
        (self.since_begin.twice(lag) - self.since_ramp.twice(lag)) / ramp
    }

    /// The set speed is there for so long (s); and `1 − e^(−τ/θ)` of that time.
    pub(crate) fn since_ramp(&self) -> (f64, f64) {
        (self.since_ramp.time, -self.since_ramp.decay)
    }
}

/// A time `τ` (s) since a ramp began to grow or ended, zero before, with `e^(−τ/θ) − 1`.
#[derive(Debug, Clone, Copy)]
struct Lagging {
    time: f64,
    decay: f64,
}

impl Lagging {
    fn new(time: f64, lag: f64) -> Self {
        if time <= 0.0 {
            return Self { time: 0.0, decay: 0.0 };
        }
        Self { time, decay: libm::expm1(-time / lag) }
    }

    /// `h`.
    fn once(&self, lag: f64) -> f64 {
        self.time + lag * self.decay
    }

    /// `H`.
    fn twice(&self, lag: f64) -> f64 {
        0.5 * self.time * self.time - lag * self.time - lag * lag * self.decay
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_share_grows_from_nothing_to_all_and_its_area_is_its_integral() {
        for (ramp, lag) in [(0.0, 0.0), (2.0, 0.0), (0.0, 1.2), (1.5, 0.4), (0.3, 2.0)] {
            let shape = RampedLag::new(ramp, lag);
            let (mut sum, step) = (0.0, 1e-3);
            let mut before = 0.0;
            for count in 0..20_000 {
                let time = f64::from(count) * step;
                let share = shape.share(time);
                assert!(share >= before - 1e-9 && share <= 1.0 + 1e-9, "{ramp} {lag} at {time}: {share}");
                before = share;
                sum += 0.5 * step * (share + shape.share(time + step));
                assert!((sum - shape.area(time + step)).abs() < 2e-3, "{ramp} {lag} at {time}");
            }
            assert!((20.0 - shape.area(20.0) - shape.delay()).abs() < 1e-3, "{ramp} {lag}");
            assert!(shape.share(shape.settled(0.01)) > 0.989, "{ramp} {lag}");
        }
    }

    #[test]
    fn without_a_lag_it_is_a_ramp_and_without_a_ramp_a_lag() {
        assert!((RampedLag::new(2.0, 0.0).share(0.5) - 0.25).abs() < 1e-3);
        assert!((RampedLag::new(0.0, 1.2).share(1.2) - (1.0 - libm::exp(-1.0))).abs() < 1e-3);
    }
}
