//! Commands that wait for the line: stops go first, outdated commands are dropped.

use alloc::collections::VecDeque;

use footplate_core::{Command, EventKind, SpeedStep, TrainId};

/// More waiting commands than this are a mistake: at 9 ms each they fill the line for more than two seconds.
const LONGEST: usize = 256;

/// Waiting commands in their order.
#[derive(Debug, Clone, Default)]
pub(crate) struct Queue {
    /// Power off and speed 0.
    urgent: VecDeque<Command>,
    usual: VecDeque<Command>,
}

impl Queue {
    /// Adds a command in its place.
    ///
    /// # Errors
    /// The number of waiting commands, if there are too many.
    pub(crate) fn push(&mut self, command: Command) -> Result<(), usize> {
        match command {
            Command::PowerOff => {
                self.usual.retain(|waiting| *waiting != Command::PowerOn);
                self.urgent.retain(|waiting| *waiting != Command::PowerOff);
                self.urgent.push_front(command);
            }
            Command::Speed { train, step: SpeedStep::STAND } => {
                self.usual.retain(|waiting| !is_speed_of(waiting, train));
                if !self.urgent.contains(&command) {
                    self.urgent.push_back(command);
                }
            }
            Command::Speed { train, .. } => {
                let last = self.usual.iter_mut().rfind(|waiting| concerns(waiting, train));
                match last {
                    Some(waiting) if is_speed_of(waiting, train) => *waiting = command,
                    // A speed before a reversal keeps its place before it.
                    Some(_) => self.push_usual(command)?,
                    None => {
                        self.push_usual(command)?;
                        self.urgent.retain(|waiting| !is_speed_of(waiting, train));
                    }
                }
            }
            Command::Turnout { turnout, .. } => {
                self.usual.retain(
                    |waiting| !matches!(waiting, Command::Turnout { turnout: other, .. } if *other == turnout),
                );
                self.push_usual(command)?;
            }
            Command::Function { .. } => {
                self.usual.retain(|waiting| !switches_same(&command, waiting));
                self.push_usual(command)?;
            }
            Command::PowerOn => {
                self.usual.retain(|waiting| *waiting != Command::PowerOn);
                self.push_usual(command)?;
            }
            Command::Reverse { .. } => self.push_usual(command)?,
        }
        Ok(())
    }

    fn push_usual(&mut self, command: Command) -> Result<(), usize> {
        if self.usual.len() >= LONGEST {
            return Err(self.usual.len());
        }
        self.usual.push_back(command);
        Ok(())
    }

    /// Adds a command that was sent before, unless a newer one replaces it.
    pub(crate) fn push_again(&mut self, command: Command) -> bool {
        !self.outdates(command) && self.push(command).is_ok()
    }

    /// Whether a waiting command replaces an earlier one.
    pub(crate) fn outdates(&self, command: Command) -> bool {
        self.iter().any(|waiting| match (command, waiting) {
            (Command::Speed { train, .. }, waiting) => concerns(waiting, train),
            (Command::Turnout { turnout, .. }, Command::Turnout { turnout: other, .. }) => turnout == *other,
            (Command::Function { .. }, waiting) => switches_same(&command, waiting),
            (Command::PowerOff | Command::PowerOn, waiting) => {
                matches!(waiting, Command::PowerOff | Command::PowerOn)
            }
            _ => false,
        })
    }

    pub(crate) fn has_urgent(&self) -> bool {
        !self.urgent.is_empty()
    }

    /// Removes and returns the next command that stops something and may go.
    pub(crate) fn next_urgent(&mut self, may_go: impl Fn(&Command) -> bool) -> Option<Command> {
        let at = self.urgent.iter().position(may_go)?;
        self.urgent.remove(at)
    }

    /// Removes and returns the next other command that may go.
    pub(crate) fn next_usual(&mut self, may_go: impl Fn(&Command) -> bool) -> Option<Command> {
        let at = self.usual.iter().position(may_go)?;
        self.usual.remove(at)
    }

    /// Whether a stop waits, or another command that may go.
    pub(crate) fn has_next(&self, may_go: impl Fn(&Command) -> bool) -> bool {
        !self.urgent.is_empty() || self.usual.iter().any(may_go)
    }

    /// All waiting commands in their order.
    pub(crate) fn iter(&self) -> impl Iterator<Item = &Command> {
        self.urgent.iter().chain(&self.usual)
    }

    /// Trains with a waiting stop.
    pub(crate) fn stops(&self) -> impl Iterator<Item = TrainId> {
        self.urgent.iter().filter_map(train_of)
    }

    pub(crate) fn clear(&mut self) {
        self.urgent.clear();
        self.usual.clear();
    }
}

/// The train that a command is for.
pub(crate) const fn train_of(command: &Command) -> Option<TrainId> {
    match command {
        Command::Speed { train, .. } | Command::Reverse { train } | Command::Function { train, .. } => {
            Some(*train)
        }
        _ => None,
    }
}

/// The recording's entry for a command that is sent for the nth time. Power and functions have none; a repeated reversal sets the same direction
/// again and has none either.
pub(crate) const fn entry_of(command: &Command, nth: u8) -> Option<EventKind> {
    match *command {
        Command::Speed { train, step } => Some(EventKind::Speed { train, step }),
        Command::Reverse { train } if nth == 1 => Some(EventKind::Reverse { train }),
        Command::Turnout { turnout, curved } => Some(EventKind::Turnout { turnout, curved }),
        _ => None,
    }
}

