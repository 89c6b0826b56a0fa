//! Where rails come together or cross, only one train is granted room: at single turnouts, at slips, and at the crossovers in the
//! middle of the built-in tracks, where four turnouts lie in one place.

use footplate_core::control::Reservation;
use footplate_core::track::{Layout, Leg, NodeKind};
use footplate_core::{EdgeId, Length, NodeId, TurnoutId};
use footplate_store::built_in;

/// The fouling point of Märklin's 22.5 degree turnouts: nearer to the toe there is no room beside each other (mm).
const FOULING: f64 = 180.0;
/// How finely points are looked at (mm).
const STEP: f64 = 12.0;

const TRACKS: [&str; 2] = ["track-a", "track-b"];

fn track(name: &str) -> Layout {
    built_in(name).expect("built in").layout
}

/// A point beyond a toe, and the legs over which it is reached.
#[derive(Debug, Clone)]
struct Beyond {
    edge: EdgeId,
    offset: Length,
    legs: Vec<(TurnoutId, Leg)>,
}

/// Every point up to the fouling point beyond a toe, over all legs of all turnouts that follow.
fn beyond(layout: &Layout, toe: NodeId) -> Vec<Beyond> {
    let mut found = Vec::new();
    let mut open = vec![(toe, 0.0, Vec::new())];
    while let Some((node, at, legs)) = open.pop() {
        for id in layout.outgoing(node).edges() {
            let edge = layout.edge(id).expect("an edge");
            let mut legs: Vec<(TurnoutId, Leg)> = legs.clone();
            if let (Some(NodeKind::Branch(turnout)), Some(leg)) =
                (layout.node(node).map(|node| node.kind), edge.leg)
            {
                legs.push((turnout, leg));
            }
            let mm = edge.length.as_mm();
            let points = (0..).map(|nth| f64::from(nth) * STEP).take_while(|along| *along <= mm);
            for along in points.filter(|along| at + along < FOULING) {
                found.push(Beyond { edge: id, offset: Length::from_mm(along), legs: legs.clone() });
            }
            if at + mm < FOULING {
                open.push((edge.to, at + mm, legs));
            }
        }
    }
    found
}

fn taken(layout: &Layout, at: &Beyond) -> Reservation {
    let mut taken = Reservation::empty();
    taken.take(layout, at.edge, at.offset, at.offset);
    taken
}

#[test]
fn nearer_to_a_toe_than_the_fouling_point_nobody_is_let_onto_two_of_its_legs() {
    for name in TRACKS {
        let layout = track(name);
        let mut looked_at = 0;
        for (turnout, toe) in layout.turnouts() {
            let points = beyond(&layout, toe);
            let leg_of = |at: &Beyond| at.legs.iter().find(|(of, _)| *of == turnout).map(|(_, leg)| *leg);
            for one in points.iter().filter(|at| leg_of(at) == Some(Leg::Straight)) {
                for other in points.iter().filter(|at| leg_of(at) == Some(Leg::Curved)) {
                    looked_at += 1;
                    let meets = taken(&layout, one).meets(&taken(&layout, other));
                    assert!(meets, "{name}, turnout {turnout}: {one:?} and {other:?}");
                }
            }
        }
        // 22 turnouts with at least 15 points on either leg.
        assert!(looked_at >= 22 * 15 * 15, "{name}: {looked_at}");
    }
}

/// Ways over the middle from one leg of it to another: the edges, each as it is run over.
fn crossings(layout: &Layout) -> Vec<Vec<EdgeId>> {
    let middle: Vec<TurnoutId> = layout.never_both_curved().iter().flatten().copied().collect();
    let is_middle = |node: NodeId| {
        matches!(layout.node(node).map(|node| node.kind),
            Some(NodeKind::Branch(turnout) | NodeKind::Merge(turnout)) if middle.contains(&turnout))
    };
    let mut found = Vec::new();
    // From each rail that leads to the middle, over whatever legs, until it leaves that.
    let leads_in = |id: &EdgeId| {
        let edge = layout.edge(*id).expect("an edge");
        is_middle(edge.to) && !is_middle(edge.from)
    };
    let mut open: Vec<Vec<EdgeId>> =
        layout.edges().map(|(id, _)| id).filter(leads_in).map(|id| vec![id]).collect();
    while let Some(way) = open.pop() {
        let at = layout.edge(*way.last().expect("never empty")).expect("an edge").to;
        if !is_middle(at) {
            found.push(way);
            continue;
        }
        for next in layout.outgoing(at).edges() {
            open.push([way.clone(), vec![next]].concat());
        }
    }
    found
}

#[test]
fn two_ways_over_the_middle_of_a_crossover_never_have_room_beside_each_other() {
    for name in TRACKS {
        let layout = track(name);
        let ways = crossings(&layout);
        // Three rails on either side, each joined to each of the other side, in both directions.
        assert_eq!(ways.len(), 18, "{name}");
        // A train of 260 mm in the middle of its way.
        let half = Length::from_mm(130.0);
        let reservation = |way: &Vec<EdgeId>| {
            let mut taken = Reservation::empty();
            let (first, last) = (way[0], way[way.len() - 1]);
            let length = layout.edge(first).expect("an edge").length;
            taken.take(&layout, first, length - half, length);
            for id in &way[1..way.len() - 1] {
                let length = layout.edge(*id).expect("an edge").length;
                taken.take(&layout, *id, Length::ZERO, length);
            }
            taken.take(&layout, last, Length::ZERO, half);
            taken
        };
        for one in &ways {
            for other in &ways {
                assert!(reservation(one).meets(&reservation(other)), "{name}: {one:?} and {other:?}");
            }
        }
    }
}

#[test]
fn who_holds_one_turnout_of_a_place_holds_the_other_with_it() {
    for name in TRACKS {
        let layout = track(name);
        for [one, other] in layout.never_both_curved() {
            for (first, second) in [(one, other), (other, one)] {
                let mut taken = Reservation::empty();
                taken.take_turnout(&layout, *first);
                assert!(taken.takes(*first) && taken.takes(*second), "{name}: {first} without {second}");
            }
        }
        // No way of the table asks for both legs of a pair to be curved at once.
        let mut pairs = layout.hops().filter(|hop| {
            layout.never_both_curved().iter().any(|pair| {
                pair.iter().all(|turnout| {
                    hop.needs.iter().any(|need| need.turnout == *turnout && need.leg == Leg::Curved)
                })
            })
        });
        assert_eq!(pairs.next(), None, "{name}");
    }
}
