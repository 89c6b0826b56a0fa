//! Circuits: closed routes, on which a train can run without end.

use alloc::collections::{BTreeMap, VecDeque};
use alloc::vec;
use alloc::vec::Vec;

use crate::ids::{NodeId, StretchId, TurnoutId};
use crate::track::{Hop, HopId, Layout, Leg, TurnoutNeed};
use crate::units::Length;

/// Most hops that one search tries. The built-in layouts take a few thousand; at the limit the search returns the best
/// circuit found so far.
const MAX_TRIED: usize = 1 << 16;

/// Most sensors on the lead to a circuit. A train that is farther away passes a better starting point first.
const LONGEST_LEAD: usize = 6;

/// A closed route, and the lead onto it.
#[derive(Debug, Clone, PartialEq)]
pub struct Circuit {
    /// The hops from the start to the lap; none if the start is on the lap.
    pub lead: Vec<HopId>,
    /// The hops of the lap, from a sensor back to it.
    pub lap: Vec<HopId>,
    /// The length of one lap.
    pub length: Length,
    /// The turnouts that the lap needs, each once. Trailed ones are included, because trailed points wear.
    pub legs: Vec<(TurnoutId, Leg)>,
}

impl Circuit {
    /// The hops from the start: the lead, then the lap without end.
    pub fn hops(&self) -> impl Iterator<Item = HopId> + '_ {
        self.lead.iter().chain(self.lap.iter().cycle()).copied()
    }
}

impl Layout {
    /// The best circuit that a train at a node can reach without reversing: the one with the most sensors,
    /// then the fewest curved legs, then the greatest length. The result is deterministic.
    ///
    /// It uses no stretch in `avoid`, and turnouts in `locked` only in the position given there (`None`: unknown
    /// position, so the circuit does not face it). Locked turnouts cannot be thrown, because a train is on them or
    /// too near.
    pub fn circuit_from(
        &self,
        start: NodeId,
        held: &BTreeMap<TurnoutId, Option<Leg>>,
        avoid: &[StretchId],
    ) -> Option<Circuit> {
        self.circuit_over(start, held, avoid, &|_| 1)
    }

    /// The same with a value for each hop: the circuit with the greatest sum.
    pub fn circuit_over(
        &self,
        start: NodeId,
        held: &BTreeMap<TurnoutId, Option<Leg>>,
        avoid: &[StretchId],
        worth: &dyn Fn(HopId) -> usize,
    ) -> Option<Circuit> {
        let mut search = Search { layout: self, held, avoid, worth, tried: 0, best: None };
        for lead in search.leads_from(start) {
            search.laps_after(start, &lead);
        }
        search.best.map(|best| best.circuit)
    }
}

struct Search<'l> {
    layout: &'l Layout,
    held: &'l BTreeMap<TurnoutId, Option<Leg>>,
    avoid: &'l [StretchId],
    worth: &'l dyn Fn(HopId) -> usize,
    tried: usize,
    best: Option<Best>,
}

struct Best {
    circuit: Circuit,
    /// Twice the value of the lap, less one for each hop of its lead.
    worth: usize,
    curved: usize,
}

impl<'l> Search<'l> {
    /// The leads with the fewest sensors to every node that can begin a lap, the start itself first.
    fn leads_from(&self, start: NodeId) -> Vec<Vec<HopId>> {
        let mut leads: Vec<Vec<HopId>> = vec![];
        let mut seen = vec![start];
        let mut open = VecDeque::from([(start, Vec::new())]);
        while let Some((node, lead)) = open.pop_front() {
            if lead.len() < LONGEST_LEAD {
                for hop in self.layout.hops_from(node).filter(|hop| self.is_allowed(hop)) {
                    if !seen.contains(&hop.to) {
                        seen.push(hop.to);
                        let mut longer = lead.clone();
                        longer.push(hop.id);
                        open.push_back((hop.to, longer));
                    }
                }
            }
            leads.push(lead);
        }
        leads
    }

    /// Whether a hop by itself may be part of a circuit.
    fn is_allowed(&self, hop: &Hop<'_>) -> bool {
        hop.sensor.is_some()
            && !hop.edges.iter().any(|edge| self.avoid.contains(&edge.stretch()))
            && hop.needs.iter().all(|need| self.can_lie(*need))
    }

    fn can_lie(&self, need: TurnoutNeed) -> bool {
        match self.held.get(&need.turnout) {
            None => true,
            Some(leg) => !need.facing || *leg == Some(need.leg),
        }
    }

    /// Tries all laps through the end of a lead, depth first.
    fn laps_after(&mut self, start: NodeId, lead: &[HopId]) {
        let first = lead.last().and_then(|id| self.layout.hop(*id)).map_or(start, |hop| hop.to);
        let mut legs = BTreeMap::new();
        let mut lap = Vec::new();
        self.go_on(first, first, lead, &mut lap, &mut legs);
    }

    fn go_on(
        &mut self,
        first: NodeId,
        node: NodeId,
        lead: &[HopId],
        lap: &mut Vec<HopId>,
        legs: &mut BTreeMap<TurnoutId, Leg>,
    ) {
        let layout = self.layout;
        for hop in layout.hops_from(node) {
            if self.tried >= MAX_TRIED {
                return;
            }
            self.tried += 1;
            let passed = |id: &HopId| layout.hop(*id).is_some_and(|past| past.to == hop.to);
            if !self.is_allowed(&hop) || lap.iter().any(passed) {
                continue;
            }
            let Some(added) = self.agree(&hop, legs) else { continue };
            lap.push(hop.id);
            if hop.to == first {
                self.offer(lead, lap, legs);
            } else {
                self.go_on(first, hop.to, lead, lap, legs);
            }
            lap.pop();
            for turnout in added {
                legs.remove(&turnout);
            }
        }
    }

