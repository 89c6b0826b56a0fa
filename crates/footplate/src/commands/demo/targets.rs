//! Draws the targets of the demo's stops from the seed.

use footplate_core::track::Landmark;
use footplate_core::tracking::TrackContext;
use footplate_core::{Length, NodeId, SpeedStep};
use footplate_eval::seeds::Choice;

/// The least distance between a target and the sensors before and after it (chosen: nearer targets would be named after
/// the other sensor, or equal it).
const MARGIN: Length = Length::from_m(0.05);
/// Hops ahead that a target is drawn from: a little more than one lap of track A.
const LOOK_AHEAD: usize = 16;

/// A random place ahead of a train that left node `from`, at least `least` beyond that node.
pub(super) fn target_ahead(
    choice: &mut Choice,
    context: TrackContext<'_>,
    from: NodeId,
    least: Length,
) -> Option<Landmark> {
    let mut distance = Length::ZERO;
    let mut places: Vec<(NodeId, Length)> = Vec::new();
    for hop in context.hops_ahead(from).take(LOOK_AHEAD) {
        if distance >= least && hop.sensor.is_some() && hop.length > MARGIN + MARGIN {
            places.push((hop.from, hop.length));
        }
        distance += hop.length;
    }
    // Only sensors are named as targets: stops can be measured against them.
    let (node, length) = *choice.of(&places)?;
    let free = length - MARGIN - MARGIN;
    // Whole millimetres, as an operator would enter it.
    let offset = Length::from_mm((MARGIN + free * choice.between(0.0, 1.0)).as_mm().round());
    Some(Landmark { node, offset })
}

/// `count` of the usable steps, spread from low to high, in random order.
pub(super) fn steps_for_stops(choice: &mut Choice, usable: &[SpeedStep], count: usize) -> Vec<SpeedStep> {
    let place = |nth: usize| {
        let last = usable.len().saturating_sub(1);
        // The lowest fifth is left out: those steps creep for a minute.
        last / 5 + (last - last / 5) * nth / count.saturating_sub(1).max(1)
    };
    let mut steps: Vec<SpeedStep> = (0..count).filter_map(|nth| usable.get(place(nth)).copied()).collect();
    // Shuffled as Fisher and Yates do.
    for last in (1..steps.len()).rev() {
        steps.swap(last, choice.between(0.0, (last + 1) as f64) as usize);
    }
    steps
}

#[cfg(test)]
mod tests {
    use footplate_core::model::survey::SectionIndex;
    use footplate_core::track::{Leg, TurnoutStates};

    use super::*;

    #[test]
    fn a_target_lies_ahead_and_between_sensors() {
        let layout = footplate_store::built_in("track-a").unwrap().layout;
        let sections = SectionIndex::of(&layout);
        let mut turnouts = TurnoutStates::unknown();
        for (turnout, _) in layout.turnouts() {
            turnouts.set(turnout, Leg::Straight);
        }
        let context = TrackContext { layout: &layout, sections: &sections, turnouts: &turnouts };
        let from = layout.node_named("C13").unwrap();
        let mut choice = Choice::new(7);
        for _ in 0..200 {
            let target = target_ahead(&mut choice, context, from, Length::from_m(1.0)).unwrap();
            let hop = context.hop_from(target.node).unwrap();
            assert!(layout.sensor_at(target.node).is_some());
            assert!(target.offset >= MARGIN && target.offset < hop.length);
        }
        assert!(target_ahead(&mut choice, context, from, Length::from_m(900.0)).is_none());
    }

    #[test]
    fn steps_are_spread_over_all_that_are_usable() {
        let usable: Vec<SpeedStep> = (3..=14).filter_map(SpeedStep::new).collect();
        let mut steps = steps_for_stops(&mut Choice::new(1), &usable, 5);
        steps.sort();
        assert_eq!(steps.iter().map(|step| step.get()).collect::<Vec<_>>(), [5, 7, 9, 11, 14]);
        assert!(steps_for_stops(&mut Choice::new(1), &[], 5).is_empty());
    }
}
