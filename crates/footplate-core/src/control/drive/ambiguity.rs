//! A detection of which nobody is sure, and how things are with one train if it was branches than is believed.

use alloc::collections::BTreeMap;
use alloc::vec::Vec;

use crate::ids::{SensorId, TrainId, TurnoutId};
use crate::time::{TimeSpan, Timestamp};
use crate::track::{Leg, TurnoutStates};
use crate::tracking::{Locator, PassedContact, TrackContext};

use super::driven_train::DrivenTrain;
use super::hypotheses::{Detection, Explanation, Hypothesis, hypotheses};

/// A detection that is still not explained after this long never will be: two contacts further even at a crawl.
const RESOLVE_WITHIN: TimeSpan = TimeSpan::from_s(15.0);
/// More ways in which it may be branches are not kept in mind at once: all trains of a layout in ambiguity twice.
const MAX_BRANCHES: usize = 8;

/// A contact that a train passed.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pass {
    pub(super) detection: Detection,
    pub(super) explanation: Explanation,
    /// How, and what had been expected.
    pub(super) passed: PassedContact,
}

/// How things are with one train if they are not as is believed.
#[derive(Debug, Clone)]
pub(super) struct Branch {
    /// What is in ambiguity, and whether the train did it.
    pub(super) detection: Detection,
    pub(super) caused: bool,
    pub(super) train: TrainId,
    /// What it passed from that detection on.
    pub(super) passes: Vec<Pass>,
    /// How turnouts lie then that are believed to lie branches.
    pub(super) legs: Vec<(TurnoutId, Leg)>,
    /// As it was followed from there since.
    pub(super) locator: Locator,
    /// A contact that should have reported it before.
    pub(super) missed_sensor: Option<SensorId>,
    /// Its probability before what came after.
    pub(super) probability: f64,
}

/// A detection of which nobody is sure.
#[derive(Debug, Clone)]
pub(super) struct Ambiguity {
    pub(super) detection: Detection,
    /// Whether a train is believed to have done it.
    pub(super) is_assigned: bool,
    /// The probability of what is believed.
    pub(super) probability: f64,
    pub(super) branches: Vec<Branch>,
    until: Timestamp,
}

impl Ambiguity {
    /// A detection that nobody is believed to have done, and the ways in which somebody may have.
    pub(super) fn unassigned(
        now: Timestamp,
        detection: Detection,
        probability: f64,
        branches: Vec<Branch>,
    ) -> Self {
        Self { detection, is_assigned: false, probability, branches, until: now + RESOLVE_WITHIN }
    }

    /// A detection that a train is believed to have done, with this probability of the times that it did not; and what was in
    /// ambiguity before stays so.
    pub(super) fn assigned(now: Timestamp, not_passed: Branch, before: Option<Self>) -> Self {
        let detection = not_passed.detection;
        let did = 1.0 - not_passed.probability;
        let mut branches = alloc::vec![not_passed];
        let mut probability = did;
        if let Some(before) = before.filter(|before| before.is_assigned) {
            probability *= before.probability;
            branches.extend(before.branches);
        }
        branches.sort_by(|one, other| other.probability.total_cmp(&one.probability));
        branches.truncate(MAX_BRANCHES);
        Self { detection, is_assigned: true, probability, branches, until: now + RESOLVE_WITHIN }
    }

    pub(super) fn is_over(&self, now: Timestamp) -> bool {
        now >= self.until
    }
}

impl Branch {
    /// A train as it goes on from a contact, if it passed it.
    pub(super) fn passing(
        trains: &BTreeMap<TrainId, DrivenTrain>,
        context: TrackContext<'_>,
        detection: Detection,
        hypothesis: &Hypothesis,
        probability: f64,
    ) -> Option<Self> {
        let explanation = hypothesis.explanation;
        let train = trains.get(&explanation.train())?;
        let mut branch =
            Self { caused: true, missed_sensor: None, ..Self::before(train, detection, probability) };
        branch.pass(trains, context, detection, explanation);
        Some(branch)
    }

