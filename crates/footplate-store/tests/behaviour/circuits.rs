//! Circuits on the built-in layouts: where a train can be sent to run for as long as it is being calibrated.

use std::collections::BTreeMap;

use footplate_core::track::{Layout, Leg, TurnoutStates};
use footplate_store::built_in;

fn layout(name: &str) -> Layout {
    built_in(name).unwrap().layout
}

/// Walks a circuit for a few laps with the turnouts lying as it says.
fn runs_round(layout: &Layout, start: footplate_core::NodeId) -> Option<usize> {
    let circuit = layout.circuit_from(start, &BTreeMap::new(), &[])?;
    let legs: TurnoutStates = circuit.legs.iter().copied().collect();
    assert_eq!(layout.illegal_pair(&legs), None);
    let first = circuit.lap.first().and_then(|id| layout.hop(*id)).unwrap().from;
    let mut node = first;
    for id in circuit.lap.iter().cycle().take(2 * circuit.lap.len()) {
        let open: Vec<_> = layout.open_hops_from(node, &legs).collect();
        assert_eq!(open.len(), 1, "every facing turnout is set");
        assert_eq!(open[0].id, *id);
        node = open[0].to;
    }
    assert_eq!(node, first);
    Some(circuit.lap.len())
}

#[test]
fn most_places_of_the_built_in_layouts_lead_onto_a_long_circuit() {
    for name in ["track-a", "track-b"] {
        let layout = layout(name);
        let laps: Vec<Option<usize>> = layout.sensors().map(|(_, node)| runs_round(&layout, node)).collect();
        let with = laps.iter().flatten().count();
        assert!(with >= laps.len() * 3 / 4, "{name}: {with} of {}", laps.len());
        assert!(laps.iter().flatten().all(|contacts| *contacts >= 8), "{name}: {laps:?}");
    }
}

#[test]
fn a_circuit_leads_around_a_turnout_that_cannot_be_thrown() {
    let layout = layout("track-a");
    let start = layout.node_named("C13").unwrap();
    let free = layout.circuit_from(start, &BTreeMap::new(), &[]).unwrap();
    let mut around = 0;
    for (turnout, leg) in &free.legs {
        let other = Leg::from_curved(!leg.is_curved());
        let held = BTreeMap::from([(*turnout, Some(other))]);
        let Some(found) = layout.circuit_from(start, &held, &[]) else { continue };
        around += 1;
        let hops = found.lead.iter().chain(&found.lap).filter_map(|id| layout.hop(*id));
        let mut needs = hops.flat_map(|hop| hop.needs);
        assert!(needs.all(|need| !need.facing || need.turnout != *turnout || need.leg == other));
    }
    assert!(around > 0, "at least one of the turnouts can be gone around");
}
