//! Itineraries on the oval, with their running times added up by hand.

use super::*;
use crate::control::dispatch::reservation::Reservation;
use crate::ids::TurnoutId;
use crate::track::Leg;
use crate::track::example::oval;

fn place(layout: &Layout, from: &str, to: &str, mm: f64) -> Position {
    let node = |name: &str| layout.node_named(name).unwrap();
    Position { edge: layout.edge_between(node(from), node(to)).unwrap(), offset: Length::from_mm(mm) }
}

/// What a train does that is 100 mm past D1 of the oval, at 100 mm/s, with 1 s for a start, 2 s for a stop and 4 s to reverse: seconds,
/// and from where to where each run goes (its number of edges, whether it reverses).
fn found(
    search: impl FnOnce(&mut Search<'_>),
    obstacle: Option<(Position, f64)>,
    may_reverse: bool,
    target: Position,
) -> Option<(f64, Vec<(usize, bool)>)> {
    let layout = oval();
    let mut obstacles = Obstacles::default();
    if let Some((from, seconds)) = obstacle {
        let mut taken = Reservation::empty();
        taken.take(&layout, from.edge, from.offset, from.offset + Length::from_mm(20.0));
        obstacles.add(&taken, seconds);
    }
    let pace = Pace { cruise: Speed::from_mm_per_s(100.0), start_s: 1.0, stop_s: 2.0, reversal_s: 4.0 };
    let mut whole = Search {
        layout: &layout,
        pace,
        clears: Length::from_mm(50.0),
        beyond: Length::ZERO,
        turnouts: &TurnoutStates::unknown(),
        obstacles: &obstacles,
        frozen: &[],
        may_trail_frozen: false,
    };
    search(&mut whole);
    let at = place(&layout, "D1", "A1", 100.0);
    let reversed = layout.reversed(at).filter(|_| may_reverse);
    let reached = whole.from(Some(at), reversed);
    let itinerary = reached.to(&[target]).pop()?;
    for pair in itinerary.runs.windows(2) {
        assert_eq!(layout.reversed(pair[0].stop), Some(pair[1].start), "runs join");
    }
    assert_eq!(itinerary.runs.last().map(|run| run.stop), Some(target));
    Some((itinerary.seconds, itinerary.runs.iter().map(|run| (run.edges.len(), run.reverses)).collect()))
}

fn assert_takes(found: Option<(f64, Vec<(usize, bool)>)>, seconds: f64, runs: &[(usize, bool)]) {
    let (took, ran) = found.unwrap();
    assert!((took - seconds).abs() < 1e-9 && ran == runs, "{took} s, {ran:?}");
}

#[test]
fn a_place_ahead_takes_its_distance_a_start_and_a_stop() {
    let layout = oval();
    let at = |from, to, mm| place(&layout, from, to, mm);
    // 300 mm on the same edge; 400 + 100 + 200 + 50 mm to one past B1.
    assert_takes(found(|_| (), None, true, at("D1", "A1", 400.0)), 3.0 + 3.0, &[(1, false)]);
    assert_takes(found(|_| (), None, true, at("B1", "MR2", 50.0)), 7.5 + 3.0, &[(4, false)]);
    // 199 mm ahead are too short for a move of its own: a lap over C1, 1070 mm, comes before.
    assert_takes(found(|_| (), None, false, at("D1", "A1", 301.0)), 2.01 + 3.0, &[(1, false)]);
    assert_takes(found(|_| (), None, false, at("D1", "A1", 299.0)), 10.7 + 1.99 + 3.0, &[(6, false)]);
}

#[test]
fn a_train_that_reverses_first_runs_the_other_direction_round() {
    let layout = oval();
    let back = |mm| layout.reversed(place(&layout, "D1", "A1", mm)).unwrap();
    // Back over D2, C2 and A2: 100 + 100 + 370 + 100 + 450 mm.
    assert_takes(found(|_| (), None, true, back(50.0)), 11.2 + 7.0, &[(6, true)]);
}

#[test]
fn track_of_others_costs_their_time_or_is_closed() {
    let layout = oval();
    let at = |from, to, mm| place(&layout, from, to, mm);
    let (target, met) = (at("D1", "A1", 400.0), at("D1", "A1", 200.0));
    assert_takes(found(|_| (), Some((met, 5.0)), false, target), 6.0 + 5.0, &[(1, false)]);
    assert_eq!(found(|_| (), Some((met, f64::INFINITY)), false, target), None);
    // Beyond the stop it needs 60 mm, of which 50 are on this edge, or 49.
    let (target, met) = (at("D1", "A1", 450.0), at("A1", "BR1", 0.0));
    let beyond = |mm| {
        let room = |search: &mut Search<'_>| search.beyond = Length::from_mm(mm);
        found(room, Some((met, f64::INFINITY)), false, target).is_some()
    };
    assert_eq!([beyond(49.0), beyond(60.0)], [true, false]);
}

#[test]
fn a_turnout_that_cannot_be_thrown_is_passed_and_backed_over_once_a_sensor_beyond_has_reported() {
    let layout = oval();
    let at = |from, to, mm| place(&layout, from, to, mm);
    const FROZEN: [TurnoutNeed; 1] = [TurnoutNeed { turnout: TurnoutId(1), leg: Leg::Curved, facing: true }];
    let frozen = |target| found(|search| search.frozen = &FROZEN, None, false, target);
    // On the curved leg: 400 + 100 + 220 + 50 mm.
    assert_takes(frozen(at("C1", "MR2", 50.0)), 7.7 + 3.0, &[(4, false)]);
    assert_eq!(
        frozen(at("B1", "MR2", 50.0)),
        None,
        "only a train that comes over C1 and back could be there"
    );
    // 400 + 100 + 370 mm to the other turnout, 100 to D1 and 60 past it, reverse, and 160 back and 50 on the straight leg.
    let back = layout.reversed(at("B1", "MR2", 150.0)).unwrap();
    assert_takes(frozen(back), 8.7 + 1.6 + 1.6 + 0.5 + 2.0 * 3.0 + 4.0, &[(6, false), (3, true)]);
}
