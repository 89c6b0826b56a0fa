//! Which train closed a contact: the likeliest of everything that may have, if it is likely enough.
//!
//! Each explanation has a density in time (1/s) with its prior chance in it; that of a contact closing by itself comes
//! from the contact's own conduct. The share of a train in the sum of all is the probability that it was this train. A
//! train is believed from [`SURE`] on. Below that nobody's estimate is touched. What may have been otherwise is kept as
//! [`Branch`]es, and the next closures decide between them: a train that was told apart wrongly is taken back.

use alloc::boxed::Box;
use alloc::collections::BTreeMap;
use alloc::vec::Vec;

use crate::estimation::{Ground, Locator, PassedContact};
use crate::event::Event;
use crate::ids::{SensorId, TrainId};
use crate::time::{TimeSpan, Timestamp};
use crate::track::TurnoutStates;

use super::contact_conduct::ContactConduct;
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
/// A closure that is still not explained after this long never will be: two contacts further even at a crawl.
const WAITS: TimeSpan = TimeSpan::from_s(15.0);

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

/// How things are with one train if they are not as is believed.
#[derive(Debug, Clone)]
pub(super) struct Branch {
    pub(super) closure: Closure,
    pub(super) train: TrainId,
    /// How it passed the contact, and what had been expected; `None` if it did not.
    pub(super) passed: Option<(Explanation, PassedContact)>,
    /// As it was followed from there since.
    pub(super) locator: Locator,
    /// A contact that should have reported it before.
    pub(super) unseen: Option<SensorId>,
    /// Its share before what came after.
    share: f64,
}

/// A closure of which nobody is sure.
#[derive(Debug, Clone)]
struct Doubt {
    closure: Closure,
    /// Whether a train is believed to have done it.
    is_believed: bool,
    /// The share of what is believed.
    share: f64,
    otherwise: Vec<Branch>,
    until: Timestamp,
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

    /// A command to a train has left: those that it may be hear it, too.
    pub(super) fn command_left(
        &mut self,
        trains: &BTreeMap<TrainId, DrivenTrain>,
        ground: Ground<'_>,
        event: &Event,
    ) {
        let branches = self.doubt.iter_mut().flat_map(|doubt| &mut doubt.otherwise);
        for branch in branches {
            if let Some(train) = trains.get(&branch.train) {
                branch.locator.handle_command(ground, &train.model, event);
            }
        }
    }

