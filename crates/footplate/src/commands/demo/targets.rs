//! Where the demo asks trains to stop: anywhere on their way, drawn from the seed.

use footplate_core::track::Landmark;
use footplate_core::tracking::TrackContext;
use footplate_core::{Length, NodeId, SpeedStep};

/// So far past a contact at least, and so far before the next one: nearer nobody would name a place by it.
const PAST: Length = Length::from_m(0.05);
const BEFORE: Length = Length::from_m(0.05);
/// Contacts ahead among which a target is drawn: a lap of track A and a little more.
const LOOK_AHEAD: usize = 16;

/// Random numbers of the demo, not of the simulator: SplitMix64 (Steele, Lea and Flood, 2014).
#[derive(Debug, Clone)]
pub(super) struct Dice(u64);

impl Dice {
    pub(super) const fn new(seed: u64) -> Self {
        Self(seed)
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut mixed = self.0;
        mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        mixed ^ (mixed >> 31)
    }

    /// From 0 up to, not including, 1.
    fn share(&mut self) -> f64 {
        // 53 bits fill the fraction of a double.
        (self.next() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// One of several.
    pub(super) fn one<'a, T>(&mut self, of: &'a [T]) -> Option<&'a T> {
        of.get((self.share() * of.len() as f64) as usize)
    }

    /// All of them, in any order (Fisher and Yates).
    pub(super) fn shuffle<T>(&mut self, items: &mut [T]) {
        for last in (1..items.len()).rev() {
            items.swap(last, (self.share() * (last + 1) as f64) as usize);
        }
    }
}

/// A place on the way ahead of a train that is on its way from a node, at least `least` beyond that node.
pub(super) fn target_ahead(
    dice: &mut Dice,
    context: TrackContext<'_>,
    from: NodeId,
    least: Length,
) -> Option<Landmark> {
    let mut way = Length::ZERO;
    let mut places: Vec<(NodeId, Length)> = Vec::new();
    for hop in context.hops_ahead(from).take(LOOK_AHEAD) {
        if way >= least && hop.sensor.is_some() && hop.length > PAST + BEFORE {
            places.push((hop.from, hop.length));
        }
        way += hop.length;
    }
    // Only contacts report trains; a turnout or a track end is no place to lay a tape.
    let (node, length) = *dice.one(&places)?;
    let free = length - PAST - BEFORE;
    // To the millimetre, as a person would name it.
    let offset = Length::from_mm((PAST + free * dice.share()).as_mm().round());
    Some(Landmark { node, offset })
}

/// Five steps out of all that can be relied upon: low, high and between, in any order.
pub(super) fn steps_to_stop_from(dice: &mut Dice, usable: &[SpeedStep], count: usize) -> Vec<SpeedStep> {
    let place = |nth: usize| {
        let last = usable.len().saturating_sub(1);
        // A fifth from the bottom up to the top: lower ones crawl for a minute.
        last / 5 + (last - last / 5) * nth / count.saturating_sub(1).max(1)
    };
    let mut steps: Vec<SpeedStep> = (0..count).filter_map(|nth| usable.get(place(nth)).copied()).collect();
    dice.shuffle(&mut steps);
    steps
}

#[cfg(test)]
mod tests {
    use footplate_core::model::survey::SectionIndex;
    use footplate_core::track::{Leg, TurnoutStates};

    use super::*;

    #[test]
    fn a_target_lies_ahead_and_between_contacts() {
        let layout = footplate_store::built_in("track-a").unwrap().layout;
        let sections = SectionIndex::of(&layout);
        let mut turnouts = TurnoutStates::unknown();
        for (turnout, _) in layout.turnouts() {
            turnouts.set(turnout, Leg::Straight);
        }
        let context = TrackContext { layout: &layout, sections: &sections, turnouts: &turnouts };
        let from = layout.node_named("C13").unwrap();
        let mut dice = Dice::new(7);
        for _ in 0..200 {
            let target = target_ahead(&mut dice, context, from, Length::from_m(1.0)).unwrap();
            let hop = context.hop_from(target.node).unwrap();
            assert!(layout.sensor_at(target.node).is_some());
            assert!(target.offset >= PAST && target.offset < hop.length);
        }
        assert!(target_ahead(&mut dice, context, from, Length::from_m(900.0)).is_none());
    }

    #[test]
    fn steps_are_spread_over_all_that_are_usable() {
        let usable: Vec<SpeedStep> = (3..=14).filter_map(SpeedStep::new).collect();
        let mut steps = steps_to_stop_from(&mut Dice::new(1), &usable, 5);
        steps.sort();
        assert_eq!(steps.iter().map(|step| step.get()).collect::<Vec<_>>(), [5, 7, 9, 11, 14]);
        assert!(steps_to_stop_from(&mut Dice::new(1), &[], 5).is_empty());
    }
}
