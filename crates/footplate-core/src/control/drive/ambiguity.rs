//! An ambiguous detection, and the state of one train under each alternative explanation.

use alloc::collections::BTreeMap;
use alloc::vec::Vec;

use crate::ids::{SensorId, TrainId, TurnoutId};
use crate::time::{TimeSpan, Timestamp};
use crate::track::{Leg, TurnoutStates};
use crate::tracking::{Locator, PassedSensor, TrackContext};

use super::driven_train::DrivenTrain;
use super::ends::Ends;
use super::hypotheses::{Detection, Explanation, Hypothesis, hypotheses};

/// An ambiguity that lasts longer is never resolved: even a creeping train reaches two more sensors in this time. One about the leg that a
/// train took lasts until a sensor decides it: the train is stopped because of it, and would start from the wrong leg.
const RESOLVE_WITHIN: TimeSpan = TimeSpan::from_s(15.0);
/// The number of alternatives kept: two for each train of a layout.
const MAX_BRANCHES: usize = 8;

/// A sensor that a train passed in a branch.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pass {
    pub(super) detection: Detection,
    pub(super) explanation: Explanation,
    /// The detection beside its prediction.
    pub(super) passed: PassedSensor,
}

/// The state of one train if the assignment is wrong.
#[derive(Debug, Clone)]
pub(super) struct Branch {
    /// The ambiguous detection, and whether the train caused it.
    pub(super) detection: Detection,
    pub(super) caused: bool,
    pub(super) train: TrainId,
    /// What the train has passed since, that detection included.
    pub(super) passes: Vec<Pass>,
    /// Turnout positions that differ from the known ones in this branch.
    pub(super) legs: Vec<(TurnoutId, Leg)>,
    /// Its position in this branch.
    pub(super) locator: Locator,
    /// A sensor that should have reported it before.
    pub(super) missed_sensor: Option<SensorId>,
    /// Where its run and its authority ended, before the detection.
    pub(super) ends: Ends,
    /// The prior probability, updated with each later detection.
    pub(super) probability: f64,
}

/// An ambiguous detection.
#[derive(Debug, Clone)]
pub(super) struct Ambiguity {
    pub(super) detection: Detection,
    /// Whether it was assigned to a train.
    pub(super) is_assigned: bool,
    /// The probability of that.
    pub(super) probability: f64,
    pub(super) branches: Vec<Branch>,
    /// `None`: until a sensor decides it.
    until: Option<Timestamp>,
}

impl Ambiguity {
    /// A detection that was not assigned, and the trains that may have caused it.
    pub(super) fn unassigned(
        now: Timestamp,
        detection: Detection,
        probability: f64,
        branches: Vec<Branch>,
    ) -> Self {
        Self { detection, is_assigned: false, probability, branches, until: Some(now + RESOLVE_WITHIN) }
    }

    /// A detection of a train in a direction that is not known. Only another sensor shows it, however long the train takes to get there.
    pub(super) fn of_direction(self) -> Self {
        Self { until: None, ..self }
    }

    /// A detection that was assigned to a train, with the branch in which that train did not cause it. Branches of an
    /// earlier assignment are kept.
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
        let until = branches.iter().all(|branch| branch.legs.is_empty()).then_some(now + RESOLVE_WITHIN);
        Self { detection, is_assigned: true, probability, branches, until }
    }

    pub(super) fn is_over(&self, now: Timestamp) -> bool {
        self.until.is_some_and(|until| now >= until)
    }
}

impl Branch {
    /// The branch in which a train caused a detection.
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
        branch.pass(trains, context, detection, hypothesis);
        Some(branch)
    }

    /// The branch in which a train did not cause the detection that was assigned to it. A turnout position that the
    /// assignment showed is then not known.
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
            ends: train.ends(),
            probability,
        }
    }

    /// A turnout was commanded: forget its position in this branch.
    pub(super) fn turnout_thrown(&mut self, thrown: TurnoutId) {
        self.legs.retain(|(turnout, _)| *turnout != thrown);
    }

    /// All trains and turnout positions in this branch.
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

    /// The hypotheses for a detection in this branch.
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

    /// Adds a further detection to the branch if this train is its most likely cause.
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
            self.pass(trains, context, detection, one);
        }
    }

    fn pass(
        &mut self,
        trains: &BTreeMap<TrainId, DrivenTrain>,
        context: TrackContext<'_>,
        detection: Detection,
        &Hypothesis { explanation, sensor, .. }: &Hypothesis,
    ) {
        let Some(train) = trains.get(&self.train) else { return };
        let detection = Detection { sensor, ..detection };
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
