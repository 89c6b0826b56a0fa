//! What the operations are asked, the same in every run and for every contestant.

use footplate_core::kinematics::{Limits, Motion, MotionState, SCurve};
use footplate_core::{Acceleration, Jerk, Length, Speed, TimeSpan};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

use crate::operation::INPUTS;

/// The train of all tables.
pub(super) const LIMITS: Limits = Limits {
    speed: Speed::from_m_per_s(40.0),
    acceleration: Acceleration::from_m_per_s2(0.8),
    deceleration: Acceleration::from_m_per_s2(0.8),
    jerk: Jerk::from_m_per_s3(0.5),
};

/// Profiles that are asked in turn: so few that all of any contestant's stay in the first level of cache.
pub(super) const PROFILES: usize = 16;

/// From a state on the move to a target farther on.
#[derive(Debug, Clone, Copy)]
pub(super) struct Task {
    pub(super) from: MotionState,
    pub(super) to: MotionState,
}

/// Which profile is asked, and where in it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Question {
    pub(super) profile: usize,
    pub(super) time: TimeSpan,
    pub(super) distance: Length,
}

/// A stream of random inputs.
pub(super) struct Inputs(ChaCha8Rng);

impl Inputs {
    pub(super) fn new() -> Self {
        Self(ChaCha8Rng::seed_from_u64(1))
    }

    /// Evenly from 0 up to 1.
    pub(super) fn share(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn many<T>(&mut self, mut one: impl FnMut(&mut Self) -> T) -> Vec<T> {
        (0..INPUTS).map(|_| one(self)).collect()
    }

    /// Metres from one stop to the next, every order of magnitude as often as any other.
    pub(super) fn stops(&mut self, nearest: f64, farthest: f64) -> Vec<f64> {
        self.many(|inputs| nearest * libm::pow(farthest / nearest, inputs.share()))
    }

    /// From any state within the limits to a speed within the limits, at least as far as that takes.
    pub(super) fn tasks(&mut self) -> Vec<Task> {
        self.many(|inputs| {
            loop {
                let speed = LIMITS.speed * inputs.share();
                let acceleration = LIMITS.acceleration * (2.0 * inputs.share() - 1.0);
                let from = MotionState { distance: Length::ZERO, speed, acceleration };
                let Ok(quickest) = SCurve::to_speed(from, LIMITS.speed * inputs.share(), LIMITS) else {
                    continue;
                };
                let target = quickest.state_at(quickest.duration());
                let distance =
                    quickest.distance() + Length::from_m(0.5 * libm::pow(10_000.0, inputs.share()));
                let to = MotionState::cruising(distance, target.speed);
                // A start that the limits force above the speed limit is another problem.
                let leveled = speed.as_m_per_s()
                    + acceleration.as_m_per_s2().powi(2) / (2.0 * LIMITS.jerk.as_m_per_s3());
                if leveled < LIMITS.speed.as_m_per_s() && SCurve::between(from, to, LIMITS).is_ok() {
                    return Task { from, to };
                }
            }
        })
    }

    /// Anywhere in any of the profiles.
    pub(super) fn questions(&mut self, motions: &[impl Motion]) -> Vec<Question> {
        self.many(|inputs| {
            let profile = (inputs.share() * motions.len() as f64) as usize;
            let motion = &motions[profile];
            Question {
                profile,
                time: TimeSpan::from_s(inputs.share() * motion.duration().as_s()),
                distance: motion.distance() * inputs.share(),
            }
        })
    }
}

/// Every question with the profile that it asks, and the part of it that an operation asks.
pub(super) fn addressed<M: Clone + 'static, Q>(
    motions: &[M],
    questions: &[Question],
    part: impl Fn(&Question) -> Q,
) -> Vec<(&'static M, Q)> {
    // The inputs of an operation live as long as the program.
    let motions: &'static [M] = motions.to_vec().leak();
    questions.iter().map(|question| (&motions[question.profile], part(question))).collect()
}
