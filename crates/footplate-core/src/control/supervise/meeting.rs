//! Which trains could meet.

use alloc::collections::{BTreeMap, BTreeSet};

use crate::ids::EdgeId;
use crate::track::{Layout, Position};
use crate::units::Length;

/// The rails within a way of a place, by any leg of any turnout, ahead only or both ways: each as the edge of the lower
/// number.
pub(super) fn rails_within(
    layout: &Layout,
    place: Position,
    ahead: Length,
    behind: Length,
) -> BTreeSet<EdgeId> {
    let mut rails = walk(layout, place, ahead);
    if let Some(back) = layout.reversed(place) {
        rails.extend(walk(layout, back, behind));
    }
    rails
}

/// The same rails for both directions.
pub(super) fn rails(edge: EdgeId) -> EdgeId {
    edge.min(edge.twin())
}

fn walk(layout: &Layout, from: Position, reach: Length) -> BTreeSet<EdgeId> {
    let mut found = BTreeSet::new();
    // By edge, with how much way was left at its beginning: a longer rest may lead further.
    let mut best: BTreeMap<EdgeId, Length> = BTreeMap::new();
    let mut open = alloc::vec![(from.edge, reach + from.offset)];
    while let Some((edge, left)) = open.pop() {
        if best.get(&edge).is_some_and(|known| *known >= left) {
            continue;
        }
        best.insert(edge, left);
        found.insert(rails(edge));
        let Some(known) = layout.edge(edge) else { continue };
        let rest = left - known.length;
        if rest > Length::ZERO {
            open.extend(layout.outgoing(known.to).edges().map(|next| (next, rest)));
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::track::example::oval;

    #[test]
    fn rails_are_found_by_both_legs_and_both_ways_and_no_further_than_the_way() {
        let layout = oval();
        let node = |name| layout.node_named(name).unwrap();
        let edge = |from, to| layout.edge_between(node(from), node(to)).unwrap();
        let place = Position { edge: edge("A1", "BR1"), offset: Length::from_mm(50.0) };
        let near = rails_within(&layout, place, Length::from_mm(10.0), Length::from_mm(10.0));
        assert_eq!(near, [rails(place.edge)].into());
        let ahead = rails_within(&layout, place, Length::from_mm(120.0), Length::ZERO);
        assert!(ahead.contains(&rails(edge("BR1", "B1"))) && ahead.contains(&rails(edge("BR1", "C1"))));
        let all = rails_within(&layout, place, Length::from_m(50.0), Length::from_m(50.0));
        assert!(all.len() > ahead.len() && !all.contains(&rails(edge("EN1", "E1"))));
    }
}
