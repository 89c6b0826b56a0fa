//! The quickest profile is as quick as Ruckig's, whose port `rsruckig` shares no line with ours.

use footplate_core::kinematics::{Limits, Motion, MotionState, ProfileError, SCurve};
use footplate_core::{Acceleration, Jerk, Length, Speed};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use rsruckig::prelude::{InputParameter, Ruckig, ThrowErrorHandler, Trajectory};

/// Its control cycle, which does not matter when a whole trajectory is calculated.
const CYCLE_S: f64 = 0.05;

struct Draw(ChaCha8Rng);

impl Draw {
    fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * (self.0.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn magnitude(&mut self, low: f64, high: f64) -> f64 {
        low * (high / low).powf(self.within(0.0, 1.0))
    }
}

fn state(distance: f64, speed: f64, acceleration: f64) -> MotionState {
    MotionState {
        distance: Length::from_m(distance),
        speed: Speed::from_m_per_s(speed),
        acceleration: Acceleration::from_m_per_s2(acceleration),
    }
}

/// Seconds that Ruckig takes, if it finds a profile.
fn ruckig(from: MotionState, to: MotionState, limits: &Limits) -> Option<f64> {
    let mut input = InputParameter::<1>::new(None);
    input.current_velocity[0] = from.speed.as_m_per_s();
    input.current_acceleration[0] = from.acceleration.as_m_per_s2();
    input.target_position[0] = to.distance.as_m();
    input.target_velocity[0] = to.speed.as_m_per_s();
    input.max_velocity[0] = limits.speed.as_m_per_s();
    input.max_acceleration[0] = limits.acceleration.as_m_per_s2();
    input.max_jerk[0] = limits.jerk.as_m_per_s3();
    let mut least = input.max_acceleration.clone();
    least[0] = -limits.deceleration.as_m_per_s2();
    input.min_acceleration = Some(least);
    let mut trajectory = Trajectory::new(None);
    let mut planner = Ruckig::<1, ThrowErrorHandler>::new(None, CYCLE_S);
    planner.calculate(&input, &mut trajectory).ok()?;
    Some(trajectory.get_duration())
}

#[test]
fn profiles_are_as_quick_as_ruckig_s() {
    let mut draw = Draw(ChaCha8Rng::seed_from_u64(3));
    let mut compared = 0;
    for turn in 0..20_000 {
        let (speeding, braking) = (draw.magnitude(0.05, 2.0), draw.magnitude(0.05, 2.0));
        let (highest, jerk) = (draw.magnitude(0.5, 60.0), draw.magnitude(0.05, 3.0));
        let limits = Limits {
            speed: Speed::from_m_per_s(highest),
            acceleration: Acceleration::from_m_per_s2(speeding),
            deceleration: Acceleration::from_m_per_s2(braking),
            jerk: Jerk::from_m_per_s3(jerk),
        };
        let stands = turn % 4 == 0;
        let speed = if stands { 0.0 } else { draw.within(0.0, highest) };
        let acceleration = if stands { 0.0 } else { draw.within(-braking, speeding) };
        let leveled = speed + 0.5 * acceleration * acceleration.abs() / jerk;
        if !(0.0..highest).contains(&leveled) {
            continue; // the limits force such a train to run backwards, or faster than they allow
        }
        let from = state(0.0, speed, acceleration);
        let target_speed = if turn % 2 == 0 { 0.0 } else { draw.within(0.0, highest) };
        let mut to = state(draw.magnitude(0.1, 5000.0), target_speed, 0.0);
        if let Err(ProfileError::TooNear { shortest, .. }) = SCurve::between(from, to, limits) {
            to.distance = shortest * (1.0 + draw.magnitude(1e-3, 1.0));
        }
        let ours = SCurve::between(from, to, limits).map(|profile| profile.duration().as_s());
        let ours = ours.unwrap_or_else(|refused| panic!("{refused} from {from:?} to {to:?} with {limits:?}"));
        let Some(theirs) = ruckig(from, to, &limits) else { continue };
        assert!(
            (ours - theirs).abs() < 1e-6 * theirs + 1e-6,
            "{ours} s, theirs {theirs} s: from {from:?} to {to:?} with {limits:?}"
        );
        compared += 1;
    }
    assert!(compared > 12_000, "only {compared} were compared");
}
