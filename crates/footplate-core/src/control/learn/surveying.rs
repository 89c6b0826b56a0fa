//! Where lengths are unknown or wrong, a train runs round by other circuits, too, until every section was passed a few times.

use alloc::collections::BTreeMap;

use super::activity::Activity;
use super::calibrator::Calibrator;
use super::notice::CalibrationNotice;
use crate::ids::{NodeId, TurnoutId};
use crate::time::Timestamp;
use crate::track::{Circuit, HopId, Leg};

/// A section is known well once it was passed this often: a passage tells its length to 10 to 15 mm, a poll at both ends, and
/// what trains feel of curves, 8 mm of a usual section, no passage narrows.
const ENOUGH: u32 = 4;

/// Another circuit is worth its way there if this many passages more are wanted on it.
const WORTH_CHANGING: usize = 4;

/// A section that was measured where others were not is wanted so many times as often: all others are as good as it is.
const MEASURED: u32 = 3;

/// How often sections were passed, and where the last passage was.
#[derive(Debug, Clone, Default)]
pub(super) struct Passes {
    of: BTreeMap<usize, u32>,
    at: Option<NodeId>,
}

impl Calibrator<'_> {
    /// Whether lengths are worth going out of the way for.
    fn surveys(&self) -> bool {
        self.survey_test.factor > 1.0 || !self.survey_test.odd.is_empty() || !self.layout.is_measured()
    }

    /// The train passed a contact.
    pub(super) fn count_passage(&mut self, node: NodeId) {
        let from = self.passes.at.replace(node);
        let Some(from) = from else { return };
        let mut ways =
            self.layout.hops_from(from).filter(|hop| hop.to == node && hop.is_open(&self.turnouts));
        if let (Some(hop), None) = (ways.next(), ways.next())
            && let Some(section) = self.sections.section(hop.id)
        {
            *self.passes.of.entry(section).or_default() += 1;
        }
    }

    /// Passages over a hop that are still wanted.
    fn wanted(&self, hop: HopId) -> usize {
        let section = self.sections.section(hop);
        let passed = section.and_then(|section| self.passes.of.get(&section)).copied().unwrap_or(0);
        let is_the_measure = self.sections.is_measured(hop) && !self.layout.is_measured();
        let enough = if is_the_measure { MEASURED * ENOUGH } else { ENOUGH };
        enough.saturating_sub(passed) as usize
    }

    fn wanted_on(&self, circuit: &Circuit) -> usize {
        circuit.lap.iter().map(|hop| self.wanted(*hop)).sum()
    }

    /// The circuit to run on from a node: the one with the most contacts or, where lengths are unknown, the most unknown.
    pub(super) fn circuit_worth_most(
        &self,
        node: NodeId,
        held: &BTreeMap<TurnoutId, Option<Leg>>,
    ) -> Option<Circuit> {
        let avoid = &self.settings.avoid;
        let unknown = self.surveys().then(|| {
            let circuit = self.layout.circuit_over(node, held, avoid, &|hop| self.wanted(hop));
            circuit.filter(|circuit| self.wanted_on(circuit) > 0)
        });
        unknown.flatten().or_else(|| self.layout.circuit_from(node, held, avoid))
    }

    /// Leaves for a circuit on which more is unknown, if there is one; `true` if it does.
    pub(super) fn goes_where_more_is_unknown(&mut self, now: Timestamp) -> bool {
        if !self.surveys() {
            return false;
        }
        let (Some(here), Some(node)) = (&self.circuit, self.tracker.last()) else { return false };
        let wanted = self.wanted_on(here);
        let held = self.held(node);
        let other = self.circuit_worth_most(node, &held);
        let Some(other) = other.filter(|other| self.wanted_on(other) >= wanted + WORTH_CHANGING) else {
            return false;
        };
        self.say(CalibrationNotice::Circuit(other.clone()));
        self.circuit = Some(other);
        self.activity = Activity::Joining;
        self.throw_turnouts(now, node);
        self.expect_contact(now);
        self.go_on_if_set(now, node);
        true
    }
}
