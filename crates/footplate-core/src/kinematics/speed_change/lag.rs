//! First-order lag: decoders with load control correct a fixed share of the remaining difference per unit of time.

use crate::kinematics::motion::{Motion, MotionState};
use crate::time::TimeSpan;
use crate::units::{Acceleration, Length, Speed};

/// Speed that approaches its final value exponentially, v₂ + (v₁ − v₂) e^(−t/θ), and never reaches it.
///
/// The change therefore ends within a tolerance: [`duration`](Motion::duration) and
/// [`distance`](Motion::distance) end where the remaining difference equals it. The law itself continues
/// beyond that without a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lag {
    /// 1, or −1 for a train that runs towards smaller distances.
    direction: f64,
    from: f64,
    to: f64,
    time_constant: f64,
    duration: f64,
}

/// Most steps of Newton's method. From the initial value chosen below it takes three or four; the bound only keeps the
/// loop finite.
const MOST_STEPS: u32 = 30;

/// Newton's method ends after a relative step of this size: the remaining error is about its square.
const SETTLED: f64 = 1e-9;

impl Lag {
    /// The default tolerance: at 1 mm/s a train covers less than 0.1 mm
    /// between two polls of a command station.
    pub const SETTLED_WITHIN: Speed = Speed::from_mm_per_s(1.0);

    /// From one speed towards another with a time constant θ; a negative one counts as zero, which is a step.
    /// `settled_within` is the tolerance at which the change ends.
    pub fn new(from: Speed, to: Speed, time_constant: TimeSpan, settled_within: Speed) -> Self {
        let (from, to) = (from.as_m_per_s(), to.as_m_per_s());
        let direction = if from + to < 0.0 { -1.0 } else { 1.0 };
        let time_constant = time_constant.as_s().max(0.0);
        let left = (to - from).abs() / settled_within.abs().as_m_per_s();
        let duration = if left > 1.0 { time_constant * libm::log(left) } else { 0.0 };
        Self { direction, from: direction * from, to: direction * to, time_constant, duration }
    }

    /// The remaining share of the difference at a time, e^(−t/θ), and the share done: each to its own last digit, at
    /// the cost of one elementary function.
    fn shares(&self, time: f64) -> (f64, f64) {
        if self.time_constant <= 0.0 {
            return if time > 0.0 { (0.0, 1.0) } else { (1.0, 0.0) };
        }
        let constants = time / self.time_constant;
        if constants > core::f64::consts::LN_2 {
            let left = libm::exp(-constants);
            (left, 1.0 - left)
        } else {
            let gone = -libm::expm1(-constants);
            (1.0 - gone, gone)
        }
    }

    /// Distance and speed at a time since the start.
    fn distance_and_speed(&self, time: f64) -> (f64, f64) {
        let (left, gone) = self.shares(time);
        let difference = self.from - self.to;
        (self.to * time + difference * self.time_constant * gone, self.to + difference * left)
    }

    /// Seconds to a distance ahead; not finite if it is out of reach.
    fn seconds_to(&self, distance: f64) -> f64 {
        let Self { from, to, time_constant: lag, .. } = *self;
        if to == 0.0 {
            return -lag * libm::log1p(-distance / (from * lag));
        }
        // On a curve that is convex or concave throughout, Newton's method never crosses the root from its right
        // side: start before the root if the distance decelerates, behind it if it accelerates.
        let mut time = if from >= to {
            distance / from
        } else {
            // Behind the root, because t − θ(1 − e^(−t/θ)) ≥ t²/(2θ + t): solved for t.
            let b = distance - 2.0 * lag * from;
            (b + libm::sqrt(b * b + 8.0 * lag * distance * to)) / (2.0 * to)
        };
        for _ in 0..MOST_STEPS {
            let (reached, speed) = self.distance_and_speed(time);
            let step = (reached - distance) / speed;
            time -= step;
            if step.abs() <= SETTLED * time {
                break;
            }
        }
        time
    }
}

impl Motion for Lag {
    #[inline]
    fn state_at(&self, time: TimeSpan) -> MotionState {
        let seconds = time.as_s();
        let changing = self.time_constant > 0.0 && seconds >= 0.0;
        let (distance, speed) =
            if seconds < 0.0 { (self.from * seconds, self.from) } else { self.distance_and_speed(seconds) };
        let acceleration = if changing { (self.to - speed) / self.time_constant } else { 0.0 };
        MotionState {
            distance: Length::from_m(self.direction * distance),
            speed: Speed::from_m_per_s(self.direction * speed),
            acceleration: Acceleration::from_m_per_s2(self.direction * acceleration),
        }
    }

    fn time_at(&self, distance: Length) -> Option<TimeSpan> {
        let distance = self.direction * distance.as_m();
        let turns_around = self.from < 0.0 || self.to < 0.0;
        if !distance.is_finite() || turns_around {
            return None;
        }
        let seconds = if distance == 0.0 {
            0.0
        } else if distance < 0.0 {
            distance / self.from
        } else {
            self.seconds_to(distance)
        };
        seconds.is_finite().then(|| TimeSpan::from_s(seconds))
    }

    fn duration(&self) -> TimeSpan {
        TimeSpan::from_s(self.duration)
    }

    fn distance(&self) -> Length {
        Length::from_m(self.direction * self.distance_and_speed(self.duration).0)
    }
}
