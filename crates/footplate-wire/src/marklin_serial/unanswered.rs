//! Commands that the interface may have missed: those since its last whole reply. They are repeated if the next reply is lost.

use alloc::vec::Vec;

use footplate_core::{Command, SpeedStep};

use crate::queue::switches_same;

/// The number of commands since the last reply that are repeated if the next is lost; older ones were obeyed long ago.
const MOST: usize = 16;

/// Commands since the last whole reply, oldest first, without those that a newer one replaces.
#[derive(Debug, Clone, Default)]
pub(super) struct Unanswered(Vec<Command>);

impl Unanswered {
    /// Adds a command that was sent. What it replaces is never repeated after it.
    pub(super) fn push(&mut self, command: Command) {
        let mut at = 0;
        let newest_reversal = self.0.iter().rposition(|earlier| reverses_train_of(earlier, &command));
        self.0.retain(|earlier| {
            let is_before_reversal = newest_reversal.is_some_and(|reversal| at < reversal);
            at += 1;
            !replaces(&command, earlier, is_before_reversal)
        });
        if self.0.len() >= MOST {
            self.0.remove(0);
        }
        self.0.push(command);
    }

    /// A whole reply has come: the interface has obeyed all of them.
    pub(super) fn clear(&mut self) {
        self.0.clear();
    }

    /// Removes and returns all of them.
    pub(super) fn take(&mut self) -> Vec<Command> {
        core::mem::take(&mut self.0)
    }
}

/// Whether both are for one train, and the earlier one reverses it.
fn reverses_train_of(earlier: &Command, command: &Command) -> bool {
    matches!((earlier, command), (Command::Reverse { train }, Command::Speed { train: of, .. }) if train == of)
}

/// Whether a command makes an earlier one outdated. A step before a reversal is not repeated after it, except the stop that the reversal
/// needs.
fn replaces(command: &Command, earlier: &Command, is_before_reversal: bool) -> bool {
    match (*command, *earlier) {
        (Command::Speed { train, step }, Command::Speed { train: other, .. }) => {
            train == other && (!is_before_reversal || step == SpeedStep::STAND)
        }
        (Command::Reverse { train }, Command::Speed { train: other, step }) => {
            train == other && step != SpeedStep::STAND
        }
        (Command::Turnout { turnout, .. }, Command::Turnout { turnout: other, .. }) => turnout == other,
        (Command::PowerOff | Command::PowerOn, Command::PowerOff | Command::PowerOn) => true,
        _ => switches_same(command, earlier),
    }
}

#[cfg(test)]
mod tests {
    use footplate_core::{TrainId, TurnoutId};

    use super::*;

    const REVERSE: Command = Command::Reverse { train: TrainId(24) };

    fn speed(train: u16, step: u8) -> Command {
        Command::Speed { train: TrainId(train), step: SpeedStep::new(step).expect("a step") }
    }

    fn turnout(number: u16, curved: bool) -> Command {
        Command::Turnout { turnout: TurnoutId(number), curved }
    }

    fn left(commands: &[Command]) -> Vec<Command> {
        let mut unanswered = Unanswered::default();
        commands.iter().for_each(|command| unanswered.push(*command));
        unanswered.take()
    }

    #[test]
    fn only_the_newest_command_of_each_subject_is_repeated() {
        assert_eq!(left(&[speed(24, 8), speed(58, 8), speed(24, 0)]), [speed(58, 8), speed(24, 0)]);
        let thrown = [turnout(3, true), turnout(4, true), turnout(3, false)];
        assert_eq!(left(&thrown), [turnout(4, true), turnout(3, false)]);
        assert_eq!(left(&[Command::PowerOff, Command::PowerOn]), [Command::PowerOn]);
        assert_eq!(left(&[Command::PowerOn, Command::PowerOff]), [Command::PowerOff]);
    }

    #[test]
    fn a_reversal_keeps_the_stop_before_it_and_no_other_step() {
        assert_eq!(left(&[speed(24, 0), REVERSE]), [speed(24, 0), REVERSE]);
        assert_eq!(left(&[speed(24, 8), REVERSE]), [REVERSE]);
        assert_eq!(left(&[speed(24, 0), REVERSE, speed(24, 8)]), [speed(24, 0), REVERSE, speed(24, 8)]);
        assert_eq!(left(&[speed(24, 8), REVERSE, speed(24, 0)]), [REVERSE, speed(24, 0)]);
    }
}
