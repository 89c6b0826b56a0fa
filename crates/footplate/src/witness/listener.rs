//! A machine that can be told all that an [`Input`] is.

use std::fmt::Debug;

use footplate_core::Timestamp;
use footplate_core::control::Machine;

use super::input::Input;

/// A machine that takes inputs, and whose decisions follow from them and from nothing else.
pub(crate) trait Listener: Machine<Notice: Debug> {
    /// A person or a program says what no railway says. A machine that nobody speaks to has nothing to do.
    fn handle_word(&mut self, _now: Timestamp, _word: &Input) {}

    /// Whatever it is.
    fn handle_input(&mut self, now: Timestamp, input: &Input) {
        match input {
            Input::Event(event) => self.handle_event(now, event),
            Input::Timeout => self.handle_timeout(now),
            Input::Line(_) | Input::EmergencyStop | Input::NoMoreLines | Input::Order(_) | Input::Link(_) => {
                self.handle_word(now, input);
            }
            Input::End => {}
        }
    }
}