    /// A train as it goes on if it did not pass a contact, as is believed. What that has shown of a turnout is not so then.
    pub(super) fn not_passing(
        train: &DrivenTrain,
        context: TrackContext<'_>,
        detection: Detection,
        assigned: &Explanation,
        probability: f64,
    ) -> Self {
        let mut branch = Self::before(train, detection, probability);
        if let Explanation::Turnout { turnout, .. } = *assigned {
            branch.legs.extend(context.turnouts.get(turnout).map(|legs| (turnout, legs)));
        }
        branch
    }

    fn before(train: &DrivenTrain, detection: Detection, probability: f64) -> Self {
        let (locator, missed_sensor) = (train.locator.clone(), train.missed_sensor());
        let (passes, legs) = (Vec::new(), Vec::new());
        Self {
            detection,
            caused: false,
            train: train.id(),
            passes,
            legs,
            locator,
            missed_sensor,
            probability,
        }
    }

    /// A turnout was thrown: however it lay before.
    pub(super) fn turnout_thrown(&mut self, thrown: TurnoutId) {
        self.legs.retain(|(turnout, _)| *turnout != thrown);
    }

    /// All trains, and how the turnouts lie, if it is so.
    fn world(
        &self,
        trains: &BTreeMap<TrainId, DrivenTrain>,
        context: TrackContext<'_>,
    ) -> (BTreeMap<TrainId, DrivenTrain>, TurnoutStates) {
        let mut trains = trains.clone();
        if let Some(train) = trains.get_mut(&self.train) {
            train.locator = self.locator.clone();
            train.expected.missed_sensor = self.missed_sensor;
        }
        (trains, self.turnouts(context))
    }

    fn turnouts(&self, context: TrackContext<'_>) -> TurnoutStates {
        let mut turnouts = context.turnouts.clone();
        self.legs.iter().for_each(|(turnout, leg)| turnouts.set(*turnout, *leg));
        turnouts
    }

    /// What explains a detection if it is so.
    pub(super) fn explains(
        &self,
        trains: &BTreeMap<TrainId, DrivenTrain>,
        context: TrackContext<'_>,
        now: Timestamp,
        detection: Detection,
    ) -> Vec<Hypothesis> {
        let (trains, turnouts) = self.world(trains, context);
        hypotheses(&trains, TrackContext { turnouts: &turnouts, ..context }, now, detection)
    }

    /// Goes on over one more detection if the likeliest explanation of it is this train.
    pub(super) fn extend(
        &mut self,
        trains: &BTreeMap<TrainId, DrivenTrain>,
        context: TrackContext<'_>,
        detection: Detection,
        found: &[Hypothesis],
        log_spurious: f64,
    ) {
        let likeliest = found.iter().max_by(|one, other| one.log_density.total_cmp(&other.log_density));
        if let Some(one) = likeliest
            && one.log_density > log_spurious
            && one.explanation.train() == self.train
        {
            self.pass(trains, context, detection, one.explanation);
        }
    }

    fn pass(
        &mut self,
        trains: &BTreeMap<TrainId, DrivenTrain>,
        context: TrackContext<'_>,
        detection: Detection,
        explanation: Explanation,
    ) {
        let Some(train) = trains.get(&self.train) else { return };
        match explanation {
            Explanation::Turnout { turnout, leg, .. } => self.legs.push((turnout, leg)),
            Explanation::Strayed(_) => self.locator.lose(),
            Explanation::Train(_) => {}
        }
        let turnouts = self.turnouts(context);
        let context = TrackContext { turnouts: &turnouts, ..context };
        let passed = self.locator.pass(context, &train.model, detection.sensor, detection.window);
        self.missed_sensor = None;
        self.passes.push(Pass { detection, explanation, passed });
    }
}
