//! What was commanded of each decoder. Every message to a locomotive sets its light as well, and one message sets F1 to F4: a change of
//! one function repeats the rest.

use alloc::collections::BTreeMap;

use footplate_core::{Command, FunctionNumber, SpeedStep, TrainId};

use super::codec::Message;

/// The highest function of the interface.
pub(super) const HIGHEST_FUNCTION: u8 = 4;

/// The decoders of all trains that were commanded.
#[derive(Debug, Clone, Default)]
pub(super) struct Decoders {
    /// Whether the light of a train is on until it is commanded otherwise.
    light: bool,
    known: BTreeMap<TrainId, Decoder>,
}

#[derive(Debug, Clone, Copy)]
struct Decoder {
    step: SpeedStep,
    light: bool,
    /// F1 to F4.
    functions: [bool; HIGHEST_FUNCTION as usize],
}

impl Decoders {
    pub(super) fn new(light: bool) -> Self {
        Self { light, known: BTreeMap::new() }
    }

    /// The message for a command.
    pub(super) fn message(&self, command: Command) -> Message {
        match command {
            Command::Speed { train, step } => Message::Drive { train, step, light: self.of(train).light },
            Command::Reverse { train } => Message::Reverse { train, light: self.of(train).light },
            Command::Turnout { turnout, curved } => Message::Turnout { turnout, curved },
            Command::Function { train, .. } => {
                let Decoder { step, light, functions } = self.after(train, command);
                if is_light(command) {
                    Message::Drive { train, step, light }
                } else {
                    Message::Functions { train, on: functions }
                }
            }
            Command::PowerOff => Message::Stop,
            Command::PowerOn => Message::Go,
        }
    }

    /// Notes a command that was sent.
    pub(super) fn sent(&mut self, command: Command) {
        if let Command::Speed { train, .. } | Command::Reverse { train } | Command::Function { train, .. } =
            command
        {
            self.known.insert(train, self.after(train, command));
        }
    }

    fn of(&self, train: TrainId) -> Decoder {
        let unknown = Decoder { step: SpeedStep::STAND, light: self.light, functions: [false; 4] };
        self.known.get(&train).copied().unwrap_or(unknown)
    }

    /// The state of a train's decoder after a command to it.
    fn after(&self, train: TrainId, command: Command) -> Decoder {
        let mut decoder = self.of(train);
        match command {
            Command::Speed { step, .. } => decoder.step = step,
            // The interface stops a train that it reverses.
            Command::Reverse { .. } => decoder.step = SpeedStep::STAND,
            Command::Function { function: FunctionNumber::LIGHT, on, .. } => decoder.light = on,
            Command::Function { function, on, .. } => {
                let at = usize::from(function.get()).checked_sub(1);
                if let Some(known) = at.and_then(|at| decoder.functions.get_mut(at)) {
                    *known = on;
                }
            }
            _ => {}
        }
        decoder
    }
}

const fn is_light(command: Command) -> bool {
    matches!(command, Command::Function { function: FunctionNumber::LIGHT, .. })
}
