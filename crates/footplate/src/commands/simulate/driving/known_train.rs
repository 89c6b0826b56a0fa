//! What the same driver could do that knew the train: a motion model made of the truth.
//!
//! Nothing of it is measured: speeds, delays, changes of speed and lengths are those of the simulated train. What
//! remains are the things that nobody can know: when a poll saw its contact, how this run deviates, where stops scatter,
//! and what the model's own form leaves over.

use anyhow::Context;
use footplate_core::calibration::motion::{KnownMotion, MotionModel};
use footplate_core::estimation::Ground;
use footplate_core::{Approach, Length, NodeId, SpeedStep, TimeSpan, TrainId};
use footplate_sim::{Train, Truth};

/// A change of speed is over after this.
const SETTLED: TimeSpan = TimeSpan::from_ms(12_000);

/// The model of a train whose every property is known; `ahead` is the way on which its lengths are wanted.
pub(super) fn known(
    ground: Ground<'_>,
    truth: Truth<'_, '_>,
    train: TrainId,
    ahead: &[NodeId],
) -> anyhow::Result<MotionModel> {
    let engine = truth.engine(train).context("the train is not there")?;
    let warmth = truth.train(train).map_or(1.0, |truth| truth.warmth);
    let warm = 1.0 - engine.warm_up.as_parts() * (1.0 - warmth);
    let highest = engine.speeds.highest();
    let speed = |step, approach| engine.speeds.speed(step, approach) * warm;
    let delay = engine.command_delay;
    // How much farther it gets by a change than if it had changed at once when the command left.
    let change = |from: SpeedStep, to: SpeedStep| {
        let approach = if to < from { Approach::Above } else { Approach::Below };
        let before = engine.speeds.speed(from, Approach::Below) * delay;
        let way = before + engine.way_after(from, Approach::Below, to, SETTLED);
        (from, to, (way - engine.speeds.speed(to, approach) * (delay + SETTLED)) * warm)
    };
    let starts_and_stops =
        steps(highest).flat_map(|step| [change(step, SpeedStep::STAND), change(SpeedStep::STAND, step)]);
    let mut known = KnownMotion {
        train,
        speeds: steps(highest)
            .map(|step| [Approach::Below, Approach::Above].map(|side| speed(step, side)))
            .collect(),
        delays: [delay + engine.change_dead_time; 2],
        start_delay: delay + engine.start_dead_time,
        changes: starts_and_stops.collect(),
        sections: sections(ground, truth, train, ahead),
        scatter_scale: 1.0,
    };
    known.scatter_scale = scatter_scale(engine, &MotionModel::from_known(&known));
    Ok(MotionModel::from_known(&known))
}

fn steps(highest: SpeedStep) -> impl Iterator<Item = SpeedStep> {
    (1..=highest.get()).filter_map(SpeedStep::new)
}

/// By how much hops are longer than surveyed, as the train feels them, by section.
fn sections(
    ground: Ground<'_>,
    truth: Truth<'_, '_>,
    train: TrainId,
    ahead: &[NodeId],
) -> Vec<(usize, Length)> {
    let mut found: Vec<(usize, Length)> = Vec::new();
    for node in ahead {
        for hop in ground.layout.hops_from(*node) {
            let (Some(from), Some(to)) = (ground.layout.sensor_at(*node), hop.sensor) else { continue };
            let felt = truth.felt(train, hop.edges, from, to);
            if let (Some(section), Some(felt)) = (ground.sections.section(hop.id), felt)
                && !found.iter().any(|(known, ..)| *known == section)
            {
                found.push((section, felt - hop.length));
            }
        }
    }
    found
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
    use footplate_core::calibration::SectionIndex;
    use footplate_core::track::TurnoutStates;
    use footplate_sim::LawFamily;

    use super::super::trial::{TRAIN, world};
    use super::*;

    #[test]
    fn what_the_oracle_says_of_a_train_is_true() {
        let layout = footplate_store::layout_named("track-a").unwrap().layout;
        let (sections, turnouts) = (SectionIndex::of(&layout), TurnoutStates::unknown());
        let ground = Ground { layout: &layout, sections: &sections, turnouts: &turnouts };
        for law in LawFamily::ALL {
            let line = world(&layout, 3, law).unwrap();
            let truth = line.station.world().truth();
            let engine = truth.engine(TRAIN).unwrap();
            let model = known(ground, truth, TRAIN, &[]).unwrap();
            for step in steps(engine.speeds.highest()).skip(4) {
                let speed = engine.speeds.speed(step, Approach::Below);
                let found = model.speed(step, Approach::Below).value;
                // Half warm: no train is more than 2.5 % slower than warm, nor faster.
                assert!((0.97..1.01).contains(&(found / speed)), "{law} {step}: {found:?} for {speed:?}");
                let really = speed * engine.command_delay + engine.way_to_rest(step, Approach::Below);
                let said = model.stop(step, Approach::Below).distance;
                assert!((said - really).abs().as_mm() < 25.0, "{law} {step}: {said:?} for {really:?}");
            }
        }
    }
}
