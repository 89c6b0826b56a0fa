//! The direction of each train of a session: as it was commanded, and as its station confirms and reports it.

use alloc::vec::Vec;

use footplate_core::{SpeedStep, TrainId};

use crate::dialogue::Dialogue;
use crate::outstanding::Awaited;
use crate::session::{LinkNotice, Transmit};

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
        if self.locomotives.is_unchecked(train) && last.is_some_and(|last| last != reported) {
            self.notify(LinkNotice::DirectionContradicted(train));
            return self.faces(train, reported);
        }
        self.faces(train, last.filter(|_| reported && is_blank).unwrap_or(reported));
    }

    /// A train runs forward or backward next, as its station has reported.
    pub(crate) fn faces(&mut self, train: TrainId, forward: bool) {
        self.locomotives.face(train, forward);
        self.keep_direction(train, forward);
    }

    fn keep_direction(&mut self, train: TrainId, forward: bool) {
        if self.locomotives.keep_direction(train, forward) != Some(forward) {
            self.output.push_back(Transmit::Direction(train, forward));
        }
    }
}
