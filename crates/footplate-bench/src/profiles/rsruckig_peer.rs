//! The same by the crate `rsruckig`, a port of Ruckig: any state to any state, with one degree of freedom.

use rsruckig::prelude::{InputParameter, Ruckig, ThrowErrorHandler, Trajectory, daov_stack};

use super::inputs::{LIMITS, PROFILES, Question, Task, addressed};
use crate::operation::Operation;

const MEANS: &str = "rsruckig 3.0.1";

/// Its control cycle, which does not matter when a whole trajectory is calculated.
const CYCLE_S: f64 = 0.05;

fn input() -> InputParameter<1> {
    let mut input = InputParameter::new(None);
    input.max_velocity[0] = LIMITS.speed.as_m_per_s();
    input.max_acceleration[0] = LIMITS.acceleration.as_m_per_s2();
    input.max_jerk[0] = LIMITS.jerk.as_m_per_s3();
    input
}

fn planner() -> Ruckig<1, ThrowErrorHandler> {
    Ruckig::new(None, CYCLE_S)
}

pub(super) fn build(group: &'static str, stops: Vec<f64>) -> Operation {
    let (mut planner, mut input, mut trajectory) = (planner(), input(), Trajectory::new(None));
    Operation::new(group, MEANS, stops, move |distance| {
        input.target_position[0] = *distance;
        planner.calculate(&input, &mut trajectory).map_or(0.0, |_| trajectory.get_duration())
    })
}

pub(super) fn build_from_any_state(group: &'static str, tasks: Vec<Task>) -> Operation {
    let (mut planner, mut input, mut trajectory) = (planner(), input(), Trajectory::new(None));
    Operation::new(group, MEANS, tasks, move |Task { from, to }| {
        input.current_velocity[0] = from.speed.as_m_per_s();
        input.current_acceleration[0] = from.acceleration.as_m_per_s2();
        input.target_position[0] = to.distance.as_m();
        input.target_velocity[0] = to.speed.as_m_per_s();
        planner.calculate(&input, &mut trajectory).map_or(0.0, |_| trajectory.get_duration())
    })
}

fn trajectories(stops: &[f64]) -> Vec<Trajectory<1>> {
    let (mut planner, mut input) = (planner(), input());
    let planned = stops.iter().take(PROFILES).filter_map(|&distance| {
        let mut trajectory = Trajectory::new(None);
        input.target_position[0] = distance;
        planner.calculate(&input, &mut trajectory).ok().map(|_| trajectory)
    });
    planned.collect()
}

pub(super) fn state_at(group: &'static str, stops: &[f64], questions: &[Question]) -> Operation {
    let asked = addressed(&trajectories(stops), questions, |question| question.time.as_s());
    let (mut position, mut velocity, mut acceleration) =
        (daov_stack![0.0], daov_stack![0.0], daov_stack![0.0]);
    Operation::new(group, MEANS, asked, move |(trajectory, time)| {
        trajectory.at_time(
            *time,
            &mut Some(&mut position),
            &mut Some(&mut velocity),
            &mut Some(&mut acceleration),
            &mut None,
            &mut None,
        );
        position[0] + velocity[0] + acceleration[0]
    })
}

pub(super) fn time_at(group: &'static str, stops: &[f64], questions: &[Question]) -> Operation {
    let asked = addressed(&trajectories(stops), questions, |question| question.distance.as_m());
    Operation::new(group, MEANS, asked, |(trajectory, distance)| {
        trajectory.get_first_time_at_position(0, *distance).unwrap_or(0.0)
    })
}
