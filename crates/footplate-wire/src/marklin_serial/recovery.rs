//! The messages that synchronise the interface after bytes may have been lost.
//!
//! An interface that waits for the second byte of a message takes any next byte for it. One power message is therefore enough to
//! synchronise it: it is swallowed or obeyed, and harmless either way. After the first lost reply nothing else is sent before the next
//! read, so that sensors are read again soon; a solenoid that the swallowed message may have powered is released after the reply, and
//! the reset mode is set, without which every sensor reports once and never again. If that read is lost, too, or the line has just been
//! opened, the station may have been restarted: then power and reset mode are set as well, and again after the first answer, as a
//! station that is switched on hears nothing before that.

use alloc::collections::VecDeque;

use super::codec::Message;

/// The messages still to send, and whether the interface may be out of step.
#[derive(Debug, Clone, Default)]
pub(super) struct Recovery {
    words: VecDeque<Message>,
    /// What is to be sent once a whole reply has come.
    later: Option<Message>,
    /// Nothing was answered since the last recovery began.
    is_unanswered: bool,
    /// The interface may take the next byte for the second one of a message.
    is_out_of_step: bool,
    /// The last frame on the line was one of these messages.
    has_just_spoken: bool,
}

impl Recovery {
    /// After a disturbance: as little as brings it into step, unless that was tried and not answered.
    pub(super) fn begin(&mut self, power: Message) {
        if self.is_unanswered {
            self.begin_anew(power);
            self.later = Some(power);
            return;
        }
        self.words.clear();
        self.words.push_back(power);
        (self.later, self.is_unanswered, self.is_out_of_step) = (Some(Message::SolenoidOff), true, true);
    }

    /// All messages that an interface in an unknown state needs.
    pub(super) fn begin_anew(&mut self, power: Message) {
        self.words.clear();
        // The first may be swallowed.
        self.words.extend([power, power, Message::SolenoidOff, Message::ResetMode { on: true }]);
        (self.later, self.is_unanswered, self.is_out_of_step) = (None, true, true);
    }

    /// The next message. A release is left out while a solenoid is powered on purpose.
    pub(super) fn next(&mut self, solenoid_is_powered: bool) -> Option<Message> {
        let word = self.words.pop_front()?;
        if word == Message::SolenoidOff && solenoid_is_powered { self.words.pop_front() } else { Some(word) }
    }

    /// Notes a frame that has left; returns whether it was one of these messages.
    pub(super) fn spoke(&mut self, is_word: bool) {
        self.is_out_of_step &= !is_word;
        self.has_just_spoken = is_word;
    }

    /// A whole reply has come.
    pub(super) fn answered(&mut self) {
        self.is_unanswered = false;
        if let Some(later) = self.later.take() {
            // A byte that is swallowed as the address of a turnout powers a solenoid: the release comes last.
            self.words.extend([later, Message::ResetMode { on: true }, Message::SolenoidOff]);
        }
    }

    /// Notes that the interface was in step.
    pub(super) fn cancel(&mut self) {
        *self = Self::default();
    }

    pub(super) const fn is_out_of_step(&self) -> bool {
        self.is_out_of_step
    }

    /// Whether a stop may directly follow the last message.
    pub(super) const fn has_just_spoken(&self) -> bool {
        self.has_just_spoken
    }
}
