//! A command of any kind from two bytes.

use footplate_core::{Command, FunctionNumber, SpeedStep, TrainId, TurnoutId};

pub(crate) fn command(kind: u8, number: u8) -> Command {
    let (train, turnout) = (TrainId(number.into()), TurnoutId(number.into()));
    match kind % 7 {
        0 => Command::Speed { train, step: SpeedStep::STAND },
        1 => Command::Speed { train, step: SpeedStep::new(kind % 16).unwrap_or_default() },
        2 => Command::Reverse { train },
        3 => Command::Turnout { turnout, curved: kind > 127 },
        4 => Command::PowerOff,
        5 => {
            let function = FunctionNumber::new(kind % 32).unwrap_or(FunctionNumber::LIGHT);
            Command::Function { train, function, on: kind > 127 }
        }
        _ => Command::PowerOn,
    }
}
