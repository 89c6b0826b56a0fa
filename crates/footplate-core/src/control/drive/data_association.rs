//! Which train closed a contact: the likeliest of everything that may have, if it is likely enough.
//!
//! Each explanation has a density in time (1/s) with its prior chance in it; that of a contact closing by itself comes
//! from the contact's own faults. The probability of a train in the sum of all is the probability that it was this train. A
//! train is believed from [`ASSIGNED_FROM`] on. Below that nobody's estimate is touched. What may have been branches is kept as
//! [`Branch`]es, and the next closures resolve between them: a train that was distinguished wrongly is taken back.

use alloc::boxed::Box;
use alloc::collections::BTreeMap;
use alloc::vec::Vec;

use crate::event::Event;
use crate::ids::{SensorId, TrainId, TurnoutId};
use crate::time::Timestamp;
use crate::tracking::TrackContext;

use super::ambiguity::{Ambiguity, Branch};
use super::driven_train::DrivenTrain;
use super::hypotheses::{Detection, Explanation, Hypothesis, hypotheses};
use super::sensor_faults::SensorFaults;

/// A train closed a contact if that is at least this probable.
const ASSIGNED_FROM: f64 = 0.9;
/// What was believed from the first is not looked at again once it is this probable.
const RESOLVED_FROM: f64 = 0.9999;
/// What is less probable is not kept in mind.
const NEGLIGIBLE: f64 = 0.01;
/// A density (ln 1/s) that is less than this is unusual: a contact was missed, a turnout failed, a train has changed.
const UNUSUAL: f64 = -3.0;

/// What is made of a detection.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Association {
    /// It was this train.
    Explained(Explanation),
    /// It may have been one of two, or one and spurious; what comes next decides.
    Ambiguous { likeliest: TrainId, or: Option<TrainId> },
    /// Nothing that trains can do.
    Unexplained,
    /// The same, of a contact that is not believed from now on.
    Stuck,
    /// Of a contact that is not believed.
    Ignored,
}

/// An earlier detection in ambiguity that has been decided.
#[derive(Debug, Clone)]
pub(super) enum Resolution {
    /// It was branches than is believed.
    Revised(Box<Branch>),
    /// No train did it, as is believed.
    Spurious(Detection),
}

/// Judges closures one after the other.
#[derive(Debug, Clone, Default)]
pub(super) struct DataAssociation {
    faults: SensorFaults,
    ambiguity: Option<Ambiguity>,
}

impl DataAssociation {
    /// A contact that was stuck and is believed again; until `None`.
    pub(super) fn next_restored(&mut self, now: Timestamp) -> Option<SensorId> {
        self.faults.next_restored(now)
    }

    /// Somebody knows better where a train is, or that nobody does: what may have been does not matter any more.
    pub(super) fn forget(&mut self, train: TrainId) {
        self.ambiguity.take_if(|ambiguity| ambiguity.branches.iter().any(|branch| branch.train == train));
    }

    /// Whether a train may be elsewhere than it is believed to be, because a contact that it passed or did not pass is in
    /// ambiguity.
    pub(super) fn is_ambiguous(&self, train: TrainId) -> bool {
        let branches = self.ambiguity.iter().flat_map(|ambiguity| &ambiguity.branches);
        branches.into_iter().any(|branch| branch.train == train)
    }

    /// A turnout was set somehow: what it may have been before does not matter any more.
    pub(super) fn turnout_thrown(&mut self, turnout: TurnoutId) {
        let branches = self.ambiguity.iter_mut().flat_map(|ambiguity| &mut ambiguity.branches);
        branches.for_each(|branch| branch.turnout_thrown(turnout));
    }

    /// A command to a train has left: those that it may be hear it, too.
    pub(super) fn command_left(
        &mut self,
        trains: &BTreeMap<TrainId, DrivenTrain>,
        context: TrackContext<'_>,
        event: &Event,
    ) {
        let branches = self.ambiguity.iter_mut().flat_map(|ambiguity| &mut ambiguity.branches);
        for branch in branches {
            if let Some(train) = trains.get(&branch.train) {
                branch.locator.handle_command(context, &train.model, event);
            }
        }
    }

