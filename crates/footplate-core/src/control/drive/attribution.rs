//! Which train closed a contact: the likeliest of everything that may have, if it is likely enough.
//!
//! Each explanation has a density in time (1/s) with its prior chance in it; that of a contact closing by itself comes
//! from the contact's own conduct. The share of a train in the sum of all is the probability that it was this train. A
//! train is believed from [`SURE`] on. Below that nobody's estimate is touched. What may have been otherwise is kept as
//! [`Branch`]es, and the next closures decide between them: a train that was distinguished wrongly is taken back.

use alloc::boxed::Box;
use alloc::collections::BTreeMap;
use alloc::vec::Vec;

use crate::event::Event;
use crate::ids::{SensorId, TrainId, TurnoutId};
use crate::time::Timestamp;
use crate::tracking::TrackContext;

use super::contact_conduct::ContactConduct;
use super::doubt::{Branch, Doubt};
use super::driven_train::DrivenTrain;
use super::hypotheses::{Closure, Explanation, Hypothesis, hypotheses};

/// A train closed a contact if that is at least this probable.
const SURE: f64 = 0.9;
/// What was believed from the first is not looked at again once it is this probable.
const CERTAIN: f64 = 0.9999;
/// What is less probable is not kept in mind.
const NEGLIGIBLE: f64 = 0.01;
/// A density (ln 1/s) that is less than this is unusual: a contact was missed, a turnout failed, a train has changed.
const UNUSUAL: f64 = -3.0;

/// What is made of a closure.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Verdict {
    /// It was this train.
    Explained(Explanation),
    /// It may have been one of two, or one and nothing; what comes next decides.
    Ambiguous { likeliest: TrainId, or: Option<TrainId> },
    /// Nothing that trains can do.
    Unexplained,
    /// The same, of a contact that is not believed from now on.
    Stuck,
    /// Of a contact that is not believed.
    Ignored,
}

/// An earlier closure in doubt that has been decided.
#[derive(Debug, Clone)]
pub(super) enum Decided {
    /// It was otherwise than is believed.
    Otherwise(Box<Branch>),
    /// No train did it, as is believed.
    Nothing(Closure),
}

/// Judges closures one after the other.
#[derive(Debug, Clone, Default)]
pub(super) struct Attribution {
    conduct: ContactConduct,
    doubt: Option<Doubt>,
}

impl Attribution {
    /// A contact that was stuck and is believed again; until `None`.
    pub(super) fn next_reformed(&mut self, now: Timestamp) -> Option<SensorId> {
        self.conduct.next_reformed(now)
    }

    /// Somebody knows better where a train is, or that nobody does: what may have been does not matter any more.
    pub(super) fn forget(&mut self, train: TrainId) {
        self.doubt.take_if(|doubt| doubt.otherwise.iter().any(|branch| branch.train == train));
    }

    /// Whether a train may be elsewhere than it is believed to be, because a contact that it passed or did not pass is in
    /// doubt.
    pub(super) fn doubts(&self, train: TrainId) -> bool {
        let otherwise = self.doubt.iter().flat_map(|doubt| &doubt.otherwise);
        otherwise.into_iter().any(|branch| branch.train == train)
    }

    /// A turnout was set somehow: what it may have been before does not matter any more.
    pub(super) fn turnout_thrown(&mut self, turnout: TurnoutId) {
        let branches = self.doubt.iter_mut().flat_map(|doubt| &mut doubt.otherwise);
        branches.for_each(|branch| branch.turnout_thrown(turnout));
    }

    /// A command to a train has left: those that it may be hear it, too.
    pub(super) fn command_left(
        &mut self,
        trains: &BTreeMap<TrainId, DrivenTrain>,
        context: TrackContext<'_>,
        event: &Event,
    ) {
        let branches = self.doubt.iter_mut().flat_map(|doubt| &mut doubt.otherwise);
        for branch in branches {
            if let Some(train) = trains.get(&branch.train) {
                branch.locator.handle_command(context, &train.model, event);
            }
        }
    }

