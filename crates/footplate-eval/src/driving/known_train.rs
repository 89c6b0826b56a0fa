//! The oracle of the driving scores: the same driver with a motion model made from the true properties of the train.
//!
//! Speeds, delays, laws and lengths are those of the simulated train, with almost no uncertainty. The remaining errors
//! cannot be known in advance: the phase of the poll, the deviation of a run, the scatter of stops, and the
//! approximations of the model.

use anyhow::{Context, anyhow};
use footplate_core::model::{MotionModel, StepUse};
use footplate_core::tracking::{Locator, PathPoint, TrackContext};
use footplate_core::{Approach, Event, EventKind, Length, NodeId, SpeedStep, TimeSpan, Timestamp, TrainId};
use footplate_sim::{Law, Train, Truth};

/// The standard deviation of each parameter (in its SI unit): zero would make the covariance singular.
const DEVIATION: f64 = 1e-6;
/// The standard deviation of a length, in metres.
const LENGTH_DEVIATION_M: f64 = 0.5e-3;
/// Indices of the model's parameters, as in core's `model/parameters.rs`.
const UP: usize = 1;
const DOWN: usize = 5;
const START_DELAY: usize = 9;
const FRICTION: usize = 10;
const STOP_NODES: usize = 11;
const NODES: usize = 8;
const SPEEDS: usize = STOP_NODES + 2 * NODES;
/// Numbers of the shapes of starts and stops, behind the hysteresis by step. They stay zero: the residuals at rest are known.
const SHAPES: usize = 4;
/// Sensors of the usual worlds trip where they are (m): the finest scatter that a model knows.
const SENSOR_SCATTER_M: f64 = 0.001;
/// The spacing of the nodes over speed, in m/s.
const NODE_SPACING: f64 = 0.1;
/// The speed below which hysteresis shrinks in proportion, as in the model, in m/s.
const FULL_HYSTERESIS_FROM: f64 = 0.12;
/// The time after which a start is over.
const STARTED: TimeSpan = TimeSpan::from_ms(12_000);
/// The lags of the simulator's motors behind ramped set speeds and behind counters, in s.
const RAMPED_LAG_S: f64 = 0.04;
const COUNTED_LAG_S: f64 = 0.12;
/// Steps of a decoder's internal counter per throttle step.
const COUNTS_PER_STEP: f64 = 9.0;

