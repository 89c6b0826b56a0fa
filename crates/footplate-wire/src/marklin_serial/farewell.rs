//! The end of a session: which trains must be stopped, and how far that has come.

use alloc::vec::Vec;

use footplate_core::{Command, SpeedStep, TrainId};

use crate::session::{Closing, Confirmation};

/// What the end must do, and what it has done.
#[derive(Debug, Clone, Default)]
pub(super) struct Farewell {
    /// Every train that was driven, and whether step 0 was its last command and has left.
    driven: Vec<Driven>,
    pub(super) begun: bool,
    pub(super) released: bool,
    /// How often power off was said.
    power_off: u8,
}

/// Power off is written twice: the interface may take the first as the second byte of another message.
const POWER_OFF_WORDS: u8 = 2;

#[derive(Debug, Clone, Copy)]
struct Driven {
    train: TrainId,
    stands: bool,
}

impl Farewell {
    /// A step is waiting for the line. From now on the train may run: its bytes may be on the line at the end.
    pub(super) fn will_command(&mut self, train: TrainId, step: SpeedStep) {
        let stood = self.driven.iter().any(|driven| driven.train == train && driven.stands);
        self.mark(train, stood && step == SpeedStep::STAND);
    }

    /// A step has left.
    pub(super) fn commanded(&mut self, train: TrainId, step: SpeedStep) {
        self.mark(train, step == SpeedStep::STAND);
    }

    fn mark(&mut self, train: TrainId, stands: bool) {
        match self.driven.iter_mut().find(|driven| driven.train == train) {
            Some(driven) => driven.stands = stands,
            None => self.driven.push(Driven { train, stands }),
        }
    }

    /// The commands that stop all of them, sent or not.
    pub(super) fn begin(&mut self) -> impl Iterator<Item = Command> {
        self.begun = true;
        self.driven.iter_mut().map(|driven| {
            driven.stands = false;
            Command::Speed { train: driven.train, step: SpeedStep::STAND }
        })
    }

    pub(super) fn said_power_off(&mut self) {
        self.power_off = self.power_off.saturating_add(1);
    }

    pub(super) fn is_over(&self) -> bool {
        self.power_off >= POWER_OFF_WORDS
    }

    pub(super) fn statement(&self, hand_shaken: bool) -> Closing {
        let trains = |stands| {
            let driven = self.driven.iter().filter(move |driven| driven.stands == stands);
            driven.map(|driven| driven.train).collect()
        };
        Closing {
            commanded_to_stop: trains(true),
            not_commanded: trains(false),
            solenoids_released: Some(self.released),
            power_off: self.is_over(),
            confirmation: if hand_shaken { Confirmation::HandShake } else { Confirmation::Nothing },
        }
    }
}
