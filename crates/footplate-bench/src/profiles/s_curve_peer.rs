//! The same by the crate `s_curve`: from rest to rest and the like, evaluated through a boxed function for each
//! derivative.

use core::hint::black_box;

use s_curve::{
    Derivative, SCurveConstraints, SCurveInput, SCurveParameters, SCurveStartConditions, s_curve_generator,
};

use super::inputs::{LIMITS, PROFILES, Question};
use crate::operation::Operation;

const MEANS: &str = "s_curve 0.1.7";

fn input(distance: f64) -> SCurveInput {
    let limits = black_box(LIMITS);
    SCurveInput {
        constraints: SCurveConstraints {
            max_jerk: limits.jerk.as_m_per_s3(),
            max_acceleration: limits.acceleration.as_m_per_s2(),
            max_velocity: limits.speed.as_m_per_s(),
        },
        start_conditions: SCurveStartConditions { q0: 0.0, q1: distance, v0: 0.0, v1: 0.0 },
    }
}

pub(super) fn build(group: &'static str, stops: Vec<f64>) -> Operation {
    Operation::new(group, MEANS, stops, |distance| {
        // What has to be known before it can be asked anything, but for the functions on the heap.
        let input = input(*distance);
        let planned = SCurveParameters::new(&input.calc_intervals(), &input);
        black_box(&planned).time_intervals.total_duration()
    })
}

pub(super) fn state_at(group: &'static str, stops: &[f64], questions: &[Question]) -> Operation {
    let of = |distance, derivative| s_curve_generator(&input(distance), derivative).1;
    let profiles: Vec<_> = stops
        .iter()
        .take(PROFILES)
        .map(|&distance| {
            [Derivative::Position, Derivative::Velocity, Derivative::Acceleration]
                .map(|which| of(distance, which))
        })
        .collect();
    let profiles: &'static [_] = profiles.leak();
    let asked =
        questions.iter().map(|question| (&profiles[question.profile], question.time.as_s())).collect();
    Operation::new(group, MEANS, asked, |(profile, time): &(&[_; 3], f64)| {
        let [position, velocity, acceleration] = *profile;
        position(*time) + velocity(*time) + acceleration(*time)
    })
}
