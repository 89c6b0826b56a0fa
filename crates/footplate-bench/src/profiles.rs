//! Operations on motion profiles: building them, asking for the state at a time, and for the time at a distance.
//!
//! The train is the one of all these tables: 40 m/s, 0.8 m/s², 0.5 m/s³. Distances are drawn evenly over the
//! orders of magnitude: from 200 m to 5 km, so that every third profile cruises and all reach the limit of
//! acceleration, or from 0.5 m to 5 km, so that every tenth cruises and every fourth does not reach it. Times and distances at which a profile is asked are drawn evenly over the
//! whole of it, and the profile anew each time.

mod inputs;
mod rsruckig_peer;
mod s_curve_peer;

use core::hint::black_box;

use footplate_core::kinematics::{
    ConstantAcceleration, ConstantJerk, Lag, Motion, MotionState, SCurve, Smooth, SpeedLaw, Trapezoid,
};
use footplate_core::{Length, Speed, TimeSpan};

use crate::operation::Operation;
use inputs::{Inputs, LIMITS, PROFILES, Question, Task};

const FOOTPLATE: &str = "footplate";

/// All of them; the first of a group is Footplate's own.
pub fn operations() -> Vec<Operation> {
    let mut inputs = Inputs::new();
    // Known only at run time, as they are in the program.
    let limits = black_box(LIMITS);
    let between_stations = inputs.stops(200.0, 5000.0);
    let stops = inputs.stops(0.5, 5000.0);
    let tasks = inputs.tasks();
    let to = |distance| MotionState::at_rest(Length::from_m(distance));
    let curve = move |distance: &f64| SCurve::between(MotionState::default(), to(*distance), limits);
    let even = move |distance: &f64| Trapezoid::between(MotionState::default(), to(*distance), limits);
    let curves: Vec<SCurve> = stops.iter().take(PROFILES).flat_map(curve).collect();
    let evens: Vec<Trapezoid> = stops.iter().take(PROFILES).flat_map(even).collect();
    let questions = inputs.questions(&curves);
    let even_questions = inputs.questions(&evens);

    let station = "build from rest to rest, 200 m to 5 km";
    let rest = "build from rest to rest, 0.5 m to 5 km";
    let (state, time) = ("state at a time", "time at a distance");
    let mut all = vec![
        build(station, between_stations.clone(), curve),
        s_curve_peer::build(station, between_stations.clone()),
        rsruckig_peer::build(station, between_stations),
        build(rest, stops.clone(), curve),
        s_curve_peer::build(rest, stops.clone()),
        rsruckig_peer::build(rest, stops.clone()),
        build("build from any state", tasks.clone(), move |task: &Task| {
            SCurve::between(task.from, task.to, limits)
        }),
        rsruckig_peer::build_from_any_state("build from any state", tasks),
        build("build with constant acceleration", stops.clone(), even),
        state_at(state, &curves, &questions),
        s_curve_peer::state_at(state, &stops, &questions),
        rsruckig_peer::state_at(state, &stops, &questions),
        time_at(time, &curves, &questions),
        rsruckig_peer::time_at(time, &stops, &questions),
        playback(&curves),
        state_at("state at a time, trapezoid", &evens, &even_questions),
        time_at("time at a distance, trapezoid", &evens, &even_questions),
    ];
    all.extend(laws(&mut inputs));
    all
}

/// The laws of speed change: no public crate has them, so they stand alone. First each by itself, then all of
/// them mixed, with the law known only at run time.
fn laws(inputs: &mut Inputs) -> Vec<Operation> {
    let lag = |from, to, time| Lag::new(from, to, time, Lag::SETTLED_WITHIN);
    let mut all = Vec::new();
    all.extend(law(
        inputs,
        ["state at a time, straight line", "time at a distance, straight line"],
        ConstantAcceleration::new,
    ));
    all.extend(law(
        inputs,
        ["state at a time, two parabolas", "time at a distance, two parabolas"],
        ConstantJerk::new,
    ));
    all.extend(law(inputs, ["state at a time, quartic", "time at a distance, quartic"], Smooth::new));
    all.extend(law(inputs, ["state at a time, lag", "time at a distance, lag"], lag));
    let mut laws = SpeedLaw::ALL.into_iter().cycle();
    all.extend(law(
        inputs,
        ["state at a time, any law", "time at a distance, any law"],
        move |from, to, time| laws.next().unwrap_or(SpeedLaw::Smooth).between(from, to, time),
    ));
    all
}

fn law<M: Motion + Copy + 'static>(
    inputs: &mut Inputs,
    [state, time]: [&'static str; 2],
    mut between: impl FnMut(Speed, Speed, TimeSpan) -> M,
) -> [Operation; 2] {
    let changes: Vec<M> = (0..PROFILES)
        .map(|_| {
            let [from, to] = [0, 0].map(|_| Speed::from_mm_per_s(600.0 * inputs.share()));
            between(from, to, TimeSpan::from_s(1.0 + 3.0 * inputs.share()))
        })
        .collect();
    let questions = inputs.questions(&changes);
    [state_at(state, &changes, &questions), time_at(time, &changes, &questions)]
}

fn sum(state: MotionState) -> f64 {
    state.distance.as_m() + state.speed.as_m_per_s() + state.acceleration.as_m_per_s2()
}

fn build<Input: 'static, M: Motion, E>(
    group: &'static str,
    inputs: Vec<Input>,
    between: impl Fn(&Input) -> Result<M, E> + 'static,
) -> Operation {
    Operation::new(group, FOOTPLATE, inputs, move |input| {
        // All of it is wanted, not only the duration; where it is, not somewhere else.
        let planned = between(input);
        black_box(&planned).as_ref().map_or(0.0, |motion| motion.duration().as_ns() as f64)
    })
}

fn state_at<M: Motion + Copy + 'static>(
    group: &'static str,
    motions: &[M],
    questions: &[Question],
) -> Operation {
    let asked = inputs::addressed(motions, questions, |question| question.time);
    Operation::new(group, FOOTPLATE, asked, |(motion, time)| sum(motion.state_at(*time)))
}

fn time_at<M: Motion + Copy + 'static>(
    group: &'static str,
    motions: &[M],
    questions: &[Question],
) -> Operation {
    let asked = inputs::addressed(motions, questions, |question| question.distance);
    Operation::new(group, FOOTPLATE, asked, |(motion, distance)| {
        motion.time_at(*distance).map_or(0.0, |time| time.as_ns() as f64)
    })
}

/// The states of profiles played at 50 ms, one profile after the other.
fn playback(curves: &[SCurve]) -> Operation {
    let period = TimeSpan::from_ms(50);
    let curves = curves.to_vec();
    Operation::with_body("playback", FOOTPLATE, move |mut count| {
        let mut total = 0.0;
        for curve in curves.iter().cycle() {
            let states = count.min((curve.duration().as_ns() / period.as_ns()) as usize + 1);
            total += curve.playback(period).take(states).map(sum).sum::<f64>();
            count -= states;
            if count == 0 {
                break;
            }
        }
        total
    })
}
