//! Data association: decides which train caused a detection.
//!
//! Each hypothesis has a density in time (1/s) that includes its prior probability. The density of a spurious
//! detection comes from the record of the sensor. Normalised, the densities are posterior probabilities. A detection
//! is assigned to a train whose probability is [`ASSIGNED_FROM`] or more; otherwise no estimate changes. Other
//! possibilities are kept as [`Branch`]es until later detections decide between them; a wrong assignment is then
//! corrected.

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
use super::unassigned::Unassigned;

/// A detection is assigned to a train from this probability on.
const ASSIGNED_FROM: f64 = 0.9;
/// An assignment is final from this probability on.
const RESOLVED_FROM: f64 = 0.9999;
/// Hypotheses below this probability are dropped.
const NEGLIGIBLE: f64 = 0.01;
/// Below this density (ln 1/s) an explanation is unusual: a sensor missed the train, a turnout failed, or the train
/// has changed.
const UNUSUAL: f64 = -3.0;

/// The result for a detection.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Association {
    /// One train caused it.
    Explained(Hypothesis),
    /// This train caused it, and its direction of travel is not known; later detections decide.
    EitherDirection(TrainId),
    /// Two trains, or one and a fault, may have caused it; later detections decide.
    Ambiguous { likeliest: TrainId, or: Option<TrainId> },
    /// No train can have caused it.
    Unexplained,
    /// No train can have caused it, and the sensor counts as stuck from now on.
    Stuck,
    /// The sensor is stuck, so its report is ignored.
    Ignored,
}

/// How later detections decided an ambiguous one.
#[derive(Debug, Clone)]
pub(super) enum Resolution {
    /// The assignment was wrong; this branch is right.
    Revised(Box<Branch>),
    /// No train caused it, and it was assigned to none.
    Spurious(Detection),
}

/// Associates detections with trains, one after the other.
#[derive(Debug, Clone, Default)]
pub(super) struct DataAssociation {
    faults: SensorFaults,
    ambiguity: Option<Ambiguity>,
    /// The last detection that no train explained.
    unexplained: Option<Unassigned>,
}

impl DataAssociation {
    /// Whether the reports of a sensor are ignored.
    pub(super) fn ignores(&self, sensor: SensorId) -> bool {
        self.faults.is_stuck(sensor)
    }

    /// ln of the rate (1/s) of spurious reports of a sensor before its last one.
    pub(super) fn log_rate_before(&self, sensor: SensorId, now: Timestamp) -> f64 {
        self.faults.log_rate_before(sensor, now)
    }

    /// A stuck sensor whose reports are used again; call until `None`.
    pub(super) fn next_restored(&mut self, now: Timestamp) -> Option<SensorId> {
        self.faults.next_restored(now)
    }

    /// Drops an ambiguity about a train whose position was entered or is lost.
    pub(super) fn forget(&mut self, train: TrainId) {
        self.ambiguity.take_if(|ambiguity| ambiguity.branches.iter().any(|branch| branch.train == train));
        self.unexplained.take_if(|unexplained| unexplained.may_be_of(train));
    }

    /// Whether the position of a train depends on an ambiguous detection that later ones may still resolve.
    pub(super) fn is_ambiguous(&self, train: TrainId, now: Timestamp) -> bool {
        let open = self.ambiguity.iter().filter(|ambiguity| !ambiguity.is_over(now));
        let branches = open.flat_map(|ambiguity| &ambiguity.branches);
        branches.into_iter().any(|branch| branch.train == train)
    }

    /// The train that is probably not where it was estimated, but at the sensor of the ambiguous detection.
    pub(super) fn probably_strayed(&self) -> Option<TrainId> {
        let ambiguity = self.ambiguity.as_ref().filter(|ambiguity| !ambiguity.is_assigned)?;
        let strayed = || ambiguity.branches.iter().filter(|branch| branch.has_strayed());
        // In either direction.
        let of = |train| strayed().filter(|one| one.train == train).map(|one| one.probability).sum::<f64>();
        strayed().map(|one| one.train).find(|train| of(*train) >= ASSIGNED_FROM)
    }

    /// The detections that a train has probably caused elsewhere, although they were assigned to no train: a sensor has been silent
    /// at which it was overdue since, as one is with this probability if the train has not strayed.
    pub(super) fn probably_elsewhere(&self, train: TrainId, silent: f64) -> impl Iterator<Item = Detection> {
        let ambiguous = self.ambiguity.as_ref().filter(|ambiguity| !ambiguity.is_assigned);
        let found = ambiguous.map(|ambiguity| Unassigned::ambiguous(ambiguity, 1.0));
        let found = found.into_iter().chain(self.unexplained.clone());
        found.filter(move |one| one.is_probably_of(train, silent, ASSIGNED_FROM)).map(|one| one.detection)
    }

    /// A turnout was commanded: branches no longer depend on where it was before.
    pub(super) fn turnout_thrown(&mut self, turnout: TurnoutId) {
        let branches = self.ambiguity.iter_mut().flat_map(|ambiguity| &mut ambiguity.branches);
        branches.for_each(|branch| branch.turnout_thrown(turnout));
    }