/// The model with the true properties of a train; `ahead` are the nodes whose path lengths it needs.
pub(crate) fn known(
    context: TrackContext<'_>,
    truth: Truth<'_, '_>,
    train: TrainId,
    ahead: &[NodeId],
) -> anyhow::Result<MotionModel> {
    let engine = truth.engine(train).context("the train is not there")?;
    let warmth = truth.train(train).map_or(1.0, |truth| truth.warmth);
    let warm = 1.0 - engine.warm_up.as_parts() * (1.0 - warmth);
    let blank = MotionModel::unknown(train, engine.speeds.highest());
    let mut numbers = blank.numbers();
    let highest = usize::from(numbers.highest.get());
    // A change of the parameter order must not go unnoticed.
    anyhow::ensure!(
        numbers.values.len() == SPEEDS + 2 * highest + SHAPES,
        "the places of the model's numbers have moved"
    );
    for value in &mut numbers.values[..SPEEDS] {
        *value = 0.0;
    }
    for step in steps(numbers.highest) {
        let place = SPEEDS + usize::from(step.get()) - 1;
        let speed = |approach| engine.speeds.speed(step, approach).as_m_per_s() * warm;
        let (below, above) = (speed(Approach::Below), speed(Approach::Above));
        numbers.values[place] = libm::log(below.max(1e-6));
        numbers.values[place + highest] = (above - below) / (below / FULL_HYSTERESIS_FROM).clamp(1e-3, 1.0);
    }
    let [up, down] = lags_and_ramps(&engine.law);
    let delay = engine.command_delay.as_s();
    for (first, [lag, kappa, rho]) in [(UP, up), (DOWN, down)] {
        numbers.values[first] = delay + engine.change_dead_time.as_s();
        numbers.values[first + 1..first + 4].copy_from_slice(&[lag, kappa, rho]);
    }
    numbers.values[FRICTION] = engine.friction.as_m_per_s2();
    numbers.values[START_DELAY] = delay + engine.start_dead_time.as_s();
    let side = numbers.values.len();
    numbers.covariance = (0..side)
        .flat_map(|i| (0..=i).map(move |j| if i == j { DEVIATION * DEVIATION } else { 0.0 }))
        .collect();
    numbers.uses = (0..=highest).map(|_| StepUse::Moves).collect();
    for (step, found) in numbers.uses.iter_mut().enumerate() {
        // A train with a high breakaway may not start at such a step.
        let speed = SpeedStep::new(step as u8).map(|step| engine.speeds.speed(step, Approach::Below));
        if speed.is_some_and(|speed| speed < engine.breakaway * 1.8) {
            *found = StepUse::Unreliable;
        }
    }
    numbers.sections = sections(context, truth, train, ahead);
    let plain = MotionModel::from_numbers(&numbers).map_err(|error| anyhow!("{error}"))?;

    // The residuals of the model's laws, from the train itself.
    let stops = steps(numbers.highest).map(|step| {
        let speed = engine.speeds.speed(step, Approach::Below);
        let from_truth = speed * engine.command_delay + engine.stopping_distance(step, Approach::Below);
        (speed.as_m_per_s(), (from_truth - plain.stop(step, Approach::Below).distance).as_m())
    });
    fill_nodes(&mut numbers.values[STOP_NODES..STOP_NODES + NODES], &stops.collect::<Vec<_>>());
    let starts = steps(numbers.highest).filter_map(|step| {
        let from_truth =
            engine.distance_after(SpeedStep::STAND, Approach::Below, step, STARTED - engine.command_delay);
        let predicted = distance_after_start(context, &plain, step)?;
        (from_truth > Length::ZERO).then(|| {
            (engine.speeds.speed(step, Approach::Below).as_m_per_s(), (from_truth - predicted).as_m())
        })
    });
    let starts = starts.collect::<Vec<_>>();
    fill_nodes(&mut numbers.values[STOP_NODES + NODES..SPEEDS], &starts);
    numbers.scatter_scale = scatter_scale(engine, &plain);
    numbers.usual_sensor_scatter = SENSOR_SCATTER_M;
    MotionModel::from_numbers(&numbers).map_err(|error| anyhow!("{error}"))
}

fn steps(highest: SpeedStep) -> impl Iterator<Item = SpeedStep> {
    (1..=highest.get()).filter_map(SpeedStep::new)
}

/// Lag, ramp time per change of speed and ramp time per step, for acceleration and deceleration.
fn lags_and_ramps(law: &Law) -> [[f64; 3]; 2] {
    let kappa = |rate: footplate_core::Acceleration| 0.5 / rate.as_m_per_s2().max(1e-3);
    match *law {
        Law::Constant { up, down } => [[RAMPED_LAG_S, kappa(up), 0.0], [RAMPED_LAG_S, kappa(down), 0.0]],
        Law::Smooth { up, down, shortest } => {
            let lag = RAMPED_LAG_S + 0.5 * shortest.as_s();
            [[lag, kappa(up), 0.0], [lag, kappa(down), 0.0]]
        }
        Law::SCurve { up, down, rounding } => {
            let lag = RAMPED_LAG_S + 0.5 * rounding.as_s();
            [[lag, kappa(up), 0.0], [lag, kappa(down), 0.0]]
        }
        Law::Lag { up, down } => [[up.as_s(), 0.0, 0.0], [down.as_s(), 0.0, 0.0]],
        Law::Momentum { up_per_count, down_per_count } => [
            [COUNTED_LAG_S, 0.0, COUNTS_PER_STEP * up_per_count.as_s()],
            [COUNTED_LAG_S, 0.0, COUNTS_PER_STEP * down_per_count.as_s()],
        ],
        Law::Mixed { up, up_lag, down } => [[up_lag.as_s(), kappa(up), 0.0], [down.as_s(), 0.0, 0.0]],
    }
}

/// The distance that a model predicts for a train after a start.
fn distance_after_start(context: TrackContext<'_>, model: &MotionModel, step: SpeedStep) -> Option<Length> {
    let train = model.train();
    let (_, node) = context.layout.sensors().next()?;
    let mut locator = Locator::new(train);
    locator.place(Timestamp::ZERO, PathPoint { node, distance: Length::ZERO }, Length::ZERO);
    let command = Event { time: Timestamp::ZERO, kind: EventKind::Speed { train, step } };
    locator.handle_command(context, model, &command);
    Some(locator.locate(context, model, Timestamp::ZERO + STARTED)?.at.distance)
}

