//! A machine that accepts every [`Input`].

use std::fmt::Debug;

use footplate_core::Timestamp;
use footplate_core::control::Machine;

use super::input::Input;

/// A machine whose decisions follow from its inputs alone.
pub(crate) trait Listener: Machine<Notice: Debug> {
    /// Takes an input that comes from a person or a program. The default ignores it.
    fn handle_word(&mut self, _now: Timestamp, _word: &Input) {}

    /// Takes any input.
    fn handle_input(&mut self, now: Timestamp, input: &Input) {
        match input {
            Input::Event(event) => self.handle_event(now, event),
            Input::Timeout => self.handle_timeout(now),
            Input::Line(_)
            | Input::Schedule(_)
            | Input::Schedules(_)
            | Input::EndSchedule(_)
            | Input::EmergencyStop
            | Input::NoMoreLines
            | Input::Order(_)
            | Input::Link(_) => {
                self.handle_word(now, input);
            }
            Input::End => {}
        }
    }
}