    /// Applies a command to a train in its branches, too.
    pub(super) fn command_sent(
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

    /// Updates the branches with a further detection and returns the result if that decides between them. Call it
    /// before [`associate`](Self::associate).
    pub(super) fn resolve(
        &mut self,
        trains: &BTreeMap<TrainId, DrivenTrain>,
        context: TrackContext<'_>,
        now: Timestamp,
        detection: Detection,
    ) -> Option<Resolution> {
        let mut ambiguity = self.ambiguity.take()?;
        if ambiguity.is_over(now) {
            if ambiguity.is_assigned {
                return None;
            }
            self.unexplained = Some(Unassigned::ambiguous(&ambiguity, 1.0));
            return Some(Resolution::Spurious(ambiguity.detection));
        }
        let log_spurious = self.faults.log_rate(detection.sensor, now);
        // The likelihood of the further detection in one branch.
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
            self.unexplained = Some(Unassigned::ambiguous(&ambiguity, all));
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

    /// The branch in which a train passed a sensor, of a detection in an unknown direction.
    pub(super) fn take_direction(&mut self, train: TrainId, sensor: SensorId) -> Option<Branch> {
        let is_it = |branch: &Branch| {
            let first = branch.passes.first();
            branch.train == train && first.is_some_and(|pass| pass.detection.sensor == sensor)
        };
        let ambiguity = self.ambiguity.take_if(|ambiguity| ambiguity.branches.iter().any(is_it))?;
        ambiguity.branches.into_iter().find(is_it)
    }

    /// Associates a detection with a train, if one is probable enough.
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
        let mut of_trains: Vec<((TrainId, SensorId), f64)> = Vec::new();
        for one in &found {
            let train = (one.explanation.train(), one.sensor);
            match of_trains.iter_mut().find(|(known, _)| *known == train) {
                Some((_, probability)) => *probability += density(one) / all,
                None => of_trains.push((train, density(one) / all)),
            }
        }
        of_trains.sort_by(|(_, one), (_, other)| other.total_cmp(one));
        let best = of_trains.first().copied();
        let likeliest_of = |train: (TrainId, SensorId)| {
            let own = found.iter().filter(move |one| (one.explanation.train(), one.sensor) == train);
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
                        // An earlier ambiguity may explain this one better once it is resolved.
                        return Association::Ambiguous { likeliest: one.explanation.train(), or: None };
                    }
                    if let Some(train) = trains.get(&one.explanation.train()) {
                        let not_passed =
                            Branch::not_passing(train, context, detection, &one.explanation, spurious / all);
                        self.ambiguity = Some(Ambiguity::assigned(now, not_passed, self.ambiguity.take()));
                    }
                }
                return Association::Explained(*one);
            }
        }
        let Some(((likeliest, _), _)) = best.filter(|_| spurious < ASSIGNED_FROM * all) else {
            return self.unexplained(detection, &found, all);
        };
        if self.faults.is_stuck(detection.sensor) {
            self.faults.note_unexplained(detection.sensor, now);
            return Association::Ignored;
        }
        let branches = found
            .iter()
            .filter(|one| density(one) >= NEGLIGIBLE * all)
            .filter_map(|one| Branch::passing(trains, context, detection, one, density(one) / all));
        // Only one ambiguity is kept: this one replaces an older one that the detection did not resolve.
        let ambiguity = Ambiguity::unassigned(now, detection, spurious / all, branches.collect());
        let of_likeliest =
            |one: &&Hypothesis| matches!(one.explanation, Explanation::Train(train) if train == likeliest);
        if found.iter().filter(of_likeliest).map(density).sum::<f64>() >= ASSIGNED_FROM * all {
            self.faults.note_explained(detection.sensor, now);
            self.ambiguity = Some(ambiguity.of_direction());
            return Association::EitherDirection(likeliest);
        }
        self.ambiguity = Some(ambiguity);
        let mut others = of_trains.iter().filter(|((train, _), _)| *train != likeliest);
        let second = others.next().filter(|(_, probability)| *probability >= spurious / all);
        Association::Ambiguous { likeliest, or: second.map(|((train, _), _)| *train) }
    }

    fn unexplained(&mut self, detection: Detection, found: &[Hypothesis], all: f64) -> Association {
        let was_stuck = self.faults.is_stuck(detection.sensor);
        let is_newly_stuck = self.faults.note_unexplained(detection.sensor, detection.window.until);
        match (was_stuck, is_newly_stuck) {
            (true, _) => Association::Ignored,
            (false, true) => Association::Stuck,
            (false, false) => {
                self.unexplained = Some(Unassigned::unexplained(detection, found, all));
                Association::Unexplained
            }
        }
    }
}

/// The probability from which an explanation is accepted. That a train is not where it was estimated takes a second
/// detection: after a single spurious one, its track would be released while it is still there.
const fn required_probability(explanation: &Explanation) -> f64 {
    match explanation {
        Explanation::Strayed(_) => RESOLVED_FROM,
        Explanation::Train(_) | Explanation::Turnout { .. } => ASSIGNED_FROM,
    }
}