/// Path lengths of hops for this train, by section.
fn sections(
    context: TrackContext<'_>,
    truth: Truth<'_, '_>,
    train: TrainId,
    ahead: &[NodeId],
) -> Vec<(usize, f64, f64)> {
    let mut found: Vec<(usize, f64, f64)> = Vec::new();
    for node in ahead {
        for hop in context.layout.hops_from(*node) {
            let (Some(from), Some(to)) = (context.layout.sensor_at(*node), hop.sensor) else { continue };
            let path_length = truth.path_length(train, hop.edges, from, to);
            if let (Some(section), Some(path_length)) = (context.sections.section(hop.id), path_length)
                && !found.iter().any(|(known, ..)| *known == section)
            {
                let longer = (path_length - hop.length).as_m();
                found.push((section, longer, LENGTH_DEVIATION_M * LENGTH_DEVIATION_M));
            }
        }
    }
    found
}

/// Values at the nodes from (speed, value) pairs in order of speed: interpolated between them, constant beyond them.
fn fill_nodes(nodes: &mut [f64], pairs: &[(f64, f64)]) {
    for (nth, node) in nodes.iter_mut().enumerate() {
        let speed = NODE_SPACING * (nth + 1) as f64;
        let after = pairs.partition_point(|(of, _)| *of < speed);
        let (low, high) = (pairs.get(after.saturating_sub(1)), pairs.get(after).or(pairs.last()));
        *node = match (low, high) {
            (Some((v0, x0)), Some((v1, x1))) if v1 > v0 => {
                x0 + (x1 - x0) * ((speed - v0) / (v1 - v0)).clamp(0.0, 1.0)
            }
            (Some((_, x)), _) => *x,
            _ => 0.0,
        };
    }
}

/// The scatter of this train's stops relative to the prior of the model, averaged over its steps.
fn scatter_scale(engine: &Train, model: &MotionModel) -> f64 {
    let ratios: Vec<f64> = steps(model.highest())
        .skip(4)
        .map(|step| {
            let sd = engine.stop_scatter.sd(engine.speeds.speed(step, Approach::Below));
            sd / model.stop(step, Approach::Below).scatter.max(Length::from_mm(0.1))
        })
        .collect();
    ratios.iter().sum::<f64>() / ratios.len().max(1) as f64
}

#[cfg(test)]
mod tests {
    use footplate_core::model::survey::SectionIndex;
    use footplate_core::track::TurnoutStates;
    use footplate_sim::LawFamily;

    use super::super::trial::{TRAIN, world};
    use super::*;

    #[test]
    fn the_oracle_model_matches_the_train() {
        let layout = footplate_store::layout_named("track-a").unwrap().layout;
        let (sections, turnouts) = (SectionIndex::of(&layout), TurnoutStates::unknown());
        let context = TrackContext { layout: &layout, sections: &sections, turnouts: &turnouts };
        for law in LawFamily::ALL {
            let line = world(&layout, 3, law).unwrap();
            let truth = line.station.world.truth();
            let engine = truth.engine(TRAIN).unwrap();
            let model = known(context, truth, TRAIN, &[]).unwrap();
            for step in steps(engine.speeds.highest()).skip(4) {
                let speed = engine.speeds.speed(step, Approach::Below);
                let found = model.speed(step, Approach::Below).value;
                // Partly warm: a train deviates at most 2.5 % from its warm speed.
                assert!((0.97..1.01).contains(&(found / speed)), "{law} {step}: {found:?} for {speed:?}");
                let from_truth =
                    speed * engine.command_delay + engine.stopping_distance(step, Approach::Below);
                let said = model.stop(step, Approach::Below).distance;
                // The stops of a counter decoder jump from step to step by more than the model's nodes can follow.
                let within_mm = if law == LawFamily::Momentum { 60.0 } else { 10.0 };
                assert!(
                    (said - from_truth).abs().as_mm() < within_mm,
                    "{law} {step}: {said:?} for {from_truth:?}"
                );
            }
        }
    }
}
