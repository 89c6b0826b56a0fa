//! The commanded state of each locomotive, and what the station has confirmed.

use alloc::collections::{BTreeMap, BTreeSet};
use alloc::vec::Vec;

use footplate_core::{Command, FunctionNumber, SpeedStep, TrainId};

use crate::dialogue::Dialogue;
use crate::outstanding::Awaited;
use crate::queue::Queue;
use crate::session::{LinkNotice, Transmit};

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

/// Speed and direction of the locomotives of a session.
impl<A: Awaited> Dialogue<A> {
    /// Notes the commanded step of a train, reversed or not; returns whether it then runs forward.
    pub(crate) fn commanded(&mut self, train: TrainId, step: SpeedStep, reverses: bool) -> bool {
        self.locomotives.know(train);
        let Some(locomotive) = self.locomotives.get_mut(train) else { return true };
        if reverses {
            locomotive.forward = Some(!locomotive.forward.unwrap_or(true));
        }
        (locomotive.step, locomotive.is_driven, locomotive.is_stopped) = (step, true, false);
        locomotive.forward.unwrap_or(true)
    }

    /// The station has confirmed the last command to a train. A reversal that it never confirms was hardly obeyed, so its
    /// direction is kept only now.
    pub(crate) fn obeyed(&mut self, train: TrainId) {
        let Some(locomotive) = self.locomotives.get_mut(train) else { return };
        locomotive.is_stopped = locomotive.step == SpeedStep::STAND;
        if let Some(forward) = locomotive.forward {
            self.keep_direction(train, forward);
        }
    }

    /// The station has forgotten how trains run, and is asked again. A reversal that it had not confirmed may have been lost.
    pub(crate) fn forget_directions(&mut self) {
        let trains: Vec<TrainId> = self.locomotives.iter().map(|known| known.train).collect();
        trains.into_iter().for_each(|train| self.forget_direction(train));
    }

    /// The same of one train.
    pub(crate) fn forget_direction(&mut self, train: TrainId) {
        let confirmed = self.locomotives.last_direction(train);
        let Some(locomotive) = self.locomotives.get_mut(train) else { return };
        let commanded = locomotive.forward.take();
        if commanded.is_some() && commanded != confirmed {
            self.notify(LinkNotice::ReverseInDoubt(train));
        }
    }

    /// Takes the direction that a station reports of a train before it is driven. Stations that were restarted have forgotten, and say *forward* of every
    /// locomotive, at rest and without functions (`is_blank`). A decoder does what it is commanded next, so it is commanded on in
    /// the direction in which its train is known to have run last.
    pub(crate) fn hear_first_direction(&mut self, train: TrainId, reported: bool, is_blank: bool) {
        let last = self.locomotives.last_direction(train);
        if self.locomotives.unchecked.contains(&train) && last.is_some_and(|last| last != reported) {
            self.notify(LinkNotice::DirectionContradicted(train));
            return self.faces(train, reported);
        }
        self.faces(train, last.filter(|_| reported && is_blank).unwrap_or(reported));
    }

    /// A train runs forward or backward next, as its station has reported.
    pub(crate) fn faces(&mut self, train: TrainId, forward: bool) {
        self.locomotives.unchecked.remove(&train);
        if let Some(locomotive) = self.locomotives.get_mut(train) {
            locomotive.forward = Some(forward);
        }
        self.keep_direction(train, forward);
    }

    fn keep_direction(&mut self, train: TrainId, forward: bool) {
        if self.locomotives.keep_direction(train, forward) != Some(forward) {
            self.output.push_back(Transmit::Direction(train, forward));
        }
    }
}
