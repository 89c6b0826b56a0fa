//! The commanded state of each locomotive, and what the station has confirmed.

use alloc::collections::{BTreeMap, BTreeSet};
use alloc::vec::Vec;

use footplate_core::{Command, SpeedStep, TrainId};

use crate::queue::Queue;
use crate::reported_functions::ReportedFunctions;

/// One locomotive.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Locomotive {
    pub(crate) train: TrainId,
    /// Whether it runs forward, by the last command; `None` until the station has reported its state.
    pub(crate) forward: Option<bool>,
    /// The step of the last command.
    pub(crate) step: SpeedStep,
    /// What the station has reported of its functions.
    pub(crate) functions: ReportedFunctions,
    /// Whether a speed was ever written for it, so that the end must stop it.
    pub(crate) is_driven: bool,
    /// Whether the station has confirmed step 0 since the last other step.
    pub(crate) is_stopped: bool,
}

/// All locomotives that were commanded or asked for.
#[derive(Debug, Clone, Default)]
pub(crate) struct Locomotives {
    known: Vec<Locomotive>,
    /// Whether each ran forward when it was commanded or reported last, in this session or an earlier one.
    directions: BTreeMap<TrainId, bool>,
    /// Those whose direction is of a session without an end, until the station reports it.
    unchecked: BTreeSet<TrainId>,
}

impl Locomotives {
    pub(crate) fn get(&self, train: TrainId) -> Option<&Locomotive> {
        self.known.iter().find(|locomotive| locomotive.train == train)
    }

    pub(crate) fn get_mut(&mut self, train: TrainId) -> Option<&mut Locomotive> {
        self.known.iter_mut().find(|locomotive| locomotive.train == train)
    }

    /// Adds a locomotive that will be commanded.
    pub(crate) fn know(&mut self, train: TrainId) {
        if self.get(train).is_none() {
            let step = SpeedStep::STAND;
            self.known.push(Locomotive {
                train,
                forward: None,
                step,
                functions: ReportedFunctions::default(),
                is_driven: false,
                is_stopped: false,
            });
        }
    }

    /// Notes whether a train runs forward; returns whether it did before, as far as is known.
    pub(crate) fn keep_direction(&mut self, train: TrainId, forward: bool) -> Option<bool> {
        self.directions.insert(train, forward)
    }

    /// Whether a train ran forward last, as far as is known.
    pub(crate) fn last_direction(&self, train: TrainId) -> Option<bool> {
        self.directions.get(&train).copied()
    }

    /// What is known of a train's direction, if anything, is of a session without an end.
    pub(crate) fn check_direction(&mut self, train: TrainId) {
        self.know(train);
        self.unchecked.insert(train);
    }

    /// The trains of which that is so.
    pub(crate) fn unchecked(&self) -> impl Iterator<Item = TrainId> {
        self.unchecked.iter().copied()
    }

    /// Whether that is so of this train.
    pub(crate) fn is_unchecked(&self, train: TrainId) -> bool {
        self.unchecked.contains(&train)
    }

    /// A train runs forward or backward next, as its station has reported.
    pub(crate) fn face(&mut self, train: TrainId, forward: bool) {
        self.unchecked.remove(&train);
        if let Some(locomotive) = self.get_mut(train) {
            locomotive.forward = Some(forward);
        }
    }

    /// Takes back reversals that no station has confirmed: stops contain a direction, and would reverse a train that the next
    /// session believes to face as before.
    pub(crate) fn withdraw_reversals(&mut self) {
        for locomotive in self.known.iter_mut().filter(|locomotive| locomotive.forward.is_some()) {
            locomotive.forward = self.directions.get(&locomotive.train).copied().or(locomotive.forward);
        }
    }

    /// Whether the direction of a train is known.
    pub(crate) fn has_direction(&self, train: TrainId) -> bool {
        self.get(train).is_some_and(|locomotive| locomotive.forward.is_some())
    }

    pub(crate) fn iter(&self) -> impl Iterator<Item = &Locomotive> {
        self.known.iter()
    }

    pub(crate) fn iter_mut(&mut self) -> impl Iterator<Item = &mut Locomotive> {
        self.known.iter_mut()
    }

    /// Adds a train that must be stopped, no matter which throttle drove it.
    pub(crate) fn know_driven(&mut self, train: TrainId) {
        self.know(train);
        if let Some(locomotive) = self.get_mut(train) {
            locomotive.is_driven = true;
        }
    }

    /// Stops every train that was driven.
    pub(crate) fn stop_driven(&mut self, waiting: &mut Queue) {
        for locomotive in self.known.iter_mut().filter(|locomotive| locomotive.is_driven) {
            locomotive.is_stopped = false;
            // Stops are always taken.
            let _ = waiting.push(Command::Speed { train: locomotive.train, step: SpeedStep::STAND });
        }
    }

    /// Returns the driven trains that have stopped, or those that have not.
    pub(crate) fn driven(&self, stopped: bool) -> Vec<TrainId> {
        let driven =
            self.known.iter().filter(|locomotive| locomotive.is_driven && locomotive.is_stopped == stopped);
        driven.map(|locomotive| locomotive.train).collect()
    }
}