    /// Adds the needs of a hop to those of the lap, unless they contradict each other. Returns the turnouts added.
    fn agree(&self, hop: &Hop<'_>, legs: &mut BTreeMap<TurnoutId, Leg>) -> Option<Vec<TurnoutId>> {
        let mut added = Vec::new();
        for need in hop.needs {
            let partner = self.layout.never_curved_with(need.turnout);
            let is_barred =
                need.leg.is_curved() && partner.and_then(|turnout| legs.get(&turnout)) == Some(&Leg::Curved);
            let known = legs.get(&need.turnout).copied();
            if is_barred || known.is_some_and(|leg| leg != need.leg) {
                for turnout in added {
                    legs.remove(&turnout);
                }
                return None;
            }
            if known.is_none() {
                legs.insert(need.turnout, need.leg);
                added.push(need.turnout);
            }
        }
        Some(added)
    }

    fn offer(&mut self, lead: &[HopId], lap: &[HopId], legs: &BTreeMap<TurnoutId, Leg>) {
        let curved = legs.values().filter(|leg| leg.is_curved()).count();
        let length: Length = lap.iter().filter_map(|id| self.layout.hop(*id)).map(|hop| hop.length).sum();
        let gained: usize = lap.iter().map(|hop| (self.worth)(*hop)).sum();
        let worth = (2 * gained).saturating_sub(lead.len());
        let is_better = self.best.as_ref().is_none_or(|best| {
            worth
                .cmp(&best.worth)
                .then(best.curved.cmp(&curved))
                .then(length.as_m().total_cmp(&best.circuit.length.as_m()))
                .is_gt()
        });
        if is_better && length > Length::ZERO {
            let legs = legs.iter().map(|(turnout, leg)| (*turnout, *leg)).collect();
            let circuit = Circuit { lead: lead.to_vec(), lap: lap.to_vec(), length, legs };
            self.best = Some(Best { circuit, worth, curved });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::track::example::{oval, oval_plan};
    use std::string::String;

    fn names(layout: &Layout, hops: &[HopId]) -> String {
        let ends = hops.iter().filter_map(|id| layout.hop(*id)).map(|hop| layout.node_name(hop.to));
        ends.collect::<Vec<_>>().join(" ")
    }

    fn circuit(start: &str, held: &[(u16, Option<Leg>)], avoid: &[StretchId]) -> Option<Circuit> {
        let layout = oval();
        let held = held.iter().map(|(turnout, leg)| (TurnoutId(*turnout), *leg)).collect();
        layout.circuit_from(layout.node_named(start).unwrap(), &held, avoid)
    }

    #[test]
    fn of_two_circuits_with_equally_many_sensors_the_straight_one_is_chosen() {
        let found = circuit("A1", &[], &[]).unwrap();
        assert_eq!(names(&oval(), &found.lap), "B1 D1 A1");
        assert!(found.lead.is_empty());
        assert_eq!(found.legs, [(TurnoutId(1), Leg::Straight), (TurnoutId(2), Leg::Straight)]);
        assert!((found.length.as_mm() - 1_100.0).abs() < 1e-9);
        let round: Vec<HopId> = found.hops().take(4).collect();
        assert_eq!(names(&oval(), &round), "B1 D1 A1 B1");
    }

    #[test]
    fn a_circuit_avoids_locked_turnouts_and_excluded_stretches() {
        let lap = |held: &[(u16, Option<Leg>)], avoid: &[StretchId]| {
            circuit("A1", held, avoid).map(|found| names(&oval(), &found.lap))
        };
        assert_eq!(lap(&[(1, Some(Leg::Curved))], &[]).as_deref(), Some("C1 D1 A1"));
        assert_eq!(lap(&[(1, None)], &[]), None, "the path of the train would be unknown");
        assert_eq!(
            lap(&[(2, None)], &[]).as_deref(),
            Some("B1 D1 A1"),
            "a trailed turnout does not decide the path"
        );
        let layout = oval();
        let node = |name| layout.node_named(name).unwrap();
        let b = layout.edge_between(node("B1"), node("MR2")).unwrap().stretch();
        assert_eq!(lap(&[], &[b]).as_deref(), Some("C1 D1 A1"));
    }

    #[test]
    fn a_train_that_faces_the_end_of_its_track_has_no_circuit() {
        assert_eq!(circuit("E1", &[], &[]), None);
        assert_eq!(circuit("E2", &[], &[]), None);
    }

    #[test]
    fn two_turnouts_in_one_place_are_never_both_needed_curved() {
        let mut plan = oval_plan();
        plan.never_both_curved = vec![[TurnoutId(1), TurnoutId(2)]];
        let layout = Layout::build(&plan).unwrap();
        let held = BTreeMap::from([(TurnoutId(1), Some(Leg::Curved))]);
        assert_eq!(layout.circuit_from(layout.node_named("A1").unwrap(), &held, &[]), None);
    }
}
