//! The commanded state of each locomotive, and what the station has confirmed.

use alloc::vec::Vec;

use footplate_core::{Command, SpeedStep, TrainId};

use crate::queue::Queue;

/// One locomotive.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Locomotive {
    pub(crate) train: TrainId,
    /// Whether it runs forward, by the last command; `None` until the station has reported its state.
    pub(crate) forward: Option<bool>,
    /// The step of the last command.
    pub(crate) step: SpeedStep,
    /// Functions that are on, F0 in the lowest bit, as the station reported last; `None` where it has not, or never does.
    pub(crate) functions: Option<u32>,
    /// Whether a speed was ever written for it, so that the end must stop it.
    pub(crate) is_driven: bool,
    /// Whether the station has confirmed step 0 since the last other step.
    pub(crate) is_stopped: bool,
}

/// All locomotives that were commanded or asked for.
#[derive(Debug, Clone, Default)]
pub(crate) struct Locomotives(Vec<Locomotive>);

impl Locomotives {
    pub(crate) fn get(&self, train: TrainId) -> Option<&Locomotive> {
        self.0.iter().find(|locomotive| locomotive.train == train)
    }

    pub(crate) fn get_mut(&mut self, train: TrainId) -> Option<&mut Locomotive> {
        self.0.iter_mut().find(|locomotive| locomotive.train == train)
    }

    /// Adds a locomotive that will be commanded.
    pub(crate) fn know(&mut self, train: TrainId) {
        if self.get(train).is_none() {
            let step = SpeedStep::STAND;
            self.0.push(Locomotive {
                train,
                forward: None,
                step,
                functions: None,
                is_driven: false,
                is_stopped: false,
            });
        }
    }

    /// Whether the direction of a train is known.
    pub(crate) fn has_direction(&self, train: TrainId) -> bool {
        self.get(train).is_some_and(|locomotive| locomotive.forward.is_some())
    }

    pub(crate) fn iter(&self) -> impl Iterator<Item = &Locomotive> {
        self.0.iter()
    }

    pub(crate) fn iter_mut(&mut self) -> impl Iterator<Item = &mut Locomotive> {
        self.0.iter_mut()
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
        for locomotive in self.0.iter_mut().filter(|locomotive| locomotive.is_driven) {
            locomotive.is_stopped = false;
            // Stops are always taken.
            let _ = waiting.push(Command::Speed { train: locomotive.train, step: SpeedStep::STAND });
        }
    }

    /// Returns the driven trains that have stopped, or those that have not.
    pub(crate) fn driven(&self, stopped: bool) -> Vec<TrainId> {
        let driven =
            self.0.iter().filter(|locomotive| locomotive.is_driven && locomotive.is_stopped == stopped);
        driven.map(|locomotive| locomotive.train).collect()
    }
}
