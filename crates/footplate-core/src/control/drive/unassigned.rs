//! A detection that was assigned to no train, and the trains that may be elsewhere and have caused it.

use alloc::vec::Vec;

use crate::ids::TrainId;

use super::ambiguity::{Ambiguity, Branch};
use super::hypotheses::{Detection, Explanation, Hypothesis};

/// A detection that was assigned to no train, and the probability with which each train was elsewhere and caused it.
#[derive(Debug, Clone)]
pub(super) struct Unassigned {
    pub(super) detection: Detection,
    strayed: Vec<(TrainId, f64)>,
}

impl Unassigned {
    /// An ambiguous detection, of whose branches the probabilities have this sum.
    pub(super) fn ambiguous(ambiguity: &Ambiguity, all: f64) -> Self {
        let strayed = ambiguity.branches.iter().filter(|branch| branch.has_strayed());
        let strayed = strayed.map(|branch| (branch.train, branch.probability / all)).collect();
        Self { detection: ambiguity.detection, strayed }
    }

    /// A detection that is probably spurious, and the hypotheses against that; the densities of all have this sum.
    pub(super) fn unexplained(detection: Detection, found: &[Hypothesis], all: f64) -> Self {
        let strayed = found.iter().filter_map(|one| match one.explanation {
            Explanation::Strayed(train) => Some((train, libm::exp(one.log_density) / all)),
            Explanation::Train(_) | Explanation::Turnout { .. } => None,
        });
        Self { detection, strayed: strayed.collect() }
    }

    /// Whether a train may have caused it.
    pub(super) fn may_be_of(&self, train: TrainId) -> bool {
        self.strayed.iter().any(|(known, _)| *known == train)
    }

    /// Whether a train has caused it with a probability of `enough` or more, after a sensor was silent that is silent with a
    /// probability if the train has not strayed, and certainly if it has.
    pub(super) fn is_probably_of(&self, train: TrainId, silent: f64, enough: f64) -> bool {
        let before =
            self.strayed.iter().find(|(known, _)| *known == train).map(|(_, probability)| *probability);
        before.is_some_and(|before| before >= enough * (before + (1.0 - before) * silent))
    }
}

impl Branch {
    /// Whether its train caused the detection, and was not where it was estimated.
    pub(super) fn has_strayed(&self) -> bool {
        self.passes.first().is_some_and(|pass| matches!(pass.explanation, Explanation::Strayed(_)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::control::drive::hypotheses::missed_or_elsewhere;
    use crate::ids::SensorId;
    use crate::link::DetectionWindow;
    use crate::time::Timestamp;

    const TRAIN: TrainId = TrainId(63);
    /// A sensor misses 3 trains in 1000.
    const SILENT: f64 = missed_or_elsewhere(0.003);

    /// A report of which this is the probability that the train, put elsewhere, caused it.
    fn caused_with(probability: f64) -> Unassigned {
        let window = DetectionWindow { after: Timestamp::from_s(9.9), until: Timestamp::from_s(10.0) };
        let detection = Detection { sensor: SensorId(54), window };
        Unassigned { detection, strayed: alloc::vec![(TRAIN, probability)] }
    }

    #[test]
    fn a_silent_sensor_shows_a_train_elsewhere_if_only_that_or_a_fault_explains_both() {
        // Nothing but a spurious report explains it: with a second fault that is less probable.
        assert!(caused_with(0.05).is_probably_of(TRAIN, SILENT, 0.9));
        // Another train may have caused it, early: then only the silent sensor is a fault.
        assert!(!caused_with(0.005).is_probably_of(TRAIN, SILENT, 0.9));
    }

    #[test]
    fn a_train_that_was_at_rest_did_not_cause_a_report_elsewhere() {
        assert!(!caused_with(0.05).is_probably_of(TrainId(58), SILENT, 0.9));
        assert!(!caused_with(0.05).may_be_of(TrainId(58)));
    }

    #[test]
    fn a_silent_sensor_counts_by_how_often_it_is_silent() {
        // Of 100 such reports 50 are of the train, which leaves the sensor silent each time; of the other 50 it is silent 25 times.
        // 50 of 75 are 0.667.
        assert!(caused_with(0.5).is_probably_of(TRAIN, 0.5, 0.66));
        assert!(!caused_with(0.5).is_probably_of(TRAIN, 0.5, 0.67));
    }
}