    /// Looks whether one more detection decides what an earlier one was. To be asked before it is judged itself.
    pub(super) fn resolve(
        &mut self,
        trains: &BTreeMap<TrainId, DrivenTrain>,
        context: TrackContext<'_>,
        now: Timestamp,
        detection: Detection,
    ) -> Option<Resolution> {
        let mut ambiguity = self.ambiguity.take()?;
        if ambiguity.is_over(now) {
            return (!ambiguity.is_assigned).then_some(Resolution::Spurious(ambiguity.detection));
        }
        let log_spurious = self.faults.log_rate(detection.sensor, now);
        // How well the new detection is explained, if the earlier one was so.
        let likely = |found: &[Hypothesis]| {
            libm::exp(log_spurious) + found.iter().map(|one| libm::exp(one.log_density)).sum::<f64>()
        };
        let assigned = ambiguity.probability * likely(&hypotheses(trains, context, now, detection));
        let explains = |branch: &Branch| branch.explains(trains, context, now, detection);
        let explained: Vec<Vec<Hypothesis>> = ambiguity.branches.iter().map(explains).collect();
        for (branch, found) in ambiguity.branches.iter_mut().zip(&explained) {
            branch.probability *= likely(found);
        }
        let all = assigned + ambiguity.branches.iter().map(|branch| branch.probability).sum::<f64>();
        if !ambiguity.is_assigned && assigned >= ASSIGNED_FROM * all {
            self.faults.note_unexplained(ambiguity.detection.sensor, ambiguity.detection.window.until);
            return Some(Resolution::Spurious(ambiguity.detection));
        }
        if ambiguity.is_assigned && assigned >= RESOLVED_FROM * all {
            return None;
        }
        let is_decided = |branch: &Branch| {
            let enough = branch
                .passes
                .iter()
                .map(|pass| required_probability(&pass.explanation))
                .fold(ASSIGNED_FROM, f64::max);
            branch.probability >= enough * all
        };
        if let Some(place) = ambiguity.branches.iter().position(is_decided) {
            let branch = ambiguity.branches.into_iter().nth(place)?;
            if branch.caused {
                self.faults.note_explained(branch.detection.sensor, now);
            } else {
                self.faults.note_unexplained(branch.detection.sensor, branch.detection.window.until);
            }
            return Some(Resolution::Revised(Box::new(branch)));
        }
        ambiguity.probability = assigned / all;
        for (branch, found) in ambiguity.branches.iter_mut().zip(&explained) {
            branch.probability /= all;
            branch.extend(trains, context, detection, found, log_spurious);
        }
        self.ambiguity = Some(ambiguity);
        None
    }

    /// Judges a detection.
    pub(super) fn associate(
        &mut self,
        trains: &BTreeMap<TrainId, DrivenTrain>,
        context: TrackContext<'_>,
        now: Timestamp,
        detection: Detection,
    ) -> Association {
        let found = hypotheses(trains, context, now, detection);
        let spurious = libm::exp(self.faults.log_rate(detection.sensor, now));
        let density = |one: &Hypothesis| libm::exp(one.log_density);
        let all = spurious + found.iter().map(density).sum::<f64>();
        let mut of_trains: Vec<(TrainId, f64)> = Vec::new();
        for one in &found {
            let train = one.explanation.train();
            match of_trains.iter_mut().find(|(known, _)| *known == train) {
                Some((_, probability)) => *probability += density(one) / all,
                None => of_trains.push((train, density(one) / all)),
            }
        }
        of_trains.sort_by(|(_, one), (_, other)| other.total_cmp(one));
        let best = of_trains.first().copied();
        let likeliest_of = |train: TrainId| {
            let own = found.iter().filter(move |one| one.explanation.train() == train);
            own.max_by(|one, other| one.log_density.total_cmp(&other.log_density))
        };
        let enough =
            |train| likeliest_of(train).map_or(ASSIGNED_FROM, |one| required_probability(&one.explanation));
        if let Some((train, _)) = best.filter(|(train, probability)| *probability >= enough(*train)) {
            self.faults.note_explained(detection.sensor, now);
            if self.faults.is_stuck(detection.sensor) {
                return Association::Ignored;
            }
            if let Some(one) = likeliest_of(train) {
                if one.log_density < UNUSUAL {
                    if self.ambiguity.as_ref().is_some_and(|ambiguity| {
                        !ambiguity.is_assigned || ambiguity.probability < ASSIGNED_FROM
                    }) {
                        // What came before may explain it better, once that is decided.
                        return Association::Ambiguous { likeliest: train, or: None };
                    }
                    if let Some(train) = trains.get(&train) {
                        let not_passed =
                            Branch::not_passing(train, context, detection, &one.explanation, spurious / all);
                        self.ambiguity = Some(Ambiguity::assigned(now, not_passed, self.ambiguity.take()));
                    }
                }
                return Association::Explained(one.explanation);
            }
        }
        let Some((likeliest, _)) = best.filter(|_| spurious < ASSIGNED_FROM * all) else {
            return self.unexplained(detection);
        };
        if self.faults.is_stuck(detection.sensor) {
            self.faults.note_unexplained(detection.sensor, now);
            return Association::Ignored;
        }
        let branches = found
            .iter()
            .filter(|one| density(one) >= NEGLIGIBLE * all)
            .filter_map(|one| Branch::passing(trains, context, detection, one, density(one) / all));
        // One ambiguity at a time: an older one that this detection did not resolve is given up.
        self.ambiguity = Some(Ambiguity::unassigned(now, detection, spurious / all, branches.collect()));
        let second = of_trains.get(1).filter(|(_, probability)| *probability >= spurious / all);
        Association::Ambiguous { likeliest, or: second.map(|(train, _)| *train) }
    }

    fn unexplained(&mut self, detection: Detection) -> Association {
        let was_stuck = self.faults.is_stuck(detection.sensor);
        let is_news = self.faults.note_unexplained(detection.sensor, detection.window.until);
        match (was_stuck, is_news) {
            (true, _) => Association::Ignored,
            (false, true) => Association::Stuck,
            (false, false) => Association::Unexplained,
        }
    }
}

/// How probable an explanation has to be to be believed. That a train is not where it was believed to be takes a second
/// detection: by one that it did not make its place would be given to others while it stands there.
const fn required_probability(explanation: &Explanation) -> f64 {
    match explanation {
        Explanation::Strayed(_) => RESOLVED_FROM,
        Explanation::Train(_) | Explanation::Turnout { .. } => ASSIGNED_FROM,
    }
}