    /// Looks whether one more closure decides what an earlier one was. To be asked before it is judged itself.
    pub(super) fn decide(
        &mut self,
        trains: &BTreeMap<TrainId, DrivenTrain>,
        context: TrackContext<'_>,
        now: Timestamp,
        closure: Closure,
    ) -> Option<Decided> {
        let mut doubt = self.doubt.take()?;
        if doubt.is_over(now) {
            return (!doubt.is_believed).then_some(Decided::Nothing(doubt.closure));
        }
        let log_nothing = self.conduct.log_rate(closure.sensor, now);
        // How well the new closure is explained, if the earlier one was so.
        let likely = |found: &[Hypothesis]| {
            libm::exp(log_nothing) + found.iter().map(|one| libm::exp(one.log_density)).sum::<f64>()
        };
        let believed = doubt.share * likely(&hypotheses(trains, context, now, closure));
        let explains = |branch: &Branch| branch.explains(trains, context, now, closure);
        let explained: Vec<Vec<Hypothesis>> = doubt.otherwise.iter().map(explains).collect();
        for (branch, found) in doubt.otherwise.iter_mut().zip(&explained) {
            branch.share *= likely(found);
        }
        let all = believed + doubt.otherwise.iter().map(|branch| branch.share).sum::<f64>();
        if !doubt.is_believed && believed >= SURE * all {
            self.conduct.note_strange(doubt.closure.sensor, doubt.closure.window.until);
            return Some(Decided::Nothing(doubt.closure));
        }
        if doubt.is_believed && believed >= CERTAIN * all {
            return None;
        }
        let is_decided = |branch: &Branch| {
            let enough = branch.passes.iter().map(|pass| enough_for(&pass.explanation)).fold(SURE, f64::max);
            branch.share >= enough * all
        };
        if let Some(place) = doubt.otherwise.iter().position(is_decided) {
            let branch = doubt.otherwise.into_iter().nth(place)?;
            if branch.did_it {
                self.conduct.note_good(branch.closure.sensor, now);
            } else {
                self.conduct.note_strange(branch.closure.sensor, branch.closure.window.until);
            }
            return Some(Decided::Otherwise(Box::new(branch)));
        }
        doubt.share = believed / all;
        for (branch, found) in doubt.otherwise.iter_mut().zip(&explained) {
            branch.share /= all;
            branch.go_on(trains, context, closure, found, log_nothing);
        }
        self.doubt = Some(doubt);
        None
    }

    /// Judges a closure.
    pub(super) fn judge(
        &mut self,
        trains: &BTreeMap<TrainId, DrivenTrain>,
        context: TrackContext<'_>,
        now: Timestamp,
        closure: Closure,
    ) -> Verdict {
        let found = hypotheses(trains, context, now, closure);
        let nothing = libm::exp(self.conduct.log_rate(closure.sensor, now));
        let density = |one: &Hypothesis| libm::exp(one.log_density);
        let all = nothing + found.iter().map(density).sum::<f64>();
        let mut of_trains: Vec<(TrainId, f64)> = Vec::new();
        for one in &found {
            let train = one.explanation.train();
            match of_trains.iter_mut().find(|(known, _)| *known == train) {
                Some((_, share)) => *share += density(one) / all,
                None => of_trains.push((train, density(one) / all)),
            }
        }
        of_trains.sort_by(|(_, one), (_, other)| other.total_cmp(one));
        let best = of_trains.first().copied();
        let likeliest_of = |train: TrainId| {
            let own = found.iter().filter(move |one| one.explanation.train() == train);
            own.max_by(|one, other| one.log_density.total_cmp(&other.log_density))
        };
        let enough = |train| likeliest_of(train).map_or(SURE, |one| enough_for(&one.explanation));
        if let Some((train, _)) = best.filter(|(train, share)| *share >= enough(*train)) {
            self.conduct.note_good(closure.sensor, now);
            if self.conduct.is_stuck(closure.sensor) {
                return Verdict::Ignored;
            }
            if let Some(one) = likeliest_of(train) {
                if one.log_density < UNUSUAL {
                    if self.doubt.as_ref().is_some_and(|doubt| !doubt.is_believed || doubt.share < SURE) {
                        // What came before may explain it better, once that is decided.
                        return Verdict::Ambiguous { likeliest: train, or: None };
                    }
                    if let Some(train) = trains.get(&train) {
                        let not_passed =
                            Branch::not_passing(train, context, closure, &one.explanation, nothing / all);
                        self.doubt = Some(Doubt::believed(now, not_passed, self.doubt.take()));
                    }
                }
                return Verdict::Explained(one.explanation);
            }
        }
        let Some((likeliest, _)) = best.filter(|_| nothing < SURE * all) else {
            return self.strange(closure);
        };
        if self.conduct.is_stuck(closure.sensor) {
            self.conduct.note_strange(closure.sensor, now);
            return Verdict::Ignored;
        }
        let otherwise = found
            .iter()
            .filter(|one| density(one) >= NEGLIGIBLE * all)
            .filter_map(|one| Branch::passing(trains, context, closure, one, density(one) / all));
        // One doubt at a time: an older one that this closure did not decide is given up.
        self.doubt = Some(Doubt::unbelieved(now, closure, nothing / all, otherwise.collect()));
        let second = of_trains.get(1).filter(|(_, share)| *share >= nothing / all);
        Verdict::Ambiguous { likeliest, or: second.map(|(train, _)| *train) }
    }

    fn strange(&mut self, closure: Closure) -> Verdict {
        let was_stuck = self.conduct.is_stuck(closure.sensor);
        let is_news = self.conduct.note_strange(closure.sensor, closure.window.until);
        match (was_stuck, is_news) {
            (true, _) => Verdict::Ignored,
            (false, true) => Verdict::Stuck,
            (false, false) => Verdict::Unexplained,
        }
    }
}

/// How probable an explanation has to be to be believed. That a train is not where it was believed to be takes a second
/// closure: by one that it did not make its place would be given to others while it stands there.
const fn enough_for(explanation: &Explanation) -> f64 {
    match explanation {
        Explanation::Strayed(_) => CERTAIN,
        Explanation::Train(_) | Explanation::Turnout { .. } => SURE,
    }
}
