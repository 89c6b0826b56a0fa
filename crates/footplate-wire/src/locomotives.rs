//! The commanded state of each locomotive, and what the station has confirmed.

use alloc::vec::Vec;

use footplate_core::{Command, FunctionNumber, SpeedStep, TrainId};

use crate::queue::Queue;

/// What the station has reported of a locomotive's functions. Sets have F0 in the lowest bit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ReportedFunctions {
    /// The functions that it reported.
    pub known: u32,
    /// Those of them that are on.
    pub on: u32,
}

impl ReportedFunctions {
    /// All functions that a station can switch, these of them on.
    #[must_use]
    pub const fn all(on: u32) -> Self {
        Self { known: (1 << (FunctionNumber::HIGHEST + 1)) - 1, on }
    }

    /// The state of a function; `None` if the station never reported it.
    #[must_use]
    pub const fn is_on(self, function: FunctionNumber) -> Option<bool> {
        if function.is_in(self.known) { Some(function.is_in(self.on)) } else { None }
    }

    /// These, with what a newer report says.
    #[must_use]
    pub const fn with(self, newer: Self) -> Self {
        Self { known: self.known | newer.known, on: self.on & !newer.known | newer.on & newer.known }
    }
}

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
                functions: ReportedFunctions::default(),
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
