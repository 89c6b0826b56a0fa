//! A closure of which nobody is sure, and how things are with one train if it was otherwise than is believed.

use alloc::collections::BTreeMap;
use alloc::vec::Vec;

use crate::ids::{SensorId, TrainId, TurnoutId};
use crate::time::{TimeSpan, Timestamp};
use crate::track::{Leg, TurnoutStates};
use crate::tracking::{Locator, PassedContact, TrackContext};

use super::driven_train::DrivenTrain;
use super::hypotheses::{Closure, Explanation, Hypothesis, hypotheses};

/// A closure that is still not explained after this long never will be: two contacts further even at a crawl.
const WAITS: TimeSpan = TimeSpan::from_s(15.0);
/// More ways in which it may be otherwise are not kept in mind at once: all trains of a layout in doubt twice.
const MOST_BRANCHES: usize = 8;

/// A contact that a train passed.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pass {
    pub(super) closure: Closure,
    pub(super) explanation: Explanation,
    /// How, and what had been expected.
    pub(super) passed: PassedContact,
}

/// How things are with one train if they are not as is believed.
#[derive(Debug, Clone)]
pub(super) struct Branch {
    /// What is in doubt, and whether the train did it.
    pub(super) closure: Closure,
    pub(super) did_it: bool,
    pub(super) train: TrainId,
    /// What it passed from that closure on.
    pub(super) passes: Vec<Pass>,
    /// How turnouts lie then that are believed to lie otherwise.
    pub(super) lies: Vec<(TurnoutId, Leg)>,
    /// As it was followed from there since.
    pub(super) locator: Locator,
    /// A contact that should have reported it before.
    pub(super) unseen: Option<SensorId>,
    /// Its share before what came after.
    pub(super) share: f64,
}

/// A closure of which nobody is sure.
#[derive(Debug, Clone)]
pub(super) struct Doubt {
    pub(super) closure: Closure,
    /// Whether a train is believed to have done it.
    pub(super) is_believed: bool,
    /// The share of what is believed.
    pub(super) share: f64,
    pub(super) otherwise: Vec<Branch>,
    until: Timestamp,
}

impl Doubt {
    /// A closure that nobody is believed to have done, and the ways in which somebody may have.
    pub(super) fn unbelieved(now: Timestamp, closure: Closure, share: f64, otherwise: Vec<Branch>) -> Self {
        Self { closure, is_believed: false, share, otherwise, until: now + WAITS }
    }

    /// A closure that a train is believed to have done, with this share of the times that it did not; and what was in
    /// doubt before stays so.
    pub(super) fn believed(now: Timestamp, not_passed: Branch, before: Option<Self>) -> Self {
        let closure = not_passed.closure;
        let did = 1.0 - not_passed.share;
        let mut otherwise = alloc::vec![not_passed];
        let mut share = did;
        if let Some(before) = before.filter(|before| before.is_believed) {
            share *= before.share;
            otherwise.extend(before.otherwise);
        }
        otherwise.sort_by(|one, other| other.share.total_cmp(&one.share));
        otherwise.truncate(MOST_BRANCHES);
        Self { closure, is_believed: true, share, otherwise, until: now + WAITS }
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
        closure: Closure,
        hypothesis: &Hypothesis,
        share: f64,
    ) -> Option<Self> {
        let explanation = hypothesis.explanation;
        let train = trains.get(&explanation.train())?;
        let mut branch = Self { did_it: true, unseen: None, ..Self::before(train, closure, share) };
        branch.pass(trains, context, closure, explanation);
        Some(branch)
    }

    /// A train as it goes on if it did not pass a contact, as is believed. What that has shown of a turnout is not so then.
    pub(super) fn not_passing(
        train: &DrivenTrain,
        context: TrackContext<'_>,
        closure: Closure,
        believed: &Explanation,
        share: f64,
    ) -> Self {
        let mut branch = Self::before(train, closure, share);
        if let Explanation::Turnout { turnout, .. } = *believed {
            branch.lies.extend(context.turnouts.get(turnout).map(|lies| (turnout, lies)));
        }
        branch
    }

    fn before(train: &DrivenTrain, closure: Closure, share: f64) -> Self {
        let (locator, unseen) = (train.locator.clone(), train.unseen());
        let (passes, lies) = (Vec::new(), Vec::new());
        Self { closure, did_it: false, train: train.id(), passes, lies, locator, unseen, share }
    }

    /// A turnout was thrown: however it lay before.
    pub(super) fn turnout_thrown(&mut self, thrown: TurnoutId) {
        self.lies.retain(|(turnout, _)| *turnout != thrown);
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
            train.expected.unseen = self.unseen;
        }
        (trains, self.turnouts(context))
    }

    fn turnouts(&self, context: TrackContext<'_>) -> TurnoutStates {
        let mut turnouts = context.turnouts.clone();
        self.lies.iter().for_each(|(turnout, leg)| turnouts.set(*turnout, *leg));
        turnouts
    }

    /// What explains a closure if it is so.
    pub(super) fn explains(
        &self,
        trains: &BTreeMap<TrainId, DrivenTrain>,
        context: TrackContext<'_>,
        now: Timestamp,
        closure: Closure,
    ) -> Vec<Hypothesis> {
        let (trains, turnouts) = self.world(trains, context);
        hypotheses(&trains, TrackContext { turnouts: &turnouts, ..context }, now, closure)
    }

    /// Goes on over one more closure if the likeliest explanation of it is this train.
    pub(super) fn go_on(
        &mut self,
        trains: &BTreeMap<TrainId, DrivenTrain>,
        context: TrackContext<'_>,
        closure: Closure,
        found: &[Hypothesis],
        log_nothing: f64,
    ) {
        let likeliest = found.iter().max_by(|one, other| one.log_density.total_cmp(&other.log_density));
        if let Some(one) = likeliest
            && one.log_density > log_nothing
            && one.explanation.train() == self.train
        {
            self.pass(trains, context, closure, one.explanation);
        }
    }

    fn pass(
        &mut self,
        trains: &BTreeMap<TrainId, DrivenTrain>,
        context: TrackContext<'_>,
        closure: Closure,
        explanation: Explanation,
    ) {
        let Some(train) = trains.get(&self.train) else { return };
        match explanation {
            Explanation::Turnout { turnout, leg, .. } => self.lies.push((turnout, leg)),
            Explanation::Strayed(_) => self.locator.lose(),
            Explanation::Train(_) => {}
        }
        let turnouts = self.turnouts(context);
        let context = TrackContext { turnouts: &turnouts, ..context };
        let passed = self.locator.pass(context, &train.model, closure.sensor, closure.window);
        self.unseen = None;
        self.passes.push(Pass { closure, explanation, passed });
    }
}
