//! The accepted orders of one phone, in the words of the prompt and as commands, to recognise which of them are refused later.

use std::collections::BTreeMap;

use footplate_core::track::Leg;
use footplate_core::{Command, TrainId, TurnoutId};
use footplate_wire::withrottle::PhoneOrder;

use crate::dashboard::{LateRefusal, Unfulfilled};

/// What an order sets: a later order for the same replaces it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Subject {
    Speed(TrainId),
    Direction(TrainId),
    Function(TrainId, u8),
    Turnout(TurnoutId),
    Power,
}

impl Subject {
    const fn of(order: PhoneOrder) -> Self {
        match order {
            PhoneOrder::Speed { train, .. } => Self::Speed(train),
            PhoneOrder::Reverse { train } => Self::Direction(train),
            PhoneOrder::Function { train, function, .. } => Self::Function(train, function.get()),
            PhoneOrder::Turnout { turnout, .. } => Self::Turnout(turnout),
            PhoneOrder::EmergencyStop | PhoneOrder::PowerOn => Self::Power,
        }
    }
}

/// The last accepted orders of a phone, one for each subject.
#[derive(Debug, Default)]
pub(super) struct GivenOrders(BTreeMap<Subject, PhoneOrder>);

impl GivenOrders {
    /// Adds an accepted order.
    pub(super) fn add(&mut self, order: PhoneOrder) {
        self.0.insert(Subject::of(order), order);
    }

    /// Removes the order that is refused, and returns whether this phone gave it.
    pub(super) fn remove(&mut self, refusal: &LateRefusal) -> bool {
        let is_meant = |order: PhoneOrder| match &refusal.of {
            Unfulfilled::Line(text) => line(order).as_ref() == Some(text),
            Unfulfilled::Command(refused) => command(order) == *refused,
        };
        let before = self.0.len();
        self.0.retain(|_, order| !is_meant(*order));
        self.0.len() < before
    }
}

/// An order in the words of the prompt; `None` for an emergency stop, which is no text for the parser.
pub(super) fn line(order: PhoneOrder) -> Option<String> {
    Some(match order {
        PhoneOrder::Speed { train, step } => format!("speed {train} {step}"),
        PhoneOrder::Reverse { train } => format!("reverse {train}"),
        PhoneOrder::Function { train, function, on } => {
            format!("function {train} {} {}", function.get(), if on { "on" } else { "off" })
        }
        PhoneOrder::Turnout { turnout, leg } => {
            format!("turnout {turnout} {}", if leg == Leg::Curved { "curved" } else { "straight" })
        }
        PhoneOrder::EmergencyStop => return None,
        PhoneOrder::PowerOn => "power on".to_owned(),
    })
}

/// The command that carries out an order.
fn command(order: PhoneOrder) -> Command {
    match order {
        PhoneOrder::Speed { train, step } => Command::Speed { train, step },
        PhoneOrder::Reverse { train } => Command::Reverse { train },
        PhoneOrder::Function { train, function, on } => Command::Function { train, function, on },
        PhoneOrder::Turnout { turnout, leg } => Command::Turnout { turnout, curved: leg == Leg::Curved },
        PhoneOrder::EmergencyStop => Command::PowerOff,
        PhoneOrder::PowerOn => Command::PowerOn,
    }
}

#[cfg(test)]
mod tests {
    use footplate_core::SpeedStep;

    use super::*;

    const T24: TrainId = TrainId(24);

    fn speed(step: u8) -> PhoneOrder {
        PhoneOrder::Speed { train: T24, step: SpeedStep::new(step).expect("a step") }
    }

    fn refused(of: Unfulfilled) -> LateRefusal {
        LateRefusal { of, why: "track power is off: enter `power on`".to_owned() }
    }

    #[test]
    fn a_phone_recognises_the_refusal_of_its_own_last_order_once() {
        let mut given = GivenOrders::default();
        given.add(speed(5));
        given.add(speed(6));
        let of_line = |line: &str| refused(Unfulfilled::Line(line.to_owned()));
        assert!(!given.remove(&of_line("speed 24 5")), "replaced by the next order");
        assert!(!given.remove(&of_line("speed 58 6")), "the order of another operator");
        assert!(given.remove(&of_line("speed 24 6")));
        assert!(!given.remove(&of_line("speed 24 6")), "answered already");
    }

    #[test]
    fn a_command_that_is_not_sent_is_recognised_too() {
        let mut given = GivenOrders::default();
        given.add(PhoneOrder::Turnout { turnout: TurnoutId(11), leg: Leg::Curved });
        let command = |curved| Unfulfilled::Command(Command::Turnout { turnout: TurnoutId(11), curved });
        assert!(!given.remove(&refused(command(false))));
        assert!(given.remove(&refused(command(true))));
    }
}