    /// Looks whether one more closure decides what an earlier one was. To be asked before it is judged itself.
    pub(super) fn decide(
        &mut self,
        trains: &BTreeMap<TrainId, DrivenTrain>,
        ground: Ground<'_>,
        now: Timestamp,
        closure: Closure,
    ) -> Option<Decided> {
        let mut doubt = self.doubt.take()?;
        if now >= doubt.until {
            return (!doubt.is_believed).then_some(Decided::Nothing(doubt.closure));
        }
        let background = self.conduct.log_rate(closure.sensor, now);
        // How well the new closure is explained, if the earlier one was so.
        let likely = |trains: &BTreeMap<TrainId, DrivenTrain>, ground: Ground<'_>| {
            let found = hypotheses(trains, ground, now, closure);
            libm::exp(background) + found.iter().map(|one| libm::exp(one.log_density)).sum::<f64>()
        };
        let believed = doubt.share * likely(trains, ground);
        let weight = |branch: &Branch| {
            let mut so = trains.clone();
            if let Some(train) = so.get_mut(&branch.train) {
                train.locator = branch.locator.clone();
                train.expected.unseen = branch.unseen;
            }
            let explanation = branch.passed.as_ref().map(|(explanation, _)| explanation);
            let turnouts = explanation.map(|explanation| turnouts_after(explanation, ground));
            let turnouts = turnouts.as_ref().unwrap_or(ground.turnouts);
            branch.share * likely(&so, Ground { turnouts, ..ground })
        };
        let weights: Vec<f64> = doubt.otherwise.iter().map(weight).collect();
        let all = believed + weights.iter().sum::<f64>();
        if !doubt.is_believed && believed >= SURE * all {
            self.conduct.note_strange(doubt.closure.sensor, doubt.closure.window.until);
            return Some(Decided::Nothing(doubt.closure));
        }
        if doubt.is_believed && believed >= CERTAIN * all {
            return None;
        }
        let is_decided = |(branch, weight): (&Branch, &f64)| {
            let explanation = branch.passed.as_ref().map(|(explanation, _)| explanation);
            *weight >= explanation.map_or(SURE, enough_for) * all
        };
        if let Some(place) = doubt.otherwise.iter().zip(&weights).position(is_decided) {
            let branch = doubt.otherwise.into_iter().nth(place)?;
            match branch.passed {
                Some(_) => self.conduct.note_good(doubt.closure.sensor, now),
                None => {
                    self.conduct.note_strange(doubt.closure.sensor, doubt.closure.window.until);
                }
            }
            return Some(Decided::Otherwise(Box::new(branch)));
        }
        doubt.share = believed / all;
        for (branch, weight) in doubt.otherwise.iter_mut().zip(weights) {
            branch.share = weight / all;
        }
        self.doubt = Some(doubt);
        None
    }

    /// Judges a closure.
    pub(super) fn judge(
        &mut self,
        trains: &BTreeMap<TrainId, DrivenTrain>,
        ground: Ground<'_>,
        now: Timestamp,
        closure: Closure,
    ) -> Verdict {
        let found = hypotheses(trains, ground, now, closure);
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
                    if self.doubt.is_some() {
                        // What came before may explain it better, once that is decided.
                        return Verdict::Ambiguous { likeliest: train, or: None };
                    }
                    self.keep_in_mind(trains, now, closure, one, nothing / all);
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
            .filter_map(|one| branch(trains, ground, closure, one, density(one) / all));
        // One doubt at a time: an older one that this closure did not decide is given up.
        self.doubt = Some(Doubt {
            closure,
            is_believed: false,
            share: nothing / all,
            otherwise: otherwise.collect(),
            until: now + WAITS,
        });
        let second = of_trains.get(1).filter(|(_, share)| *share >= nothing / all);
        Verdict::Ambiguous { likeliest, or: second.map(|(train, _)| *train) }
    }

    /// What is believed is unusual enough to remember how it would be if nobody had passed the contact.
    fn keep_in_mind(
        &mut self,
        trains: &BTreeMap<TrainId, DrivenTrain>,
        now: Timestamp,
        closure: Closure,
        believed: &Hypothesis,
        nothing: f64,
    ) {
        let Some(train) = trains.get(&believed.explanation.train()) else { return };
        let not_passed = Branch {
            closure,
            train: train.id(),
            passed: None,
            locator: train.locator.clone(),
            unseen: train.unseen(),
            share: nothing,
        };
        self.doubt = Some(Doubt {
            closure,
            is_believed: true,
            share: 1.0 - nothing,
            otherwise: alloc::vec![not_passed],
            until: now + WAITS,
        });
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

/// A train as it goes on from a contact, if it passed it.
fn branch(
    trains: &BTreeMap<TrainId, DrivenTrain>,
    ground: Ground<'_>,
    closure: Closure,
    hypothesis: &Hypothesis,
    share: f64,
) -> Option<Branch> {
    let explanation = hypothesis.explanation;
    let train = trains.get(&explanation.train())?;
    let turnouts = turnouts_after(&explanation, ground);
    let mut locator = train.locator.clone();
    if matches!(explanation, Explanation::Strayed(_)) {
        locator.lose();
    }
    let ground = Ground { turnouts: &turnouts, ..ground };
    let passed = locator.pass(ground, &train.model, closure.sensor, closure.window);
    let passed = Some((explanation, passed));
    Some(Branch { closure, train: train.id(), passed, locator, unseen: None, share })
}

/// How probable an explanation has to be to be believed. That a train is not where it was believed to be takes a second
/// closure: by one that it did not make its place would be given to others while it stands there.
const fn enough_for(explanation: &Explanation) -> f64 {
    match explanation {
        Explanation::Strayed(_) => CERTAIN,
        Explanation::Train(_) | Explanation::Turnout { .. } => SURE,
    }
}

/// How the turnouts lie if an explanation is true.
fn turnouts_after(explanation: &Explanation, ground: Ground<'_>) -> TurnoutStates {
    let mut turnouts = ground.turnouts.clone();
    if let Explanation::Turnout { turnout, leg, .. } = explanation {
        turnouts.set(*turnout, *leg);
    }
    turnouts
}
