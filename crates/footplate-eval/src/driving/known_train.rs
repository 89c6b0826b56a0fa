//! What the same driver could do that knew the train: a motion model made of the truth.
//!
//! Nothing of it is measured: speeds, delays, laws and lengths are those of the simulated train, with next to no doubt.
//! What remains are the things that nobody can know: when a poll saw its contact, how this run deviates, where stops
//! scatter, and what the model's own form leaves over.

use anyhow::{Context, anyhow};
use footplate_core::model::{MotionModel, StepUse};
use footplate_core::tracking::{Locator, TrackContext, WayPoint};
use footplate_core::{Approach, Event, EventKind, Length, NodeId, SpeedStep, TimeSpan, Timestamp, TrainId};
use footplate_sim::{Law, Train, Truth};

/// What an oracle doubts of each number (in its SI unit): nothing, but a matrix without any doubt inverts badly.
const DOUBT: f64 = 1e-6;
/// The same of a length, in metres.
const DOUBT_OF_LENGTH_M: f64 = 0.5e-3;
/// Places of the model's numbers, as in core's `model/parameters.rs`.
const UP: usize = 1;
const DOWN: usize = 5;
const START_DELAY: usize = 9;
const FRICTION: usize = 10;
const STOP_NODES: usize = 11;
const NODES: usize = 8;
const SPEEDS: usize = STOP_NODES + 2 * NODES;
/// Speeds of the nodes, in m/s.
const NODE_SPACING: f64 = 0.1;
/// Below this speed hysteresis shrinks in proportion, as in the model, in m/s.
const FULL_HYSTERESIS_FROM: f64 = 0.12;
/// A start is over after this.
const STARTED: TimeSpan = TimeSpan::from_ms(12_000);
/// Lags of the simulator's motors behind set speeds that move gently, and behind counters, in s.
const RAMPED_LAG_S: f64 = 0.04;
const COUNTED_LAG_S: f64 = 0.12;
/// Internal steps of a decoder's counter between two throttle steps.
const COUNTS_PER_STEP: f64 = 9.0;

/// The model of a train whose every property is known; `ahead` is the way on which its lengths are wanted.
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
    // The test below says whether the places still mean the same.
    anyhow::ensure!(
        numbers.values.len() == SPEEDS + 2 * highest,
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
    numbers.covariance =
        (0..side).flat_map(|i| (0..=i).map(move |j| if i == j { DOUBT * DOUBT } else { 0.0 })).collect();
    numbers.uses = (0..=highest).map(|_| StepUse::Moves).collect();
    for (step, found) in numbers.uses.iter_mut().enumerate() {
        // A start that draws a high breakaway would not get going at such a step.
        let speed = SpeedStep::new(step as u8).map(|step| engine.speeds.speed(step, Approach::Below));
        if speed.is_some_and(|speed| speed < engine.breakaway * 1.8) {
            *found = StepUse::Unreliable;
        }
    }
    numbers.sections = sections(context, truth, train, ahead);
    let plain = MotionModel::from_numbers(&numbers).map_err(|error| anyhow!("{error}"))?;

    // What the laws leave over, from the train itself.
    let stops = steps(numbers.highest).map(|step| {
        let speed = engine.speeds.speed(step, Approach::Below);
        let really = speed * engine.command_delay + engine.stopping_distance(step, Approach::Below);
        (speed.as_m_per_s(), (really - plain.stop(step, Approach::Below).distance).as_m())
    });
    fill_nodes(&mut numbers.values[STOP_NODES..STOP_NODES + NODES], &stops.collect::<Vec<_>>());
    let starts = steps(numbers.highest).filter_map(|step| {
        let really =
            engine.distance_after(SpeedStep::STAND, Approach::Below, step, STARTED - engine.command_delay);
        let foreseen = way_after_start(context, &plain, step)?;
        (really > Length::ZERO)
            .then(|| (engine.speeds.speed(step, Approach::Below).as_m_per_s(), (really - foreseen).as_m()))
    });
    let starts = starts.collect::<Vec<_>>();
    fill_nodes(&mut numbers.values[STOP_NODES + NODES..SPEEDS], &starts);
    numbers.scatter_scale = scatter_scale(engine, &plain);
    MotionModel::from_numbers(&numbers).map_err(|error| anyhow!("{error}"))
}

fn steps(highest: SpeedStep) -> impl Iterator<Item = SpeedStep> {
    (1..=highest.get()).filter_map(SpeedStep::new)
}

/// Lag, ramp time for a change of speed and ramp time a step, upwards and downwards.
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

/// How far a train gets that is told a step, by a model.
fn way_after_start(context: TrackContext<'_>, model: &MotionModel, step: SpeedStep) -> Option<Length> {
    let train = model.train();
    let (_, node) = context.layout.sensors().next()?;
    let mut locator = Locator::new(train);
    locator.place(Timestamp::ZERO, WayPoint { node, way: Length::ZERO }, Length::ZERO);
    let told = Event { time: Timestamp::ZERO, kind: EventKind::Speed { train, step } };
    locator.handle_command(context, model, &told);
    Some(locator.locate(context, model, Timestamp::ZERO + STARTED)?.at.way)
}

/// Lengths of hops as the train feels them, by section.
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
            let felt = truth.felt(train, hop.edges, from, to);
            if let (Some(section), Some(felt)) = (context.sections.section(hop.id), felt)
                && !found.iter().any(|(known, ..)| *known == section)
            {
                let longer = (felt - hop.length).as_m();
                found.push((section, longer, DOUBT_OF_LENGTH_M * DOUBT_OF_LENGTH_M));
            }
        }
    }
    found
}

/// Numbers at the nodes from pairs of speed and number in order of speed, between them straight, beyond them constant.
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

/// How far this train's stops scatter against what the model takes for usual, on average over its steps.
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
    fn what_the_oracle_says_of_a_train_is_true() {
        let layout = footplate_store::layout_named("track-a").unwrap().layout;
        let (sections, turnouts) = (SectionIndex::of(&layout), TurnoutStates::unknown());
        let context = TrackContext { layout: &layout, sections: &sections, turnouts: &turnouts };
        for law in LawFamily::ALL {
            let line = world(&layout, 3, law).unwrap();
            let truth = line.station.world().truth();
            let engine = truth.engine(TRAIN).unwrap();
            let model = known(context, truth, TRAIN, &[]).unwrap();
            for step in steps(engine.speeds.highest()).skip(4) {
                let speed = engine.speeds.speed(step, Approach::Below);
                let found = model.speed(step, Approach::Below).value;
                // Half warm: no train is more than 2.5 % slower than warm, nor faster.
                assert!((0.97..1.01).contains(&(found / speed)), "{law} {step}: {found:?} for {speed:?}");
                let really = speed * engine.command_delay + engine.stopping_distance(step, Approach::Below);
                let said = model.stop(step, Approach::Below).distance;
                // A counter's stops jump from step to step by more than the model's nodes can follow.
                let within_mm = if law == LawFamily::Momentum { 60.0 } else { 10.0 };
                assert!((said - really).abs().as_mm() < within_mm, "{law} {step}: {said:?} for {really:?}");
            }
        }
    }
}