/// Whether both switch the same function of the same train.
pub(crate) fn switches_same(command: &Command, other: &Command) -> bool {
    let switched = |command: &Command| match *command {
        Command::Function { train, function, .. } => Some((train, function)),
        _ => None,
    };
    switched(command).is_some() && switched(command) == switched(other)
}

fn is_speed_of(command: &Command, of: TrainId) -> bool {
    matches!(command, Command::Speed { train, .. } if *train == of)
}

fn concerns(command: &Command, of: TrainId) -> bool {
    is_speed_of(command, of) || *command == Command::Reverse { train: of }
}

#[cfg(test)]
mod tests {
    use alloc::vec::Vec;

    use footplate_core::TurnoutId;

    use super::*;

    const T24: TrainId = TrainId(24);
    const REVERSE: Command = Command::Reverse { train: T24 };

    fn speed(train: TrainId, step: u8) -> Command {
        Command::Speed { train, step: SpeedStep::new(step).expect("a step") }
    }

    fn turnout(number: u16) -> Command {
        Command::Turnout { turnout: TurnoutId(number), curved: true }
    }

    fn order(commands: &[Command]) -> Vec<Command> {
        let mut queue = Queue::default();
        for command in commands {
            queue.push(*command).expect("few commands");
        }
        core::iter::from_fn(|| queue.next_urgent(|_| true).or_else(|| queue.next_usual(|_| true))).collect()
    }

    #[test]
    fn what_stops_goes_first() {
        let said = [turnout(3), speed(T24, 8), speed(TrainId(58), 0), Command::PowerOff];
        assert_eq!(order(&said), [Command::PowerOff, speed(TrainId(58), 0), turnout(3), speed(T24, 8)]);
    }

    #[test]
    fn a_newer_step_replaces_the_one_that_waits() {
        assert_eq!(order(&[speed(T24, 8), turnout(3), speed(T24, 9)]), [speed(T24, 9), turnout(3)]);
        assert_eq!(order(&[speed(T24, 8), speed(T24, 0)]), [speed(T24, 0)]);
        assert_eq!(order(&[speed(T24, 0), speed(T24, 8)]), [speed(T24, 8)]);
    }

    #[test]
    fn steps_never_pass_a_turn() {
        assert_eq!(order(&[speed(T24, 0), REVERSE, speed(T24, 8)]), [speed(T24, 0), REVERSE, speed(T24, 8)]);
        assert_eq!(
            order(&[speed(T24, 3), REVERSE, speed(T24, 8), speed(T24, 9)]),
            [speed(T24, 3), REVERSE, speed(T24, 9)]
        );
        // But a stop is a stop: no step that waited comes after it.
        assert_eq!(order(&[REVERSE, speed(T24, 8), speed(T24, 0)]), [speed(T24, 0), REVERSE]);
    }

    #[test]
    fn what_may_not_go_yet_keeps_its_place() {
        let mut queue = Queue::default();
        for command in [turnout(3), turnout(4), speed(T24, 8)] {
            queue.push(command).expect("few commands");
        }
        let no_turnout = |waiting: &Command| !matches!(waiting, Command::Turnout { .. });
        assert_eq!(queue.next_usual(no_turnout), Some(speed(T24, 8)));
        assert_eq!(queue.next_usual(no_turnout), None);
        assert_eq!(queue.next_usual(|_| true), Some(turnout(3)));
    }

    #[test]
    fn what_is_said_again_never_overrides_what_is_newer() {
        let mut queue = Queue::default();
        queue.push(speed(T24, 0)).expect("few commands");
        assert!(!queue.push_again(speed(T24, 8)));
        assert!(queue.push_again(speed(TrainId(58), 8)));
    }

    #[test]
    fn a_flood_is_refused() {
        let mut queue = Queue::default();
        for train in 0..LONGEST {
            let train = TrainId(u16::try_from(train).expect("few trains"));
            assert_eq!(queue.push(Command::Reverse { train }), Ok(()));
        }
        assert_eq!(queue.push(REVERSE), Err(LONGEST));
        assert_eq!(queue.push(speed(T24, 0)), Ok(()), "a stop is always taken");
    }

    #[test]
    fn a_newer_switch_replaces_a_waiting_one_of_the_same_function() {
        let switch = |train, number, on| {
            let function = footplate_core::FunctionNumber::new(number).unwrap();
            Command::Function { train, function, on }
        };
        let mut queue = Queue::default();
        for command in [switch(T24, 0, true), switch(T24, 1, true), switch(TrainId(58), 0, true)] {
            assert_eq!(queue.push(command), Ok(()));
        }
        assert_eq!(queue.push(switch(T24, 0, false)), Ok(()));
        assert!(queue.outdates(switch(T24, 0, true)) && !queue.outdates(switch(TrainId(58), 1, true)));
        let left: Vec<Command> = queue.iter().copied().collect();
        assert_eq!(left, [switch(T24, 1, true), switch(TrainId(58), 0, true), switch(T24, 0, false)]);
    }
}
